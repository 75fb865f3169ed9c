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
    /// How each row moves, in one column.
    pub(super) reach: Plane<Reach>,
}

/// How the cells of a row move.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reach {
    /// Smallest downward velocity.
    pub(super) slowest: i16,
    /// Largest downward velocity.
    pub(super) fastest: i16,
    /// Whether any cell moves, in whatever direction.
    moves: bool,
}

impl SourceField {
    /// Takes the field of `key`, which has a velocity field.
    ///
    /// Without depth, a faster surface counts as nearer, in steps of a pixel: it is what parallax
    /// does to a moving camera, and better than a fold-over that shows both surfaces at random.
    /// Depth is left out where nothing moves: nothing can fold over.
    pub fn update(&mut self, pool: &ThreadPool, key: &KeyFrame) {
        self.update_velocity(pool, &key.velocity);
        self.depth.resize(key.velocity.width(), key.velocity.height());
        if self.is_still() && key.acceleration.data().is_empty() {
            return;
        }
        self.update_depth(pool, key);
    }

    /// Takes velocities on the grid of the key that was taken last.
    pub fn update_velocity(&mut self, pool: &ThreadPool, velocity: &Plane<Velocity>) {
        self.velocity.resize(velocity.width(), velocity.height());
        self.reach.resize(1, velocity.height());
        for_each_row_of_two(
            pool,
            &mut self.velocity,
            &mut self.reach,
            #[inline(always)]
            |y, row, reach| {
                let [mut slowest, mut fastest, mut moved] = [i16::MAX, i16::MIN, 0];
                for (held, &velocity) in row.iter_mut().zip(velocity.row(y)) {
                    *held = if velocity.is_trackable() { velocity } else { Velocity::default() };
                    (slowest, fastest) = (slowest.min(held.y), fastest.max(held.y));
                    moved |= held.x | held.y;
                }
                reach[0] = Reach { slowest, fastest, moves: moved != 0 };
            },
        );
    }

    fn update_depth(&mut self, pool: &ThreadPool, key: &KeyFrame) {
        let has_depth = !key.depth.data().is_empty();
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
    /// Whether no cell moves: then every frame is the key as it is.
    #[must_use]
    pub fn is_still(&self) -> bool {
        !self.reach.data().iter().any(|row| row.moves)
    }
}
