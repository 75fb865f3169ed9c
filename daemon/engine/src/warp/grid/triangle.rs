//! One triangle of the warped mesh: which pixels it covers and where they come from.
//!
//! Corners are in 1/16 px; everything is relative to a corner or to the triangle's first pixel, so
//! that edge functions stay within 30 bits. Positive orientation is clockwise on the screen (y
//! down).

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

/// Walks down the pixel rows of a triangle of positive orientation, a span of columns per row.
///
/// An edge from `a` to `b` has a pixel centre `p` inside when
/// `E = (b.x - a.x) (p.y - a.y) - (b.y - a.y) (p.x - a.x) >= t`, with `t` 0 on the edges of the
/// top-left rule and 1 on others, so that a centre on an edge that two triangles share belongs to
/// exactly one. `E` falls or rises along a row, so each edge gives one bound of the columns; from
/// row to row its numerator grows by a constant, so quotient and remainder are carried along.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spans {
    origin: i32,
    last: i32,
    edges: [Edge; 3],
}

#[derive(Clone, Copy, Debug)]
enum Edge {
    /// Columns from `-quotient` on are inside.
    Left(Ratio),
    /// Columns up to `quotient` are inside.
    Right(Ratio),
    /// The whole row is inside while `value` is not negative; it grows by `step`.
    Level { value: i32, step: i32 },
}

impl Spans {
    /// Starts at pixel row `y`.
    pub(super) fn new(moved: [Point; 3], y: i32) -> Self {
        let [origin, last] = pixel_range(moved, 0);
        let edge = |a: Point, b: Point| {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let threshold = i32::from(!(dy < 0 || (dy == 0 && dx > 0)));
            let (value, step) = (dx * (16 * y - a[1]) - threshold, 16 * dx);
            // E - t = value - dy (16 x - from_origin), x counted from the origin.
            let value = value + dy * (a[0] - 16 * origin);
            match dy {
                0 => Edge::Level { value, step },
                _ if dy < 0 => Edge::Left(Ratio::new(value, step, -16 * dy)),
                _ => Edge::Right(Ratio::new(value, step, 16 * dy)),
            }
        };
        let [a, b, c] = moved;
        Self { origin, last, edges: [edge(a, b), edge(b, c), edge(c, a)] }
    }

    /// First and end column of the row, and on to the next.
    #[inline]
    pub(super) fn next(&mut self) -> [i32; 2] {
        let (mut first, mut end) = (0, self.last - self.origin + 1);
        for edge in &mut self.edges {
            match edge {
                Edge::Left(ratio) => first = first.max(-ratio.next()),
                Edge::Right(ratio) => end = end.min(ratio.next() + 1),
                Edge::Level { value, step } => {
                    if *value < 0 {
                        end = 0;
                    }
                    *value += *step;
                }
            }
        }
        [self.origin + first, self.origin + end.max(first)]
    }
}

/// `floor(value / divisor)` while `value` grows by a constant; `divisor` is positive.
#[derive(Clone, Copy, Debug)]
struct Ratio {
    quotient: i32,
    remainder: i32,
    step_quotient: i32,
    step_remainder: i32,
    divisor: i32,
}

impl Ratio {
    fn new(value: i32, step: i32, divisor: i32) -> Self {
        let (quotient, step_quotient) = (floor_div(value, divisor), floor_div(step, divisor));
        let remainder = value - quotient * divisor;
        let step_remainder = step - step_quotient * divisor;
        Self { quotient, remainder, step_quotient, step_remainder, divisor }
    }

    #[inline]
    fn next(&mut self) -> i32 {
        let quotient = self.quotient;
        self.quotient += self.step_quotient;
        self.remainder += self.step_remainder;
        if self.remainder >= self.divisor {
            self.remainder -= self.divisor;
            self.quotient += 1;
        }
        quotient
    }
}

/// Rounds towards minus infinity; `divisor` is positive.
fn floor_div(value: i32, divisor: i32) -> i32 {
    let magnitude = |value: i32| (value.cast_unsigned() / divisor.cast_unsigned()).cast_signed();
    if value >= 0 { magnitude(value) } else { !magnitude(!value) }
}

/// The affine map from target to source of one triangle, equation (2).
///
/// Kept relative to the first corner in 2^-24 px, which reaches +-127 px: more than a cell before
/// the warp. Sums wrap: a gradient of a sliver may overflow, the result inside the triangle does
/// not.
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
    #[inline]
    pub(super) fn at(&self, x: i32, y: i32) -> [i32; 2] {
        let [xx, xy, yx, yy] = self.gradient;
        let (dx, dy) = (16 * x - self.moved[0], 16 * y - self.moved[1]);
        [
            q8(self.source[0], xx.wrapping_mul(dx).wrapping_add(xy.wrapping_mul(dy))),
            q8(self.source[1], yx.wrapping_mul(dx).wrapping_add(yy.wrapping_mul(dy))),
        ]
    }
}

#[inline]
fn q8(source: i32, relative: i32) -> i32 {
    source * 16 + (relative.wrapping_add(1 << 15) >> 16)
}

/// `numerator / area` in 2^-20, rounded to nearest, its low 32 bits.
#[expect(clippy::cast_possible_truncation, reason = "sums of gradients wrap")]
fn ratio(numerator: i32, area: i32) -> i32 {
    let area = i64::from(area);
    ((i64::from(numerator) << 20) + area / 2).div_euclid(area) as i32
}
