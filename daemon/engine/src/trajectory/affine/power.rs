//! (1) to (3) of [`super`] for one point.

use crate::trajectory::curve::Curve;

/// A 2x2 matrix, by rows.
pub(super) type Matrix = [[f32; 2]; 2];

/// The way of a point with displacement `d` where the field's derivative is `j`. None where the map
/// mirrors, collapses, or turns by half a circle: no power leads there.
#[inline(always)]
pub(super) fn continued(d: [f32; 2], j: &Matrix) -> Option<Curve> {
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
    let one = times(&a, d);
    Some(Curve { half: times(&inverse(&root_plus_one)?, one), one })
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
fn times(m: &Matrix, v: [f32; 2]) -> [f32; 2] {
    [m[0][0] * v[0] + m[0][1] * v[1], m[1][0] * v[0] + m[1][1] * v[1]]
}
