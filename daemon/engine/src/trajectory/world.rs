//! The `world` rung: depth and cameras say how the picture moves, motion says what moves besides.
//!
//! With c(x, p) the displacement at phase p of a still point seen at x as the camera goes on
//! ([`super::camera_path`]), and c'(x) how far the camera's motion since the older key moved it:
//!
//! ```text
//! (1) m    = D - c'(x)                       motion of its own, in the picture; D the motion field
//! (2) d(p) = c(x, p) + m p                   where m is small: it stands still, give or take
//! (3) h(p) = h + (h - h') p                  where it is not: h = w (x, y, 1), h' of its place then
//!     d(p) = c(h(p), p)
//! ```
//!
//! A still point has m = 0 and follows the camera's path alone. One that moves goes on through the
//! world at constant velocity, (3): its place one span ago comes from where it was in the older
//! picture and the depth that the older key has there. h, a pixel scaled by its distance, is linear
//! in the place, so that no matrix has to be undone. Where the older key shows no such surface the
//! point goes on along its motion vector. Where the field knows no motion a point is taken to be
//! still; and so is the background where nothing was drawn (depth key 0), which engines leave
//! without vectors.

use super::camera_path::{Onward, Reprojection};
use super::curve::{Curve, Curves};
use super::grid::Grid;
use super::quadratic::Quadratic;
use crate::key::{Camera, KeyFrame};
use crate::lanes::both;
use crate::time::MonoSpan;

/// Own motion, pixels per span and axis, up to which a surface moves with the world: more than the
/// motion and depth of real engines are off.
const STILL_PX: f32 = 0.25;

/// The camera's motion around one key.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct World {
    /// Since the older key: from the picture of the key to that one.
    older: Reprojection,
    /// And back.
    from_older: Reprojection,
    /// Until phases 1/2 and 1.
    half: Reprojection,
    one: Reprojection,
    /// Inverse distance of a depth key of 1.
    per_depth_key: f32,
}

impl World {
    /// Of `key`, which has depth and a camera, as the camera goes `onward` from it. `older` is the
    /// camera at the time that its motion points back to, `span` before. None where its projection
    /// tells no distance.
    #[must_use]
    pub fn new(key: &KeyFrame, older: &Camera, onward: &Onward, span: MonoSpan) -> Option<Self> {
        let camera = key.camera.as_ref()?;
        let per_depth_key = key.inverse_distance_per_depth_key?;
        Some(Self {
            older: super::camera_path::between(camera, older, key.valid)?,
            from_older: super::camera_path::between(older, camera, key.valid)?,
            half: onward.reprojection(key.valid, span.scale(1, 2))?,
            one: onward.reprojection(key.valid, span)?,
            per_depth_key,
        })
    }

    /// (2) or (3) of a cell; `older` reads the key before. NaN where the point is not in front of
    /// the camera.
    #[must_use]
    #[inline(always)]
    pub fn curve(
        &self,
        key: &KeyFrame,
        older: Option<&Quadratic<'_>>,
        grid: &Grid,
        x: u32,
        y: u32,
    ) -> Curve {
        let at = grid.centre(x, y);
        let depth = key.depth.at(x, y);
        let q = self.inverse_distance(depth);
        let displacement = if depth == 0 { [f32::NAN; 2] } else { key.displacement.at(x, y) };
        let own = self.own_motion(at, q, displacement);
        if is_small(own) {
            let (half, one) = (self.half.place(at, q), self.one.place(at, q));
            return Curve {
                half: [half[0] - at[0] + 0.5 * own[0], half[1] - at[1] + 0.5 * own[1]],
                one: [one[0] - at[0] + own[0], one[1] - at[1] + own[1]],
            };
        }
        let before = older.and_then(|older| older.depth_before(at, displacement, depth));
        let Some(before) = before.filter(|before| *before > 0) else {
            return Curve::straight(displacement);
        };
        let was = [at[0] - displacement[0], at[1] - displacement[1]];
        let then = self.from_older.scaled(was, self.inverse_distance(before));
        let now = [at[0] / q, at[1] / q, 1.0 / q];
        let seen = |by: &Reprojection, p: f32| {
            let part = |i: usize| now[i] + (now[i] - then[i]) * p;
            let [x, y, w] = [part(0), part(1), part(2)];
            let w = if w > 0.0 { w } else { f32::NAN };
            let place = by.place([x / w, y / w], 1.0 / w);
            [place[0] - at[0], place[1] - at[1]]
        };
        Curve { half: seen(&self.half, 0.5), one: seen(&self.one, 1.0) }
    }

    /// (2) of `N` cells from (`x`, `y`) on; None where one of them moves on its own.
    #[must_use]
    #[inline(always)]
    pub fn still_curves<const N: usize>(
        &self,
        key: &KeyFrame,
        grid: &Grid,
        x: u32,
        y: u32,
    ) -> Option<Curves<N>> {
        let start = y as usize * grid.cells[0] as usize + x as usize;
        let depth: &[u32; N] = key.depth.data().get(start..)?.first_chunk()?;
        let displacement: &[[f32; 2]; N] = key.displacement.data().get(start..)?.first_chunk()?;
        let mut curves = Curves { velocity: [[0.0; N]; 2], acceleration: [[0.0; N]; 2] };
        let mut is_still = true;
        for i in 0..N {
            let at = grid.centre(x + i as u32, y);
            let q = self.inverse_distance(depth[i]);
            let own = self.own_motion(at, q, displacement[i]);
            let own = both(|axis| if depth[i] == 0 { 0.0 } else { own[axis] });
            is_still &= is_small(own);
            let (half, one) = (self.half.place(at, q), self.one.place(at, q));
            for axis in 0..2 {
                let half = half[axis] - at[axis] + 0.5 * own[axis];
                let one = one[axis] - at[axis] + own[axis];
                curves.velocity[axis][i] = 4.0 * half - one;
                curves.acceleration[axis][i] = 4.0 * one - 8.0 * half;
            }
        }
        curves.or_straight(displacement);
        is_still.then_some(curves)
    }

    /// 1 / w of a depth key.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "24 bits of depth are enough")]
    fn inverse_distance(&self, depth: u32) -> f32 {
        depth as f32 * self.per_depth_key
    }

    /// (1), 0 where no motion is known.
    #[inline(always)]
    fn own_motion(&self, at: [f32; 2], q: f32, displacement: [f32; 2]) -> [f32; 2] {
        let was = self.older.place(at, q);
        let own = both(|axis| displacement[axis] - (at[axis] - was[axis]));
        let is_known = own[0].is_finite() & own[1].is_finite();
        if is_known { own } else { [0.0; 2] }
    }

    /// Whether a cell moves with the world, as far as is known.
    #[must_use]
    #[inline(always)]
    pub fn is_still(&self, key: &KeyFrame, grid: &Grid, x: u32, y: u32) -> bool {
        let q = self.inverse_distance(key.depth.at(x, y));
        let own = self.own_motion(grid.centre(x, y), q, key.displacement.at(x, y));
        is_small(own)
    }
}

#[inline(always)]
fn is_small(own: [f32; 2]) -> bool {
    (own[0].abs() < STILL_PX) & (own[1].abs() < STILL_PX)
}
