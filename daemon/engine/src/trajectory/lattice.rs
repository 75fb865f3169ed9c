//! The field at one cell of every 4x4: what is fitted to it and what is measured of it reads these.
//!
//! Motion and depth of the lattice's cells lie side by side, with a margin of cells of unknown
//! motion around them, so that a window is a run of words and knows no border.

use rayon::ThreadPool;

use super::grid::Grid;
use crate::bands::for_each_row;
use crate::key::KeyFrame;
use crate::lanes::{LANES, Lanes, Mask};
use crate::plane::Plane;

/// Cells from one lattice point to the next, per axis.
pub const STRIDE: u32 = 4;
/// Lattice points that a window may reach beyond the border.
pub(crate) const MARGIN: usize = 2;

/// The lattice of one key.
#[derive(Clone, Debug, Default)]
pub struct Lattice {
    points: [u32; 2],
    /// Per row the motion right, the motion down, both as the bits of floats, and the depth keys.
    rows: Plane<u32>,
    /// Words of each of the three.
    stride: usize,
    /// Where the columns and rows lie, pixels; with margins.
    x: Vec<f32>,
    y: Vec<f32>,
}

/// Eight lattice points of a row.
#[derive(Clone, Copy)]
pub(crate) struct Eight {
    pub(crate) d: [Lanes; 2],
    pub(crate) depth: [u32; LANES],
}

impl Eight {
    /// Whose motion is known.
    #[inline(always)]
    pub(super) fn is_known(&self) -> Mask {
        let mut mask = [false; LANES];
        for ((mask, right), down) in mask.iter_mut().zip(self.d[0].0).zip(self.d[1].0) {
            *mask = right.is_finite() & down.is_finite();
        }
        mask
    }
}

/// The cell of a lattice point along an axis of `cells`.
#[must_use]
#[inline(always)]
pub fn middle(point: u32, cells: u32) -> u32 {
    (point * STRIDE + STRIDE / 2).min(cells - 1)
}

impl Lattice {
    /// Columns and rows of lattice points on a grid.
    #[must_use]
    pub fn points_on(grid: &Grid) -> [u32; 2] {
        grid.cells.map(|cells| cells.div_ceil(STRIDE))
    }

    /// Takes the field of `key`, whose cells lie on `grid`. Without depth all of it is one surface.
    pub fn update(&mut self, pool: &ThreadPool, key: &KeyFrame, grid: &Grid) {
        self.points = Self::points_on(grid);
        let [columns, rows] = self.points;
        self.stride = (columns as usize).next_multiple_of(LANES) + 2 * MARGIN;
        let width = u32::try_from(3 * self.stride).expect("a quarter of 8192 columns, thrice");
        self.rows.resize(width, rows + 2 * MARGIN as u32);
        let places = |axis: usize, points: u32, padded: usize| {
            let place = |point: usize| {
                let point = (point as u32).saturating_sub(MARGIN as u32).min(points - 1);
                let cell = middle(point, grid.cells[axis]);
                grid.centre(cell, cell)[axis]
            };
            (0..padded).map(place).collect::<Vec<_>>()
        };
        self.x = places(0, columns, self.stride);
        self.y = places(1, rows, rows as usize + 2 * MARGIN);
        let has_depth = !key.depth.data().is_empty();
        let stride = self.stride;
        for_each_row(pool, &mut self.rows, |row, words| {
            let unknown = f32::NAN.to_bits();
            let (motion, depth) = words.split_at_mut(2 * stride);
            motion.fill(unknown);
            depth.fill(0);
            let inside = (row as usize).checked_sub(MARGIN).filter(|row| *row < rows as usize);
            let Some(row) = inside else { return };
            let y = middle(row as u32, grid.cells[1]);
            let cells = || (0..columns).map(|point| middle(point, grid.cells[0]) as usize);
            let (right, down) = motion.split_at_mut(stride);
            let field = key.displacement.row(y);
            for ((right, down), cell) in
                right[MARGIN..].iter_mut().zip(&mut down[MARGIN..]).zip(cells())
            {
                let [dx, dy] = field[cell];
                (*right, *down) = (dx.to_bits(), dy.to_bits());
            }
            if has_depth {
                let keys = key.depth.row(y);
                for (depth, cell) in depth[MARGIN..].iter_mut().zip(cells()) {
                    *depth = keys[cell];
                }
            }
        });
    }

    /// Columns and rows of lattice points.
    #[must_use]
    pub fn points(&self) -> [u32; 2] {
        self.points
    }

    /// Motion and depth key of a lattice point.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, column: u32, row: u32) -> ([f32; 2], u32) {
        let words = self.rows.row(row + MARGIN as u32);
        let column = column as usize + MARGIN;
        let word = |i: usize| words[i * self.stride + column];
        ([f32::from_bits(word(0)), f32::from_bits(word(1))], word(2))
    }

    /// Where a lattice point lies, pixels.
    #[must_use]
    #[inline(always)]
    pub fn place(&self, column: u32, row: u32) -> [f32; 2] {
        [self.x[column as usize + MARGIN], self.y[row as usize + MARGIN]]
    }

    /// Those from a column on, counted with the margin as the row is.
    #[inline(always)]
    pub(crate) fn eight(&self, row: usize, column: usize) -> Eight {
        let words = self.rows.row(row as u32);
        let run = |i: usize| {
            words[i * self.stride + column..]
                .first_chunk()
                .expect("rows have a margin on the right")
        };
        let d = [Lanes::from_bits(run(0)), Lanes::from_bits(run(1))];
        Eight { d, depth: *run(2) }
    }

    /// Where eight columns lie, counted with the margin.
    #[inline(always)]
    pub(crate) fn columns(&self, column: usize) -> Lanes {
        Lanes(*self.x[column..].first_chunk().expect("rows have a margin on the right"))
    }

    /// Where a row lies, counted with the margin.
    #[inline(always)]
    pub(crate) fn row(&self, row: usize) -> f32 {
        self.y[row]
    }
}
