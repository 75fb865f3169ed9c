//! Repairs disocclusions: what no source pixel lands on.
//!
//! What comes into view lies behind what moved away, so a hole continues its far side. It never
//! takes the colour of the nearer side, nor a mixture of both.

pub mod far_side;
