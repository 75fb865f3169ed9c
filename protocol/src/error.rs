//! The one error of this crate. Whatever a peer can cause names what was expected and what was
//! found.

use std::io;
use std::path::PathBuf;

use crate::message::MessageKind;

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong between two peers.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A packet that is no message of ours.
    #[error("packet: expected {expected}, found {found}")]
    Packet {
        /// What a packet has.
        expected: String,
        /// What this one has.
        found: String,
    },
    /// A message with a value that its field does not allow.
    #[error("{message}, field {field}: expected {expected}, found {found}")]
    Field {
        /// The message.
        message: MessageKind,
        /// The field, as `PROTOCOL.md` names it.
        field: &'static str,
        /// What the field allows.
        expected: String,
        /// What it holds.
        found: String,
    },
    /// The peer has another major version.
    #[error("protocol version: expected major {expected}, found {found}: update the older side")]
    Version {
        /// Ours.
        expected: u16,
        /// The peer's.
        found: u16,
    },
    /// A plane of a key frame that does not fit its stream.
    #[error("{plane} plane, {field}: expected {expected}, found {found}")]
    Plane {
        /// The plane.
        plane: crate::plane::PlaneKind,
        /// Its property.
        field: &'static str,
        /// What the stream allows.
        expected: String,
        /// What the key frame brings.
        found: String,
    },
    /// A slot that is used out of turn.
    #[error("slot {slot}: expected {expected}, found {found}")]
    Slot {
        /// Number of the slot.
        slot: u32,
        /// State that the step needs.
        expected: &'static str,
        /// State that it is in.
        found: String,
    },
    /// A key frame or UI plane that is not newer than the one before it.
    #[error("field {field}: expected more than {last}, found {found}")]
    Order {
        /// The field.
        field: &'static str,
        /// Of the key frame before.
        last: u64,
        /// Of this one.
        found: u64,
    },
    /// Shared memory that would not be safe to read.
    #[error("shared memory, {property}: expected {expected}, found {found}")]
    Memory {
        /// What was looked at.
        property: &'static str,
        /// What it has to be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// A path that may not be used for the socket.
    #[error("{}: expected {expected}, found {found}", path.display())]
    Path {
        /// The path.
        path: PathBuf,
        /// What it has to be, and what to do.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// The folder for sockets is not known.
    #[error(
        "XDG_RUNTIME_DIR: expected an absolute path, found {found}: set it, or name a socket with \
         --socket PATH"
    )]
    RuntimeFolder {
        /// What the variable holds.
        found: String,
    },
    /// A daemon already listens here.
    #[error("{}: another daemon listens here: stop it, or use another --socket PATH", path.display())]
    DaemonRuns {
        /// Socket of the other daemon.
        path: PathBuf,
    },
    /// No daemon listens here.
    #[error("{}: no daemon listens here: start `foreframe serve`", path.display())]
    NoDaemon {
        /// Socket that was tried.
        path: PathBuf,
    },
    /// The peer is another user.
    #[error("peer: expected user {expected}, found user {found}")]
    Peer {
        /// Our user id.
        expected: u32,
        /// The peer's.
        found: u32,
    },
    /// The peer is gone.
    #[error("the peer closed the connection")]
    Disconnected,
    /// The operating system refused.
    // The reason is part of the text, because the text goes to peers, and so it is no source: a
    // chain of errors would tell it twice.
    #[error("{action}: {reason}")]
    Os {
        /// What was being done.
        action: &'static str,
        /// Why it was not.
        reason: io::Error,
    },
}

impl Error {
    pub(crate) fn os(action: &'static str) -> impl FnOnce(rustix::io::Errno) -> Self {
        move |errno| Self::Os { action, reason: errno.into() }
    }

    pub(crate) fn field(
        message: MessageKind,
        field: &'static str,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self::Field { message, field, expected: expected.into(), found: found.to_string() }
    }

    pub(crate) fn packet(expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Packet { expected: expected.into(), found: found.to_string() }
    }

    pub(crate) fn memory(
        property: &'static str,
        expected: impl Into<String>,
        found: impl ToString,
    ) -> Self {
        Self::Memory { property, expected: expected.into(), found: found.to_string() }
    }

    /// The part that was wrong, what it should have been and what it was, for an
    /// [`ErrorMessage`](crate::ErrorMessage).
    #[must_use]
    pub fn parts(&self) -> (String, String, String) {
        match self {
            Self::Packet { expected, found } => ("packet".into(), expected.clone(), found.clone()),
            Self::Field { message, field, expected, found } => {
                (format!("{message}.{field}"), expected.clone(), found.clone())
            }
            Self::Version { expected, found } => {
                ("major".into(), expected.to_string(), found.to_string())
            }
            Self::Plane { plane, field, expected, found } => {
                (format!("{plane} plane, {field}"), expected.clone(), found.clone())
            }
            Self::Slot { slot, expected, found } => {
                (format!("slot {slot}"), (*expected).into(), found.clone())
            }
            Self::Order { field, last, found } => {
                ((*field).into(), format!("more than {last}"), found.to_string())
            }
            Self::Memory { property, expected, found } => {
                ((*property).into(), expected.clone(), found.clone())
            }
            other => ("session".into(), "a working session".into(), other.to_string()),
        }
    }
}
