//! `foreframe score`.

use crate::output::Output;

/// Arguments of `foreframe score`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// Always, until it exists.
pub fn run(_args: &Args, _output: &Output) -> anyhow::Result<()> {
    anyhow::bail!("score does not exist yet")
}
