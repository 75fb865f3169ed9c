//! Where in-between frames are made.
//!
//! The engine decodes keys and quantises trajectories; what follows is integer arithmetic on whole
//! planes, and runs where a backend says. Every backend makes the same bytes: the CPU is the
//! reference, others are compared with it.
//!
//! A picture that is a key as it is needs no backend: the engine copies it.

pub mod choice;
pub mod cpu;
pub(crate) mod fallback;
#[cfg_attr(not(feature = "gpu"), path = "no_gpu.rs")]
pub mod gpu;
pub mod shader;

pub use fallback::BackendStatus;

use crate::field::FieldMap;
use crate::finish::shares::Split;
use crate::key::KeyFrame;
use crate::method::Method;
use crate::phase::Phase;
use crate::plane::Plane;

/// What one picture is made of.
#[derive(Clone, Copy, Debug)]
pub struct FrameInput<'a> {
    /// The method, not [`Method::Hold`].
    pub method: Method,
    /// Position after `newest`; not 0 with a method that extrapolates, and then `newest` has a
    /// velocity field.
    pub phase: Phase,
    /// The newest key.
    pub newest: &'a KeyFrame,
    /// The keys before it, from the newest on; at least one with a method that interpolates.
    pub past: &'a [&'a KeyFrame],
    /// Where the cells of `newest`'s field lie.
    pub map: &'a FieldMap,
    /// How much brighter it is, per tile ([`crate::light`]), on a backend that can.
    pub gains: Option<&'a Plane<i32>>,
    /// What the picture is finished with, on a backend that can.
    pub finish: Option<Split<'a>>,
}

/// What pictures of a stream may go through after their warp.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Passes {
    /// [`crate::light`].
    pub relights: bool,
    /// [`crate::finish`].
    pub finishes: bool,
}
