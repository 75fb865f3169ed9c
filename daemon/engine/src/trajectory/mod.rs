//! From decoded planes to quantised trajectories: dilation, the rungs of the ladder, quantisation.
//!
//! A rung is a model of how surfaces go on from a key: [`global`], the motion field itself,
//! [`affine`], [`quadratic`], [`world`]. Each says for a cell where its point will be at two phases
//! ([`curve`]); [`ladder`] prepares what they need once per key, takes the rung that the method
//! names, and leaves velocity and acceleration in the key. [`effective`] turns the two into the one
//! velocity that a warp scales. [`flow`] estimates motion where a key has none.
//!
//! The last place with floats. They are deterministic: single operations of IEEE 754 in a fixed
//! order, no fused multiply-add, functions from `libm`. What leaves is integer.

pub mod affine;
pub mod camera_path;
pub mod curve;
pub mod dilate_motion;
pub mod effective;
mod fill;
pub mod flow;
pub mod global;
pub mod grid;
pub mod ladder;
pub mod lattice;
pub mod models;
pub mod quadratic;
pub mod rung;
mod steps;
pub mod surface;
pub mod world;
