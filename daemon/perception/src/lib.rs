//! Models of the display and of the eye. Pure: numbers in, numbers out.
//!
//! [`tracking`] says how much of a motion the eye can follow.

pub mod tracking;
