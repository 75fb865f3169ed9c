//! `foreframe export`.

use crate::output::Output;

/// Arguments of `foreframe export`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// Always, until it exists.
pub fn run(_args: &Args, _output: &Output) -> anyhow::Result<()> {
    anyhow::bail!("export does not exist yet")
}
