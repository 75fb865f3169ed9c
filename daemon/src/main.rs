//! The daemon on its own. Exit codes: 0 stopped by a signal, 1 could not start, 2 wrong usage.

use std::process::ExitCode;

use clap::Parser;
use foreframed::huge_pages::HugePages;

#[global_allocator]
static ALLOCATOR: HugePages = HugePages;

/// Makes a 40-60 Hz application look like 120 Hz and more.
#[derive(Parser, Debug)]
#[command(name = "foreframed", version, max_term_width = 100)]
struct Cli {
    #[command(flatten)]
    args: foreframed::Args,
}

fn main() -> ExitCode {
    match foreframed::run(Cli::parse().args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("foreframed: {error:#}");
            foreframed::exit_code(&error)
        }
    }
}
