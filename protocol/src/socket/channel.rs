//! One connection: packets with their descriptors, sent and received without ever waiting.

use std::io::{IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::Path;

use rustix::io::Errno;
use rustix::net::{
    AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, ReturnFlags,
    SendAncillaryBuffer, SendAncillaryMessage, SendFlags, SocketAddrUnix, SocketFlags, SocketType,
};

use super::listener::new_socket;
use super::path::path_error;
use crate::error::{Error, Result};
use crate::limits::{MAX_FDS, MAX_PACKET_BYTES};
use crate::message::{ClientMessage, DaemonMessage, MessageKind, Packet, split};

/// Descriptors that there is room to receive. More than a packet may carry, so that one too many
/// arrives, is counted and is closed; what does not fit even here, the kernel closes.
const RECEIVED_FDS: usize = 4;

/// What became of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[must_use = "a packet that was not sent has to be sent again or counted"]
pub enum Sent {
    /// The peer will read it, if it lives.
    Whole,
    /// The peer has not read for a while and there is no room. Nothing was sent.
    WouldBlock,
}

/// What a connection had to say.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one lives on the stack at a time")]
pub enum Received {
    /// A packet.
    Packet(Incoming),
    /// Nothing yet.
    WouldBlock,
    /// The peer is gone, and everything that it sent has been read.
    Closed,
}

/// A packet as it arrived, with the one descriptor that its type carries, if it does.
#[derive(Debug)]
pub struct Incoming {
    bytes: [u8; MAX_PACKET_BYTES],
    length: usize,
    fd: Option<OwnedFd>,
}

impl Incoming {
    /// The whole packet, not yet checked.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Reads what a client sent.
    ///
    /// # Errors
    /// Those of [`ClientMessage::parse`], and a descriptor too many or too few.
    pub fn parse_client(self) -> Result<(ClientMessage, Option<OwnedFd>)> {
        let message = ClientMessage::parse(self.as_bytes())?;
        Ok((message, self.fd))
    }

    /// Reads what the daemon sent.
    ///
    /// # Errors
    /// Those of [`DaemonMessage::parse`], and a descriptor too many or too few.
    pub fn parse_daemon(self) -> Result<(DaemonMessage, Option<OwnedFd>)> {
        let message = DaemonMessage::parse(self.as_bytes())?;
        Ok((message, self.fd))
    }
}

/// Who is at the other end, as the kernel knows it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PeerCredentials {
    /// Process id when it connected.
    pub pid: i32,
    /// User id.
    pub uid: u32,
}

/// One end of a connection.
#[derive(Debug)]
pub struct Channel {
    socket: OwnedFd,
}

impl Channel {
    /// Connects to the daemon at `path`, and checks that it runs as the same user.
    ///
    /// # Errors
    /// [`Error::NoDaemon`] if none listens, [`Error::Peer`] if it belongs to another user.
    pub fn connect(path: &Path) -> Result<Self> {
        let address = SocketAddrUnix::new(path).map_err(|_| {
            let found = format!("{} bytes", path.as_os_str().len());
            path_error(path, "a path of at most 107 bytes", found)
        })?;
        let socket = new_socket()?;
        match rustix::net::connect(&socket, &address) {
            Ok(()) => {}
            Err(Errno::NOENT | Errno::CONNREFUSED | Errno::NOTDIR) => {
                return Err(Error::NoDaemon { path: path.to_owned() });
            }
            Err(errno) => return Err(path_error(path, "a daemon that can be reached", errno)),
        }
        let channel = Self::from_socket(socket);
        channel.check_same_user()?;
        Ok(channel)
    }

    /// Two ends of a connection inside this process, for tests and for a daemon in a thread.
    ///
    /// # Errors
    /// If the process has no descriptor left.
    pub fn pair() -> Result<(Self, Self)> {
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        let (one, other) =
            rustix::net::socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None)
                .map_err(Error::os("make a pair of sockets"))?;
        Ok((Self::from_socket(one), Self::from_socket(other)))
    }

    /// A connection over a socket that must be `SOCK_SEQPACKET` and non-blocking.
    #[must_use]
    pub fn from_socket(socket: OwnedFd) -> Self {
        Self { socket }
    }

    /// Who is at the other end.
    ///
    /// # Errors
    /// If the kernel does not say.
    pub fn peer(&self) -> Result<PeerCredentials> {
        let peer = rustix::net::sockopt::socket_peercred(&self.socket)
            .map_err(Error::os("ask who the peer is"))?;
        Ok(PeerCredentials { pid: peer.pid.as_raw_nonzero().get(), uid: peer.uid.as_raw() })
    }

    /// Refuses a peer that runs as another user.
    ///
    /// # Errors
    /// [`Error::Peer`] with both user ids.
    pub fn check_same_user(&self) -> Result<()> {
        let (expected, found) = (rustix::process::geteuid().as_raw(), self.peer()?.uid);
        if expected == found { Ok(()) } else { Err(Error::Peer { expected, found }) }
    }

    /// Sends a packet, with a descriptor where its type carries one.
    ///
    /// # Errors
    /// [`Error::Disconnected`] if the peer is gone.
    pub fn send(&self, packet: &Packet, fd: Option<BorrowedFd<'_>>) -> Result<Sent> {
        self.send_bytes(packet.as_bytes(), fd.as_slice())
    }

    /// Sends any bytes with any descriptors: what a hostile peer would do.
    ///
    /// # Errors
    /// [`Error::Disconnected`] if the peer is gone.
    pub fn send_bytes(&self, bytes: &[u8], fds: &[BorrowedFd<'_>]) -> Result<Sent> {
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(253))];
        let mut control = SendAncillaryBuffer::new(&mut space);
        if !fds.is_empty() && !control.push(SendAncillaryMessage::ScmRights(fds)) {
            return Err(Error::packet("at most 253 descriptors", fds.len()));
        }
        let parts = [IoSlice::new(bytes)];
        let flags = SendFlags::NOSIGNAL | SendFlags::DONTWAIT;
        loop {
            match rustix::net::sendmsg(&self.socket, &parts, &mut control, flags) {
                Ok(_) => return Ok(Sent::Whole),
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => return Ok(Sent::WouldBlock),
                Err(Errno::PIPE | Errno::CONNRESET | Errno::NOTCONN) => {
                    return Err(Error::Disconnected);
                }
                Err(errno) => return Err(Error::os("send a packet")(errno)),
            }
        }
    }

    /// Receives a packet. Whatever descriptors came with one that is refused are closed.
    ///
    /// # Errors
    /// [`Error::Packet`] if it is longer than a packet may be, or carries another number of
    /// descriptors than its type does.
    pub fn receive(&self) -> Result<Received> {
        let mut bytes = [0; MAX_PACKET_BYTES];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(RECEIVED_FDS))];
        let mut control = RecvAncillaryBuffer::new(&mut space);
        let flags = RecvFlags::CMSG_CLOEXEC | RecvFlags::DONTWAIT;
        let message = loop {
            let mut parts = [IoSliceMut::new(&mut bytes)];
            match rustix::net::recvmsg(&self.socket, &mut parts, &mut control, flags) {
                Ok(message) => break message,
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) => return Ok(Received::WouldBlock),
                Err(Errno::CONNRESET | Errno::NOTCONN) => return Ok(Received::Closed),
                Err(errno) => return Err(Error::os("receive a packet")(errno)),
            }
        };

        // Owning every descriptor first makes sure that each return below closes it.
        let mut fds: Vec<OwnedFd> = Vec::new();
        for ancillary in control.drain() {
            if let RecvAncillaryMessage::ScmRights(rights) = ancillary {
                fds.extend(rights);
            }
        }
        let length = message.bytes;
        if length == 0 {
            // An empty packet cannot be told from the end, and no peer of ours sends one.
            return Ok(Received::Closed);
        }
        if message.flags.contains(ReturnFlags::TRUNC) {
            let expected = format!("at most {MAX_PACKET_BYTES} bytes");
            return Err(Error::packet(expected, "a longer packet"));
        }
        if message.flags.contains(ReturnFlags::CTRUNC) || fds.len() > MAX_FDS {
            let found = format!("more than {}", MAX_FDS.max(fds.len().saturating_sub(1)));
            return Err(Error::packet(format!("at most {MAX_FDS} descriptor"), found));
        }
        let expected = fds_of(&bytes[..length]);
        if expected != fds.len() {
            let expected = format!("{expected} descriptors with this type of message");
            return Err(Error::packet(expected, fds.len()));
        }
        Ok(Received::Packet(Incoming { bytes, length, fd: fds.pop() }))
    }
}

/// Descriptors that this packet has to carry. One that is no message carries none.
fn fds_of(packet: &[u8]) -> usize {
    split(packet).map_or(0, |(kind, _)| MessageKind::fds(kind))
}

impl AsFd for Channel {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}
