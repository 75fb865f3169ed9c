//! What the linear method keeps from frame to frame.

use rayon::ThreadPool;

use crate::field::FieldMap;
use crate::fill::far_side::{FarScratch, far_side};
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::Plane;
use crate::warp::resolve::{CellClass, classify, resolve};
use crate::warp::scatter::{NO_SOURCE, ScatterScratch, SourceField, scatter};

/// Planes on the field grid, all of its size. Their contents hold for one key and one phase.
#[derive(Clone, Debug, Default)]
pub struct LinearScratch {
    /// The key's field, set by [`LinearScratch::take_key`].
    pub(super) source: SourceField,
    pub(super) splat: Plane<u32>,
    /// The velocity that each cell shows, x and y.
    pub(super) carried: Plane<[i16; 2]>,
    pub(super) class: Plane<CellClass>,
    /// For each hole, the cell on its far side.
    pub(super) far: Plane<u32>,
    scatter: ScatterScratch,
    sides: FarScratch,
}

impl LinearScratch {
    /// Prepares for the frames after `key`, which has a velocity field.
    pub fn take_key(&mut self, pool: &ThreadPool, key: &KeyFrame) {
        self.source.update(pool, key);
    }

    /// Takes the velocities of one frame of the key, whose field accelerates.
    pub fn take_velocity(&mut self, pool: &ThreadPool, velocity: &Plane<Velocity>) {
        self.source.update_velocity(pool, velocity);
    }

    /// Whether no source cell landed on cell (`x`, `y`) of the field grid.
    #[must_use]
    pub fn is_hole(&self, x: u32, y: u32) -> bool {
        self.splat.at(x, y) == NO_SOURCE
    }

    /// Scatters the field to `phase` and resolves it.
    pub(super) fn resolve(&mut self, pool: &ThreadPool, map: &FieldMap, phase: Phase) {
        scatter(pool, &self.source, map, phase, &mut self.scatter, &mut self.splat);
        resolve(pool, &self.source, &self.splat, &mut self.carried);
        if self.splat.data().contains(&NO_SOURCE) {
            far_side(pool, &self.source, &self.splat, &mut self.sides, &mut self.far);
        }
        classify(pool, &self.carried, phase, &mut self.class);
    }
}
