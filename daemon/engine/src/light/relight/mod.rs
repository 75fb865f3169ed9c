//! Makes a picture brighter or darker, by a gain between tiles.
//!
//! With g the gain at the middle of each tile, linear between them in 1/16 of the way, and level
//! where the picture ends; c a channel but alpha, which stays:
//!
//! ```text
//! (1) c' = (c g + 2048) >> 12, the last level at most      g Q12; integer formats
//! (2) c' = c + g, above 0 and finite                       half floats above 0, whose codes are a
//!                                                          logarithm; g in codes
//! ```
//!
//! A gain of 4096, or of 0 codes, changes nothing. Exactness: `Exact`.

mod cpu;
mod gpu;

pub use cpu::{BLACK, BRIGHTEST, WAYS, gain, relight};
pub use gpu::RELIGHT;
