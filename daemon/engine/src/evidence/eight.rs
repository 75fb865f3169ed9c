//! The first pass of [`super::measure`] over eight samples at once.
//!
//! Where a sample was, whether that is its surface and how far `hold` and `linear` are off is worked
//! out for all eight together. Those that go by one of the two, as most do, are done with that;
//! the others are followed one by one. Either way gives the same numbers.

use super::Sample;
use super::measure::{ByUsed, FAILED, Measuring, Predictions, Trace, error};
use crate::lanes::{LANES, Lanes, Mask, both};
use crate::trajectory::lattice::MARGIN;
use crate::trajectory::rung::Rung;
use crate::trajectory::surface::was_same_surface;

/// What was found of eight samples.
struct Eight {
    /// Whether the cell nearest to where it was lies on its surface.
    is_found: Mask,
    /// That cell.
    cell: [[u32; LANES]; 2],
    depth: [u32; LANES],
    /// Where the motion of that cell had said that it would be by now.
    straight: [Lanes; 2],
    /// (2) of hold and of linear.
    errors: [Lanes; 2],
}

impl Measuring<'_> {
    /// Follows at most eight samples back, from (column, row) on.
    #[inline(always)]
    pub(super) fn follow_run(
        &self,
        predictions: &Predictions<'_>,
        [first, row]: [u32; 2],
        samples: &mut [Sample],
        traces: &mut [Trace],
    ) {
        let mut each = (first..).zip(samples.iter_mut().zip(traces));
        // After a change of method nothing may be known of the older key's grid.
        if self.orders_alone || predictions.models.grid().cells.contains(&0) {
            each.for_each(|(column, (sample, trace))| {
                (*sample, *trace) = self.follow(predictions, column, row);
            });
            return;
        }
        let eight = self.look(predictions, first as usize, row as usize);
        for i in 0..LANES {
            let Some((column, (sample, trace))) = each.next() else { return };
            let common = self.follow_one(&eight, i, [column, row]);
            (*sample, *trace) = common.unwrap_or_else(|| self.follow(predictions, column, row));
        }
    }

    /// The `i`-th of eight, at `at`; None where it goes by another rung or by flow, or was not
    /// found at once.
    #[inline(always)]
    fn follow_one(&self, eight: &Eight, i: usize, at: [u32; 2]) -> Option<(Sample, Trace)> {
        let goes_by_flow = || self.failed.at(self.lattice.place(at[0], at[1])).is_some();
        if !eight.is_found[i] || goes_by_flow() {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "grids have at most 8192 cells per axis"
        )]
        let cell = both(|axis| eight.cell[axis][i] as u16);
        let depth = eight.depth[i];
        let history = self.history(cell, depth);
        let used = history.map_or(self.image_rung, Sample::rung);
        let [of_hold, of_linear] = both(|rung| eight.errors[rung].0[i]);
        let (foreseen, of_used) = match used {
            Rung::Hold => ([0.0; 2], of_hold),
            Rung::Linear => (both(|axis| eight.straight[axis].0[i]), of_linear),
            _ => return None,
        };
        let has_failed = of_used > FAILED;
        let errors = [of_hold, of_linear, of_used];
        let by_used = ByUsed { used, foreseen, has_failed, errors };
        Some(self.take_in_used(at, cell, depth, history, &by_used))
    }

    /// Looks where eight samples were.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "cells up to 8192 are exact")]
    fn look(&self, predictions: &Predictions<'_>, column: usize, row: usize) -> Eight {
        const TWO_TO_23: f32 = 8_388_608.0;
        let Predictions { key, models, phase, .. } = predictions;
        let (lattice, grid) = (self.lattice, models.grid());
        let run = lattice.eight(row + MARGIN, column + MARGIN);
        let at = [lattice.columns(column + MARGIN), Lanes::all(lattice.row(row + MARGIN))];
        let mut is_found = [true; LANES];
        let mut cell = [[0; LANES]; 2];
        for axis in 0..2 {
            let was = at[axis] - run.d[axis];
            let place = (was - Lanes::all(grid.first[axis])) / Lanes::all(grid.step[axis]);
            let last = (grid.cells[axis] - 1) as f32;
            for i in 0..LANES {
                let place = place.0[i];
                is_found[i] &= (place >= -0.5) & (place <= last + 0.5);
                // The first of two that are equally near.
                let nearest = (place.max(0.0).min(last) - 0.5).ceil().abs();
                cell[axis][i] = (nearest + TWO_TO_23).to_bits() - TWO_TO_23.to_bits();
            }
        }
        let (cells, depths) = (key.displacement.data(), key.depth.data());
        let (mut moved, mut depth) = ([Lanes::default(); 2], run.depth);
        for i in 0..LANES {
            let index = cell[1][i] as usize * grid.cells[0] as usize + cell[0][i] as usize;
            [moved[0].0[i], moved[1].0[i]] = cells[index];
            depth[i] = depths.get(index).copied().unwrap_or(depth[i]);
        }
        let phase = Lanes::all(*phase);
        let straight = [moved[0] * phase, moved[1] * phase];
        let mut errors = [Lanes::default(); 2];
        for i in 0..LANES {
            is_found[i] &= was_same_surface(run.depth[i], depth[i]);
            let d = [run.d[0].0[i], run.d[1].0[i]];
            errors[0].0[i] = error([0.0; 2], d);
            errors[1].0[i] = error([straight[0].0[i], straight[1].0[i]], d);
        }
        Eight { is_found, cell, depth: run.depth, straight, errors }
    }
}
