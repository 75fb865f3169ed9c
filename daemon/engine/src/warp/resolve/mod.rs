//! From splats to what a gather needs: the velocity that each target cell shows, and whether the
//! cells around it agree.
//!
//! ```text
//! (1) carried(c) = v(source(c));  HOLE where nothing landed
//! (2) class(c)   = Smooth where 3x3 around c holds no hole and, in x and in y,
//!                  ((max v - min v) p) >> 9 <= 128, half a pixel; else Broken
//! ```
//!
//! In a smooth cell displacement may be interpolated between cell centres: whatever surfaces there
//! are, they move together. Only broken cells pay for choosing. Neighbours outside the grid do not
//! take part. Exactness: `Exact`.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod cpu;
mod gpu;

pub use cpu::{classify, resolve, smooth_limit};
pub use gpu::{CLASSIFY, RESOLVE};

use crate::key::Velocity;

/// What [`resolve`] carries where nothing landed; no velocity of a surface has this value.
pub const HOLE: Velocity = Velocity::UNTRACKABLE;

/// Whether the cells around a target cell agree on their displacement.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[repr(u8)]
pub enum CellClass {
    /// They do, to half a pixel.
    Smooth,
    /// They do not, or one is a hole.
    #[default]
    Broken,
}
