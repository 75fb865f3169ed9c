//! Contrast sensitivity: one over the contrast of a grating that is seen half of the time.
//!
//! Each model is used where the published constants that build on it were fitted with it:
//! [`barten`] for still patterns, [`kelly`] for moving ones under pursuit, [`PyramidOfVisibility`]
//! for flicker, [`chromatic`] for colour. They are not interchangeable.

pub mod barten;
pub mod chromatic;
pub mod kelly;
mod pyramid;

pub use pyramid::PyramidOfVisibility;
