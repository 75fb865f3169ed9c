//! The derivative of the motion field along surfaces.
//!
//! At each lattice point J is fitted by least squares to the motion of the 5x5 points around it
//! that lie on its surface:
//!
//! ```text
//! (4) minimise  sum of w |D(x + e) - D0 - J e|^2  +  RIDGE |J|^2
//! ```
//!
//! over D0 and J, with Cauchy weights w of the residual before, so that another object at the same
//! distance counts little. The ridge keeps J at 0 along a direction in which a thin surface has no
//! extent. Eight neighbouring points are fitted at once.

use super::power::{Matrix, Power};
use crate::lanes::{LANES, Lanes, both};
use crate::trajectory::lattice::{Lattice, MARGIN};
use crate::trajectory::surface::is_same_surface;

/// Points of a window per axis.
const SIDE: usize = 2 * MARGIN + 1;
/// Fewest points of one surface that a fit takes.
const MIN_POINTS: f32 = 7.0;
/// Rounds of reweighting.
const ROUNDS: usize = 3;
/// Residual, pixels, at which a point's weight has halved.
const HALF_WEIGHT_PX: f32 = 0.5;
/// Ridge of (4), cells squared: that of one cell two cells away.
const RIDGE: f32 = 4.0;

/// What was fitted at a lattice point.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Fit {
    /// Depth key of the surface.
    pub(super) depth: u32,
    pub(super) is_known: bool,
    /// Its motion at the lattice point, pixels per span.
    pub(super) d: [f32; 2],
    /// Derivative of the motion, per pixel.
    pub(super) j: Matrix,
    /// How motions there go on.
    pub(super) power: Power,
}

/// The points around eight, and which of them count.
struct Window {
    /// 1 where a point is on the surface of the middle and its motion is known, else 0.
    on: [Lanes; SIDE * SIDE],
    /// Its motion, 0 where it does not count.
    d: [[Lanes; 2]; SIDE * SIDE],
    /// Way from the middle to the columns and to the rows, pixels.
    right: [Lanes; SIDE],
    down: [Lanes; SIDE],
}

/// The affine maps of eight points.
#[derive(Clone, Copy)]
struct Maps {
    d: [Lanes; 2],
    j: [[Lanes; 2]; 2],
}

impl Maps {
    #[inline(always)]
    fn predict(&self, e: [Lanes; 2]) -> [Lanes; 2] {
        both(|axis| self.d[axis] + self.j[axis][0] * e[0] + self.j[axis][1] * e[1])
    }
}

/// Fits eight lattice points of `row` from `column` on; `step` is a cell's size in pixels.
#[inline(always)]
pub(super) fn fit_eight(
    lattice: &Lattice,
    row: usize,
    column: usize,
    step: [f32; 2],
) -> [Fit; LANES] {
    let middle = lattice.eight(row + MARGIN, column + MARGIN);
    let window = Window::new(lattice, row, column);
    let is_known = middle.is_known();
    let zero = Lanes::default();
    let d = both(|axis| middle.d[axis].or(&is_known, zero));
    let mut count = zero;
    // Mean distance of the window's motion from the middle's.
    let mut spread = zero;
    for (on, cell) in window.on.iter().zip(&window.d) {
        count = count + *on;
        spread = spread + *on * ((cell[0] - d[0]).abs() + (cell[1] - d[1]).abs());
    }
    // The middle's own motion first: what is near it in motion weighs most from the start, so that
    // of two objects the one in the middle wins.
    let mut maps = Maps { d, j: [[zero; 2]; 2] };
    let half = Lanes::all(HALF_WEIGHT_PX);
    let mut is_fit = Lanes::all(MIN_POINTS - 0.5).is_below(count);
    for round in 0..ROUNDS {
        let half = if round == 0 { half.max(spread / count) } else { half };
        let is_solved;
        (maps, is_solved) = window.solve(&maps, half, RIDGE * step[0] * step[1]);
        for (is_fit, is_solved) in is_fit.iter_mut().zip(is_solved) {
            *is_fit &= is_solved;
        }
    }
    let mut fits = [Fit::default(); LANES];
    for (lane, fit) in fits.iter_mut().enumerate() {
        let j = both(|row| both(|column| maps.j[row][column].0[lane]));
        if let Some(power) = Power::of(&j).filter(|_| is_fit[lane] && is_known[lane]) {
            let d = both(|axis| maps.d[axis].0[lane]);
            *fit = Fit { depth: middle.depth[lane], is_known: true, d, j, power };
        }
    }
    fits
}

impl Window {
    #[inline(always)]
    fn new(lattice: &Lattice, row: usize, column: usize) -> Self {
        let middle = lattice.eight(row + MARGIN, column + MARGIN);
        let here = lattice.columns(column + MARGIN);
        let zero = Lanes::default();
        let mut window = Self {
            on: [zero; SIDE * SIDE],
            d: [[zero; 2]; SIDE * SIDE],
            right: [zero; SIDE],
            down: [zero; SIDE],
        };
        for i in 0..SIDE {
            window.right[i] = lattice.columns(column + i) - here;
            window.down[i] = Lanes::all(lattice.row(row + i) - lattice.row(row + MARGIN));
        }
        for (i, (on, d)) in window.on.iter_mut().zip(&mut window.d).enumerate() {
            let cells = lattice.eight(row + i / SIDE, column + i % SIDE);
            for lane in 0..LANES {
                let (right, down) = (cells.d[0].0[lane], cells.d[1].0[lane]);
                let counts = right.is_finite()
                    & down.is_finite()
                    & is_same_surface(cells.depth[lane], middle.depth[lane]);
                on.0[lane] = if counts { 1.0 } else { 0.0 };
                d[0].0[lane] = if counts { right } else { 0.0 };
                d[1].0[lane] = if counts { down } else { 0.0 };
            }
        }
        window
    }

    /// (4) with the weights of the residuals of `maps`, and where it has a solution.
    #[inline(always)]
    fn solve(&self, maps: &Maps, half: Lanes, ridge: f32) -> (Maps, [bool; LANES]) {
        let zero = Lanes::default();
        let (one, per_square) = (Lanes::all(1.0), Lanes::all(1.0) / (half * half));
        // Sums of w, w e, w e e^T, w d, w d e^T.
        let (mut w, mut we, mut wd) = (zero, [zero; 2], [zero; 2]);
        let (mut wee, mut wde) = ([zero; 3], [[zero; 2]; 2]);
        for (i, (on, d)) in self.on.iter().zip(&self.d).enumerate() {
            let e = [self.right[i % SIDE], self.down[i / SIDE]];
            let predicted = maps.predict(e);
            let (rx, ry) = (predicted[0] - d[0], predicted[1] - d[1]);
            let weight = *on / (one + (rx * rx + ry * ry) * per_square);
            let weighted = [weight * e[0], weight * e[1]];
            w = w + weight;
            for axis in 0..2 {
                we[axis] = we[axis] + weighted[axis];
                wd[axis] = wd[axis] + weight * d[axis];
                wde[axis][0] = wde[axis][0] + d[axis] * weighted[0];
                wde[axis][1] = wde[axis][1] + d[axis] * weighted[1];
            }
            wee[0] = wee[0] + weighted[0] * e[0];
            wee[1] = wee[1] + weighted[0] * e[1];
            wee[2] = wee[2] + weighted[1] * e[1];
        }
        // About the weighted mean, where D0 and J part.
        let per_w = one / w;
        let (mean_e, mean_d) = ([we[0] * per_w, we[1] * per_w], [wd[0] * per_w, wd[1] * per_w]);
        let ridge = Lanes::all(ridge);
        let xx = wee[0] - we[0] * mean_e[0] + ridge;
        let xy = wee[1] - we[0] * mean_e[1];
        let yy = wee[2] - we[1] * mean_e[1] + ridge;
        let det = xx * yy - xy * xy;
        let per_det = one / det;
        let mut maps = Maps { d: mean_d, j: [[zero; 2]; 2] };
        for axis in 0..2 {
            let x = wde[axis][0] - wd[axis] * mean_e[0];
            let y = wde[axis][1] - wd[axis] * mean_e[1];
            maps.j[axis] = [(x * yy - y * xy) * per_det, (y * xx - x * xy) * per_det];
            maps.d[axis] = mean_d[axis] - maps.j[axis][0] * mean_e[0] - maps.j[axis][1] * mean_e[1];
        }
        let (is_weighty, is_regular) = (Lanes::all(1.0).is_below(w), zero.is_below(det));
        let mut is_solved = [false; LANES];
        for ((is_solved, a), b) in is_solved.iter_mut().zip(is_weighty).zip(is_regular) {
            *is_solved = a & b;
        }
        (maps, is_solved)
    }
}
