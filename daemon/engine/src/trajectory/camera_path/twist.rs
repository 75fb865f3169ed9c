//! Rigid motions and their logarithms: twists.
//!
//! A twist (w, u) is the constant rate of turn and drift, in the moving frame, that leads to a
//! rigid motion (R, t) in one unit of time. With `[w]` the cross product with w and th = |w|:
//!
//! ```text
//! (1) exp: R = I + A [w] + B [w]^2,  t = (I + B [w] + C [w]^2) u
//!          A = sin th / th,  B = (1 - cos th) / th^2,  C = (1 - A) / th^2
//! (2) log: w = axis of R's skew part times atan2(|skew|, (tr R - 1) / 2),  u = V^-1 t
//! ```
//!
//! Series near th = 0. A turn of nearly pi has no axis that can be told: no logarithm.
//! Formulas: Murray, Li, Sastry 1994, "A Mathematical Introduction to Robotic Manipulation",
//! section 2.3.

use glam::{DMat3, DMat4, DVec3};

/// A constant rate of turn and drift.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Twist {
    /// Turn, radians per unit of time about its axis.
    pub(super) turn: DVec3,
    /// Drift, world units per unit of time.
    pub(super) drift: DVec3,
}

/// Largest deviation of R^T R from the unit matrix in something that counts as rigid. Matrices come
/// as f32; scenes far from the origin lose some of their bits.
const RIGID: f64 = 1e-3;
/// Below this square of an angle the series are exact to f64.
const SMALL: f64 = 1e-8;
/// Below this sine of an angle beyond a quarter turn there is no axis.
const HALF_TURN: f64 = 1e-3;

impl Twist {
    /// (2). None of a matrix that is not rigid, or turns by nearly half a circle.
    pub(super) fn log(motion: &DMat4) -> Option<Self> {
        let r = DMat3::from_mat4(*motion);
        let error = r.transpose() * r - DMat3::IDENTITY;
        let is_rigid = error.to_cols_array().iter().all(|e| e.abs() < RIGID);
        if !is_rigid || r.determinant() < 0.0 {
            return None;
        }
        let skew =
            DVec3::new(r.y_axis.z - r.z_axis.y, r.z_axis.x - r.x_axis.z, r.x_axis.y - r.y_axis.x)
                * 0.5;
        let cos = (r.x_axis.x + r.y_axis.y + r.z_axis.z - 1.0) * 0.5;
        let sin = libm::sqrt(skew.dot(skew));
        if cos < 0.0 && sin < HALF_TURN {
            return None;
        }
        let angle = libm::atan2(sin, cos);
        let turn = if sin * sin < SMALL { skew } else { skew * (angle / sin) };
        let drift = v_of(turn).inverse() * motion.w_axis.truncate();
        (turn.is_finite() && drift.is_finite()).then_some(Self { turn, drift })
    }

    /// (1).
    pub(super) fn exp(&self) -> DMat4 {
        let [a, b, _] = coefficients(self.turn);
        let cross = cross(self.turn);
        let r = DMat3::IDENTITY + cross * a + cross * cross * b;
        let t = v_of(self.turn) * self.drift;
        DMat4::from_cols(
            r.x_axis.extend(0.0),
            r.y_axis.extend(0.0),
            r.z_axis.extend(0.0),
            t.extend(1.0),
        )
    }

    pub(super) fn scale(&self, factor: f64) -> Self {
        Self { turn: self.turn * factor, drift: self.drift * factor }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self { turn: self.turn + other.turn, drift: self.drift + other.drift }
    }

    pub(super) fn minus(&self, other: &Self) -> Self {
        self.plus(&other.scale(-1.0))
    }
}

/// A, B and C of (1).
fn coefficients(turn: DVec3) -> [f64; 3] {
    let square = turn.dot(turn);
    if square < SMALL {
        return [1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0];
    }
    let angle = libm::sqrt(square);
    let a = libm::sin(angle) / angle;
    [a, (1.0 - libm::cos(angle)) / square, (1.0 - a) / square]
}

/// V of (2).
fn v_of(turn: DVec3) -> DMat3 {
    let [_, b, c] = coefficients(turn);
    let cross = cross(turn);
    DMat3::IDENTITY + cross * b + cross * cross * c
}

fn cross(w: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, w.z, -w.y),
        DVec3::new(-w.z, 0.0, w.x),
        DVec3::new(w.y, -w.x, 0.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn twist(turn: [f64; 3], drift: [f64; 3]) -> Twist {
        Twist { turn: DVec3::from_array(turn), drift: DVec3::from_array(drift) }
    }

    proptest! {
        #[test]
        fn the_logarithm_undoes_the_exponential(
            turn in prop::array::uniform3(-1.7_f64..1.7),
            drift in prop::array::uniform3(-50.0_f64..50.0),
            size in prop::sample::select(vec![1.0, 1e-3, 1e-5, 0.0]),
        ) {
            let there = twist(turn, drift).scale(size);
            let back = Twist::log(&there.exp()).expect("it turns by less than half a circle");
            prop_assert!((back.turn - there.turn).length() < 1e-7);
            prop_assert!((back.drift - there.drift).length() < 1e-6);
        }

        #[test]
        fn half_a_twist_done_twice_is_the_whole(
            turn in prop::array::uniform3(-1.5_f64..1.5),
            drift in prop::array::uniform3(-5.0_f64..5.0),
        ) {
            let whole = twist(turn, drift);
            let half = whole.scale(0.5).exp();
            prop_assert!((half * half).abs_diff_eq(whole.exp(), 1e-9));
        }
    }

    #[test]
    fn a_quarter_turn_about_z_moves_x_to_y() {
        let quarter = twist([0.0, 0.0, std::f64::consts::FRAC_PI_2], [0.0; 3]).exp();
        assert!(quarter.x_axis.truncate().abs_diff_eq(DVec3::Y, 1e-12));
    }

    #[test]
    fn what_is_not_rigid_or_half_a_turn_has_no_logarithm() {
        let half_turn = twist([0.0, std::f64::consts::PI, 0.0], [0.0; 3]).exp();
        assert_eq!(Twist::log(&half_turn), None);
        assert_eq!(Twist::log(&(DMat4::IDENTITY * 2.0)), None);
        assert_eq!(Twist::log(&DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0))), None, "a mirror");
        assert!(Twist::log(&DMat4::IDENTITY).is_some());
    }
}
