//! The reference of [`super`].

use rayon::ThreadPool;

use super::LARGEST;
use crate::bands::for_each_row;
use crate::key::{Acceleration, Velocity};
use crate::phase::Phase;
use crate::plane::Plane;

/// Makes `effective` from `velocity` and `acceleration`, which have one size.
pub fn effective_velocity(
    pool: &ThreadPool,
    velocity: &Plane<Velocity>,
    acceleration: &Plane<Acceleration>,
    phase: Phase,
    effective: &mut Plane<Velocity>,
) {
    effective.resize(velocity.width(), velocity.height());
    let p = phase.q12();
    for_each_row(
        pool,
        effective,
        #[inline(always)]
        |y, row| {
            let cells = velocity.row(y).iter().zip(acceleration.row(y));
            for (effective, (&velocity, &acceleration)) in row.iter_mut().zip(cells) {
                let moved = Velocity {
                    x: along(velocity.x, acceleration.x, p),
                    y: along(velocity.y, acceleration.y, p),
                };
                *effective = if velocity.is_trackable() { moved } else { velocity };
            }
        },
    );
}

/// (1) of one axis.
#[expect(clippy::cast_possible_truncation, reason = "saturated to what fits an i16")]
#[inline(always)]
fn along(v: i16, a: i16, p: i32) -> i16 {
    let effective = i32::from(v) + ((i32::from(a) * p + (1 << 12)) >> 13);
    effective.clamp(-LARGEST, LARGEST) as i16
}
