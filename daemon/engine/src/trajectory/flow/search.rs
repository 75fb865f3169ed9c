//! Coarse to fine: (2) and (3) of [`super`].
//!
//! The coarsest level is searched in full, every finer one around what the four coarser blocks next
//! to a block found, and around standing still. A second pass over each level lets every block take
//! what its neighbours found in the first, where that costs less.

use rayon::ThreadPool;

use super::believe::{Belief, believe};
use super::block::sad;
use super::luma::{Level, Pyramid};
use super::subpixel::refine;
use super::{BLOCK, Step};
use crate::bands::for_each_chunk;
use crate::plane::Plane;

/// Pixels of the coarsest level that it is searched for, to either side.
const REACH: i16 = 4;
/// SMOOTH of (2), steps of luma per pixel: noise of a step or two in every pixel of a block changes
/// (1) by about as much, and does not make blocks of one surface go apart.
const SMOOTH: u32 = 4;
/// Moves to a neighbouring place that costs less, at most.
const MOVES: usize = 3;

/// What is found, and buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Search {
    /// Of the level searched last, whole pixels.
    found: Plane<Step>,
    /// Of its first pass.
    first: Plane<Step>,
    coarser: Plane<Step>,
    /// Of the finest level, 1/32 pixels, with what is thought of it.
    blocks: Plane<Block>,
    is_believable: bool,
}

/// What was found of a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Block {
    pub(super) step: Step,
    pub(super) belief: Belief,
}

impl Search {
    /// Finds where every block of `now` was in `then`, which has its size, to a whole pixel.
    /// `wanted` says which blocks of each level, the finest first; the others count as still.
    pub(super) fn find(
        &mut self,
        pool: &ThreadPool,
        now: &Pyramid,
        then: &Pyramid,
        wanted: Option<&[Plane<bool>]>,
    ) {
        let levels = now.levels().iter().zip(then.levels()).enumerate().rev();
        let coarsest = now.levels().len() - 1;
        for (number, (now, then)) in levels {
            std::mem::swap(&mut self.found, &mut self.coarser);
            let Self { found, first, coarser, .. } = self;
            let level = Pair { now, then };
            let is_wanted = |[x, y]: [u32; 2]| wanted.is_none_or(|wanted| wanted[number].at(x, y));
            level.each_block(pool, first, |block| match number {
                _ if !is_wanted(block) => [0; 2],
                number if number == coarsest => level.search(block),
                _ => level.follow(block, coarser),
            });
            let first = &*first;
            level.each_block(pool, found, |block| {
                if is_wanted(block) { level.agree(block, first) } else { [0; 2] }
            });
        }
    }

    /// Takes what was found on below a pixel, and says what is to be thought of it.
    pub(super) fn believe(&mut self, pool: &ThreadPool, now: &Pyramid, then: &Pyramid) {
        let level = Pair { now: now.finest(), then: then.finest() };
        let found = &self.found;
        level.each_block(pool, &mut self.blocks, |block| {
            let at = level.start(block);
            let step = found.at(block[0], block[1]);
            let (step, error) = refine([level.now, level.then], at, step);
            let still = sad(level.now, at, level.then, at);
            believe(level.now, at, step, error, still)
        });
        self.is_believable = super::believe::is_believable(&self.blocks);
    }

    /// Of every block of the picture, whole pixels.
    pub(super) fn found(&self) -> &Plane<Step> {
        &self.found
    }

    /// Of every block of the picture.
    pub(super) fn blocks(&self) -> &Plane<Block> {
        &self.blocks
    }

    /// Whether the two pictures have enough in common.
    pub(super) fn is_believable(&self) -> bool {
        self.is_believable
    }
}

/// The same level of both keys.
#[derive(Clone, Copy)]
struct Pair<'a> {
    now: &'a Level,
    then: &'a Level,
}

/// A displacement and its cost.
#[derive(Clone, Copy)]
struct Best {
    step: Step,
    cost: u32,
}

impl Pair<'_> {
    /// Makes `plane` what `of` gives for every block.
    fn each_block<T: Copy + Default + Send>(
        &self,
        pool: &ThreadPool,
        plane: &mut Plane<T>,
        of: impl Fn([u32; 2]) -> T + Sync,
    ) {
        let [columns, rows] = self.now.blocks();
        plane.resize(columns, rows);
        // A row of blocks is work enough for a thread.
        for_each_chunk(
            pool,
            plane.data_mut(),
            columns as usize,
            #[inline(always)]
            |y, row| {
                for (x, out) in (0..).zip(row) {
                    *out = of([x, y]);
                }
            },
        );
    }

    #[inline(always)]
    fn start(&self, [x, y]: [u32; 2]) -> [i32; 2] {
        [self.now.start_of(x, 0), self.now.start_of(y, 1)]
    }

    /// Takes `step` where it costs less than the best so far, by (2) with `P` = `near`.
    #[inline(always)]
    fn consider(&self, at: [i32; 2], near: Step, step: Step, best: &mut Best) {
        let from = [at[0] - i32::from(step[0]), at[1] - i32::from(step[1])];
        if !self.then.has_block(from) {
            return;
        }
        let aside = step[0].abs_diff(near[0]) + step[1].abs_diff(near[1]);
        let price = SMOOTH * u32::from(aside);
        if price >= best.cost {
            return;
        }
        let cost = sad(self.now, at, self.then, from) + price;
        if cost < best.cost {
            *best = Best { step, cost };
        }
    }

    /// The coarsest level: everything within reach, near places first.
    #[inline(always)]
    fn search(&self, block: [u32; 2]) -> Step {
        let at = self.start(block);
        let mut best = Best { step: [0; 2], cost: u32::MAX };
        for ring in 0..=REACH {
            for y in -ring..=ring {
                for x in -ring..=ring {
                    if x.abs().max(y.abs()) == ring {
                        self.consider(at, [0; 2], [x, y], &mut best);
                    }
                }
            }
        }
        best.step
    }

    /// Around what the coarser level found here and beside.
    #[inline(always)]
    fn follow(&self, block: [u32; 2], coarser: &Plane<Step>) -> Step {
        let at = self.start(block);
        let size = [coarser.width(), coarser.height()];
        let places = [0, 1].map(|axis| {
            let own = (block[axis] / 2).min(size[axis] - 1);
            let beside =
                if block[axis].is_multiple_of(2) { own.saturating_sub(1) } else { own + 1 };
            [own, beside.min(size[axis] - 1)]
        });
        let doubled = |x: usize, y: usize| coarser.at(places[0][x], places[1][y]).map(|d| 2 * d);
        let near = doubled(0, 0);
        let mut best = Best { step: [0; 2], cost: u32::MAX };
        self.consider(at, near, near, &mut best);
        for other in [doubled(1, 0), doubled(0, 1), doubled(1, 1), [0; 2]] {
            self.consider(at, near, other, &mut best);
        }
        self.descend(at, near, MOVES, &mut best);
        best.step
    }

    /// Moves to the best of the eight places around as long as one costs less.
    #[inline(always)]
    fn descend(&self, at: [i32; 2], near: Step, moves: usize, best: &mut Best) {
        for _ in 0..moves {
            let [x, y] = best.step;
            for (dx, dy) in AROUND {
                self.consider(at, near, [x + dx, y + dy], best);
            }
            if best.step == [x, y] {
                return;
            }
        }
    }

    /// What the block or its neighbours found, whichever costs least beside the middle of them all.
    #[inline(always)]
    fn agree(&self, block: [u32; 2], first: &Plane<Step>) -> Step {
        let at = self.start(block);
        let last = [first.width() - 1, first.height() - 1];
        let [x, y] = block;
        let others = [
            [x, y],
            [x.saturating_sub(1), y],
            [(x + 1).min(last[0]), y],
            [x, y.saturating_sub(1)],
            [x, (y + 1).min(last[1])],
        ]
        .map(|[x, y]| first.at(x, y));
        let near = [median(others.map(|d| d[0])), median(others.map(|d| d[1]))];
        if others.iter().all(|other| *other == near) {
            return near;
        }
        let mut best = Best { step: others[0], cost: u32::MAX };
        self.consider(at, near, near, &mut best);
        for other in others {
            self.consider(at, near, other, &mut best);
        }
        self.consider(at, near, [0; 2], &mut best);
        self.descend(at, near, 1, &mut best);
        best.step
    }
}

/// The places around one.
const AROUND: [(i16, i16); 8] =
    [(0, -1), (-1, 0), (1, 0), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];

fn median(mut of: [i16; 5]) -> i16 {
    of.sort_unstable();
    of[2]
}

const _: () = assert!(BLOCK == 8, "a row of a block is eight bytes");
