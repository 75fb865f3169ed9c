//! The daemon's end: one socket, guarded by a locked file so that a second daemon is noticed and
//! what a killed one left behind is replaced.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

use rustix::fs::{FlockOperation, Mode, OFlags, flock};
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketFlags, SocketType};

use super::channel::Channel;
use super::path::{address_of, check_place, path_error, prepare_folder};
use crate::error::{Error, Result};

/// Connections that may wait to be accepted.
const BACKLOG: i32 = 32;

/// A socket that clients can connect to. Dropping it removes the socket; the lock file stays,
/// because removing it would let two daemons hold different locks.
#[derive(Debug)]
pub struct Listener {
    socket: OwnedFd,
    path: PathBuf,
    _lock: OwnedFd,
}

impl Listener {
    /// Listens at `path`. The folder is made if it is missing (not its parents), and must belong
    /// to this user alone.
    ///
    /// # Errors
    /// [`Error::DaemonRuns`] if another daemon holds the lock, [`Error::Path`] if the folder or
    /// whatever lies at `path` may not be used.
    pub fn bind(path: &Path) -> Result<Self> {
        prepare_folder(path)?;
        let lock = lock(path)?;
        remove_stale_socket(path)?;

        let address = address_of(path)?;
        let socket = new_socket()?;
        rustix::net::bind(&socket, &address)
            .map_err(|errno| path_error(path, "a place for a socket", errno))?;
        rustix::net::listen(&socket, BACKLOG).map_err(Error::os("listen"))?;
        Ok(Self { socket, path: path.to_owned(), _lock: lock })
    }

    /// Where it listens.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The next connection; None where none waits.
    ///
    /// # Errors
    /// If the process has no descriptor left; the connection keeps waiting.
    pub fn accept(&self) -> Result<Option<Channel>> {
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        loop {
            match rustix::net::accept_with(&self.socket, flags) {
                Ok(socket) => return Ok(Some(Channel::from_socket(socket))),
                // A peer that was gone before it was accepted is no error.
                Err(Errno::INTR | Errno::CONNABORTED) => {}
                Err(Errno::AGAIN) => return Ok(None),
                Err(errno) => return Err(Error::os("accept a connection")(errno)),
            }
        }
    }
}

impl AsFd for Listener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        // If it cannot be removed, the next daemon does it.
        drop(std::fs::remove_file(&self.path));
    }
}

pub(super) fn new_socket() -> Result<OwnedFd> {
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    rustix::net::socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None)
        .map_err(Error::os("make a socket"))
}

/// Takes the lock of this socket for as long as the descriptor lives, also across a crash.
fn lock(socket: &Path) -> Result<OwnedFd> {
    let path = socket.with_added_extension("lock");
    let flags = OFlags::RDWR | OFlags::CREATE | OFlags::CLOEXEC | OFlags::NOFOLLOW;
    let file = rustix::fs::open(&path, flags, Mode::RUSR | Mode::WUSR)
        .map_err(|errno| path_error(&path, "a lock file that can be written", errno))?;
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(file),
        Err(Errno::AGAIN) => Err(Error::DaemonRuns { path: socket.to_owned() }),
        Err(errno) => Err(Error::os("lock the socket")(errno)),
    }
}

/// Removes the socket of a daemon that did not get round to it. The lock says that none runs.
fn remove_stale_socket(path: &Path) -> Result<()> {
    if !check_place(path)? {
        return Ok(());
    }
    std::fs::remove_file(path)
        .map_err(|error| path_error(path, "a socket that can be replaced", error))
}
