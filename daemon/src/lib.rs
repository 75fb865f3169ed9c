//! The daemon: sessions, engine threads, sinks, recorder. The only place with clocks, sockets and
//! logs.
//!
//! A key frame comes in over a client's socket ([`session`]), is checked by the main loop
//! ([`server`]), copied and turned into pictures by the thread of its [`stream`], and leaves
//! through a [`sink`] or to subscribers. The [`recorder`] keeps what came in as a [`capture`].
//! [`ingest`] translates the protocol's words into the engine's, [`clock`] is the only reader of
//! clocks, [`config`] says what was asked for, [`gpu`] what the machine has for it, and through
//! [`control`] people see what runs and change it. A [`hud`], made with [`draw`], says it in the
//! picture. Programs keep their planes in [`huge_pages`].

pub mod capture;
pub mod clock;
pub mod config;
pub mod control;
pub mod draw;
pub mod gpu;
pub mod hud;
pub mod huge_pages;
pub mod ingest;
pub mod profiles;
pub mod recorder;
pub mod server;
pub mod session;
pub mod sink;
pub mod stream;

use std::io::IsTerminal as _;
use std::process::ExitCode;

use tracing_subscriber::EnvFilter;

pub use config::{Args, Config, UsageError};
pub use server::{Daemon, Stopper};

/// Runs the daemon until a signal ends it: the entry point of `foreframed` and `foreframe serve`.
///
/// # Errors
/// In one line, what was expected and what was found, if the daemon cannot start.
pub fn run(args: Args) -> anyhow::Result<()> {
    let config = args.clone().resolve()?;
    start_log(&config.log);
    let signals = server::stop_signals()?;
    let hangup = server::reload_signal()?;
    let mut daemon = Daemon::bind(config)?;
    daemon.stop_on(signals)?;
    daemon.reload_from(args, hangup)?;
    daemon.run()
}

/// Logs go to standard error: standard output may be a y4m stream.
fn start_log(filter: &str) {
    tracing_subscriber::fmt()
        .with_env_filter(EnvFilter::new(filter))
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .init();
}

/// What a program that ends with `error` exits with: 2 for wrong usage, as for anything else on the
/// command line that cannot be, 1 for all that is no fault of the command line.
#[must_use]
pub fn exit_code(error: &anyhow::Error) -> ExitCode {
    let is_usage = error.chain().any(|cause| cause.is::<UsageError>());
    ExitCode::from(if is_usage { 2 } else { 1 })
}
