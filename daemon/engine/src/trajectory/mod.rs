//! From decoded planes to quantised trajectories: dilation and quantisation of motion.
//!
//! The last place with floats. They are deterministic: single operations of IEEE 754 in a fixed
//! order, no fused multiply-add, functions from `libm`. What leaves is integer.

pub mod dilate_motion;
