//! The velocity that, scaled by the phase, moves a point as far as its velocity and acceleration
//! do.
//!
//! Warps scale one velocity per cell. Before a frame whose field accelerates, this kernel makes the
//! field that they scale:
//!
//! ```text
//! (1) v_eff = v + ((a p + 2^12) >> 13)        v, a in 1/32 pixel, p in Q12: a p / 2
//! ```
//!
//! saturated to +-1023 pixels, so that v_eff p = v p + a p^2 / 2. Untrackable stays untrackable;
//! the shader, which writes what the scatter reads, writes 0 there as `warp/scatter` does.
//!
//! |a| <= 32767 and p <= 16384, so the product stays inside an i32. Phase 0 gives v. Exactness:
//! `Exact`.

mod cpu;
mod gpu;
#[cfg(test)]
mod tests;

pub use cpu::effective_velocity;
pub use gpu::EFFECTIVE;

/// Largest effective velocity per axis, 1/32 pixel: 1023 pixels.
pub const LARGEST: i32 = 1023 * 32;
