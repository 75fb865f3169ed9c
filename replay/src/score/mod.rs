//! Scoring: what left-out frames of a capture should look like against what a method made of them.
//!
//! [`picture`] turns any colour plane into the 8-bit sRGB pictures that [`metrics`] compare.

pub mod metrics;
pub mod picture;
