//! The derivative of the motion field along surfaces.
//!
//! At each point of a lattice of cells, J is fitted by least squares to the motion of the cells
//! around it that lie on the surface of its middle one:
//!
//! ```text
//! (4) minimise  sum of w |D(x + e) - D0 - J e|^2  +  RIDGE |J|^2
//! ```
//!
//! over D0 and J, with Cauchy weights w of the residual before, so that another object at the same
//! distance counts little. The ridge keeps J at 0 along a direction in which a thin surface has no
//! extent.

use rayon::ThreadPool;

use super::power::{Matrix, continued};
use crate::bands::for_each_row;
use crate::key::KeyFrame;
use crate::plane::Plane;
use crate::trajectory::curve::Curve;
use crate::trajectory::grid::Grid;
use crate::trajectory::surface::is_same_surface;

/// Cells from one lattice point to the next.
const STRIDE: u32 = 4;
/// Reach of a fit in cells, and the step between those that it reads: 5x5 of them.
const REACH: i32 = 8;
const STEP: i32 = 4;
/// Cells that a fit reads at most.
const WINDOW: usize = ((2 * REACH / STEP + 1) * (2 * REACH / STEP + 1)) as usize;
/// Fewest cells of one surface that a fit takes.
const MIN_CELLS: usize = 7;
/// Rounds of reweighting.
const ROUNDS: usize = 3;
/// Residual, pixels, at which a cell's weight has halved.
const HALF_WEIGHT_PX: f32 = 0.5;
/// Ridge of (4), cells squared: that of one cell two cells away.
const RIDGE: f32 = 4.0;
/// A fit predicts the motion of a cell that it is of to this many pixels.
const AGREES_PX: f32 = 0.5;

/// What was fitted at a lattice point.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Fit {
    /// Depth key of the surface.
    depth: u32,
    is_known: bool,
    /// Its motion at the lattice point, pixels per span.
    d: [f32; 2],
    /// Derivative of the motion, per pixel.
    j: Matrix,
}

/// The derivative of one key's motion field.
#[derive(Clone, Debug, Default)]
pub struct AffineField {
    lattice: Plane<Fit>,
}

impl AffineField {
    /// Fits the field of `key`, which has motion.
    pub fn update(&mut self, pool: &ThreadPool, key: &KeyFrame, grid: &Grid) {
        let [columns, rows] = grid.cells.map(|cells| cells.div_ceil(STRIDE));
        self.lattice.resize(columns, rows);
        for_each_row(pool, &mut self.lattice, |row, fits| {
            for (column, fit) in (0..).zip(fits) {
                *fit = fit_at(key, grid, middle(column, grid.cells[0]), middle(row, grid.cells[1]));
            }
        });
    }

    /// (3) of a cell. None where no fit around it explains its motion.
    #[must_use]
    #[inline(always)]
    pub fn curve(&self, key: &KeyFrame, grid: &Grid, x: u32, y: u32) -> Option<Curve> {
        if self.lattice.data().is_empty() {
            return None;
        }
        let d = key.displacement.at(x, y);
        let depth = if key.depth.data().is_empty() { 0 } else { key.depth.at(x, y) };
        let (mut weights, mut sum) = (0.0, [[0.0; 2]; 2]);
        for (column, weight_x) in around(x, self.lattice.width()) {
            for (row, weight_y) in around(y, self.lattice.height()) {
                let fit = self.lattice.at(column, row);
                let (fit_x, fit_y) = (middle(column, grid.cells[0]), middle(row, grid.cells[1]));
                let e = offset(grid, [fit_x, fit_y], [x, y]);
                let predicted = predict(&fit, e);
                let (dx, dy) = (predicted[0] - d[0], predicted[1] - d[1]);
                let is_its = fit.is_known
                    & is_same_surface(fit.depth, depth)
                    & (dx * dx + dy * dy < AGREES_PX * AGREES_PX);
                let weight = if is_its { weight_x * weight_y } else { 0.0 };
                weights += weight;
                for (sum, j) in sum.as_flattened_mut().iter_mut().zip(fit.j.as_flattened()) {
                    *sum += weight * j;
                }
            }
        }
        if weights <= 0.0 {
            return None;
        }
        continued(d, &sum.map(|row| row.map(|j| j / weights)))
    }
}

/// The cell at the middle of a lattice point's cells.
#[inline(always)]
fn middle(index: u32, cells: u32) -> u32 {
    (index * STRIDE + STRIDE / 2).min(cells - 1)
}

/// The two lattice points around a cell along an axis with their weights, none of them 0.
#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "at most a few cells")]
fn around(cell: u32, points: u32) -> [(u32, f32); 2] {
    let place = (cell + STRIDE / 2) as f32 / STRIDE as f32;
    let next = (cell + STRIDE / 2) / STRIDE;
    // Half a cell aside, so that a cell on a lattice point is still lent to by the next.
    let way = place - next as f32 + 0.5 / STRIDE as f32;
    [(next.max(1) - 1, 1.0 - way), (next.min(points - 1), way)]
}

/// From one cell to another, pixels.
#[inline(always)]
fn offset(grid: &Grid, from: [u32; 2], to: [u32; 2]) -> [f32; 2] {
    let (from, to) = (grid.centre(from[0], from[1]), grid.centre(to[0], to[1]));
    [to[0] - from[0], to[1] - from[1]]
}

/// D0 + J e.
#[inline(always)]
fn predict(fit: &Fit, e: [f32; 2]) -> [f32; 2] {
    [0, 1].map(|axis| fit.d[axis] + fit.j[axis][0] * e[0] + fit.j[axis][1] * e[1])
}

/// A cell of the window: its offset in pixels and its motion.
#[derive(Clone, Copy, Default)]
struct Neighbour {
    e: [f32; 2],
    d: [f32; 2],
}

fn fit_at(key: &KeyFrame, grid: &Grid, x: u32, y: u32) -> Fit {
    let d = key.displacement.at(x, y);
    if !(d[0].is_finite() && d[1].is_finite()) {
        return Fit::default();
    }
    let has_depth = !key.depth.data().is_empty();
    let depth = if has_depth { key.depth.at(x, y) } else { 0 };
    let mut window = [Neighbour::default(); WINDOW];
    let mut count = 0;
    for down in (-REACH..=REACH).step_by(STEP as usize) {
        let Some(row) = y.checked_add_signed(down).filter(|row| *row < grid.cells[1]) else {
            continue;
        };
        for right in (-REACH..=REACH).step_by(STEP as usize) {
            let Some(column) = x.checked_add_signed(right).filter(|c| *c < grid.cells[0]) else {
                continue;
            };
            let d = key.displacement.at(column, row);
            let is_on = !has_depth || is_same_surface(depth, key.depth.at(column, row));
            if is_on && d[0].is_finite() && d[1].is_finite() {
                window[count] = Neighbour { e: offset(grid, [x, y], [column, row]), d };
                count += 1;
            }
        }
    }
    let window = &window[..count];
    if count < MIN_CELLS {
        return Fit::default();
    }
    // The middle's own motion first: what is near it in motion weighs most from the start, so that
    // of two objects the one in the middle wins.
    let mut fit = Fit { depth, is_known: true, d, j: [[0.0; 2]; 2] };
    let scale = spread(window, d);
    for round in 0..ROUNDS {
        let half = if round == 0 { HALF_WEIGHT_PX.max(scale) } else { HALF_WEIGHT_PX };
        match solve(window, &fit, half, RIDGE * grid.step[0] * grid.step[1]) {
            Some((d, j)) => (fit.d, fit.j) = (d, j),
            None => return Fit::default(),
        }
    }
    fit
}

/// Mean distance of the window's motion from the middle's, pixels.
#[expect(clippy::cast_precision_loss, reason = "at most 25 cells")]
fn spread(window: &[Neighbour], d: [f32; 2]) -> f32 {
    let sum: f32 =
        window.iter().map(|cell| (cell.d[0] - d[0]).abs() + (cell.d[1] - d[1]).abs()).sum();
    sum / window.len() as f32
}

/// (4) with the weights of the residuals of `fit`.
fn solve(window: &[Neighbour], fit: &Fit, half: f32, ridge: f32) -> Option<([f32; 2], Matrix)> {
    // Sums of w, w e, w e e^T, w d, w d e^T.
    let (mut w, mut we, mut wd) = (0.0, [0.0; 2], [0.0; 2]);
    let (mut wee, mut wde) = ([0.0; 3], [[0.0; 2]; 2]);
    for Neighbour { e, d } in window {
        let predicted = predict(fit, *e);
        let (rx, ry) = (predicted[0] - d[0], predicted[1] - d[1]);
        let weight = 1.0 / (1.0 + (rx * rx + ry * ry) / (half * half));
        w += weight;
        for axis in 0..2 {
            we[axis] += weight * e[axis];
            wd[axis] += weight * d[axis];
            wde[axis][0] += weight * d[axis] * e[0];
            wde[axis][1] += weight * d[axis] * e[1];
        }
        wee[0] += weight * e[0] * e[0];
        wee[1] += weight * e[0] * e[1];
        wee[2] += weight * e[1] * e[1];
    }
    if w < 1.0 {
        return None;
    }
    // About the weighted mean, where D0 and J part.
    let (mean_e, mean_d) = (we.map(|e| e / w), wd.map(|d| d / w));
    let xx = wee[0] - we[0] * mean_e[0] + ridge;
    let xy = wee[1] - we[0] * mean_e[1];
    let yy = wee[2] - we[1] * mean_e[1] + ridge;
    let det = xx * yy - xy * xy;
    if det.is_nan() || det <= 0.0 {
        return None;
    }
    let j = [0, 1].map(|axis| {
        let x = wde[axis][0] - wd[axis] * mean_e[0];
        let y = wde[axis][1] - wd[axis] * mean_e[1];
        [(x * yy - y * xy) / det, (y * xx - x * xy) / det]
    });
    let d0 = [0, 1].map(|axis| mean_d[axis] - j[axis][0] * mean_e[0] - j[axis][1] * mean_e[1]);
    Some((d0, j))
}
