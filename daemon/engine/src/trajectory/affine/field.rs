//! The affine maps of one key's lattice, and what they say of its cells.

use rayon::ThreadPool;

use super::fit::{Fit, fit_eight};
use super::power::Power;
use crate::bands::for_each_row;
use crate::key::KeyFrame;
use crate::lanes::{LANES, both};
use crate::plane::Plane;
use crate::trajectory::curve::{Curve, Curves};
use crate::trajectory::grid::Grid;
use crate::trajectory::lattice::{Lattice, STRIDE, middle};
use crate::trajectory::surface::is_same_surface;

/// A fit predicts the motion of a cell that it is of to this many pixels.
const AGREES_PX: f32 = 0.5;

/// The derivative of one key's motion field, where it was asked for.
#[derive(Clone, Debug, Default)]
pub struct AffineField {
    fits: Plane<[Fit; LANES]>,
    /// Which of them have been fitted.
    is_fitted: Plane<bool>,
    /// Columns of the lattice, the last one of which may end a run of eight early.
    columns: u32,
}

impl AffineField {
    /// Forgets all fits: a key with so many columns and rows of lattice points is to come.
    pub fn clear(&mut self, [columns, rows]: [u32; 2]) {
        self.columns = columns;
        let runs = columns.div_ceil(LANES as u32);
        self.fits.resize(runs, rows);
        self.is_fitted.resize(runs, rows);
        self.is_fitted.data_mut().fill(false);
    }

    /// Fits the runs of eight points that are `wanted`, by number and row, and have not been
    /// fitted.
    pub fn fit(
        &mut self,
        pool: &ThreadPool,
        lattice: &Lattice,
        grid: &Grid,
        wanted: impl Fn(u32, u32) -> bool + Sync,
    ) {
        let mut is_new = false;
        let mut wanted_runs = Vec::with_capacity(self.is_fitted.data().len());
        for row in 0..self.is_fitted.height() {
            for (run, is_fitted) in (0..).zip(self.is_fitted.row_mut(row)) {
                let is_wanted = !*is_fitted && wanted(run, row);
                wanted_runs.push(is_wanted);
                *is_fitted |= is_wanted;
                is_new |= is_wanted;
            }
        }
        if !is_new {
            return;
        }
        let runs = self.fits.width() as usize;
        for_each_row(
            pool,
            &mut self.fits,
            #[inline(always)]
            |row, fits| {
                let row = row as usize;
                for (run, fits) in fits.iter_mut().enumerate() {
                    if wanted_runs[row * runs + run] {
                        *fits = fit_eight(lattice, row, run * LANES, grid.step);
                    }
                }
            },
        );
    }

    /// Whether the point was fitted, with or without success.
    #[must_use]
    pub fn is_fitted(&self, column: u32, row: u32) -> bool {
        column < self.columns && self.is_fitted.at(column / LANES as u32, row)
    }

    /// The fit at a point; unknown where none was asked for.
    #[inline(always)]
    fn at(&self, column: u32, row: u32) -> Fit {
        if !self.is_fitted.at(column / LANES as u32, row) {
            return Fit::default();
        }
        let row = self.fits.row(row);
        row[(column / LANES as u32) as usize][column as usize % LANES]
    }

    /// (3) of a cell of depth key `depth` and motion `d`, by the fit of its own lattice point
    /// alone. None where that does not explain its motion.
    #[must_use]
    #[inline(always)]
    pub fn curve_by_own(
        &self,
        grid: &Grid,
        [x, y]: [u32; 2],
        depth: u32,
        d: [f32; 2],
    ) -> Option<Curve> {
        let (column, row) = (x / STRIDE, y / STRIDE);
        let fit = self.at(column, row);
        let (from, to) = (
            grid.centre(middle(column, grid.cells[0]), middle(row, grid.cells[1])),
            grid.centre(x, y),
        );
        let e = [to[0] - from[0], to[1] - from[1]];
        let off =
            both(|axis| fit.d[axis] + fit.j[axis][0] * e[0] + fit.j[axis][1] * e[1] - d[axis]);
        let is_its = fit.is_known
            && is_same_surface(fit.depth, depth)
            && off[0] * off[0] + off[1] * off[1] < AGREES_PX * AGREES_PX;
        let Power { velocity, acceleration } = fit.power;
        let times = |m: &[[f32; 2]; 2]| both(|row| m[row][0] * d[0] + m[row][1] * d[1]);
        is_its.then(|| Curve::accelerated(times(&velocity), times(&acceleration)))
    }

    /// (3) of a cell. None where no fit around it explains its motion.
    #[must_use]
    #[inline(always)]
    pub fn curve(&self, key: &KeyFrame, grid: &Grid, x: u32, y: u32) -> Option<Curve> {
        if self.fits.data().is_empty() {
            return None;
        }
        let curves = self.curves::<1>(key, grid, x, y);
        let at = |parts: [[f32; 1]; 2]| both(|axis| parts[axis][0]);
        let (v, a) = (at(curves.velocity), at(curves.acceleration));
        v[0].is_finite().then(|| Curve::accelerated(v, a))
    }

    /// (3) of `N` cells from (`x`, `y`) on, which lie between the same lattice points.
    #[must_use]
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "positions and at most a few cells")]
    pub fn curves<const N: usize>(&self, key: &KeyFrame, grid: &Grid, x: u32, y: u32) -> Curves<N> {
        let start = y as usize * grid.cells[0] as usize + x as usize;
        let displacement: &[[f32; 2]; N] =
            key.displacement.data()[start..].first_chunk().expect("the cells lie in the field");
        let depth: [u32; N] = match key.depth.data().get(start..) {
            Some(depth) if !depth.is_empty() => {
                *depth.first_chunk().expect("the cells lie in the field")
            }
            _ => [0; N],
        };
        let mut d = [[0.0; N]; 2];
        for (i, [right, down]) in displacement.iter().enumerate() {
            (d[0][i], d[1][i]) = (*right, *down);
        }
        let here = grid.centre(x, y);
        let mut weights = [0.0; N];
        let mut sums = [[0.0; N]; 8];
        for (row, way_y) in around(y, self.fits.height()) {
            for (column, way_x) in around(x, self.columns) {
                let fit = self.at(column, row);
                if !fit.is_known {
                    continue;
                }
                let from = grid.centre(middle(column, grid.cells[0]), middle(row, grid.cells[1]));
                let e = [here[0] - from[0], here[1] - from[1]];
                let weight_y = way_y.weight();
                let parts = fit.power.velocity.as_flattened().iter();
                let parts = parts.chain(fit.power.acceleration.as_flattened());
                let mut lent = [0.0; N];
                for (i, lent) in lent.iter_mut().enumerate() {
                    let right = e[0] + i as f32 * grid.step[0];
                    let off = both(|axis| {
                        fit.d[axis] + fit.j[axis][0] * right + fit.j[axis][1] * e[1] - d[axis][i]
                    });
                    let is_its = is_same_surface(fit.depth, depth[i])
                        & (off[0] * off[0] + off[1] * off[1] < AGREES_PX * AGREES_PX);
                    let weight = way_x.after(i as f32).weight() * weight_y;
                    *lent = if is_its { weight } else { 0.0 };
                    weights[i] += *lent;
                }
                for (sum, part) in sums.iter_mut().zip(parts) {
                    for (sum, lent) in sum.iter_mut().zip(lent) {
                        *sum += lent * part;
                    }
                }
            }
        }
        let mut curves = Curves { velocity: [[f32::NAN; N]; 2], acceleration: [[f32::NAN; N]; 2] };
        for i in 0..N {
            let per = if weights[i] > 0.0 { 1.0 / weights[i] } else { f32::NAN };
            let (x, y) = (d[0][i] * per, d[1][i] * per);
            let row = |at: usize| sums[at][i] * x + sums[at + 1][i] * y;
            (curves.velocity[0][i], curves.velocity[1][i]) = (row(0), row(2));
            (curves.acceleration[0][i], curves.acceleration[1][i]) = (row(4), row(6));
        }
        curves
    }
}

/// How far a cell has left a lattice point, or the way that remains to it, in lattice steps.
#[derive(Clone, Copy)]
enum Way {
    From(f32),
    To(f32),
}

impl Way {
    /// So many cells further.
    #[inline(always)]
    fn after(self, cells: f32) -> Self {
        match self {
            Self::From(way) => Self::From(way + cells / STRIDE as f32),
            Self::To(way) => Self::To(way + cells / STRIDE as f32),
        }
    }

    #[inline(always)]
    fn weight(self) -> f32 {
        match self {
            Self::From(way) => 1.0 - way,
            Self::To(way) => way,
        }
    }
}

/// The two lattice points around a cell along an axis, and the way from the first to it; no weight
/// is 0.
#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "at most a few cells")]
fn around(cell: u32, points: u32) -> [(u32, Way); 2] {
    let place = (cell + STRIDE / 2) as f32 / STRIDE as f32;
    let next = (cell + STRIDE / 2) / STRIDE;
    // Half a cell aside, so that a cell on a lattice point is still lent to by the next.
    let way = place - next as f32 + 0.5 / STRIDE as f32;
    [(next.max(1) - 1, Way::From(way)), (next.min(points - 1), Way::To(way))]
}
