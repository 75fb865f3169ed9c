//! From blocks to cells: what a cell of 4x4 pixels takes of the blocks around it.
//!
//! Where they agree to a pixel, it takes their mean, weighted by how near they are: a surface moves
//! smoothly. Where they do not, an outline runs between them, and the cell takes that motion, or
//! none, by which the 8x8 pixels around it are explained best; that of its own block among equals.

use rayon::ThreadPool;

use super::block::sad;
use super::luma::Level;
use super::search::{Block, Search};
use super::{BLOCK, CELL, PER_PX, Step};
use crate::bands::for_each_chunk;
use crate::plane::Plane;

/// Most that blocks of one surface differ by, per axis: a pixel.
const ONE_SURFACE: u16 = PER_PX.unsigned_abs();

/// The answer, 1/32 pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells {
    field: Plane<Step>,
}

impl Cells {
    /// Cells of the whole picture.
    pub(super) fn field(&self) -> &Plane<Step> {
        &self.field
    }

    /// Gives every cell its motion from the blocks of `search`.
    pub(super) fn choose(&mut self, pool: &ThreadPool, [now, then]: [&Level; 2], search: &Search) {
        let blocks = search.blocks();
        let [columns, rows] = now.size().map(|length| length.div_ceil(CELL));
        self.field.resize(columns, rows);
        for_each_chunk(
            pool,
            self.field.data_mut(),
            columns as usize,
            #[inline(always)]
            |y, row| {
                for (x, out) in (0..).zip(row) {
                    *out = of_cell(now, then, blocks, [x, y]);
                }
            },
        );
    }
}

#[inline(always)]
fn of_cell(now: &Level, then: &Level, blocks: &Plane<Block>, cell: [u32; 2]) -> Step {
    let size = [blocks.width(), blocks.height()];
    let per_block = BLOCK / CELL;
    let places = [0, 1].map(|axis| {
        let own = (cell[axis] / per_block).min(size[axis] - 1);
        let is_first = cell[axis].is_multiple_of(per_block);
        let beside = if is_first { own.saturating_sub(1) } else { (own + 1).min(size[axis] - 1) };
        [own, beside]
    });
    let step = |x: usize, y: usize| blocks.at(places[0][x], places[1][y]).step;
    let steps = [step(0, 0), step(1, 0), step(0, 1), step(1, 1)];
    let own = steps[0];
    let is_near = |other: &Step| {
        own[0].abs_diff(other[0]) <= ONE_SURFACE && own[1].abs_diff(other[1]) <= ONE_SURFACE
    };
    if steps.iter().all(is_near) {
        // A cell's centre is a quarter of a block from its own block's.
        return [0, 1].map(|axis| {
            let [own, across, down, aslant] = steps.map(|step| i32::from(step[axis]));
            let sum = 9 * own + 3 * (across + down) + aslant;
            #[expect(clippy::cast_possible_truncation, reason = "a mean of 16 bits has 16 bits")]
            let mean = ((sum + 8) >> 4) as i16;
            mean
        });
    }
    // The block around the cell.
    let aside = ((BLOCK - CELL) / 2).cast_signed();
    let at = [0, 1].map(|axis| {
        let last = (now.size()[axis] - BLOCK).cast_signed();
        ((cell[axis] * CELL).cast_signed() - aside).clamp(0, last)
    });
    let mut best = (u32::MAX, own);
    for step in steps.into_iter().chain([[0; 2]]) {
        let whole = step.map(|d| i32::from(d + PER_PX / 2).div_euclid(i32::from(PER_PX)));
        let from = [at[0] - whole[0], at[1] - whole[1]];
        if !then.has_block(from) {
            continue;
        }
        let cost = sad(now, at, then, from);
        if cost < best.0 {
            best = (cost, step);
        }
    }
    best.1
}
