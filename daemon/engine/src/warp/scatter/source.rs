//! What the scatter reads of a key: velocity and depth per source cell.

use rayon::ThreadPool;

use crate::bands::for_each_row;
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
    /// How each tile of cells moves.
    pub(super) bounds: Plane<Bounds>,
}

/// Columns and rows of a tile of cells.
pub(super) const TILE: [u32; 2] = [32, 8];

/// The velocities of a tile, right and down.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Bounds {
    pub(super) low: [i16; 2],
    pub(super) high: [i16; 2],
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
        for_each_row(
            pool,
            &mut self.velocity,
            #[inline(always)]
            |y, row| {
                for (held, &velocity) in row.iter_mut().zip(velocity.row(y)) {
                    *held = if velocity.is_trackable() { velocity } else { Velocity::default() };
                }
            },
        );
        self.bound(pool);
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

    /// Bounds the velocities of each tile.
    fn bound(&mut self, pool: &ThreadPool) {
        let [tile_width, tile_height] = TILE;
        let (width, height) = (self.velocity.width(), self.velocity.height());
        self.bounds.resize(width.div_ceil(tile_width), height.div_ceil(tile_height));
        let velocity = &self.velocity;
        for_each_row(
            pool,
            &mut self.bounds,
            #[inline(always)]
            |y, bounds| {
                bounds.fill(Bounds { low: [i16::MAX; 2], high: [i16::MIN; 2] });
                for y in y * tile_height..((y + 1) * tile_height).min(height) {
                    let tiles = velocity.row(y).chunks(tile_width as usize);
                    for (Bounds { low, high }, tile) in bounds.iter_mut().zip(tiles) {
                        for &Velocity { x, y } in tile {
                            *low = [low[0].min(x), low[1].min(y)];
                            *high = [high[0].max(x), high[1].max(y)];
                        }
                    }
                }
            },
        );
    }

    /// Whether no cell moves: then every frame is the key as it is.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.bounds.data().iter().all(|bounds| *bounds == Bounds::default())
    }
}
