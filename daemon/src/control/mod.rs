//! The control socket: what a running daemon does, and what it is told to do differently.
//!
//! Beside the socket of the applications lies another one, `PATH.control`, for people and scripts:
//! one JSON object per line in each direction, a [`Request`] and its [`Response`]. `foreframe top`
//! and `foreframe ctl` speak it through [`Controller`]; so can anything that can write a line. It
//! is open to the same user alone, and kept apart from the applications' protocol so that neither
//! has to be frozen for the other. The daemon's end is [`crate::server`]'s.

mod client;
mod listener;
mod status;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use client::{ControlError, Controller};
pub use listener::{Closed, ControlConnection, ControlListener};
pub use status::{DaemonStatus, Rates, Spread, Stages, StreamStatus};

/// Longest request, bytes.
pub const MAX_REQUEST: usize = 4096;

/// Where the control socket of the daemon at `socket` lies.
#[must_use]
pub fn control_path(socket: &Path) -> PathBuf {
    socket.with_added_extension("control")
}

/// What a daemon can be asked to do. Changes hold for the streams that run and for those to come.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// Say what it does.
    Status,
    /// Make in-between frames by another method.
    Method {
        /// Its name.
        method: String,
    },
    /// Record from the next key on, into another file if it records already; None ends it.
    Record {
        /// The capture, by its path from the root.
        file: Option<PathBuf>,
    },
    /// Show at most so many frames a second; None is every refresh.
    Cap {
        /// Frames a second, 1 to 1000.
        hz: Option<f64>,
    },
    /// Draw this into the pictures of windows.
    Hud {
        /// Its name.
        view: String,
    },
    /// Read the configuration file again.
    Reload,
    /// Say goodbye to everybody and end.
    Stop,
}

/// What the daemon answers.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Response {
    /// To [`Request::Status`].
    Status(Box<DaemonStatus>),
    /// Done: what is different now, one line each.
    Done(Vec<String>),
    /// Not done: what was expected and what was found.
    Refused(String),
}
