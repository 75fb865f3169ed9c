//! What an application links: hands key frames to the Foreframe daemon.
//!
//! Three promises to the application: nothing here waits for the daemon (except where a timeout
//! is an argument), nothing here panics, and a daemon that dies costs one
//! [`Error::Disconnected`]. There is no thread and no event loop inside: one file descriptor
//! ([`Client::as_fd`](std::os::fd::AsFd)) to watch and one [`Client::dispatch`] to call, once per
//! frame will do.
//!
//! ```no_run
//! use std::time::Duration;
//! use foreframe_client::{ConnectOptions, Error, Key, StreamOptions};
//!
//! # fn main() -> Result<(), Error> {
//! let mut client = ConnectOptions::new("my game").connect(Duration::from_secs(1))?;
//! let stream = client.create_stream(&StreamOptions::rgba8(1280, 720))?;
//! for index in 0..100 {
//!     let content_time_ns = 1_000_000 + index * 25_000_000;
//!     client.dispatch()?;
//!     match client.acquire(stream) {
//!         Ok(mut frame) => {
//!             frame.color_mut().bytes.fill(128);
//!             client.submit(frame, Key::new(index, content_time_ns))?;
//!         }
//!         Err(Error::WouldBlock) => {} // The daemon is behind: this key frame is skipped.
//!         Err(error) => return Err(error),
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! The files under `examples/` are to be read in the order of their numbers.

mod client;
mod connect;
mod deadline;
mod error;
mod event;
mod frame;
mod key;
mod options;
mod outbox;
mod output;
mod stream;
mod ui;

pub use client::{Client, StreamId};
pub use connect::{ConnectOptions, Connecting, Handshake};
pub use error::{Error, Result};
pub use event::Event;
pub use foreframe_protocol::{
    Camera, CameraMotion, ColorFormat, DepthFormat, DepthMeaning, EndReason, ErrorCode,
    ErrorMessage, Features, GpuKind, Hint, MaskClass, MotionDirection, MotionFormat, MotionUnit,
    OutputKind, Pacing, PciAddress, PlaneKind, PlaneSize, Presented, Primaries, ProfileName, Rect,
    ReleaseReason, SlotReleased, Statistics, Transfer, ValidRectUse, Welcome,
};
pub use frame::{KeyFrame, PlaneMut};
pub use key::Key;
pub use options::{Depth, Motion, StreamOptions};
pub use output::{OutputFrame, OutputSource};
pub use stream::StreamState;
pub use ui::UiFrame;
