//! The daemon: sessions, engine threads, sinks, recorder. The only place with clocks, sockets and
//! logs.
//!
//! A key frame comes in over a client's socket ([`session`]), is checked by the main loop
//! ([`server`]), copied and turned into pictures by the thread of its [`stream`], and leaves
//! through a [`sink`] or to subscribers. The [`recorder`] keeps what came in as a [`capture`].
//! [`ingest`] translates the protocol's words into the engine's, [`clock`] is the only reader of
//! clocks, [`config`] says what was asked for.

pub mod capture;
pub mod clock;
pub mod config;
pub mod ingest;
pub mod recorder;
pub mod server;
pub mod session;
pub mod sink;
pub mod stream;

use std::io::IsTerminal as _;

use anyhow::Context as _;
use tracing_subscriber::EnvFilter;

pub use config::{Args, Config};
pub use server::{Daemon, Stopper};

/// Runs the daemon until a signal ends it: the entry point of `foreframed` and `foreframe serve`.
///
/// # Errors
/// In one line, what was expected and what was found, if the daemon cannot start.
pub fn run(args: Args) -> anyhow::Result<()> {
    let config = args.resolve()?;
    start_log(&config.log)?;
    let signals = server::stop_signals()?;
    let mut daemon = Daemon::bind(config)?;
    daemon.stop_on(signals)?;
    daemon.run()
}

/// Logs go to standard error: standard output may be a y4m stream.
fn start_log(filter: &str) -> anyhow::Result<()> {
    let filter = EnvFilter::try_new(filter)
        .with_context(|| format!("--log: expected a level or a filter, found `{filter}`"))?;
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .init();
    Ok(())
}
