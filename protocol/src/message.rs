//! Packets: the header that each one starts with, and the message that it turns out to be.

use std::fmt;

use zerocopy::little_endian::{U16, U32};
use zerocopy::{FromBytes, IntoBytes};

use crate::error::{Error, Result};
use crate::limits::{MAGIC, MAJOR, MAX_PACKET_BYTES};
use crate::wire::Wire;
use crate::wire::camera::LateCamera;
use crate::wire::feedback::{ErrorMessage, Hint, Pacing, Presented, Statistics};
use crate::wire::handshake::{Hello, Welcome};
use crate::wire::output::{
    OutputEnded, OutputFrame, OutputPool, OutputReleased, Subscribe, Unsubscribe,
};
use crate::wire::pool::{PoolAccepted, RegisterPool};
use crate::wire::reject::Reject;
use crate::wire::session::Goodbye;
use crate::wire::stream::{CreateStream, DestroyStream, StreamCreated, StreamEnded};
use crate::wire::submit::{SlotReleased, Submit};
use crate::wire::ui::UiPlane;

wire_struct! {
    /// Starts every packet. Never changes, in any version.
    HeaderRaw, 16 {
        0 magic: U32,
        4 major: U16,
        6 kind: U16,
        8 length: U32,
        12 reserved: U32,
    }
}

wire_struct! {
    /// Starts each extension behind the body of a message.
    ExtensionRaw, 4 {
        0 tag: U16,
        2 length: U16,
    }
}

/// Bit of an extension's tag that says: refuse the message if you do not know me.
pub const EXTENSION_IS_CRITICAL: u16 = 0x8000;
/// Bytes of the header.
pub const HEADER_BYTES: usize = size_of::<HeaderRaw>();

wire_enum! {
    /// Type of a message.
    MessageKind {
        /// Client: who it is, first packet of a session.
        Hello = 1 "hello",
        /// Daemon: the session does not start. Never changes, in any version.
        Reject = 2 "reject",
        /// Daemon: the session starts.
        Welcome = 3 "welcome",
        /// Either: the session ends in good order.
        Goodbye = 4 "goodbye",
        /// Daemon: what was wrong with something that the client sent.
        Error = 5 "error",
        /// Client: a new stream.
        CreateStream = 16 "create_stream",
        /// Daemon: the stream exists.
        StreamCreated = 17 "stream_created",
        /// Client: memory for a stream, one file descriptor.
        RegisterPool = 18 "register_pool",
        /// Daemon: the memory is mapped; slots belong to the client.
        PoolAccepted = 19 "pool_accepted",
        /// Client: no more key frames.
        DestroyStream = 20 "destroy_stream",
        /// Daemon: the stream is gone.
        StreamEnded = 21 "stream_ended",
        /// Client: a key frame.
        Submit = 32 "submit",
        /// Daemon: the slot belongs to the client again.
        SlotReleased = 33 "slot_released",
        /// Client: where the camera is by now.
        LateCamera = 34 "late_camera",
        /// Daemon: a key frame came to the display.
        Presented = 35 "presented",
        /// Daemon: counts since the stream started.
        Statistics = 36 "statistics",
        /// Daemon: how well submissions meet the display.
        Pacing = 37 "pacing",
        /// Daemon: size and rate that would look best.
        Hint = 38 "hint",
        /// Client: a user interface, between key frames.
        UiPlane = 39 "ui_plane",
        /// Client: wants the output frames.
        Subscribe = 48 "subscribe",
        /// Client: wants no more output frames.
        Unsubscribe = 49 "unsubscribe",
        /// Daemon: memory of the output frames, one file descriptor.
        OutputPool = 50 "output_pool",
        /// Daemon: an output frame.
        OutputFrame = 51 "output_frame",
        /// Client: the slot of an output frame is free again.
        OutputReleased = 52 "output_released",
        /// Daemon: no more output frames.
        OutputEnded = 53 "output_ended",
    }
}

impl MessageKind {
    /// File descriptors that a packet of this type carries: exactly this many.
    #[must_use]
    pub const fn fds(self) -> usize {
        match self {
            Self::RegisterPool | Self::OutputPool => 1,
            _ => 0,
        }
    }
}

/// A body that can be written and read without a socket, so that a capture can keep it.
pub trait Body: Sized {
    /// Type of the message.
    const KIND: MessageKind;

    /// The body and its extensions, without header. Each value has exactly one encoding.
    fn to_bytes(&self) -> Vec<u8>;

    /// Copies a body out of `bytes` and checks every field. Unknown optional extensions behind it
    /// are skipped.
    ///
    /// # Errors
    /// [`Error::Field`] with the first field that does not hold what it must.
    fn parse(bytes: &[u8]) -> Result<Self>;

    /// Whether another peer would accept this value.
    ///
    /// # Errors
    /// Those of [`parse`](Self::parse).
    fn validate(&self) -> Result<()>;
}

impl<T: Wire> Body for T {
    const KIND: MessageKind = <T as Wire>::KIND;

    fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = self.to_raw().as_bytes().to_vec();
        self.put_extensions(&mut bytes);
        bytes
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let Ok((raw, tail)) = T::Raw::read_from_prefix(bytes) else {
            let expected = format!("at least {} bytes", size_of::<T::Raw>());
            return Err(Error::field(T::KIND, "body", expected, bytes.len()));
        };
        let mut body = T::from_raw(&raw)?;
        take_extensions(&mut body, tail)?;
        Ok(body)
    }

    fn validate(&self) -> Result<()> {
        T::from_raw(&self.to_raw()).map(|_| ())
    }
}

/// Appends an extension.
pub(crate) fn put_extension(tag: u16, data: &[u8], bytes: &mut Vec<u8>) {
    let length = u16::try_from(data.len()).expect("extensions are shorter than a packet");
    let header = ExtensionRaw { tag: U16::new(tag), length: U16::new(length) };
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend_from_slice(data);
}

/// Walks the extensions behind a body, which takes in those that it knows.
fn take_extensions<T: Wire>(body: &mut T, mut tail: &[u8]) -> Result<()> {
    while !tail.is_empty() {
        let fail = |expected: &str, found: String| {
            Err(Error::field(T::KIND, "extension", expected, found))
        };
        let Ok((extension, rest)) = ExtensionRaw::read_from_prefix(tail) else {
            return fail("a tag and a length, 4 bytes", format!("{} bytes", tail.len()));
        };
        let (tag, length) = (extension.tag.get(), usize::from(extension.length.get()));
        if length > rest.len() {
            return fail("a length inside the packet", format!("{length} of {}", rest.len()));
        }
        let is_known = body.take_extension(tag, &rest[..length])?;
        if !is_known && tag & EXTENSION_IS_CRITICAL != 0 {
            return fail("no critical extension that is unknown here", format!("tag {tag:#06x}"));
        }
        tail = &rest[length..];
    }
    Ok(())
}

/// One packet as it is sent: header and body.
#[derive(Clone, Copy)]
pub struct Packet {
    bytes: [u8; MAX_PACKET_BYTES],
    length: usize,
}

impl Packet {
    /// The packet of this message.
    #[must_use]
    pub fn new<T: Body>(body: &T) -> Self {
        Self::from_body_bytes(T::KIND, &body.to_bytes())
    }

    /// A packet around bytes that are taken as they are.
    ///
    /// # Panics
    /// If the body does not fit a packet, which no body of this crate can do.
    #[must_use]
    pub fn from_body_bytes(kind: MessageKind, body: &[u8]) -> Self {
        let length = HEADER_BYTES + body.len();
        let mut bytes = [0; MAX_PACKET_BYTES];
        assert!(length <= bytes.len(), "a packet of {length} bytes");
        let header = HeaderRaw {
            magic: U32::new(MAGIC),
            major: U16::new(MAJOR),
            kind: U16::new(u16::try_from(kind.code()).expect("types are below 65536")),
            length: U32::new(u32::try_from(length).expect("at most 1024")),
            reserved: U32::ZERO,
        };
        bytes[..HEADER_BYTES].copy_from_slice(header.as_bytes());
        bytes[HEADER_BYTES..length].copy_from_slice(body);
        Self { bytes, length }
    }

    /// What is sent.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

impl fmt::Debug for Packet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Packet").field(&self.as_bytes()).finish()
    }
}

/// Checks the header of a packet: its type, and the body with whatever extends it.
///
/// # Errors
/// [`Error::Packet`] if it is no packet of ours, [`Error::Version`] if the sender has another
/// major version (and the message is not one that never changes).
pub fn split(packet: &[u8]) -> Result<(MessageKind, &[u8])> {
    let Ok((header, body)) = HeaderRaw::read_from_prefix(packet) else {
        return Err(Error::packet(format!("at least {HEADER_BYTES} bytes"), packet.len()));
    };
    if header.magic.get() != MAGIC {
        let found = format!("{:#010x}", header.magic.get());
        return Err(Error::packet(format!("magic {MAGIC:#010x} (FFRM)"), found));
    }
    if header.length.get() as usize != packet.len() || packet.len() > MAX_PACKET_BYTES {
        let expected = format!("its length, at most {MAX_PACKET_BYTES}, in the header");
        let found = format!("length {} in {} bytes", header.length.get(), packet.len());
        return Err(Error::packet(expected, found));
    }
    let kind = MessageKind::from_code(u32::from(header.kind.get()));
    if header.major.get() != MAJOR && kind != Some(MessageKind::Reject) {
        return Err(Error::Version { expected: MAJOR, found: header.major.get() });
    }
    if header.reserved.get() != 0 {
        return Err(Error::packet("0 in the reserved field of the header", header.reserved.get()));
    }
    let kind = kind.ok_or_else(|| Error::packet("a known message type", header.kind.get()))?;
    Ok((kind, body))
}

/// Declares what one side sends.
macro_rules! message_enum {
    ($(#[$meta:meta])* $name:ident, $side:literal { $($kind:ident($type:ty),)* }) => {
        $(#[$meta])*
        #[derive(Clone, PartialEq, Debug)]
        pub enum $name {
            $(#[doc = concat!("See [`", stringify!($type), "`].")] $kind($type),)*
        }

        impl $name {
            /// Reads a whole packet.
            ///
            /// # Errors
            /// Whatever is wrong with the header, with a field of the body, or a message that
            /// this side may not send.
            pub fn parse(packet: &[u8]) -> Result<Self> {
                let (kind, body) = split(packet)?;
                match kind {
                    $(MessageKind::$kind => <$type as Body>::parse(body).map(Self::$kind),)*
                    other => {
                        Err(Error::packet(concat!("a message that ", $side, " sends"), other))
                    }
                }
            }

            /// Type of the message.
            #[must_use]
            pub const fn kind(&self) -> MessageKind {
                match self { $(Self::$kind(_) => MessageKind::$kind,)* }
            }

            /// The packet of this message.
            #[must_use]
            pub fn to_packet(&self) -> Packet {
                match self { $(Self::$kind(body) => Packet::new(body),)* }
            }
        }

        $(impl From<$type> for $name {
            fn from(body: $type) -> Self {
                Self::$kind(body)
            }
        })*
    };
}

message_enum! {
    /// What a client sends.
    #[expect(clippy::large_enum_variant, reason = "one lives on the stack at a time")]
    ClientMessage, "a client" {
        Hello(Hello),
        Goodbye(Goodbye),
        CreateStream(CreateStream),
        RegisterPool(RegisterPool),
        DestroyStream(DestroyStream),
        Submit(Submit),
        LateCamera(LateCamera),
        UiPlane(UiPlane),
        Subscribe(Subscribe),
        Unsubscribe(Unsubscribe),
        OutputReleased(OutputReleased),
    }
}

message_enum! {
    /// What the daemon sends.
    DaemonMessage, "a daemon" {
        Reject(Reject),
        Welcome(Welcome),
        Goodbye(Goodbye),
        Error(ErrorMessage),
        StreamCreated(StreamCreated),
        PoolAccepted(PoolAccepted),
        StreamEnded(StreamEnded),
        SlotReleased(SlotReleased),
        Presented(Presented),
        Statistics(Statistics),
        Pacing(Pacing),
        Hint(Hint),
        OutputPool(OutputPool),
        OutputFrame(OutputFrame),
        OutputEnded(OutputEnded),
    }
}
