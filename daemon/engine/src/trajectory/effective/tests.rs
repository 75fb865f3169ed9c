//! Laws of the effective velocity.

use super::*;
use crate::key::{Acceleration, Velocity};
use crate::phase::Phase;
use crate::testing::{plane, pool};
use crate::warp::displacement;

fn effective(velocity: Velocity, acceleration: Acceleration, phase: Phase) -> Velocity {
    let (velocities, accelerations) =
        (plane(3, 2, |_, _| velocity), plane(3, 2, |_, _| acceleration));
    let mut out = Default::default();
    effective_velocity(&pool(1), &velocities, &accelerations, phase, &mut out);
    out.at(2, 1)
}

#[test]
fn the_effective_velocity_moves_a_point_along_its_parabola() {
    let (v, a) = (Velocity { x: 320, y: -96 }, Acceleration { x: -200, y: 64 });
    for p in [0.25, 0.5, 0.75, 1.0, 2.0] {
        let phase = Phase::from_f64(p);
        let moved = displacement(effective(v, a, phase), phase).map(|d| f64::from(d) / 256.0);
        let expected = [(10.0, -6.25), (-3.0, 2.0)].map(|(v, a)| v * p + a * p * p / 2.0);
        for (moved, expected) in moved.into_iter().zip(expected) {
            assert!((moved - expected).abs() <= p / 64.0 + 1.0 / 256.0, "{p}: {moved}, {expected}");
        }
    }
}

#[test]
fn without_acceleration_or_at_phase_0_it_is_the_velocity() {
    let (v, a) = (Velocity { x: 1234, y: -32736 }, Acceleration { x: 32767, y: -32767 });
    assert_eq!(effective(v, Acceleration::default(), Phase::MAX), v);
    assert_eq!(effective(v, a, Phase::ZERO), v);
}

#[test]
fn it_saturates_and_leaves_the_untrackable_alone() {
    let a = Acceleration { x: 32767, y: -32767 };
    let fastest = Velocity { x: 32736, y: -32736 };
    assert_eq!(effective(fastest, a, Phase::MAX), fastest);
    assert_eq!(effective(Velocity { x: 0, y: 0 }, a, Phase::MAX), fastest);
    assert_eq!(effective(Velocity::UNTRACKABLE, a, Phase::ONE), Velocity::UNTRACKABLE);
}
