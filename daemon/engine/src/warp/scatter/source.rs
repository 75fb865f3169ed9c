//! What the scatter reads of a key: velocity and depth per source cell.

use rayon::ThreadPool;

use crate::bands::{for_each_row, for_each_row_of_two};
use crate::key::{KeyFrame, Velocity};
use crate::plane::Plane;
use crate::trajectory::dilate_motion::dilate_depth_row;

/// What the scatter reads of a key; derived from it once.
#[derive(Clone, Debug, Default)]
pub struct SourceField {
    /// Velocity per cell, 0 where none is known.
    pub velocity: Plane<Velocity>,
    /// Depth key of the surface that the velocity is of.
    pub depth: Plane<u32>,
    /// Smallest and largest downward velocity of each row, in one column.
    pub(super) reach: Plane<[i16; 2]>,
}

impl SourceField {
    /// Takes the field of `key`, which has a velocity field.
    ///
    /// Without depth, a faster surface counts as nearer, in steps of a pixel: it is what parallax
    /// does to a moving camera, and better than a fold-over that shows both surfaces at random.
    pub fn update(&mut self, pool: &ThreadPool, key: &KeyFrame) {
        let (width, height) = (key.velocity.width(), key.velocity.height());
        self.velocity.resize(width, height);
        self.depth.resize(width, height);
        let has_depth = !key.depth.data().is_empty();
        self.reach.resize(1, height);
        for_each_row_of_two(
            pool,
            &mut self.velocity,
            &mut self.reach,
            #[inline(always)]
            |y, row, reach| {
                let [mut slowest, mut fastest] = [i16::MAX, i16::MIN];
                for (held, &velocity) in row.iter_mut().zip(key.velocity.row(y)) {
                    *held = if velocity.is_trackable() { velocity } else { Velocity::default() };
                    (slowest, fastest) = (slowest.min(held.y), fastest.max(held.y));
                }
                reach[0] = [slowest, fastest];
            },
        );
        let velocity = &self.velocity;
        for_each_row(
            pool,
            &mut self.depth,
            #[inline(always)]
            |y, row| {
                if has_depth {
                    dilate_depth_row(&key.depth, y, row);
                    return;
                }
                for (depth, &Velocity { x, y }) in row.iter_mut().zip(velocity.row(y)) {
                    *depth = (u32::from(x.unsigned_abs()) + u32::from(y.unsigned_abs())) >> 5;
                }
            },
        );
    }
}
