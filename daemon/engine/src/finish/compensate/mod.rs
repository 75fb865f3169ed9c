//! From a picture and its blur to a key, or to an in-between frame.
//!
//! Per channel but alpha, which stays, with `o` the picture, `s` its blur, `w` how far it is
//! blurred there ([`super::selection`], of 128; everywhere 128 without a selection) and N the
//! frames that share the light:
//!
//! ```text
//! (0) b     = ((128 - w) o + w s + 64) >> 7
//! (1) least = (N l(o) - full) / (N - 1), most = N l(o) / (N - 1), both within D / N of l(o)
//! (2) i     = b, the level nearest to most where l(b) > most, to least where l(b) < least
//! (3) key   = o where i = o, else the level nearest to N l(o) - (N - 1) l(i)
//! ```
//!
//! Divisions round to the nearest, N l(o) - full is 0 where it would be below. D is how far key and
//! in-between frames may differ (`foreframe_perception::flicker`), full where there is no limit. A
//! key is (3) and an in-between frame is (2), so that over N frames of one surface the light is N
//! times that of `o`, whatever w is, if it is the same for all of them. Where w is 0 nothing
//! changes. Exactness: `Exact`.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod cpu;
mod gpu;

pub use cpu::compensate;
pub use gpu::COMPENSATE;
