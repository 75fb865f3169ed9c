//! The tool's end of the control socket: asks, and waits for the answer.

use std::io::{self, BufRead as _, BufReader, ErrorKind, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{Request, Response, control_path};
use crate::clock;

/// A daemon whose main loop takes longer than this is stuck.
const PATIENCE: Duration = Duration::from_secs(5);
/// Longest answer that is read, bytes.
const MAX_RESPONSE: usize = 1 << 20;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// Nobody listens.
    #[error("expected a running daemon at {path}, found none: start one with `foreframe serve`")]
    NoDaemon {
        /// Of the control socket.
        path: PathBuf,
        /// Why the connection failed.
        source: io::Error,
    },
    /// Somebody may listen, whom this process does not reach.
    #[error("expected to reach the daemon at {path}")]
    Unreachable {
        /// Of the control socket.
        path: PathBuf,
        /// Why the connection failed.
        source: io::Error,
    },
    /// The daemon went away, or is stuck.
    #[error("expected an answer of the daemon within 5 s")]
    Lost(#[source] io::Error),
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
    /// If none runs, or this process may not reach it.
    pub fn connect(socket: &Path) -> Result<Self, ControlError> {
        let path = control_path(socket);
        let stream = match UnixStream::connect(&path) {
            Ok(stream) => stream,
            Err(source) => {
                let is_none =
                    matches!(source.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused);
                return Err(match is_none {
                    true => ControlError::NoDaemon { path, source },
                    false => ControlError::Unreachable { path, source },
                });
            }
        };
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
        let answer = self.read_line().map_err(ControlError::Lost)?;
        serde_json::from_str(&answer).map_err(|source| ControlError::Unknown {
            found: answer.trim_end().chars().take(60).collect(),
            source,
        })
    }

    /// Reads up to the end of the line, all of it within [`PATIENCE`].
    fn read_line(&mut self) -> io::Result<String> {
        let began_at = clock::now();
        let mut line = Vec::new();
        while !line.ends_with(b"\n") {
            let waited = Duration::from_nanos(clock::now().since(began_at).as_ns().unsigned_abs());
            let left = PATIENCE.checked_sub(waited).filter(|left| !left.is_zero());
            let left = left.ok_or(ErrorKind::TimedOut)?;
            self.stream.get_ref().set_read_timeout(Some(left))?;
            let read = self.stream.fill_buf()?;
            if read.is_empty() {
                return Err(ErrorKind::UnexpectedEof.into());
            }
            let end = read.iter().position(|byte| *byte == b'\n').map_or(read.len(), |at| at + 1);
            line.extend(&read[..end]);
            self.stream.consume(end);
            if line.len() > MAX_RESPONSE {
                return Err(ErrorKind::InvalidData.into());
            }
        }
        String::from_utf8(line).map_err(|_| ErrorKind::InvalidData.into())
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;

    use super::*;

    #[test]
    fn only_where_nobody_listens_is_there_no_daemon() {
        let folder = tempfile::tempdir().unwrap();
        let connect = |name: &str| Controller::connect(&folder.path().join(name)).unwrap_err();
        assert!(matches!(connect("none"), ControlError::NoDaemon { .. }));
        let path = control_path(&folder.path().join("left"));
        drop(UnixListener::bind(&path).unwrap());
        assert!(matches!(connect("left"), ControlError::NoDaemon { .. }));
        let long = "x".repeat(200);
        assert!(matches!(connect(&long), ControlError::Unreachable { .. }));
    }

    #[test]
    fn an_answer_in_pieces_is_read_whole_and_one_without_an_end_is_none() {
        let answers = |pieces: &'static [&'static str]| {
            let (near, far) = UnixStream::pair().unwrap();
            let mut controller = Controller { stream: BufReader::new(near) };
            for piece in pieces {
                (&far).write_all(piece.as_bytes()).unwrap();
            }
            drop(far);
            controller.read_line().map_err(|error| error.kind())
        };
        assert_eq!(answers(&["{\"a\":", "1}\n", "more"]).unwrap(), "{\"a\":1}\n");
        assert_eq!(answers(&["{\"a\":"]), Err(ErrorKind::UnexpectedEof));
        assert_eq!(answers(&["\u{80}"]), Err(ErrorKind::UnexpectedEof));
    }
}
