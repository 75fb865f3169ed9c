//! `foreframe completions`: shell completions from the same definitions as the commands.

use clap::CommandFactory as _;
use clap_complete::Shell;

use crate::cli::Cli;

/// Arguments of `foreframe completions`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Which shell the script is for.
    pub shell: Shell,
}

/// Prints the script on standard output.
///
/// # Errors
/// None.
pub fn run(args: &Args) -> anyhow::Result<()> {
    clap_complete::generate(
        args.shell,
        &mut Cli::command(),
        "foreframe",
        &mut std::io::stdout().lock(),
    );
    Ok(())
}
