//! What a display makes of codes: light, when, and how large to the eye.
//!
//! [`GainOffsetGamma`] turns codes into CIE XYZ and back, [`LcdModel`] adds the memory of liquid
//! crystals, [`DisplayProfile`] holds the constants of one display, [`geometry`] turns pixels into
//! visual degrees, and [`transfer`] has the two transfer functions that streams state.
//!
//! Codes are encoded values of 0 to 1 per channel, whatever the number of bits.

mod gain_offset_gamma;
pub mod geometry;
mod lcd;
mod profile;
pub mod transfer;

pub use gain_offset_gamma::GainOffsetGamma;
pub use lcd::{LcdInverse, LcdModel};
pub use profile::{DisplayProfile, HighRefresh, Technology};
