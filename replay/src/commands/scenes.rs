//! `foreframe scenes`.

use crate::output::Output;

/// Arguments of `foreframe scenes`.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// Always, until it exists.
pub fn run(_args: &Args, _output: &Output) -> anyhow::Result<()> {
    anyhow::bail!("scenes does not exist yet")
}
