//! Forward splat on the field grid: which source cell does each target cell show?
//!
//! Each source cell `i` lands at its own place plus its displacement, in Q8 cells,
//!
//! ```text
//! (1) t = 256 i + ((v p_cell + 256) >> 9)       p_cell = p cells / pixels, per axis, Q12
//! ```
//!
//! and is splatted on the 2x2 cells around `t` (1 or 2 of them where `t` is on a column or row).
//! Two passes, each free of order:
//!
//! ```text
//! (2) top(c)    = max of the depth keys splatted on c
//! (3) splat(c)  = min of (distance << 25 | source) of those with depth >= top(c) - (top(c) >> 8)
//! (4) distance  = (|t_x - 256 c_x| + |t_y - 256 c_y|) >> 2, 0 to 127
//! ```
//!
//! So fold-overs show the nearest surface, and of one surface the cell that lands closest. 25 bits
//! number [`MAX_CELLS`] cells. [`NO_SOURCE`] marks a hole. Cells that land outside are dropped.
//! Exactness: `Exact`.

mod gpu;
mod one_by_one;
mod runs;
mod source;
#[cfg(test)]
mod tests;
mod tiles;
mod window;

pub use gpu::{SCATTER, SOURCE};
pub use one_by_one::scatter as scatter_one_by_one;
pub use source::SourceField;
pub use tiles::{ScatterScratch, scatter};

use crate::field::FieldAxis;
use crate::phase::Phase;

/// What a target cell holds that no source cell lands on.
pub const NO_SOURCE: u32 = u32::MAX;
/// Bits that number a source cell.
pub const SOURCE_BITS: u32 = 25;
/// Most cells that a field grid may have. One less than the bits number, so that no splat is
/// [`NO_SOURCE`].
pub const MAX_CELLS: u32 = (1 << SOURCE_BITS) - 1;

/// The source cell of a splat that is not [`NO_SOURCE`].
#[must_use]
pub const fn source_of(splat: u32) -> usize {
    (splat & MAX_CELLS) as usize
}

/// `p_cell` of (1): the phase in the unit that turns velocities into Q8 cells.
#[expect(clippy::cast_possible_wrap, reason = "at most the phase, 16384")]
#[must_use]
pub fn phase_in_cells(phase: Phase, axis: &FieldAxis) -> i32 {
    let pixels = axis.pixels();
    ((phase.q12().cast_unsigned() * axis.cells() + pixels / 2) / pixels) as i32
}

/// Displacement in Q8 cells of (1).
#[inline(always)]
fn shift(v: i16, scale: i32) -> i32 {
    (i32::from(v) * scale + 256) >> 9
}
