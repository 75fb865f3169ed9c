//! Moves colour along trajectories: gather (backward), scatter (forward) and the snapped grid.
//!
//! Positions are signed Q8 pixels of the colour plane: the centre of pixel `i` is `i * 256`.
//! What lies outside a key's valid rectangle is shown as it is by every method.

pub mod blend;
pub mod gather;
pub mod grid;
pub mod linear;
pub mod resolve;
pub mod sample;
pub mod scatter;
pub mod voxel;

#[cfg(test)]
mod laws;

use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::color::Texel;
use crate::key::Velocity;
use crate::phase::Phase;
use crate::plane::{Plane, Rect};

/// Calls `inside(row, pixels)` for every row of the valid rectangle of `out`, counted from its top,
/// and copies what lies outside from `color`.
fn for_each_valid_row<T: Texel>(
    pool: &ThreadPool,
    valid: Rect,
    color: &Plane<T>,
    out: &mut Plane<T>,
    inside: impl Fn(u32, &mut [T]) + Sync,
) {
    for_each_row(
        pool,
        out,
        #[inline(always)]
        |y, row| {
            if !(valid.y..valid.y + valid.height).contains(&y) {
                row.copy_from_slice(color.row(y));
                return;
            }
            let (left, right) = (valid.x as usize, (valid.x + valid.width) as usize);
            row[..left].copy_from_slice(&color.row(y)[..left]);
            row[right..].copy_from_slice(&color.row(y)[right..]);
            inside(y - valid.y, &mut row[left..right]);
        },
    );
}

/// Displacement after `phase` of a surface that moves by `velocity` per motion span, Q8 pixels:
/// `(v p + 256) >> 9` with v in 1/32 pixel and p in Q12. Where no velocity is known, 0.
///
/// |v| <= 32767 and p <= 16384, so the product stays inside an i32.
#[must_use]
pub fn displacement(velocity: Velocity, phase: Phase) -> [i32; 2] {
    if velocity.is_trackable() { moved(velocity, phase) } else { [0, 0] }
}

/// [`displacement`] of a velocity that is known.
#[inline(always)]
fn moved(velocity: Velocity, phase: Phase) -> [i32; 2] {
    [velocity.x, velocity.y].map(|v| (i32::from(v) * phase.q12() + 256) >> 9)
}
