//! What the method keeps from frame to frame.

use rayon::ThreadPool;

use crate::field::FieldMap;
use crate::fill::far_side::{FarScratch, far_side};
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::Plane;
use crate::warp::resolve::{CellClass, classify, resolve};
use crate::warp::scatter::{NO_SOURCE, ScatterScratch, SourceField, scatter};

/// Planes on the newest key's field grid. Their contents hold for one key and one phase.
#[derive(Clone, Debug, Default)]
pub struct VoxelScratch {
    /// The key's field, its velocities turned round: older minus newer position.
    pub(super) source: SourceField,
    pub(super) splat: Plane<u32>,
    /// The turned velocity that each cell shows.
    pub(super) carried: Plane<[i16; 2]>,
    pub(super) class: Plane<CellClass>,
    /// For each hole, the cell on its far side.
    pub(super) far: Plane<u32>,
    /// Where the cells of the older key lie.
    pub(super) older_map: FieldMap,
    scatter: ScatterScratch,
    sides: FarScratch,
    turned: KeyFrame,
}

/// Turns velocities round, into `turned`: older minus newer position.
pub fn turn(velocity: &Plane<Velocity>, turned: &mut Plane<Velocity>) {
    turned.copy_from(velocity);
    for velocity in turned.data_mut() {
        if velocity.is_trackable() {
            *velocity = Velocity { x: -velocity.x, y: -velocity.y };
        }
    }
}

impl VoxelScratch {
    /// Prepares for the frames before `key`, which has a velocity field.
    pub fn take_key(&mut self, pool: &ThreadPool, key: &KeyFrame) {
        let turned = &mut self.turned;
        turned.depth.copy_from(&key.depth);
        turn(&key.velocity, &mut turned.velocity);
        self.source.update(pool, turned);
    }

    /// Scatters the field back by `phase` and resolves it.
    pub(super) fn resolve(
        &mut self,
        pool: &ThreadPool,
        map: &FieldMap,
        phase: Phase,
        older: &KeyFrame,
    ) {
        scatter(pool, &self.source, map, phase, &mut self.scatter, &mut self.splat);
        resolve(pool, &self.source, &self.splat, &mut self.carried);
        if self.splat.data().contains(&NO_SOURCE) {
            far_side(pool, &self.source, &self.splat, &mut self.sides, &mut self.far);
        }
        classify(pool, &self.carried, phase, &mut self.class);
        if !older.depth.data().is_empty() {
            let cells = [older.depth.width(), older.depth.height()];
            self.older_map.update(older.valid, cells, older.field_offset);
        }
    }
}
