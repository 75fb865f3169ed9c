//! Every command and its options, defined once.

use clap::{Parser, Subcommand};

use crate::commands::{
    adapters, bench, check, completions, ctl, demo, doctor, export, import, info, man, pacing,
    perception, replay, scenes, score, serve, stability, top,
};
use crate::output::Output;
use foreframed::UsageError;

/// Makes a 40-60 Hz application look like 120 Hz and more.
///
/// Start with `foreframe demo`: it needs no GPU, no display and no configuration.
#[derive(Parser, Debug)]
#[command(name = "foreframe", version, propagate_version = true, max_term_width = 100)]
#[command(after_help = "Exit codes: 0 done, 1 failed or found wanting, 2 wrong usage.")]
pub struct Cli {
    /// Print one JSON object on standard output instead of text.
    #[arg(long, global = true)]
    pub json: bool,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Show what Foreframe does: a scene at 40 Hz through a real daemon, out at 120 Hz.
    Demo(demo::Args),
    /// Run the daemon (the same as `foreframed`).
    Serve(serve::Args),
    /// Watch a running daemon: rates, latency by stage, headroom, warnings.
    Top(top::Args),
    /// Change a running daemon: method, recording, cap, HUD.
    Ctl(ctl::Args),
    /// List the built-in scenes, or write one as a capture.
    Scenes(scenes::Args),
    /// Turn a folder of EXR frames and JSON side-cars into a capture.
    Import(import::Args),
    /// Turn a capture into a folder of EXR frames and JSON side-cars.
    Export(export::Args),
    /// Say what a capture holds and whether it is whole.
    Info(info::Args),
    /// Look for what is wrong with a capture, its motion and the bits of its colour, or this machine.
    Doctor(doctor::Args),
    /// Feed a capture through the engine and the pacer, on virtual time.
    Replay(replay::Args),
    /// Predict left-out frames of captures and measure how far off the methods are.
    Score(score::Args),
    /// Ask in CI whether a capture still gives the bytes and the quality that it gave.
    Check(check::Args),
    /// Find out where methods fail: one knob at a time, on scenes that isolate one difficulty.
    Stability(stability::Args),
    /// Time the engine on built-in scenes, beside plain copies of the same bytes.
    Bench(bench::Args),
    /// List the GPU adapters, and say which one would be chosen.
    Adapters(adapters::Args),
    /// Run the pacer against a simulated display and clock.
    Pacing(pacing::Args),
    /// Ask the models of display and eye: motion quality, flicker, banding and more.
    Perception(perception::Args),
    /// Print a shell completion script.
    Completions(completions::Args),
    /// Write the man pages.
    Man(man::Args),
}

impl Command {
    /// The name of a command that prints something else than a result, or nothing.
    fn without_result(&self) -> Option<&'static str> {
        match self {
            Self::Serve(_) => Some("serve"),
            Self::Completions(_) => Some("completions"),
            _ => None,
        }
    }
}

impl Cli {
    /// Runs the command.
    ///
    /// # Errors
    /// What was expected, what was found, and what to do, as a chain of contexts.
    pub fn run(self) -> anyhow::Result<()> {
        if let (true, Some(name)) = (self.json, self.command.without_result()) {
            let text = format!(
                "--json: expected a command that ends with a result, found `{name}`: leave it out"
            );
            return Err(UsageError(text).into());
        }
        let output = Output::new(self.json);
        match self.command {
            Command::Demo(args) => demo::run(&args, &output),
            Command::Serve(args) => serve::run(args),
            Command::Top(args) => top::run(&args, &output),
            Command::Ctl(args) => ctl::run(&args, &output),
            Command::Scenes(args) => scenes::run(&args, &output),
            Command::Import(args) => import::run(&args, &output),
            Command::Export(args) => export::run(&args, &output),
            Command::Info(args) => info::run(&args, &output),
            Command::Doctor(args) => doctor::run(&args, &output),
            Command::Replay(args) => replay::run(&args, &output),
            Command::Score(args) => score::run(&args, &output),
            Command::Check(args) => check::run(&args, &output),
            Command::Stability(args) => stability::run(&args, &output),
            Command::Bench(args) => bench::run(&args, &output),
            Command::Adapters(args) => adapters::run(&args, &output),
            Command::Pacing(args) => pacing::run(&args, &output),
            Command::Perception(args) => perception::run(&args, &output),
            Command::Completions(args) => completions::run(&args),
            Command::Man(args) => man::run(&args, &output),
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    /// Command lines of `foreframe` in the fenced blocks of a document.
    fn commands(document: &str) -> Vec<Vec<String>> {
        let lines = document.split("```").skip(1).step_by(2).flat_map(str::lines);
        let words = |line: &str| {
            let command = line.split('#').next().unwrap_or_default();
            command.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
        };
        lines.filter(|line| line.starts_with("foreframe ")).map(words).collect()
    }

    #[test]
    fn the_definitions_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn blur_of_the_whole_picture_is_refused_without_finishing() {
        for command in [&["replay", "x.mcap"][..], &["score", "x.mcap", "--ratio", "4"]] {
            let parse = |more: &[&str]| {
                Cli::try_parse_from([&["foreframe"], command, more].concat()).map(|_| ())
            };
            let said = parse(&["--finish-whole"]).expect_err("nothing is finished").to_string();
            assert!(said.contains("--finish <"), "{said}");
            parse(&["--finish", "on", "--finish-whole"]).expect("it is finished");
            parse(&[]).expect("it is not finished");
        }
    }

    #[test]
    fn every_command_line_of_the_readme_is_one_that_exists() {
        let commands = commands(include_str!("../../README.md"));
        assert!(commands.len() >= 7, "found {}", commands.len());
        for command in commands {
            let parsed = Cli::try_parse_from(&command);
            assert!(parsed.is_ok(), "{}: {}", command.join(" "), parsed.unwrap_err());
        }
    }

    #[test]
    fn every_command_line_of_the_page_on_perception_is_one_that_exists() {
        let commands = commands(include_str!("../../docs/perception.md"));
        assert_eq!(commands.len(), 9);
        for command in commands {
            let parsed = Cli::try_parse_from(&command);
            assert!(parsed.is_ok(), "{}: {}", command.join(" "), parsed.unwrap_err());
        }
    }

    #[test]
    fn a_command_line_with_an_unknown_option_would_be_found() {
        let document = "```\nforeframe info x.mcap --speed 3   # no such option\n```";
        assert!(Cli::try_parse_from(&commands(document)[0]).is_err());
    }
}
