//! `foreframe top`: a running daemon in the terminal.

use std::io::IsTerminal as _;

use anyhow::bail;
use foreframed::control::{Request, Response};

use super::ctl::SocketArgs;
use crate::options::number;
use crate::output::Output;
use crate::top::{screen, text};

/// Arguments of `foreframe top`.
#[derive(clap::Args, Debug)]
pub struct Args {
    #[command(flatten)]
    socket: SocketArgs,
    /// Time between two looks, seconds.
    #[arg(long, value_name = "S", default_value_t = 0.25, value_parser = number(0.05, 3600.0))]
    interval: f64,
    /// Look once and print, as is done anyway where standard output is no terminal.
    #[arg(long)]
    once: bool,
}

/// Shows the daemon until `q` is pressed or it ends.
///
/// # Errors
/// If no daemon runs, or the terminal cannot be used.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let mut controller = args.socket.connect()?;
    let mut look = || match controller.ask(&Request::Status)? {
        Response::Status(status) => Ok(*status),
        other => bail!("expected a status, found {other:?}"),
    };
    if args.once || output.is_json() || !std::io::stdout().is_terminal() {
        let status = look()?;
        return output.result(&status, &text::status(&status));
    }
    screen::show(std::time::Duration::from_secs_f64(args.interval), look)
}
