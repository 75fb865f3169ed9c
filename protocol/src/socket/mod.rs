//! Unix sockets of type `SOCK_SEQPACKET`: one message per packet, in order, with an end that is
//! seen at once when the peer dies.
//!
//! [`Listener`] owns the socket's place in the file system, [`Channel`] one connection. Neither
//! blocks, neither raises SIGPIPE, and every descriptor is closed on exec. Descriptors that a
//! message should not carry are closed before anybody sees them.

mod channel;
mod listener;
mod path;

pub use channel::{Channel, Incoming, PeerCredentials, Received, Sent};
pub use listener::Listener;
pub use path::{SOCKET_NAME, check_socket_path, default_socket_path, socket_path_in};
