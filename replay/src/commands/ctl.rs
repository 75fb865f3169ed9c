//! `foreframe ctl`: tells a running daemon to do something differently.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::Subcommand;
use foreframe_engine::Method;
use foreframe_protocol::socket::default_socket_path;
use foreframed::control::{Controller, Request, Response};
use foreframed::hud::HudView;
use serde::Serialize;

use crate::options::number;
use crate::output::Output;
use crate::top::text;

/// Arguments of `foreframe ctl`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    socket: SocketArgs,
    /// What to change.
    #[command(subcommand)]
    command: Command,
}

/// Which daemon.
#[derive(clap::Args, Clone, Debug)]
pub struct SocketArgs {
    /// Socket of the daemon [default: foreframe/daemon.sock in XDG_RUNTIME_DIR]
    #[arg(long, value_name = "PATH", global = true)]
    pub socket: Option<PathBuf>,
}

/// Changes hold for the streams that run and for those to come, until the daemon ends.
#[derive(Subcommand, Debug)]
enum Command {
    /// Say once what the daemon does; `foreframe top` says it all the time.
    Status,
    /// Make in-between frames by another method.
    Method {
        /// Its name.
        method: Method,
    },
    /// Record what the applications send into a capture, or no longer.
    Record {
        /// The capture, or `off`.
        #[arg(value_name = "FILE|off")]
        file: PathBuf,
    },
    /// Show at most so many frames a second, or every refresh again.
    Cap {
        /// Frames a second, 1 to 1000, or `off`.
        #[arg(value_name = "HZ|off", value_parser = cap, allow_negative_numbers = true)]
        hz: Cap,
    },
    /// Draw something into the pictures of windows, as `h` does there.
    Hud {
        /// off, stats, motion, grid, rungs, disocclusion, tear, only-real or only-synthesised.
        view: HudView,
    },
    /// Read the daemon's configuration file again.
    Reload,
    /// End the daemon in good order.
    Stop,
}

/// A rate, or none.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Cap(Option<f64>);

fn cap(text: &str) -> Result<Cap, String> {
    match text {
        "off" => Ok(Cap(None)),
        _ => number(1.0, 1000.0)(text).map(|hz| Cap(Some(hz))),
    }
}

/// What was done.
#[derive(Serialize)]
struct Done {
    done: Vec<String>,
}

impl SocketArgs {
    /// A connection to the daemon.
    ///
    /// # Errors
    /// If none runs there.
    pub fn connect(&self) -> anyhow::Result<Controller> {
        let socket = match &self.socket {
            Some(path) => path.clone(),
            None => default_socket_path()?,
        };
        Ok(Controller::connect(&socket)?)
    }
}

/// Asks the daemon, and prints what it says.
///
/// # Errors
/// If no daemon runs, or it does not do what it was asked for.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let request = match &args.command {
        Command::Status => Request::Status,
        Command::Method { method } => Request::Method { method: method.name().to_owned() },
        Command::Record { file } if file.as_os_str() == "off" => Request::Record { file: None },
        Command::Record { file } => {
            let path = std::path::absolute(file).context("finding the capture's folder")?;
            Request::Record { file: Some(path) }
        }
        Command::Cap { hz: Cap(hz) } => Request::Cap { hz: *hz },
        Command::Hud { view } => Request::Hud { view: view.name().to_owned() },
        Command::Reload => Request::Reload,
        Command::Stop => Request::Stop,
    };
    match args.socket.connect()?.ask(&request)? {
        Response::Status(status) => output.result(&status, &text::status(&status)),
        Response::Done(done) if done.is_empty() => {
            output.result(&Done { done }, "nothing is different")
        }
        Response::Done(done) => {
            let text = done.join("\n");
            output.result(&Done { done }, &text)
        }
        Response::Refused(why) => bail!("{why}"),
    }
}
