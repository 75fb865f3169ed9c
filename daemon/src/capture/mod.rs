//! Captures: key frames recorded in a file, exactly as they arrived.
//!
//! A capture is one MCAP file that every MCAP tool can open. `container` and `index` are its two
//! halves: writing chunks, and finding them again without trusting more than has been checked.
//! `codec` and `filter` turn planes into fewer bytes and back. `writer` and `reader` add the
//! protocol's meaning: a frame is the submit message that the application sent, plus its planes.
//!
//! What is guaranteed: a file that ends anywhere opens up to its last whole frame; what is read
//! equals what was written, bit for bit, or is an error that says what was expected and found; no
//! file, however hostile, makes the reader allocate more than the planes it declares, each within
//! the limits of the protocol, one frame at a time.

mod codec;
mod container;
mod error;
mod filter;
mod index;
mod info;
mod layout;
mod reader;
mod record;
mod schema;
mod session;
mod source;
#[cfg(test)]
mod tests;
mod ui_plane;
mod walk;
mod writer;

pub use codec::{Codec, Coding, Filter, plane_hash};
pub use container::PlaneBytes;
pub use error::CaptureError;
pub use filter::PixelLayout;
pub use index::{CapturedPose, Damage};
pub use info::{CaptureInfo, PlanesInfo, StreamInfo};
pub use layout::pixel_layout;
pub use reader::{Capture, CapturedFrame, CapturedPlane, FrameTimes};
pub use record::PlaneInfo;
pub use schema::VERSION;
pub use session::{
    CaptureSource, DISPLAY_ORIGIN, Gap, PIXELS_PER_DEGREE, PIXELS_PER_DEGREE_IS_GIVEN, SessionInfo,
};
pub use source::ReadAt;
pub use ui_plane::CapturedUi;
pub use writer::CaptureWriter;
