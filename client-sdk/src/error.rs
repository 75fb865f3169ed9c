//! The one error of this crate.

use foreframe_protocol::{ErrorMessage, PlaneKind, Reject};

/// Result of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong between an application and the daemon. None of it needs more from an
/// application than to go on presenting its own frames.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No slot is free, or the daemon has not read for a while. The key frame is skipped and
    /// counted; its successor may come as usual.
    #[error("the daemon is behind: this key frame is skipped")]
    WouldBlock,
    /// The daemon is gone. Every later call says so at once: drop the client, and connect again
    /// if you like.
    #[error("the daemon is gone")]
    Disconnected,
    /// The daemon did not answer in time.
    #[error("expected an answer of the daemon within {seconds} s, found none")]
    Timeout {
        /// Time that was given.
        seconds: f64,
    },
    /// The daemon does not want this client.
    #[error("the daemon refuses the session: {}", describe(.0))]
    Rejected(Reject),
    /// The daemon refuses something that was sent.
    #[error(
        "the daemon found a mistake in {}: expected {}, found {}",
        .0.field, .0.expected, .0.found
    )]
    Refused(ErrorMessage),
    /// There is no such stream, or it has ended.
    #[error("expected a stream that is open, found stream {stream}")]
    Stream {
        /// What was asked for.
        stream: u32,
    },
    /// The stream has no such plane.
    #[error("expected a plane that the stream has, found {plane}")]
    NoPlane {
        /// What was asked for.
        plane: PlaneKind,
    },
    /// A plane that does not fit what was declared.
    #[error("{plane} plane: expected {expected}, found {found}")]
    Plane {
        /// The plane.
        plane: PlaneKind,
        /// What was declared.
        expected: String,
        /// What was asked for.
        found: String,
    },
    /// An option that this daemon does not grant.
    #[error("{option}: expected {expected}, found {found}")]
    Option {
        /// The option.
        option: &'static str,
        /// What is granted.
        expected: String,
        /// What was asked for.
        found: String,
    },
    /// A message that may not be sent, or one that may not have been received.
    #[error(transparent)]
    Protocol(foreframe_protocol::Error),
}

impl From<foreframe_protocol::Error> for Error {
    fn from(error: foreframe_protocol::Error) -> Self {
        match error {
            foreframe_protocol::Error::Disconnected => Self::Disconnected,
            other => Self::Protocol(other),
        }
    }
}

impl Error {
    pub(crate) fn os(action: &'static str) -> impl FnOnce(rustix::io::Errno) -> Self {
        move |errno| Self::Protocol(foreframe_protocol::Error::Os { action, reason: errno.into() })
    }
}

fn describe(reject: &Reject) -> String {
    let Reject { code, major_min, major_max, minor_max, text } = reject;
    let code = code.map_or("unknown reason", |code| code.name());
    format!("{code}: {text} (it speaks protocol {major_min} to {major_max}.{minor_max})")
}
