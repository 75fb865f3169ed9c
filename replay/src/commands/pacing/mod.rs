//! `foreframe pacing`: the pacer between a simulated application and a simulated display.
//!
//! Reads what to simulate, runs it twice on the same chance (our pacer, and a plain timer to
//! compare with), and reports. With `--compare` ([`compare`]) it runs the pacers of others too,
//! through fixed traces.

mod compare;

use std::path::PathBuf;

use foreframe_engine::MonoSpan;
use foreframe_engine::pacing::sim::{
    DisplayScript, KeyScript, Policy, Scenario, SimReport, WorkScript, simulate,
};
use foreframe_engine::pacing::{PacerConfig, RefreshKind, WorkEstimate};
use serde::Serialize;

use super::plot;
use crate::options::{number, parse_whole, whole};
use crate::output::Output;

/// Jitter of synthesis times around `--work-ms`, +-: what a loaded two-core machine shows.
const WORK_JITTER_PERCENT: i64 = 15;
/// Error of simulated presentation timestamps, +-.
const TIMESTAMP_JITTER: MonoSpan = MonoSpan::from_us(50);

/// Arguments of `foreframe pacing`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Refresh rate of the display, 1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = 120.0)]
    #[arg(value_parser = number(1.0, 1000.0), allow_negative_numbers = true)]
    refresh: f64,
    /// Key frames per second, 1 to 1000.
    #[arg(long, value_name = "HZ", default_value_t = 40.0)]
    #[arg(value_parser = number(1.0, 1000.0), allow_negative_numbers = true)]
    key_rate: f64,
    /// Arrivals of keys are off by up to this, plus or minus, 0 to 1000.
    #[arg(long, value_name = "MS", default_value_t = 2.0)]
    #[arg(value_parser = number(0.0, 1000.0), allow_negative_numbers = true)]
    jitter_ms: f64,
    /// The same as a share of the key interval; added to `--jitter-ms`, 0 to 100.
    #[arg(long, value_name = "P", default_value_t = 0.0)]
    #[arg(value_parser = number(0.0, 100.0), allow_negative_numbers = true)]
    arrival_jitter_percent: f64,
    /// Content times of keys are off by up to this share of the key interval, plus or minus, 0 to
    /// 100.
    #[arg(long, value_name = "P", default_value_t = 0.0)]
    #[arg(value_parser = number(0.0, 100.0), allow_negative_numbers = true)]
    content_jitter_percent: f64,
    /// Keys that arrive a whole key interval late, in percent, 0 to 100.
    #[arg(long, value_name = "P", default_value_t = 0.0)]
    #[arg(value_parser = number(0.0, 100.0), allow_negative_numbers = true)]
    late_percent: f64,
    /// How long to simulate, 0.1 to 86400.
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    #[arg(value_parser = number(0.1, 86400.0), allow_negative_numbers = true)]
    seconds: f64,
    /// By how much the display's period is longer than it says, in millionths, -1000 to 1000.
    #[arg(long, value_name = "PPM", default_value_t = 50)]
    #[arg(value_parser = whole(-1000, 1000), allow_negative_numbers = true)]
    drift_ppm: i32,
    /// Refreshes that the display skips, in percent, 0 to 90.
    #[arg(long, value_name = "P", default_value_t = 0.0)]
    #[arg(value_parser = number(0.0, 90.0), allow_negative_numbers = true)]
    skipped_percent: f64,
    /// Time that making a picture takes, usually, 0 to 1000.
    #[arg(long, value_name = "MS", default_value_t = 2.0)]
    #[arg(value_parser = number(0.0, 1000.0), allow_negative_numbers = true)]
    work_ms: f64,
    /// Where chance comes from, a whole number of 0 or more.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_whole::<u64>)]
    #[arg(allow_negative_numbers = true)]
    seed: u64,
    /// Run this pacer and those of others through fixed traces instead, and print a table; of the
    /// other options, `--seconds` and `--seed` apply to it.
    #[arg(long, conflicts_with_all = [
        "refresh", "key_rate", "jitter_ms", "arrival_jitter_percent", "content_jitter_percent",
        "late_percent", "drift_ppm", "skipped_percent", "work_ms",
    ])]
    compare: bool,
    /// With `--compare`: draw one trace to an SVG or PNG file.
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot, requires = "compare")]
    plot: Option<PathBuf>,
}

/// The report. Scripts read these names, so they stay as they are.
#[derive(Serialize, Debug)]
struct Report {
    #[serde(flatten)]
    pacer: Row,
    naive_timer: Row,
    refresh_error_ppm: f64,
    clock_steps: u64,
    relocks: u64,
}

/// What one pacer came to.
#[derive(Serialize, Debug)]
struct Row {
    keys: u64,
    keys_shown: u64,
    presents: u64,
    real: u64,
    synthesised: u64,
    repeated: u64,
    missed: u64,
    dropped: u64,
    on_target_percent: f64,
    present_error_p50_ms: f64,
    present_error_p99_ms: f64,
    interval_5_95_ms: f64,
    content_judder: f64,
    content_judder_after_1_s: f64,
    backward_steps: u64,
    latency_ms: Percentiles,
    content_age_p50_ms: f64,
}

#[derive(Serialize, Debug)]
struct Percentiles {
    p50: f64,
    p99: f64,
}

/// Runs the command.
///
/// # Errors
/// If standard output or the plot cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    if args.compare {
        return compare::run(args.seconds, args.seed, args.plot.as_deref(), output);
    }
    let scenario = scenario(args);
    let config = PacerConfig {
        refresh_interval: scenario.display.refresh_interval,
        refresh: RefreshKind::Fixed,
        known_refresh: None,
        interpolates: false,
        work: WorkEstimate::learned(scenario.display.refresh_interval),
    };
    let ours = simulate(&scenario, Policy::Pacer(config));
    let naive = simulate(&scenario, Policy::NaiveTimer);
    let truth = scenario.display.refresh_interval.as_secs_f64()
        * (1.0 + f64::from(scenario.display.drift_ppm) * 1e-6);
    let tracked = ours.status.map_or(truth, |status| status.refresh_interval.as_secs_f64());
    let counts = ours.status.map(|status| status.counts).unwrap_or_default();
    let report = Report {
        pacer: Row::from(&ours),
        naive_timer: Row::from(&naive),
        refresh_error_ppm: round((tracked / truth - 1.0) * 1e6, 1),
        clock_steps: counts.clock_steps,
        relocks: counts.relocks,
    };
    output.result(&report, &text(args, &report))
}

fn scenario(args: &Args) -> Scenario {
    let key_interval = MonoSpan::from_hz(args.key_rate);
    let share = |percent| key_interval.scale(per_mille(percent).into(), 1_000);
    let work = MonoSpan::from_secs_f64(args.work_ms / 1e3);
    Scenario {
        duration: MonoSpan::from_secs_f64(args.seconds),
        seed: args.seed,
        keys: KeyScript {
            content_jitter: share(args.content_jitter_percent),
            arrival_jitter: MonoSpan::from_secs_f64(args.jitter_ms / 1e3)
                + share(args.arrival_jitter_percent),
            late_per_mille: per_mille(args.late_percent),
            ..KeyScript::steady(key_interval)
        },
        display: DisplayScript {
            drift_ppm: args.drift_ppm,
            skipped_per_mille: per_mille(args.skipped_percent),
            timestamp_jitter: TIMESTAMP_JITTER,
            ..DisplayScript::steady(MonoSpan::from_hz(args.refresh))
        },
        work: WorkScript {
            typical: work,
            jitter: work.scale(WORK_JITTER_PERCENT, 100),
            spike_per_mille: 0,
        },
    }
}

/// Percent as parts per thousand.
#[expect(clippy::cast_possible_truncation, reason = "options of 0 to 100 percent")]
#[expect(clippy::cast_sign_loss, reason = "options of 0 to 100 percent")]
fn per_mille(percent: f64) -> u32 {
    (percent * 10.0).round() as u32
}

impl From<&SimReport> for Row {
    fn from(report: &SimReport) -> Self {
        let ms = |span: MonoSpan| round(span.as_ms_f64(), 3);
        Self {
            keys: report.keys,
            keys_shown: report.keys_shown,
            presents: report.presents,
            real: report.real,
            synthesised: report.synthesised,
            repeated: report.repeated,
            missed: report.missed,
            dropped: report.dropped,
            on_target_percent: round(report.on_target * 100.0, 3),
            present_error_p50_ms: ms(report.present_error_p50),
            present_error_p99_ms: ms(report.present_error_p99),
            interval_5_95_ms: ms(report.interval_5_95),
            content_judder: round(report.content_judder, 5),
            content_judder_after_1_s: round(report.steady_judder, 5),
            backward_steps: report.backward_steps,
            latency_ms: Percentiles { p50: ms(report.latency_p50), p99: ms(report.latency_p99) },
            content_age_p50_ms: ms(report.content_age_p50),
        }
    }
}

fn text(args: &Args, report: &Report) -> String {
    let rows = [("pacer", &report.pacer), ("naive timer", &report.naive_timer)];
    let mut text = format!(
        "{} s of {} Hz keys on a {} Hz display, simulated\n\n\
         {:12} {:>8} {:>6} {:>8} {:>9} {:>7} {:>10} {:>10} {:>8} {:>8} {:>8}\n",
        args.seconds,
        args.key_rate,
        args.refresh,
        "",
        "presents",
        "real",
        "repeated",
        "missed",
        "dropped",
        "on target",
        "5-95 % ms",
        "judder",
        "p50 ms",
        "p99 ms",
    );
    for (name, row) in rows {
        text += &format!(
            "{:12} {:>8} {:>6} {:>8} {:>9} {:>7} {:>8.2} % {:>10.3} {:>8.4} {:>8.2} {:>8.2}\n",
            name,
            row.presents,
            row.real,
            row.repeated,
            row.missed,
            row.dropped,
            row.on_target_percent,
            row.interval_5_95_ms,
            row.content_judder,
            row.latency_ms.p50,
            row.latency_ms.p99,
        );
    }
    text + "\njudder: standard deviation of the content-time step over the refresh interval\n\
            p50, p99: from the arrival of a key to the first refresh that shows it"
}

fn round(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    #[derive(clap::Parser, Debug)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn args(line: &str) -> Args {
        Line::parse_from(std::iter::once("pacing").chain(line.split_whitespace())).args
    }

    #[test]
    fn options_become_the_scenario() {
        let scenario = scenario(&args(
            "--refresh 100 --key-rate 50 --jitter-ms 1 --arrival-jitter-percent 10 \
             --content-jitter-percent 30 --late-percent 2.5 --seconds 3 --drift-ppm -20",
        ));
        assert_eq!(scenario.display.refresh_interval, MonoSpan::from_ms(10));
        assert_eq!(scenario.keys.arrival_jitter, MonoSpan::from_ms(3));
        assert_eq!(scenario.keys.content_jitter, MonoSpan::from_ms(6));
        assert_eq!((scenario.keys.late_per_mille, scenario.display.drift_ppm), (25, -20));
        assert_eq!(scenario.duration, MonoSpan::from_ms(3_000));
    }

    #[test]
    fn what_is_out_of_range_is_refused_and_never_quietly_made_to_fit() {
        for line in [
            "--refresh 0",
            "--key-rate nan",
            "--seconds -1",
            "--late-percent 101",
            "--drift-ppm 1001",
            "--drift-ppm -1001",
            "--skipped-percent 90.1",
            "--seed -1",
        ] {
            let words = std::iter::once("pacing").chain(line.split_whitespace());
            let error = Line::try_parse_from(words).unwrap_err();
            let (option, value) = line.split_once(' ').unwrap();
            let text = error.to_string();
            assert!(text.contains(option) && text.contains(&format!("'{value}'")), "{text}");
            assert_eq!(error.exit_code(), 2, "{text}");
        }
    }

    #[test]
    fn the_help_tells_every_range() {
        use clap::CommandFactory as _;
        let command = Line::command();
        for argument in command
            .get_arguments()
            .filter(|argument| argument.get_action().takes_values() && argument.get_id() != "plot")
        {
            let help = argument.get_help().unwrap().to_string();
            assert!(help.contains(" to ") || help.contains("or more"), "{argument}: {help}");
        }
    }

    #[test]
    fn json_has_the_fixed_names() {
        let scenario = scenario(&args("--seconds 1"));
        let row = Row::from(&simulate(&scenario, Policy::NaiveTimer));
        let json = serde_json::to_value(&row).unwrap();
        for name in ["presents", "missed", "on_target_percent", "interval_5_95_ms"] {
            assert!(json[name].is_number(), "{name} in {json}");
        }
        assert!(json["content_judder"].is_number() && json["latency_ms"]["p99"].is_number());
    }
}
