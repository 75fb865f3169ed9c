//! The `global` rung: one homography for the whole image, continued as its own power.
//!
//! ```text
//! (1) w (x, y, 1) = H (x', y', 1)        x' = x - D(x), the place one span ago
//! (2) d(1) = H x - x,  d(1/2) = H^(1/2) x - x
//! ```
//!
//! H is fitted to the motion field by least squares, reweighted so that what moves on its own
//! counts little (Cauchy weights). The square root is Denman and Beavers' iteration (1976, "The
//! matrix sign function and computations in systems"). f64, in coordinates of about -1 to 1; the
//! fit and the iteration have a fixed number of steps.

use glam::{DMat3, DVec3};

use super::curve::Curve;
use super::grid::Grid;
use crate::key::KeyFrame;
use crate::plane::Rect;
use crate::simd::widest;

/// Samples of the field along its longer side.
const SAMPLES: u32 = 48;
/// Rounds of reweighting. What a fifth of the image does on its own pulls the first fits by
/// pixels; after ten rounds by less than a tenth.
const ROUNDS: usize = 10;
/// Residual, pixels, at which a sample's weight has halved.
const HALF_WEIGHT_PX: f64 = 1.0;
/// Steps of the square root: it converges quadratically.
const ROOT_STEPS: usize = 8;
/// Fewest samples that a fit of eight unknowns takes.
const MIN_SAMPLES: usize = 16;

/// The motion of the image as a whole.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Homography {
    half: [[f32; 3]; 3],
    one: [[f32; 3]; 3],
}

/// A sample of (1) in unit coordinates: new place, old place, weight.
struct Sample {
    new: [f64; 2],
    old: [f64; 2],
    weight: f64,
}

impl Homography {
    /// Fits the motion of `key`. None where too little of it is known or no single motion does.
    #[must_use]
    pub fn fit(key: &KeyFrame, grid: &Grid) -> Option<Self> {
        let (centre, scale) = unit(key.valid);
        let mut samples = samples(key, grid, centre, scale);
        if samples.len() < MIN_SAMPLES {
            return None;
        }
        let mut h = solve(&samples)?;
        for _ in 0..ROUNDS {
            for sample in &mut samples {
                let [x, y] = apply(&h, sample.old);
                let (dx, dy) = ((x - sample.new[0]) * scale, (y - sample.new[1]) * scale);
                sample.weight =
                    1.0 / (1.0 + (dx * dx + dy * dy) / (HALF_WEIGHT_PX * HALF_WEIGHT_PX));
            }
            h = solve(&samples)?;
        }
        let to_unit = DMat3::from_cols(
            DVec3::new(1.0 / scale, 0.0, 0.0),
            DVec3::new(0.0, 1.0 / scale, 0.0),
            DVec3::new(-centre[0] / scale, -centre[1] / scale, 1.0),
        );
        let from_unit = to_unit.inverse();
        let in_pixels = |h: DMat3| rows(&(from_unit * h * to_unit));
        Some(Self { half: in_pixels(root(&h)?), one: in_pixels(h) })
    }

    /// (2) of the point at a pixel. NaN where it has passed the horizon.
    #[must_use]
    #[inline(always)]
    pub fn curve(&self, at: [f32; 2]) -> Curve {
        Curve { half: moved(&self.half, at), one: moved(&self.one, at) }
    }
}

#[inline(always)]
fn moved(h: &[[f32; 3]; 3], [x, y]: [f32; 2]) -> [f32; 2] {
    let part = |row: &[f32; 3]| row[0] * x + row[1] * y + row[2];
    let [to_x, to_y, w] = [part(&h[0]), part(&h[1]), part(&h[2])];
    let w = if w > 1e-6 { w } else { f32::NAN };
    [to_x / w - x, to_y / w - y]
}

/// Centre and half the width of the picture: what makes coordinates run from about -1 to 1.
fn unit(valid: Rect) -> ([f64; 2], f64) {
    let [x, y, width, height] = [valid.x, valid.y, valid.width, valid.height].map(f64::from);
    ([x + 0.5 * width - 0.5, y + 0.5 * height - 0.5], 0.5 * width)
}

fn samples(key: &KeyFrame, grid: &Grid, centre: [f64; 2], scale: f64) -> Vec<Sample> {
    let mut samples = Vec::new();
    let stride = grid.cells[0].max(grid.cells[1]).div_ceil(SAMPLES);
    for y in (stride / 2..grid.cells[1]).step_by(stride as usize) {
        for x in (stride / 2..grid.cells[0]).step_by(stride as usize) {
            let d = key.displacement.at(x, y);
            if d[0].is_finite() && d[1].is_finite() {
                let at = grid.centre(x, y);
                let to_unit = |axis: usize, back: f32| {
                    (f64::from(at[axis]) - f64::from(back) - centre[axis]) / scale
                };
                samples.push(Sample {
                    new: [to_unit(0, 0.0), to_unit(1, 0.0)],
                    old: [to_unit(0, d[0]), to_unit(1, d[1])],
                    weight: 1.0,
                });
            }
        }
    }
    samples
}

/// The unknowns of (1) in the equation of either axis, and in the end its right side.
const HELD: [[usize; 6]; 2] = [[0, 1, 2, 6, 7, 8], [3, 4, 5, 6, 7, 8]];

/// The homography of least squares with its last element 1: normal equations of (1).
fn solve(samples: &[Sample]) -> Option<DMat3> {
    let sums = widest(
        #[inline(always)]
        || normal_sums(samples),
    );
    let mut normal = [[0.0; 9]; 8];
    for (held, sums) in HELD.iter().zip(sums) {
        for (row, sums) in held.iter().zip(sums) {
            for (column, sum) in held.iter().zip(sums) {
                normal[*row][*column] += sum;
            }
        }
    }
    let h = eliminate(normal)?;
    let matrix = DMat3::from_cols(
        DVec3::new(h[0], h[3], h[6]),
        DVec3::new(h[1], h[4], h[7]),
        DVec3::new(h[2], h[5], 1.0),
    );
    (matrix.is_finite() && matrix.determinant() > 1e-3).then_some(matrix)
}

/// Sums of the products of what [`HELD`] names, the right side times the unknowns alone, for the
/// equations of either axis.
#[inline(always)]
fn normal_sums(samples: &[Sample]) -> [[[f64; 6]; 5]; 2] {
    let mut sums = [[[0.0; 6]; 5]; 2];
    for Sample { new, old: [x, y], weight } in samples {
        for (sums, new) in sums.iter_mut().zip(new) {
            let equation = [*x, *y, 1.0, -x * new, -y * new, *new];
            for (row, a) in sums.iter_mut().zip(equation) {
                let a = weight * a;
                for (sum, b) in row.iter_mut().zip(equation) {
                    *sum += a * b;
                }
            }
        }
    }
    sums
}

/// Gauss with row exchanges. None where the equations leave an unknown open.
fn eliminate(mut rows: [[f64; 9]; 8]) -> Option<[f64; 8]> {
    for column in 0..8 {
        let pivot =
            (column..8).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        rows.swap(column, pivot);
        if rows[column][column].abs() < 1e-9 {
            return None;
        }
        let from = rows[column];
        for (_, row) in rows.iter_mut().enumerate().filter(|(row, _)| *row != column) {
            let factor = row[column] / from[column];
            for (element, from) in row.iter_mut().zip(from) {
                *element -= factor * from;
            }
        }
    }
    Some(std::array::from_fn(|i| rows[i][8] / rows[i][i]))
}

/// The principal square root.
fn root(h: &DMat3) -> Option<DMat3> {
    let (mut y, mut z) = (*h, DMat3::IDENTITY);
    for _ in 0..ROOT_STEPS {
        (y, z) = ((y + z.inverse()) * 0.5, (z + y.inverse()) * 0.5);
    }
    let error = y * y - *h;
    let is_root = error.to_cols_array().iter().all(|e| e.abs() < 1e-6);
    (y.is_finite() && is_root).then_some(y)
}

fn apply(h: &DMat3, [x, y]: [f64; 2]) -> [f64; 2] {
    let moved = *h * DVec3::new(x, y, 1.0);
    [moved.x / moved.z, moved.y / moved.z]
}

#[expect(clippy::cast_possible_truncation, reason = "positions need no more than an f32")]
fn rows(h: &DMat3) -> [[f32; 3]; 3] {
    let h = *h * (1.0 / h.z_axis.z);
    let row = |r: DVec3| [r.x as f32, r.y as f32, r.z as f32];
    let t = h.transpose();
    [row(t.x_axis), row(t.y_axis), row(t.z_axis)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::plane;

    /// A key whose field is that of `old_of`, from places at the key to places one span ago.
    fn key(old_of: impl Fn([f32; 2]) -> [f32; 2]) -> KeyFrame {
        KeyFrame {
            valid: Rect::full(160, 96),
            displacement: plane(160, 96, |x, y| {
                let at = [x as f32, y as f32];
                let old = old_of(at);
                [at[0] - old[0], at[1] - old[1]]
            }),
            ..KeyFrame::default()
        }
    }

    fn turned(at: [f32; 2], angle: f32) -> [f32; 2] {
        let (x, y) = (at[0] - 70.0, at[1] - 50.0);
        let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
        [70.0 + cos * x - sin * y, 50.0 + sin * x + cos * y]
    }

    #[test]
    fn a_turning_picture_goes_on_turning_although_a_part_of_it_does_not() {
        let key = key(|at| if at[0] < 32.0 { at } else { turned(at, -0.3) });
        let homography = Homography::fit(&key, &Grid::of(&key)).unwrap();
        for at in [[10.0, 10.0], [150.0, 90.0], [80.0, 20.0]] {
            for (found, angle) in
                [(homography.curve(at).half, 0.15), (homography.curve(at).one, 0.3)]
            {
                let expected = turned(at, angle);
                for axis in 0..2 {
                    let error = at[axis] + found[axis] - expected[axis];
                    assert!(error.abs() < 0.1, "{at:?} by {angle}: {error} px");
                }
            }
        }
    }

    #[test]
    fn without_motion_or_with_too_little_of_it_there_is_no_homography() {
        let unknown = key(|_| [f32::NAN; 2]);
        assert_eq!(Homography::fit(&unknown, &Grid::of(&unknown)), None);
        let collapse = key(|_| [5.0, 5.0]);
        assert_eq!(Homography::fit(&collapse, &Grid::of(&collapse)), None, "no motion does that");
    }
}
