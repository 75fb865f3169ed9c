//! The `foreframe` tool. Exit codes: 0 done, 1 failed or found wanting, 2 wrong usage.

use std::process::ExitCode;

use clap::Parser as _;
use foreframe_replay::cli::Cli;
use foreframed::huge_pages::HugePages;

#[global_allocator]
static ALLOCATOR: HugePages = HugePages;

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("foreframe: {error:#}");
            foreframed::exit_code(&error)
        }
    }
}
