//! `foreframe pacing --compare`: our pacer and those of others on the same traces.
//!
//! The table is printed as Markdown, so that `docs/pacing.md` holds it as it comes; a test computes
//! it again and compares.

use std::path::Path;

use foreframe_engine::MonoSpan;
use foreframe_engine::pacing::sim::{
    Policy, SimReport, TRACES, Trace, simulate, simulate_pictures,
};
use serde::Serialize;

use super::super::plot;
use super::round;
use crate::output::Output;
use crate::pictures::{ChartLabels, Series, line_chart};

/// The trace that the picture shows, and the span of it.
const PLOTTED: &str = "arrival jitter";
const PLOTTED_FROM: MonoSpan = MonoSpan::from_ms(2_000);
const PLOTTED_UNTIL: MonoSpan = MonoSpan::from_ms(2_500);

/// The whole comparison. Scripts read these names, so they stay as they are.
#[derive(Serialize, Debug)]
pub(super) struct Comparison {
    seconds: f64,
    seed: u64,
    traces: Vec<TraceRows>,
}

#[derive(Serialize, Debug)]
struct TraceRows {
    name: &'static str,
    what: &'static str,
    pacers: Vec<PacerRow>,
}

#[derive(Serialize, Debug)]
struct PacerRow {
    pacer: &'static str,
    present_error_p50_ms: f64,
    present_error_p99_ms: f64,
    missed_percent: f64,
    content_judder_after_1_s: f64,
    latency_p50_ms: f64,
    latency_p99_ms: f64,
}

/// Runs every pacer through every trace, and draws one of them if `picture` says where to.
pub(super) fn run(
    seconds: f64,
    seed: u64,
    picture: Option<&Path>,
    output: &Output,
) -> anyhow::Result<()> {
    let duration = MonoSpan::from_secs_f64(seconds);
    if let Some(path) = picture {
        let least = PLOTTED_UNTIL.as_secs_f64();
        anyhow::ensure!(
            seconds >= least,
            "--seconds: expected at least {least}, where the picture ends, found {seconds}"
        );
        draw(duration, seed, path)?;
    }
    let comparison = compare(seconds, seed);
    output.result(&comparison, &table(&comparison))
}

pub(super) fn compare(seconds: f64, seed: u64) -> Comparison {
    let duration = MonoSpan::from_secs_f64(seconds);
    let of_trace = |trace: &Trace| {
        let scenario = trace.scenario(duration, seed);
        let row = |policy: Policy| PacerRow::new(policy, &simulate(&scenario, policy));
        TraceRows { name: trace.name, what: trace.what, pacers: policies(trace).map(row).collect() }
    };
    Comparison { seconds, seed, traces: TRACES.iter().map(of_trace).collect() }
}

/// Ours first.
fn policies(trace: &Trace) -> impl Iterator<Item = Policy> {
    std::iter::once(trace.pacer()).chain(Policy::COMPARED)
}

impl PacerRow {
    fn new(policy: Policy, report: &SimReport) -> Self {
        let ms = |span: MonoSpan| round(span.as_ms_f64(), 3);
        Self {
            pacer: policy.name(),
            present_error_p50_ms: ms(report.present_error_p50),
            present_error_p99_ms: ms(report.present_error_p99),
            missed_percent: round(100.0 - report.on_target * 100.0, 3),
            content_judder_after_1_s: round(report.steady_judder, 5),
            latency_p50_ms: ms(report.latency_p50),
            latency_p99_ms: ms(report.latency_p99),
        }
    }
}

/// The table as Markdown.
pub(super) fn table(comparison: &Comparison) -> String {
    let mut text = String::from(
        "| trace | pacer | error p50 ms | error p99 ms | missed | judder | latency p50 ms | latency p99 ms |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for trace in &comparison.traces {
        for (index, row) in trace.pacers.iter().enumerate() {
            let name = if index == 0 { trace.name } else { "" };
            text += &format!(
                "| {name} | {} | {:.2} | {:.2} | {:.2} % | {:.2} % | {:.1} | {:.1} |\n",
                row.pacer,
                row.present_error_p50_ms,
                row.present_error_p99_ms,
                row.missed_percent,
                row.content_judder_after_1_s * 100.0,
                row.latency_p50_ms,
                row.latency_p99_ms,
            );
        }
    }
    text
}

/// Draws how old what is shown is: a level line is motion at an even speed.
fn draw(duration: MonoSpan, seed: u64, path: &Path) -> anyhow::Result<()> {
    let trace = TRACES.iter().find(|trace| trace.name == PLOTTED);
    let series = |policy: Policy, trace: &Trace| {
        let pictures = simulate_pictures(&trace.scenario(duration, seed), policy);
        let start = pictures.first().map(|picture| picture.presented_at).unwrap_or_default();
        let points = pictures.iter().filter_map(|picture| {
            let at = picture.presented_at - start;
            let age = picture.presented_at - picture.content_time;
            let is_plotted = at >= PLOTTED_FROM && at <= PLOTTED_UNTIL;
            is_plotted.then(|| [at.as_ms_f64(), age.as_ms_f64()])
        });
        Series { name: policy.name().to_owned(), points: points.collect() }
    };
    let series: Vec<Series> = trace
        .into_iter()
        .flat_map(|trace| policies(trace).map(|policy| series(policy, trace)).collect::<Vec<_>>())
        .collect();
    let title = "Age of what is shown while keys arrive unevenly; level is even motion";
    let labels =
        ChartLabels { title, across: "time, ms", up: "present time minus content time, ms" };
    plot::write(&line_chart(labels, &series)?, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the published table was made with.
    const PUBLISHED: (f64, u64) = (60.0, 1);

    #[test]
    fn the_published_table_is_what_the_pacers_come_to() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/pacing.md");
        let published = std::fs::read_to_string(path).unwrap();
        let rows = |text: &str| {
            let is_row = |line: &&str| line.matches('|').count() == 9 && line.contains(" % |");
            text.lines().filter(is_row).map(str::to_owned).collect::<Vec<_>>()
        };
        let found = rows(&table(&compare(PUBLISHED.0, PUBLISHED.1)));
        assert_eq!(found.len(), TRACES.len() * (1 + Policy::COMPARED.len()));
        for (found, published) in found.iter().zip(rows(&published)) {
            assert_eq!(*found, published, "`foreframe pacing --compare` says otherwise");
        }
        assert_eq!(found.len(), rows(&published).len());
        for trace in &TRACES {
            assert!(
                published.contains(trace.what),
                "the page does not say what `{}` is",
                trace.name
            );
        }
    }

    #[test]
    fn another_seed_gives_another_table() {
        assert_ne!(table(&compare(2.0, 1)), table(&compare(2.0, 2)));
    }

    #[test]
    fn json_has_the_fixed_names() {
        let json = serde_json::to_value(compare(1.0, 1)).unwrap();
        let row = &json["traces"][0]["pacers"][0];
        assert_eq!(row["pacer"], "foreframe");
        for name in ["present_error_p50_ms", "missed_percent", "content_judder_after_1_s"] {
            assert!(row[name].is_number(), "{name} in {row}");
        }
    }
}
