//! The CPU backend: the reference of all others.

use rayon::ThreadPool;

use super::FrameInput;
use crate::color::ColorPlane;
use crate::key::{KeyFrame, Velocity};
use crate::method::Method;
use crate::plane::Plane;
use crate::trajectory::effective::effective_velocity;
use crate::warp::blend::blend;
use crate::warp::gather::warp_gather;
use crate::warp::grid::{GridScratch, warp_grid};
use crate::warp::linear::{LinearScratch, warp_linear};
use crate::warp::voxel::{Between, VoxelScratch, warp_voxel};

/// Buffers of the steps, kept from frame to frame.
#[derive(Debug, Default)]
pub struct CpuBackend {
    grid: GridScratch,
    linear: LinearScratch,
    voxel: VoxelScratch,
    effective: Plane<Velocity>,
}

impl CpuBackend {
    /// Prepares for the frames that `method` makes after `key`.
    pub fn take_key(&mut self, pool: &ThreadPool, method: Method, key: &KeyFrame) {
        self.grid.forget_key();
        if method == Method::Linear && !key.velocity.data().is_empty() {
            self.linear.take_key(pool, key);
        }
        if method == Method::Voxel && !key.velocity.data().is_empty() {
            self.voxel.take_key(pool, key);
        }
    }

    /// Makes a picture after the key that was taken last into `out`, which has the size and format
    /// of the keys.
    pub fn make(&mut self, pool: &ThreadPool, frame: &FrameInput<'_>, out: &mut ColorPlane) {
        let FrameInput { method, phase, newest: key, past, map, .. } = *frame;
        let previous = past.first().copied();
        match (method, previous) {
            (Method::Blend, Some(older)) => blend(pool, &older.color, &key.color, out),
            (Method::Voxel, Some(older)) => {
                let between = Between { older, newer: key, phase };
                warp_voxel(pool, &between, map, &mut self.voxel, out);
            }
            (Method::Gather, _) => warp_gather(pool, key, map, phase, out),
            (Method::Grid, _) => warp_grid(key, phase, out, &mut self.grid, pool),
            (Method::Linear, _) => {
                if !key.acceleration.data().is_empty() {
                    let (velocity, acceleration) = (&key.velocity, &key.acceleration);
                    effective_velocity(pool, velocity, acceleration, phase, &mut self.effective);
                    self.linear.take_velocity(pool, &self.effective);
                }
                // A phase other than 0 needs motion, and with motion `linear` has taken the key.
                warp_linear(pool, key, past, map, phase, &mut self.linear, out);
            }
            _ => out.copy_from(&key.color),
        }
    }
}
