//! `foreframe serve`: the daemon itself, so that one binary is enough.

use anyhow::{Context as _, ensure};
use rustix::process::{Signal, getppid, set_parent_process_death_signal};

/// Arguments of `foreframe serve`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    daemon: foreframed::Args,
    /// Process id of the parent, with which the daemon ends. For the demo.
    #[arg(long, value_name = "PID", hide = true)]
    with_parent: Option<i32>,
}

/// Serves clients until a signal ends it.
///
/// # Errors
/// If the daemon cannot start.
pub fn run(args: Args) -> anyhow::Result<()> {
    if let Some(parent) = args.with_parent {
        end_with(parent)?;
    }
    foreframed::run(args.daemon)
}

/// Has the kernel send SIGTERM when the parent ends, however it ends: the daemon then stops in good
/// order.
fn end_with(parent: i32) -> anyhow::Result<()> {
    set_parent_process_death_signal(Some(Signal::TERM)).context("watching the parent")?;
    let found = getppid().map_or(0, |pid| pid.as_raw_nonzero().get());
    // It may have ended before it was watched.
    ensure!(found == parent, "--with-parent: expected a child of {parent}, found one of {found}");
    Ok(())
}
