//! The daemon's end of the control socket: accepts, and cuts what comes in into lines.
//!
//! Nothing here waits. Whoever sends a line that is too long, does not take an answer, or is
//! another user is cut off; the daemon and the applications do not notice.

use std::cell::RefCell;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use rustix::net::sockopt::socket_peercred;
use rustix::process::geteuid;

use super::{MAX_REQUEST, Request, Response, control_path};

/// Listens; dropping it removes the socket.
#[derive(Debug)]
pub struct ControlListener {
    listener: UnixListener,
    path: PathBuf,
}

impl ControlListener {
    /// Listens beside `socket`, on which this process already holds the lock: what an earlier
    /// daemon left behind is replaced.
    ///
    /// # Errors
    /// If the socket cannot be made.
    pub fn bind(socket: &Path) -> io::Result<Self> {
        let path = control_path(socket);
        match std::fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let listener = UnixListener::bind(&path)?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener, path })
    }

    /// The next connection of this user; None where none waits.
    ///
    /// # Errors
    /// If the process has no descriptor left.
    pub fn accept(&self) -> io::Result<Option<ControlConnection>> {
        loop {
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(None),
                Err(error) => return Err(error),
            };
            let is_same_user = socket_peercred(&stream).is_ok_and(|peer| peer.uid == geteuid());
            if is_same_user && stream.set_nonblocking(true).is_ok() {
                return Ok(Some(ControlConnection { stream, unread: RefCell::default() }));
            }
        }
    }
}

impl AsFd for ControlListener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.listener.as_fd()
    }
}

impl Drop for ControlListener {
    fn drop(&mut self) {
        // If it cannot be removed, the next daemon does it.
        drop(std::fs::remove_file(&self.path));
    }
}

/// Somebody who asks.
#[derive(Debug)]
pub struct ControlConnection {
    stream: UnixStream,
    /// The beginning of a line. The main loop lends its sources out shared.
    unread: RefCell<Vec<u8>>,
}

/// The other end is gone, or has to go.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Closed;

impl ControlConnection {
    /// Reads what has come and answers every whole line of it by `answer`.
    ///
    /// # Errors
    /// If the connection is over.
    pub fn serve(&self, mut answer: impl FnMut(Request) -> Response) -> Result<(), Closed> {
        let mut bytes = [0; MAX_REQUEST];
        loop {
            match (&self.stream).read(&mut bytes) {
                Ok(0) => return Err(Closed),
                Ok(read) => self.unread.borrow_mut().extend(&bytes[..read]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(_) => return Err(Closed),
            }
            while let Some(line) = self.next_line() {
                let response = match serde_json::from_slice(&line) {
                    Ok(request) => answer(request),
                    Err(error) => {
                        let found = String::from_utf8_lossy(&line);
                        let found = found.trim_end().escape_debug();
                        Response::Refused(format!(
                            "expected a request as one JSON object, such as \
                             {{\"request\":\"status\"}}, found `{found}`: {error}"
                        ))
                    }
                };
                self.send(&response)?;
            }
            let found = self.unread.borrow().len();
            if found > MAX_REQUEST {
                let expected = format!("expected a line of at most {MAX_REQUEST} bytes");
                let _gone = self.send(&Response::Refused(format!("{expected}, found {found}")));
                return Err(Closed);
            }
        }
    }

    fn next_line(&self) -> Option<Vec<u8>> {
        let mut unread = self.unread.borrow_mut();
        let end = unread.iter().position(|&byte| byte == b'\n')?;
        Some(unread.drain(..=end).collect())
    }

    /// Whoever does not take an answer that fits the socket's buffer does not read at all.
    fn send(&self, response: &Response) -> Result<(), Closed> {
        let mut line = serde_json::to_vec(response).expect("strings and numbers become JSON");
        line.push(b'\n');
        (&self.stream).write_all(&line).map_err(|_| Closed)
    }
}

impl AsFd for ControlConnection {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}
