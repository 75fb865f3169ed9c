//! `foreframe serve`: the daemon itself, so that one binary is enough.

use crate::output::Output;

/// Arguments of `foreframe serve`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    daemon: foreframed::Args,
}

/// Serves clients until a signal ends it.
///
/// # Errors
/// If the daemon cannot start.
pub fn run(args: Args, _output: &Output) -> anyhow::Result<()> {
    foreframed::run(args.daemon)
}
