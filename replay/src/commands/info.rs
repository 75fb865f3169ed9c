//! `foreframe info`.

use crate::output::Output;

/// Arguments of `foreframe info`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// Always, until it exists.
pub fn run(_args: &Args, _output: &Output) -> anyhow::Result<()> {
    anyhow::bail!("info does not exist yet")
}
