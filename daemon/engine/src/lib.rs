//! The Foreframe engine: extrapolates in-between frames and plans when to show which content time.
//!
//! Pure: bytes and times go in, pictures and plans come out. It reads no clock, opens no socket
//! and knows no wire format, so the live daemon, the replay tool and the tests run the same code.
//!
//! Flow of a key frame: [`decode`] converts what the application declared to the one convention
//! inside; [`evidence`] judges what was predicted of it; [`trajectory`] says how its surfaces go on
//! and quantises that; of an in-between frame: [`warp`]
//! scatters or gathers along the trajectories, [`fill`] repairs what no source pixel lands on,
//! [`light`] goes on changing where nothing that moves explains it,
//! [`finish`] moves detail from in-between frames to their keys where it is asked to.
//! [`engine`] runs these steps in order, [`pacing`] says for which content time.
//!
//! Everything after the trajectory is integer arithmetic, so that one input gives one output on
//! every machine and for any number of threads.

pub mod backend;
pub mod bands;
pub mod color;
pub mod decode;
pub mod diagnosis;
pub mod engine;
pub mod evidence;
pub mod field;
pub mod fill;
pub mod finish;
pub mod format;
pub mod inspect;
pub mod kernels;
pub mod key;
mod lanes;
pub mod light;
pub mod mask;
pub mod method;
pub mod multiplex;
pub mod pacing;
pub mod params;
pub mod phase;
pub mod plane;
pub mod simd;
#[cfg(test)]
mod testing;
pub mod time;
pub mod trajectory;
pub mod ui;
pub mod warp;

pub use color::ColorPlane;
pub use decode::DecodeError;
pub use engine::{Engine, EngineConfig, FrameReport, KeyReport};
pub use finish::{FinishConfig, FinishMode};
pub use format::StreamFormat;
pub use key::{Camera, KeyFrame, KeyInput, Pixels, PlaneInput, ReadPixels};
pub use method::Method;
pub use phase::Phase;
pub use plane::{Plane, Rect};
pub use simd::Simd;
pub use time::{MonoSpan, MonoTime};
pub use ui::UiInput;
