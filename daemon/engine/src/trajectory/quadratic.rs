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
    /// The key that the older one's motion points back to, which has depth.
    oldest: Option<(&'a KeyFrame, Grid)>,
}

/// Where a point has been.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Been {
    /// Pixel.
    pub at: [f32; 2],
    /// Depth key there, between the cells of its surface.
    pub depth: f32,
}

impl<'a> Quadratic<'a> {
    /// Of `key` and the key `older` whose content time its motion points back to. None where it
    /// points elsewhere, or either has no motion. Where the motion of `older` points back to
    /// `oldest` and that has depth, points are followed to there.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a ratio needs no more than an f32")]
    pub fn new(key: &KeyFrame, older: &'a KeyFrame, oldest: Option<&'a KeyFrame>) -> Option<Self> {
        let (span, older_span) = (key.motion_span()?, older.motion_span()?);
        let follows = key.motion_from == Some(older.content_time);
        let leads_there = |key: &&KeyFrame| {
            older.motion_from == Some(key.content_time) && !key.depth.data().is_empty()
        };
        let ratio = (older_span.as_secs_f64() / span.as_secs_f64()) as f32;
        (follows && !older.displacement.data().is_empty()).then(|| Self {
            older,
            grid: Grid::of(older),
            ratio,
            oldest: oldest.filter(leads_there).map(|key| (key, Grid::of(key))),
        })
    }

    /// r of (1).
    #[must_use]
    #[inline(always)]
    pub fn ratio(&self) -> f32 {
        self.ratio
    }

    /// Where a point was in the older picture that is at pixel `at` now, came by `d`, and has depth
    /// key `depth`.
    #[must_use]
    #[inline(always)]
    pub fn been(&self, at: [f32; 2], d: [f32; 2], depth: u32) -> Option<Been> {
        let at = both(|axis| at[axis] - d[axis]);
        let depth = Around::new(&self.grid, at)?.depth(self.older, depth)?;
        Some(Been { at, depth })
    }

    /// Where a point was in the oldest picture that is at pixel `at` now, came to there from `was`
    /// in the older one.
    #[must_use]
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "between depth keys")]
    #[expect(clippy::cast_sign_loss, reason = "between depth keys")]
    pub fn been_before(&self, was: &Been) -> Option<Been> {
        let (oldest, grid) = self.oldest.as_ref()?;
        let depth = was.depth as u32;
        let d = Around::new(&self.grid, was.at)?.motion(self.older, Some(depth))?;
        let at = both(|axis| was.at[axis] - d[axis]);
        let depth = Around::new(grid, at)?.depth(oldest, depth)?;
        Some(Been { at, depth })
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
