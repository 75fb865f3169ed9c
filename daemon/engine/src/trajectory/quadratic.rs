//! The `quadratic` rung: velocity and acceleration from the last two motion fields.
//!
//! A point at x now was at x - D one span ago and, by the motion field of the key before, at
//! x - D - D' a span of that key earlier. The parabola through the three places, with r the older
//! span as a part of the newer one:
//!
//! ```text
//! (1) a = (D - D' / r) / ((1 + r) / 2)         v = D + a / 2
//! ```
//!
//! D' is read where the point was, from cells of its own surface. Where it was hidden, or outside
//! the picture, nothing is known but D.

use super::curve::Curve;
use super::grid::Grid;
use super::surface::Around;
use crate::key::KeyFrame;
use crate::lanes::both;

/// The older of two fields, and how it is read.
#[derive(Clone, Copy, Debug)]
pub struct Quadratic<'a> {
    older: &'a KeyFrame,
    grid: Grid,
    /// r of (1).
    ratio: f32,
}

impl<'a> Quadratic<'a> {
    /// Of `key` and the key `older` whose content time its motion points back to. None where it
    /// points elsewhere, or either has no motion.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a ratio needs no more than an f32")]
    pub fn new(key: &KeyFrame, older: &'a KeyFrame) -> Option<Self> {
        let (span, older_span) = (key.motion_span()?, older.motion_span()?);
        let follows = key.motion_from == Some(older.content_time);
        let ratio = (older_span.as_secs_f64() / span.as_secs_f64()) as f32;
        (follows && !older.displacement.data().is_empty()).then(|| Self {
            older,
            grid: Grid::of(older),
            ratio,
        })
    }

    /// The depth key of the older field where a point was that is at pixel `at` now, came by `d`,
    /// and has depth key `depth`: that of the cell of its own surface nearest to there.
    #[must_use]
    #[inline(always)]
    pub fn depth_before(&self, at: [f32; 2], d: [f32; 2], depth: u32) -> Option<u32> {
        let around = Around::new(&self.grid, [at[0] - d[0], at[1] - d[1]])?;
        let (x, y) = around.nearest(self.older, Some(depth))?;
        self.older.depth.data().get(y as usize * self.grid.cells[0] as usize + x as usize).copied()
    }

    /// (1) of a cell.
    #[must_use]
    #[inline(always)]
    pub fn curve(&self, key: &KeyFrame, grid: &Grid, x: u32, y: u32) -> Option<Curve> {
        let d = key.displacement.at(x, y);
        let at = grid.centre(x, y);
        let was = [at[0] - d[0], at[1] - d[1]];
        let depth = (!key.depth.data().is_empty()).then(|| key.depth.at(x, y));
        let before = Around::new(&self.grid, was)?.motion(self.older, depth)?;
        let a = both(|axis| (d[axis] - before[axis] / self.ratio) * (2.0 / (1.0 + self.ratio)));
        Some(Curve::accelerated([d[0] + 0.5 * a[0], d[1] + 0.5 * a[1]], a))
    }
}
