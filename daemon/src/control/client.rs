//! The tool's end of the control socket: asks, and waits for the answer.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{Request, Response, control_path};

/// A daemon whose main loop takes longer than this is stuck.
const PATIENCE: Duration = Duration::from_secs(5);
/// Longest answer that is read, bytes.
const MAX_RESPONSE: u64 = 1 << 20;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// Nobody listens.
    #[error("expected a running daemon at {path}, found none: start one with `foreframe serve`")]
    NoDaemon {
        /// Of the control socket.
        path: PathBuf,
        /// Why the connection failed.
        source: std::io::Error,
    },
    /// The daemon went away, or is stuck.
    #[error("expected an answer of the daemon within 5 s")]
    Lost(#[source] std::io::Error),
    /// The daemon is of another version.
    #[error("expected an answer that this version knows, found `{found}`")]
    Unknown {
        /// The beginning of it.
        found: String,
        /// What is wrong with it.
        source: serde_json::Error,
    },
}

/// A connection to a running daemon.
#[derive(Debug)]
pub struct Controller {
    stream: BufReader<UnixStream>,
}

impl Controller {
    /// Connects to the daemon whose applications connect to `socket`.
    ///
    /// # Errors
    /// If none runs.
    pub fn connect(socket: &Path) -> Result<Self, ControlError> {
        let path = control_path(socket);
        let stream = match UnixStream::connect(&path) {
            Ok(stream) => stream,
            Err(source) => return Err(ControlError::NoDaemon { path, source }),
        };
        stream.set_read_timeout(Some(PATIENCE)).map_err(ControlError::Lost)?;
        stream.set_write_timeout(Some(PATIENCE)).map_err(ControlError::Lost)?;
        Ok(Self { stream: BufReader::new(stream) })
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// If the daemon goes away, is stuck, or answers what this version does not know.
    pub fn ask(&mut self, request: &Request) -> Result<Response, ControlError> {
        let mut line = serde_json::to_string(request).expect("strings and numbers become JSON");
        line.push('\n');
        self.stream.get_mut().write_all(line.as_bytes()).map_err(ControlError::Lost)?;
        let mut answer = String::new();
        let mut limited = self.stream.by_ref().take(MAX_RESPONSE);
        if limited.read_line(&mut answer).map_err(ControlError::Lost)? == 0 {
            return Err(ControlError::Lost(std::io::ErrorKind::UnexpectedEof.into()));
        }
        serde_json::from_str(&answer).map_err(|source| ControlError::Unknown {
            found: answer.trim_end().chars().take(60).collect(),
            source,
        })
    }
}
