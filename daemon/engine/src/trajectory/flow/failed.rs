//! Where a key's own motion does not explain its picture, and flow does.
//!
//! A block of the key is looked at by the motion of the cells at its centre and near its corners
//! first: most are explained by one of them. What is not is doubted. Every other row of blocks is
//! looked at in turn, and what lies near blocks that were doubted in the key before; all of them
//! where nothing is known of that. Where one was,
//! a doubted block is looked at pixel by pixel ([`super::own`]), by the motion of
//! each and but for those that were hidden before, as outlines may run through it. A picture that
//! is another all of a sudden, as at a cut, so costs no search:
//!
//! ```text
//! (5) failed    where SAD(D) > NOISE + contrast / 4
//! (6) explained where SAD(F) < SAD(D) / 2 and SAD(F) < NOISE + contrast / 4    F what is found then
//! (7) kept      where F is that of two blocks beside it, to a pixel
//! ```
//!
//! with SAD less the mean difference, so that light may change.
//!
//! What is left out is nothing that moves as a whole: of it nothing is said.

use std::ops::Range;

use rayon::ThreadPool;

use super::believe::NOISE;
use super::block::{contrast, sad, sad_between, sad_in_any_light};
use super::luma::Level;
use super::own::{Own, SIDE};
use super::search::Search;
use super::subpixel::{error_of, refine};
use super::{BLOCK, PER_PX, Step};
use crate::bands::for_each_chunk;
use crate::lanes::both;
use crate::plane::{Plane, Rect};
use crate::time::MonoTime;

/// How far, in blocks, what is doubted goes from key to key.
const NEAR: u32 = 2;
/// Of a block that its key's motion explains, or nothing does.
const NONE: Step = [i16::MIN; 2];

/// Flow of the blocks that a key's own motion does not explain.
#[derive(Clone, Debug, Default)]
pub struct FailedField {
    /// Empty where there are none.
    blocks: Plane<Step>,
    valid: Rect,
}

impl FailedField {
    /// Knows of none.
    pub fn clear(&mut self) {
        self.blocks.resize(0, 0);
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.blocks.data().is_empty()
    }

    /// The flow at a place, pixels: newer minus older position. None where the key's motion
    /// explains the picture, or flow does not.
    #[must_use]
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "clamped to the picture")]
    #[expect(clippy::cast_sign_loss, reason = "clamped to the picture")]
    pub fn at(&self, [x, y]: [f32; 2]) -> Option<[f32; 2]> {
        if self.is_empty() {
            return None;
        }
        let block = |place: f32, start: u32, blocks: u32| {
            ((place + 0.5 - start as f32).max(0.0) as u32 / BLOCK).min(blocks - 1)
        };
        let column = block(x, self.valid.x, self.blocks.width());
        let row = block(y, self.valid.y, self.blocks.height());
        let step = self.blocks.row(row)[column as usize];
        (step != NONE).then(|| step.map(|d| f32::from(d) / f32::from(PER_PX)))
    }
}

/// Buffers of the search for them.
#[derive(Clone, Debug, Default)]
pub(super) struct Failing {
    /// The blocks that are doubted, and those of the key before.
    doubted: Plane<bool>,
    doubted_before: Plane<bool>,
    /// Which rows of blocks it is the turn of.
    turn: u32,
    /// Of which key `doubted` is.
    doubted_of: Option<MonoTime>,
    /// The blocks of each level that are searched, the finest first.
    wanted: Vec<Plane<bool>>,
    /// What (6) leaves.
    explained: Plane<Step>,
}

impl Failing {
    /// Which blocks of each level are to be searched, the finest first.
    pub(super) fn wanted(&self) -> &[Plane<bool>] {
        &self.wanted
    }

    /// Marks the blocks that have failed (5) in the key of content time `times[0]`, whose `own`
    /// motion points back to `times[1]`; false if none has.
    pub(super) fn mark(
        &mut self,
        pool: &ThreadPool,
        own: &Own<'_>,
        levels: [&Level; 2],
        times: [MonoTime; 2],
    ) -> bool {
        if self.wanted.is_empty() {
            self.wanted.push(Plane::default());
        }
        let [columns, rows] = levels[0].blocks();
        std::mem::swap(&mut self.doubted, &mut self.doubted_before);
        let knows_before = self.doubted_of.replace(times[0]) == Some(times[1])
            && [self.doubted_before.width(), self.doubted_before.height()] == [columns, rows];
        self.doubted.resize(columns, rows);
        self.turn ^= 1;
        let (before, turn) = (&self.doubted_before, self.turn);
        for_each_chunk(
            pool,
            self.doubted.data_mut(),
            columns as usize,
            #[inline(always)]
            |y, row| {
                let is_its_turn = !knows_before || y % 2 == turn;
                for (x, marks) in (0..).step_by(SIDE).zip(row.chunks_mut(SIDE)) {
                    if !is_its_turn && !is_near(before, x..x + SIDE as u32, y) {
                        marks.fill(false);
                        continue;
                    }
                    mark_doubted(own, levels, [x, y], marks);
                }
            },
        );
        if !knows_before {
            return false;
        }
        let (doubted, before) = (&self.doubted, &self.doubted_before);
        let marks = &mut self.wanted[0];
        marks.resize(columns, rows);
        for_each_chunk(
            pool,
            marks.data_mut(),
            columns as usize,
            #[inline(always)]
            |y, row| {
                for (x, mark) in (0..).zip(row) {
                    *mark = doubted.at(x, y)
                        && is_near(before, x..x + 1, y)
                        && has_failed(own, levels, [x, y]);
                }
            },
        );
        marks.data().contains(&true)
    }

    /// Whether a block of the key that was marked last is doubted.
    pub(super) fn doubts(&self) -> bool {
        self.doubted.data().contains(&true)
    }

    /// Marks the blocks of the coarser levels that hold marked ones.
    pub(super) fn spread(&mut self, levels: &[Level]) {
        self.wanted.resize_with(levels.len().max(self.wanted.len()), Plane::default);
        for index in 1..levels.len() {
            let (finer, coarser) = self.wanted.split_at_mut(index);
            let (finer, coarser) = (&finer[index - 1], &mut coarser[0]);
            let [columns, rows] = levels[index].blocks();
            coarser.resize(columns, rows);
            coarser.data_mut().fill(false);
            for y in 0..finer.height() {
                for (x, _) in (0..).zip(finer.row(y)).filter(|(_, mark)| **mark) {
                    coarser.row_mut((y / 2).min(rows - 1))[(x / 2).min(columns - 1) as usize] =
                        true;
                }
            }
        }
    }

    /// Keeps in `found` what of `search` explains a marked block, (6) and (7).
    pub(super) fn keep(
        &mut self,
        pool: &ThreadPool,
        own: &Own<'_>,
        levels: [&Level; 2],
        search: &Search,
        found: &mut FailedField,
    ) {
        let Self { wanted, explained, .. } = self;
        let marks = &wanted[0];
        let size = [marks.width(), marks.height()];
        explained.resize(size[0], size[1]);
        for_each_chunk(
            pool,
            explained.data_mut(),
            size[0] as usize,
            #[inline(always)]
            |y, row| {
                for ((x, step), marked) in (0..).zip(row).zip(marks.row(y)) {
                    *step = NONE;
                    if !marked {
                        continue;
                    }
                    let at = start(levels[0], [x, y]);
                    let seen = own.seen(levels, at);
                    let (flow, _) = refine(levels, at, search.found().at(x, y));
                    let error = error_of(levels, at, flow, &seen.mask);
                    if 2 * error < seen.error && error < NOISE + contrast(levels[0], at) / 4 {
                        *step = flow;
                    }
                }
            },
        );
        let explained = &*explained;
        found.valid = own.valid();
        found.blocks.resize(size[0], size[1]);
        for_each_chunk(
            pool,
            found.blocks.data_mut(),
            size[0] as usize,
            #[inline(always)]
            |y, row| {
                for (x, step) in (0..).zip(row) {
                    *step = if has_company(explained, [x, y]) { explained.at(x, y) } else { NONE };
                }
            },
        );
        if found.blocks.data().iter().all(|step| *step == NONE) {
            found.clear();
        }
    }
}

/// (7).
#[inline(always)]
fn has_company(explained: &Plane<Step>, [x, y]: [u32; 2]) -> bool {
    let own = explained.at(x, y);
    if own == NONE {
        return false;
    }
    let last = [explained.width() - 1, explained.height() - 1];
    let is_alike = |other: Step| {
        let near = PER_PX.unsigned_abs();
        other != NONE && own[0].abs_diff(other[0]) <= near && own[1].abs_diff(other[1]) <= near
    };
    let mut count = 0;
    for y in y.saturating_sub(1)..=(y + 1).min(last[1]) {
        for x in x.saturating_sub(1)..=(x + 1).min(last[0]) {
            count += u32::from(is_alike(explained.at(x, y)));
        }
    }
    // Itself and two more.
    count > 2
}

/// Whether a marked block lies around those at columns `x` of row `y`.
#[inline(always)]
fn is_near(marks: &Plane<bool>, x: Range<u32>, y: u32) -> bool {
    let columns = x.start.saturating_sub(NEAR)..(x.end + NEAR).min(marks.width());
    let mut rows = y.saturating_sub(NEAR)..(y + NEAR + 1).min(marks.height());
    rows.any(|y| marks.row(y)[columns.start as usize..columns.end as usize].contains(&true))
}

/// (5), pixel by pixel.
#[inline(always)]
fn has_failed(own: &Own<'_>, levels: [&Level; 2], block: [u32; 2]) -> bool {
    let at = start(levels[0], block);
    own.seen(levels, at).error > NOISE + contrast(levels[0], at) / 4
}

/// (5) by the motion of a few cells, of at most eight blocks from `block` on.
#[inline(always)]
fn mark_doubted(own: &Own<'_>, levels: [&Level; 2], [x, y]: [u32; 2], marks: &mut [bool]) {
    let mut at = [0; SIDE];
    for (at, x) in at.iter_mut().zip(x..) {
        *at = levels[0].start_of(x, 0);
    }
    let row = levels[0].start_of(y, 1);
    let [right, down] = own.at_centres(at, row);
    let (mut centre, mut whole) = ([[0; 2]; SIDE], [[0; 2]; SIDE]);
    for i in 0..SIDE {
        centre[i] = [(at[i] << 8) - right[i], (row << 8) - down[i]];
        whole[i] = [at[i] - ((right[i] + 128) >> 8), row - ((down[i] + 128) >> 8)];
    }
    for (i, mark) in marks.iter_mut().enumerate() {
        let at = [at[i], row];
        // Most blocks end here.
        *mark = levels[1].has_block(whole[i])
            && sad(levels[0], at, levels[1], whole[i]) > NOISE
            && is_doubted(own, levels, at, centre[i]);
    }
}

/// (5) of a block at `at` by the motion at its centre, which leads back to `centre` (Q8 pixels),
/// and by that near its corners, to whole pixels.
#[inline(always)]
fn is_doubted(own: &Own<'_>, [now, then]: [&Level; 2], at: [i32; 2], centre: [i32; 2]) -> bool {
    let most = NOISE + contrast(now, at) / 4;
    let fails = |d: [i32; 2]| {
        let from = both(|axis| at[axis] - ((d[axis] + 128) >> 8));
        then.has_block(from) && sad_in_any_light(now, at, then, from) > most
    };
    sad_between(now, at, then, centre) > most && own.near_corners(at).into_iter().all(fails)
}

fn start(level: &Level, block: [u32; 2]) -> [i32; 2] {
    [level.start_of(block[0], 0), level.start_of(block[1], 1)]
}
