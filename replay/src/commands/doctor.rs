//! `foreframe doctor`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use foreframed::config::read_profile;

use crate::doctor::machine::{Facts, examine_machine};
use crate::doctor::{Examination, Report, examine_file};
use crate::options::{number, parse_count};
use crate::output::Output;

/// Arguments of `foreframe doctor`.
#[derive(clap::Args, Debug)]
#[command(after_help = "\
Without a capture: what a daemon would find on this machine, and what would make it better.

With one: every way of reading the motion plane is tried on the first keys that move: as
declared, with an axis flipped, in the other direction, half and twice as long, in another unit,
with the camera's motion and with the jitter of the projection. What a key shows is compared with
what the frame before has shown where the motion says that it came from.

Smooth gradients are looked for in the last of these keys, and the fewest bits at which their
steps are hardly seen on the display at the distance that --ppd means.

Exit code 1: the motion looks wrong, or a daemon cannot run here.")]
pub struct Args {
    /// Capture to look into [default: this machine]
    #[arg(value_name = "FILE.mcap")]
    pub file: Option<PathBuf>,
    /// Socket of the daemon to look for, without a capture [default: foreframe/daemon.sock in
    /// XDG_RUNTIME_DIR]
    #[arg(long, value_name = "PATH", conflicts_with = "file")]
    pub socket: Option<PathBuf>,
    /// Keys to look at, the first that move
    #[arg(long, value_name = "N", default_value = "8", requires = "file")]
    #[arg(value_parser = parse_count, allow_negative_numbers = true)]
    pub keys: NonZeroUsize,
    /// Pixels per degree, 1 to 1000.
    #[arg(long, value_name = "PPD", default_value_t = 52.0, value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true, requires = "file")]
    pub ppd: f64,
    /// Display: a built-in profile (see `perception displays`) or a file that ends in .toml.
    #[arg(long, value_name = "NAME", default_value = "asus-pg279q", requires = "file")]
    pub profile: String,
}

/// Runs the command.
///
/// # Errors
/// If the capture cannot be read or has no motion, or its motion looks wrong; without one, if a
/// daemon cannot run here.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let Some(file) = &args.file else {
        let report = examine_machine(&Facts::gather(args.socket.as_deref()));
        output.result(&report, &report.to_text())?;
        return match report.wrong() {
            0 => Ok(()),
            wrong => anyhow::bail!("{wrong} of these keep a daemon from running"),
        };
    };
    let profile = read_profile(&args.profile)?;
    let keys = u32::try_from(args.keys.get()).unwrap_or(u32::MAX);
    let examination = Examination { keys, ppd: args.ppd, profile: &profile };
    let report = examine_file(file, &examination)?;
    output.result(&report, &text(&report))?;
    match report.motion.verdict {
        None => Ok(()),
        Some(verdict) => anyhow::bail!("{}: {verdict}", file.display()),
    }
}

fn text(Report { motion, colour }: &Report) -> String {
    let mut text = format!(
        "motion: {} keys, {} samples that move\n\n  read as                 error, levels of luma\n",
        motion.keys, motion.samples
    );
    for finding in &motion.hypotheses {
        text += &format!("  {:22} {:7.2}\n", finding.name, finding.rms_levels);
    }
    let nothing = if motion.keys == 0 { "too little moves to tell" } else { "nothing looks wrong" };
    text += &format!("\n  {}\n\n", motion.verdict.as_deref().unwrap_or(nothing));
    text + &match (colour.gradients, colour.min_bits) {
        (0, _) => "colour: no smooth gradients; 8 bits will do".to_owned(),
        (gradients, Some(bits)) => format!(
            "colour: {gradients} smooth gradients, whose steps are hidden from {bits} bits on: {} will do",
            colour.format
        ),
        (gradients, None) => {
            format!("colour: {gradients} smooth gradients, whose steps 16 bits do not hide")
        }
    }
}
