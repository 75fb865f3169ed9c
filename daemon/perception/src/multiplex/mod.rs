//! Ways to show motion with half of the rendering, or with half of the light.
//!
//! [`TemporalMultiplexing`] is the method of Denes 2020, chapter 5; [`Technique`] names it and what
//! it is compared with in table 5.1, and [`table`] computes that table by the models of this crate.
//! Planes hold linear light, 0 to 1 of what the display can show.

mod resample;
mod sequence;
pub mod table;
mod trm;

pub use resample::{reduced, reduced_size, restored};
pub use sequence::{Technique, sequence};
pub use trm::{TemporalMultiplexing, motion_weight};

/// Standard deviation of the low-pass filter before reduction, px (section 5.2.3).
pub const SIGMA_PX: f32 = 2.5;
/// Contrast at which the weight of the residual has fallen to 1/e (below equation 5.6).
pub const S1: f32 = 0.46;
/// Steepness of that fall (below equation 5.6).
pub const S2: f32 = 3.0;

/// Share of the pixels that need not be rendered when every second frame has its sides reduced to
/// `reduction` (figure 5.5): 0.375 at 1/2, 0.42 at 0.4.
#[must_use]
pub fn pixels_saved(reduction: f64) -> f64 {
    (1.0 - reduction * reduction) / 2.0
}

#[cfg(test)]
mod tests;
