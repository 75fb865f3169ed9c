//! For each hole cell, the resolved cell on its far side.
//!
//! A hole opens between a surface that moved away and what it used to hide. Walking from the hole
//! to either side along the axis in which the hole is shorter meets both:
//!
//! ```text
//! (1) run(axis) = cells from the resolved one on one side to that on the other
//! (2) axis      = the one with a resolved cell and the shorter run, x among equals
//! (3) far       = of its two cells the one of the smaller depth key; where they are within
//!                 1/256 of each other, the nearer one, and the left or upper one among equals
//! ```
//!
//! At the border of the image a side is missing: a run is then counted as twice the way to the
//! other one, and as what is missing may be the far one, the other axis takes part in (3). A grid
//! without any resolved cell has no far side: [`NO_CELL`].
//! Exactness: `Exact`.

mod cpu;
mod gpu;
#[cfg(test)]
mod tests;

pub use cpu::{FarScratch, far_side};
pub use gpu::FAR_SIDE;

/// No cell at all.
pub const NO_CELL: u32 = u32::MAX;
/// No resolved row on this side.
pub const NO_ROW: u16 = u16::MAX;
