//! The `world` rung: depth and cameras say how the picture moves, motion says what moves besides.
//!
//! With c(x, p) the displacement at phase p of a still point seen at x as the camera goes on
//! ([`super::camera_path`]), and c'(x) how far the camera's motion since the older key moved it:
//!
//! ```text
//! (1) m    = D - c'(x)                       motion of its own, in the picture; D the motion field
//! (2) d(p) = c(x, p) + m p                   where m is small: it stands still, give or take
//! (3) h(p) = h + v p + a p^2 / 2             where it is not: h = w (x, y, 1), h' of its place then
//!     d(p) = c(h(p), p)
//! (4) v = h - h',  a = 0                     first order
//! (5) a = 2 (h - h' - (h' - h") / r) / (1 + r),  v = h - h' + a / 2          second; h" before that
//! ```
//!
//! A still point has m = 0 and follows the camera's path alone. One that moves goes on through the
//! world, (3), at constant velocity or at constant acceleration ([`MoverOrder`]): its place one span
//! ago comes from where it was in the older picture and the depth that the older key has there, the
//! place before that from the older key's own motion and the oldest key's depth, r spans earlier.
//! h, a pixel scaled by its distance, is linear in the place, so that no matrix has to be undone.
//! Where the older key shows no such surface the point goes on along its motion vector, where the
//! oldest shows none at constant velocity. Where the field knows no motion a point is taken to be
//! still; and so is the background where nothing was drawn (depth key 0), which engines leave
//! without vectors.

use super::camera_path::{Onward, Reprojection, between};
use super::curve::{Curve, Curves};
use super::grid::Grid;
use super::quadratic::{Been, Quadratic};
use crate::key::{Camera, KeyFrame};
use crate::lanes::both;
use crate::time::MonoSpan;

/// Own motion, pixels per span and axis, up to which a surface moves with the world: more than the
/// motion and depth of real engines are off.
const STILL_PX: f32 = 0.25;

/// How what moves on its own goes on through the world.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum MoverOrder {
    /// At constant velocity (4).
    #[default]
    Constant,
    /// At constant acceleration (5).
    Accelerated,
}

impl MoverOrder {
    /// Every order, simplest first.
    pub const ALL: [Self; 2] = [Self::Constant, Self::Accelerated];
}

/// The camera's motion around one key.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct World {
    /// Since the older key: from the picture of the key to that one.
    older: Reprojection,
    /// And back.
    from_older: Reprojection,
    /// From the picture of the key before the older one.
    from_oldest: Option<Reprojection>,
    /// Until phases 1/2 and 1.
    half: Reprojection,
    one: Reprojection,
    /// Inverse distance of a depth key of 1.
    per_depth_key: f32,
}

impl World {
    /// Of `key`, which has depth and a camera, as the camera goes `onward` from it. `older` is the
    /// camera at the time that its motion points back to, `span` before, and `oldest` the one at the
    /// time that the motion of that key points back to, if it is known. None where its projection
    /// tells no distance.
    #[must_use]
    pub fn new(
        key: &KeyFrame,
        older: &Camera,
        oldest: Option<&Camera>,
        onward: &Onward,
        span: MonoSpan,
    ) -> Option<Self> {
        let camera = key.camera.as_ref()?;
        let per_depth_key = key.inverse_distance_per_depth_key?;
        Some(Self {
            older: between(camera, older, key.valid)?,
            from_older: between(older, camera, key.valid)?,
            from_oldest: oldest.and_then(|oldest| between(oldest, camera, key.valid)),
            half: onward.reprojection(key.valid, span.scale(1, 2))?,
            one: onward.reprojection(key.valid, span)?,
            per_depth_key,
        })
    }

    /// (2) or (3) of a cell; `older` reads the keys before. NaN where the point is not in front of
    /// the camera.
    #[must_use]
    #[inline(always)]
    pub fn curve(
        &self,
        movers: MoverOrder,
        key: &KeyFrame,
        older: Option<&Quadratic<'_>>,
        grid: &Grid,
        [x, y]: [u32; 2],
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
        let was = older.and_then(|older| older.been(at, displacement, depth));
        let Some((was, past)) = was.filter(|was| was.depth > 0.0).zip(older) else {
            return Curve::straight(displacement);
        };
        let now = [at[0] / q, at[1] / q, 1.0 / q];
        let then = self.from_older.scaled(was.at, was.depth * self.per_depth_key);
        let change = match movers {
            MoverOrder::Constant => None,
            MoverOrder::Accelerated => self.change(past, &was, now, then),
        };
        let [v, a] =
            change.unwrap_or_else(|| [std::array::from_fn(|i| now[i] - then[i]), [0.0; 3]]);
        let seen = |by: &Reprojection, p: f32| {
            let part = |i: usize| now[i] + v[i] * p + 0.5 * a[i] * p * p;
            let [x, y, w] = [part(0), part(1), part(2)];
            let w = if w > 0.0 { w } else { f32::NAN };
            let place = by.place([x / w, y / w], 1.0 / w);
            [place[0] - at[0], place[1] - at[1]]
        };
        Curve { half: seen(&self.half, 0.5), one: seen(&self.one, 1.0) }
    }

    /// v and a of (5) of a point that is at `now` and was at `then`, seen at `was`. None where the
    /// oldest key does not show it.
    #[inline(always)]
    fn change(
        &self,
        past: &Quadratic<'_>,
        was: &Been,
        now: [f32; 3],
        then: [f32; 3],
    ) -> Option<[[f32; 3]; 2]> {
        let from_oldest = self.from_oldest.as_ref()?;
        let before = past.been_before(was).filter(|before| before.depth > 0.0)?;
        let earlier = from_oldest.scaled(before.at, before.depth * self.per_depth_key);
        let r = past.ratio();
        let a: [f32; 3] = std::array::from_fn(|i| {
            ((now[i] - then[i]) - (then[i] - earlier[i]) / r) * (2.0 / (1.0 + r))
        });
        Some([std::array::from_fn(|i| now[i] - then[i] + 0.5 * a[i]), a])
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
