//! One point's way through the image, and how it becomes fixed point.
//!
//! A model says where a point is at two phases, a half and one, and the trajectory is the parabola
//! through those places and its present one:
//!
//! ```text
//! (1) d(p) = v p + a p^2 / 2      v = 4 d(1/2) - d(1),  a = 4 d(1) - 8 d(1/2)
//! ```
//!
//! Exact where a model's curve is a parabola or a line; of a turn by an angle t per span the error
//! up to phase 1 is below t^3 / 125 of the radius, mostly along the circle. Going through places at
//! both phases, rather than following the derivatives at phase 0, is what keeps a turning wheel at
//! its size.

use crate::key::{Acceleration, Velocity};
use crate::lanes::both;
use crate::trajectory::dilate_motion::MAX_DISPLACEMENT_PX;
use crate::trajectory::steps::steps;

/// Displacements of one point from its place at the key, pixels.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Curve {
    /// At phase 1/2.
    pub half: [f32; 2],
    /// At phase 1.
    pub one: [f32; 2],
}

impl Curve {
    /// A straight line at constant speed: `displacement` per span.
    #[must_use]
    #[inline(always)]
    pub fn straight([x, y]: [f32; 2]) -> Self {
        Self { half: [0.5 * x, 0.5 * y], one: [x, y] }
    }

    /// From velocity and acceleration per span.
    #[must_use]
    #[inline(always)]
    pub fn accelerated(v: [f32; 2], a: [f32; 2]) -> Self {
        Self {
            half: [0.5 * v[0] + 0.125 * a[0], 0.5 * v[1] + 0.125 * a[1]],
            one: [v[0] + 0.5 * a[0], v[1] + 0.5 * a[1]],
        }
    }

    /// Whether both displacements are numbers.
    #[must_use]
    #[inline(always)]
    pub fn is_known(&self) -> bool {
        // A sum is a number if its terms are; infinities of either sign cancel to none.
        (self.half[0] + self.half[1] + self.one[0] + self.one[1]).is_finite()
    }

    /// Displacement at phase `p` (1).
    #[must_use]
    #[inline(always)]
    pub fn at(&self, p: f32) -> [f32; 2] {
        let (v, a) = self.parts();
        both(|axis| p * (v[axis] + 0.5 * p * a[axis]))
    }

    /// Velocity and acceleration (1).
    #[inline(always)]
    fn parts(&self) -> ([f32; 2], [f32; 2]) {
        let v = both(|axis| 4.0 * self.half[axis] - self.one[axis]);
        let a = both(|axis| 4.0 * self.one[axis] - 8.0 * self.half[axis]);
        (v, a)
    }

    /// Fixed point. What leads farther than [`MAX_DISPLACEMENT_PX`], or is no number, is
    /// untrackable; where the parts do not fit although their sum does, the line to the place at
    /// phase 1 takes their place.
    #[must_use]
    #[inline(always)]
    pub fn quantise(&self) -> (Velocity, Acceleration) {
        if !fits(self.one) {
            return (Velocity::UNTRACKABLE, Acceleration::default());
        }
        let (v, a) = self.parts();
        let (v, a) = held(self.one, v, a);
        let velocity = Velocity { x: steps(v[0]), y: steps(v[1]) };
        (velocity, Acceleration { x: steps(a[0]), y: steps(a[1]) })
    }
}

/// Velocity and acceleration of some neighbouring cells, pixels per span; NaN where a model has no
/// answer.
#[derive(Clone, Copy, Debug)]
pub struct Curves<const N: usize> {
    /// Right and down.
    pub velocity: [[f32; N]; 2],
    /// Right and down.
    pub acceleration: [[f32; N]; 2],
}

impl<const N: usize> Curves<N> {
    /// Where there is no answer, the straight lines of these motions.
    #[inline(always)]
    pub fn or_straight(&mut self, displacement: &[[f32; 2]]) {
        for (i, d) in displacement.iter().take(N).enumerate() {
            // NaN in either part, and only that, makes the sum differ from itself.
            let sum = self.velocity[0][i] + self.velocity[1][i];
            let sum = sum + (self.acceleration[0][i] + self.acceleration[1][i]);
            let is_known = sum.is_finite();
            for (axis, d) in d.iter().enumerate() {
                let (v, a) = (self.velocity[axis][i], self.acceleration[axis][i]);
                self.velocity[axis][i] = if is_known { v } else { *d };
                self.acceleration[axis][i] = if is_known { a } else { 0.0 };
            }
        }
    }

    /// As [`Curve::quantise`], without a branch.
    #[inline(always)]
    pub fn quantise(&self) -> ([Velocity; N], [Acceleration; N]) {
        let mut velocities = [Velocity::default(); N];
        let mut accelerations = [Acceleration::default(); N];
        for i in 0..N {
            let v = [self.velocity[0][i], self.velocity[1][i]];
            let a = [self.acceleration[0][i], self.acceleration[1][i]];
            let one = [v[0] + 0.5 * a[0], v[1] + 0.5 * a[1]];
            let (v, a) = held(one, v, a);
            let is_tracked = fits(one);
            let step = |d: f32| if is_tracked { steps(d) } else { 0 };
            let none = |d: i16| if is_tracked { d } else { i16::MIN };
            velocities[i] = Velocity { x: none(step(v[0])), y: none(step(v[1])) };
            accelerations[i] = Acceleration { x: step(a[0]), y: step(a[1]) };
        }
        (velocities, accelerations)
    }
}

/// Whether it is no farther than [`MAX_DISPLACEMENT_PX`]; written so that NaN is not.
#[inline(always)]
fn fits(d: [f32; 2]) -> bool {
    (d[0].abs() <= MAX_DISPLACEMENT_PX) & (d[1].abs() <= MAX_DISPLACEMENT_PX)
}

/// Velocity and acceleration where both fit, else the line to the place at phase 1.
#[inline(always)]
fn held(one: [f32; 2], v: [f32; 2], a: [f32; 2]) -> ([f32; 2], [f32; 2]) {
    let is_held = fits(v) & fits(a);
    let pick = |part: f32, other: f32| if is_held { part } else { other };
    ([pick(v[0], one[0]), pick(v[1], one[1])], [pick(a[0], 0.0), pick(a[1], 0.0)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_parabola_is_kept_and_a_line_has_no_acceleration(
            v in prop::array::uniform2(-300.0_f32..300.0),
            a in prop::array::uniform2(-100.0_f32..100.0),
        ) {
            let (velocity, acceleration) = Curve::accelerated(v, a).quantise();
            let found = [velocity.x, velocity.y, acceleration.x, acceleration.y];
            for (found, expected) in found.into_iter().zip([v[0], v[1], a[0], a[1]]) {
                prop_assert!((f32::from(found) / 32.0 - expected).abs() < 1.0 / 32.0);
            }
            prop_assert_eq!(Curve::straight(v).quantise().1, Acceleration::default());
        }
    }

    #[test]
    fn what_leads_too_far_is_untrackable_and_a_sharp_bend_becomes_its_chord() {
        for one in [[f32::NAN, 0.0], [0.0, 1023.5], [f32::NEG_INFINITY, 0.0]] {
            let curve = Curve { half: [0.0; 2], one };
            assert_eq!(curve.quantise().0, Velocity::UNTRACKABLE, "{one:?}");
        }
        let bend = Curve { half: [300.0, 0.0], one: [8.0, 0.0] };
        let chord = Velocity { x: 256, y: 0 };
        assert_eq!(bend.quantise(), (chord, Acceleration::default()));
    }

    #[test]
    fn a_turning_wheel_keeps_its_radius_up_to_the_next_key() {
        for angle in [0.1_f32, 0.5, 1.0, 1.5] {
            let turned =
                |p: f32| [60.0 * (libm::cosf(angle * p) - 1.0), 60.0 * libm::sinf(angle * p)];
            let curve = Curve { half: turned(0.5), one: turned(1.0) };
            for p in [0.1, 0.25, 0.5, 0.75, 0.9, 1.0] {
                let [x, y] = curve.at(p);
                let radius = libm::hypotf(60.0 + x, y);
                let bound = 60.0 * angle * angle * angle / 125.0 + 1e-3;
                assert!((radius - 60.0).abs() < bound, "{angle} rad, phase {p}: radius {radius}");
            }
            let line = Curve::straight([0.0, 60.0 * angle]).at(1.0);
            assert!(libm::hypotf(60.0 + line[0], line[1]) > 60.0 + 20.0 * angle * angle);
        }
    }
}
