//! (1) to (3) of [`super`] for one point.

use crate::lanes::both;

/// A 2x2 matrix, by rows.
pub(super) type Matrix = [[f32; 2]; 2];

/// What makes velocity and acceleration of a motion: v = V d, a = Q d.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Power {
    /// V = 4 P - A, with P = (S + I)^-1 A of (3).
    pub(super) velocity: Matrix,
    /// Q = 4 A - 8 P.
    pub(super) acceleration: Matrix,
}

impl Power {
    /// Where the field's derivative is `j`. None where the map mirrors, collapses, or turns by half
    /// a circle: no power leads there.
    #[inline(always)]
    pub(super) fn of(j: &Matrix) -> Option<Self> {
        let a = inverse(&[[1.0 - j[0][0], -j[0][1]], [-j[1][0], 1.0 - j[1][1]]])?;
        let s = det(&a).sqrt();
        let square = a[0][0] + a[1][1] + 2.0 * s;
        if square.is_nan() || square < MIN_TRACE {
            return None;
        }
        // (2)
        let scale = 1.0 / square.sqrt();
        let root_plus_one = [
            [(a[0][0] + s) * scale + 1.0, a[0][1] * scale],
            [a[1][0] * scale, (a[1][1] + s) * scale + 1.0],
        ];
        // (3)
        let half = product(&inverse(&root_plus_one)?, &a);
        let sum =
            |x: f32, y: f32| both(|row| both(|column| x * a[row][column] + y * half[row][column]));
        Some(Self { velocity: sum(-1.0, 4.0), acceleration: sum(4.0, -8.0) })
    }
}

/// A map that shrinks or grows an area by more than this in one span is no motion of a surface.
const MAX_GROWTH: f32 = 4.0;
/// tr A + 2 sqrt(det A) is 0 for half a turn and 4 for none; below this the axis is noise.
const MIN_TRACE: f32 = 0.05;

#[inline(always)]
fn det(m: &Matrix) -> f32 {
    m[0][0] * m[1][1] - m[0][1] * m[1][0]
}

#[inline(always)]
fn inverse(m: &Matrix) -> Option<Matrix> {
    let det = det(m);
    if !(1.0 / MAX_GROWTH..=4.0 * MAX_GROWTH).contains(&det) {
        return None;
    }
    let scale = 1.0 / det;
    Some([[m[1][1] * scale, -m[0][1] * scale], [-m[1][0] * scale, m[0][0] * scale]])
}

#[inline(always)]
fn product(a: &Matrix, b: &Matrix) -> Matrix {
    both(|row| both(|column| a[row][0] * b[0][column] + a[row][1] * b[1][column]))
}
