//! Wire types, handshake, shared-memory planes and fd passing of Foreframe.
//!
//! `PROTOCOL.md` in the root of the repository is normative; a test compares its tables with the
//! offsets in [`wire`]. This crate owns layout and validation and nothing else: no threads, no
//! clocks, no pixels. The peer is not trusted: a message is copied out of the socket, validated by
//! the one `parse` of its type, and only then used.
//!
//! - [`message`]: [`ClientMessage`] and [`DaemonMessage`], what a packet holds
//! - [`wire`]: each message, its layout and its checks
//! - [`format`](mod@format), [`plane`]: what a stream declares, what one key frame brings
//! - [`layout`]: how a struct and a closed set of numbers are declared
//! - [`slots`]: who may touch a slot when, the same code on either side
//! - [`memory`]: sealed pools, the only unsafe code
//! - [`socket`]: one packet in, one packet out, with its file descriptors

#[macro_use]
pub mod layout;

pub mod error;
pub mod format;
pub mod limits;
pub mod memory;
pub mod message;
pub mod plane;
pub mod profile;
pub mod slots;
pub mod socket;
mod text;
pub mod wire;

pub use error::{Error, Result};
pub use format::{
    CameraMotion, ColorFormat, DepthConvention, DepthFormat, DepthMeaning, MaskClass, MaskFormat,
    MotionConvention, MotionDirection, MotionFormat, MotionUnit, Primaries, StreamFormat, Transfer,
    ValidRectUse,
};
pub use message::{Body, ClientMessage, DaemonMessage, MessageKind, Packet};
pub use plane::{PlaneDescriptor, PlaneKind, PlaneMap, PlaneSize, Rect};
pub use profile::ProfileName;
pub use wire::camera::{Camera, LateCamera};
pub use wire::feedback::{ErrorCode, ErrorMessage, Hint, Pacing, Presented, Statistics};
pub use wire::handshake::{Clock, Features, GpuKind, Hello, PciAddress, Welcome};
pub use wire::output::{
    OutputEnded, OutputFrame, OutputKind, OutputPool, OutputReleased, Subscribe, Unsubscribe,
};
pub use wire::pool::{PoolAccepted, RegisterPool};
pub use wire::reject::{Reject, RejectCode};
pub use wire::session::{EndReason, Goodbye};
pub use wire::stream::{CreateStream, DestroyStream, StreamCreated, StreamEnded};
pub use wire::submit::{ReleaseReason, SlotReleased, Submit};
pub use wire::ui::UiPlane;
