//! From a socket to a client: hello, and the daemon's answer.

use std::os::fd::{AsFd, BorrowedFd};
use std::path::PathBuf;
use std::time::Duration;

use foreframe_protocol::socket::{Channel, Received, Sent, default_socket_path};
use foreframe_protocol::{
    DaemonMessage, Error as ProtocolError, Features, Hello, Packet, PciAddress,
};

use crate::client::Client;
use crate::deadline::Deadline;
use crate::error::{Error, Result};

/// How to reach the daemon, and who is asking.
#[derive(Clone, PartialEq, Eq, Debug)]
#[must_use]
pub struct ConnectOptions {
    hello: Hello,
    socket: Option<PathBuf>,
}

/// A handshake under way. Watch its descriptor, and call [`dispatch`](Self::dispatch) when it can
/// be read.
#[derive(Debug)]
pub struct Connecting {
    channel: Channel,
    required: Features,
}

/// How far a handshake has come.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one per session")]
pub enum Handshake {
    /// The daemon has not answered yet.
    Pending(Connecting),
    /// The session has started.
    Done(Client),
}

impl ConnectOptions {
    /// An application of this name (up to 64 bytes), at the daemon's usual place.
    pub fn new(application: impl Into<String>) -> Self {
        Self { hello: Hello::new(application), socket: None }
    }

    /// A daemon somewhere else.
    pub fn socket(mut self, path: impl Into<PathBuf>) -> Self {
        self.socket = Some(path.into());
        self
    }

    /// The card that the application renders on, so that the daemon can use another.
    pub fn gpu_pci(mut self, address: PciAddress) -> Self {
        self.hello.gpu_pci = Some(address);
        self
    }

    /// Vulkan's device UUID of that card.
    pub fn gpu_uuid(mut self, uuid: [u8; 16]) -> Self {
        self.hello.gpu_uuid = Some(uuid);
        self
    }

    /// Features without which a session is of no use.
    pub fn require(mut self, features: Features) -> Self {
        self.hello.required_features = features;
        self
    }

    /// Connects, waiting at most `timeout` for the daemon's answer.
    ///
    /// # Errors
    /// If no daemon listens, it refuses, or it does not answer in time.
    pub fn connect(&self, timeout: Duration) -> Result<Client> {
        let deadline = Deadline::new(timeout)?;
        let mut connecting = self.start()?;
        loop {
            if !deadline.wait(connecting.as_fd(), false)? {
                return Err(Error::Timeout { seconds: timeout.as_secs_f64() });
            }
            match connecting.dispatch()? {
                Handshake::Done(client) => return Ok(client),
                Handshake::Pending(pending) => connecting = pending,
            }
        }
    }

    /// Connects without waiting.
    ///
    /// # Errors
    /// If no daemon listens.
    pub fn start(&self) -> Result<Connecting> {
        let path = match &self.socket {
            Some(path) => path.clone(),
            None => default_socket_path()?,
        };
        self.start_over(Channel::connect(&path)?)
    }

    /// Starts a session over a connection that exists already.
    ///
    /// # Errors
    /// If the peer is gone.
    pub fn start_over(&self, channel: Channel) -> Result<Connecting> {
        match channel.send(&Packet::new(&self.hello), None)? {
            Sent::Whole => Ok(Connecting { channel, required: self.hello.required_features }),
            // The first packet into an empty socket always fits.
            Sent::WouldBlock => Err(Error::Disconnected),
        }
    }
}

impl Connecting {
    /// Looks whether the daemon has answered. Never waits.
    ///
    /// # Errors
    /// If it refuses, is gone, or answers with something else.
    pub fn dispatch(self) -> Result<Handshake> {
        let incoming = match self.channel.receive()? {
            Received::WouldBlock => return Ok(Handshake::Pending(self)),
            Received::Closed => return Err(Error::Disconnected),
            Received::Packet(incoming) => incoming,
        };
        match incoming.parse_daemon()?.0 {
            DaemonMessage::Welcome(welcome) if welcome.features.contains(self.required) => {
                Ok(Handshake::Done(Client::new(self.channel, welcome)))
            }
            DaemonMessage::Welcome(welcome) => Err(Error::Option {
                option: "required features",
                expected: format!("{:#x}", self.required.0),
                found: format!("{:#x}", welcome.features.0),
            }),
            DaemonMessage::Reject(reject) => Err(Error::Rejected(reject)),
            other => Err(Error::Protocol(ProtocolError::Packet {
                expected: "welcome or reject".to_owned(),
                found: other.kind().to_string(),
            })),
        }
    }
}

impl AsFd for Connecting {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.channel.as_fd()
    }
}
