//! One triangle of the warped mesh: which pixels it covers and where they come from.
//!
//! Corners are in 1/16 px; everything is relative to a corner or to the triangle's first pixel, so
//! that edge functions stay within 30 bits. Positive orientation is clockwise on the screen (y down).

use super::mesh::MeshTriangle;

/// x, y in 1/16 px.
pub(super) type Point = [i32; 2];

/// Twice the area of a triangle in 1/256 px^2, positive when its corners run clockwise.
pub(super) fn cross(a: Point, b: Point, c: Point) -> i32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// First and last pixel row or column whose centres can lie in the triangle.
pub(super) fn pixel_range(moved: [Point; 3], axis: usize) -> [i32; 2] {
    let [a, b, c] = moved.map(|point| point[axis]);
    [(a.min(b).min(c) + 15) >> 4, a.max(b).max(c) >> 4]
}

/// Columns `first..end` of pixel row `y` whose centres lie in the triangle, which has positive
/// orientation.
///
/// An edge from `a` to `b` has a pixel centre `p` inside when
/// `E = (b.x - a.x) (p.y - a.y) - (b.y - a.y) (p.x - a.x) >= t`, with `t` 0 on the edges of the
/// top-left rule and 1 on others, so that a centre on an edge that two triangles share belongs to
/// exactly one. `E` falls or rises along a row, so each edge gives one bound of the columns.
pub(super) fn span(moved: [Point; 3], y: i32) -> [i32; 2] {
    let [origin, last] = pixel_range(moved, 0);
    let (mut first, mut end) = (0, last - origin + 1);
    for [a, b] in [[moved[0], moved[1]], [moved[1], moved[2]], [moved[2], moved[0]]] {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let is_top_left = dy < 0 || (dy == 0 && dx > 0);
        let threshold = i32::from(!is_top_left);
        let across = dx * (16 * y - a[1]);
        let from_origin = a[0] - 16 * origin;
        if dy < 0 {
            // -dy (16 x - from_origin) >= threshold - across
            let bound = threshold - across - dy * from_origin;
            first = first.max(ceil_div(bound, -16 * dy));
        } else if dy > 0 {
            // dy (16 x - from_origin) <= across - threshold
            let bound = across - threshold + dy * from_origin;
            end = end.min(floor_div(bound, 16 * dy) + 1);
        } else if across < threshold {
            return [origin, origin];
        }
    }
    [origin + first, origin + end.max(first)]
}

/// Rounds towards minus infinity; `divisor` is positive.
fn floor_div(value: i32, divisor: i32) -> i32 {
    let magnitude = |value: i32| (value.cast_unsigned() / divisor.cast_unsigned()).cast_signed();
    if value >= 0 { magnitude(value) } else { !magnitude(!value) }
}

/// Rounds towards plus infinity; `divisor` is positive.
fn ceil_div(value: i32, divisor: i32) -> i32 {
    -floor_div(-value, divisor)
}

/// The affine map from target to source of one triangle, equation (2).
///
/// Kept relative to the first corner in 2^-24 px, which reaches +-127 px: more than a cell before
/// the warp. Sums wrap: a gradient of a sliver may overflow, the result inside the triangle does not.
#[derive(Clone, Copy, Debug)]
pub(super) struct SourceMap {
    moved: Point,
    source: Point,
    /// 2^-24 px of source per 1/16 px of target: x by x, x by y, y by x, y by y.
    gradient: [i32; 4],
}

/// One source pixel per target pixel, as [`SourceMap`] counts it.
const UNIT: i32 = 1 << 20;

impl SourceMap {
    pub(super) fn new(triangle: &MeshTriangle) -> Self {
        let [a, b, c] = triangle.moved;
        let [s, t, u] = triangle.source;
        let (moved, source) = (a, s);
        let (b, c) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let (t, u) = ([t[0] - s[0], t[1] - s[1]], [u[0] - s[0], u[1] - s[1]]);
        if (b, c) == (t, u) {
            return Self { moved, source, gradient: [UNIT, 0, 0, UNIT] };
        }
        let area = b[0] * c[1] - c[0] * b[1];
        let by_x = |axis: usize| ratio(t[axis] * c[1] - u[axis] * b[1], area);
        let by_y = |axis: usize| ratio(u[axis] * b[0] - t[axis] * c[0], area);
        Self { moved, source, gradient: [by_x(0), by_y(0), by_x(1), by_y(1)] }
    }

    /// Whether the triangle moved as a whole.
    pub(super) fn is_shift(&self) -> bool {
        self.gradient == [UNIT, 0, 0, UNIT]
    }

    /// Source of the pixel in column `x` of row `y`, Q8 px.
    pub(super) fn at(&self, x: i32, y: i32) -> [i32; 2] {
        let [xx, xy, yx, yy] = self.gradient;
        let (dx, dy) = (16 * x - self.moved[0], 16 * y - self.moved[1]);
        [
            q8(self.source[0], xx.wrapping_mul(dx).wrapping_add(xy.wrapping_mul(dy))),
            q8(self.source[1], yx.wrapping_mul(dx).wrapping_add(yy.wrapping_mul(dy))),
        ]
    }
}

fn q8(source: i32, relative: i32) -> i32 {
    source * 16 + (relative.wrapping_add(1 << 15) >> 16)
}

/// `numerator / area` in 2^-20, rounded to nearest, its low 32 bits.
#[expect(clippy::cast_possible_truncation, reason = "sums of gradients wrap")]
fn ratio(numerator: i32, area: i32) -> i32 {
    let area = i64::from(area);
    ((i64::from(numerator) << 20) + area / 2).div_euclid(area) as i32
}
