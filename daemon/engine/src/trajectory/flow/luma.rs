//! Luma of a key in 8 bits, at full size and halved again and again.

use rayon::ThreadPool;

use super::BLOCK;
use crate::bands::for_each_row;
use crate::color::{ColorPlane, Texel};
use crate::key::KeyFrame;
use crate::plane::{Plane, Rect};

/// Pixels around a level that repeat its border: blocks may reach that far beyond it.
pub(super) const MARGIN: u32 = 2 * BLOCK;
/// Times that the picture is halved at most: motion of 256 pixels is within reach of the coarsest.
const HALVINGS: usize = 6;

/// Luma of one size, with its margin.
#[derive(Clone, Debug, Default)]
pub(super) struct Level {
    plane: Plane<u8>,
    size: [u32; 2],
}

impl Level {
    /// Columns and rows.
    pub(super) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Columns and rows of blocks that cover it.
    pub(super) fn blocks(&self) -> [u32; 2] {
        self.size.map(|length| length.div_ceil(BLOCK))
    }

    /// The first pixel of a block along an axis: the last one ends with the picture.
    #[inline(always)]
    pub(super) fn start_of(&self, block: u32, axis: usize) -> i32 {
        (block * BLOCK).min(self.size[axis] - BLOCK).cast_signed()
    }

    /// Whether a block from (`x`, `y`) on, and one pixel around it, lies within the margin, and
    /// half of it or more in the picture.
    #[inline(always)]
    pub(super) fn has_block(&self, [x, y]: [i32; 2]) -> bool {
        let half = (BLOCK / 2).cast_signed();
        let is_in = |at: i32, length: u32| (-half..=length.cast_signed() - half).contains(&at);
        is_in(x, self.size[0]) && is_in(y, self.size[1])
    }

    /// `N` pixels from (`x`, `y`) on, which lie within the margin.
    #[inline(always)]
    pub(super) fn run<const N: usize>(&self, x: i32, y: i32) -> &[u8; N] {
        let margin = MARGIN.cast_signed();
        let (x, y) = ((x + margin).cast_unsigned() as usize, (y + margin).cast_unsigned());
        self.plane.row(y)[x..].first_chunk().expect("blocks stay within the margin")
    }

    /// The rows of a block from (`x`, `y`) on, which lie within the margin.
    #[inline(always)]
    pub(super) fn block(&self, [x, y]: [i32; 2]) -> impl Iterator<Item = &[u8; BLOCK as usize]> {
        let rows = self.plane.data()[self.index(x, y)..].chunks(self.plane.width() as usize);
        rows.take(BLOCK as usize).map(|row| row.first_chunk().expect("a margin is that wide"))
    }

    /// Where (`x`, `y`) lies among all pixels.
    #[inline(always)]
    fn index(&self, x: i32, y: i32) -> usize {
        let margin = MARGIN.cast_signed();
        let (x, y) = ((x + margin).cast_unsigned(), (y + margin).cast_unsigned());
        y as usize * self.plane.width() as usize + x as usize
    }

    /// Luma in sixteenths at a place in Q8 pixels, between four; None outside the picture.
    #[inline(always)]
    pub(super) fn sample(&self, [x, y]: [i32; 2]) -> Option<i32> {
        let (column, row) = (x >> 8, y >> 8);
        if column.cast_unsigned() >= self.size[0] || row.cast_unsigned() >= self.size[1] {
            return None;
        }
        let (fx, fy) = (x & 0xff, y & 0xff);
        let start = self.index(column, row);
        let across = |start: usize| {
            let [left, right] = *self.plane.data()[start..].first_chunk()?;
            Some(i32::from(left) * (256 - fx) + i32::from(right) * fx)
        };
        let (upper, lower) = (across(start)?, across(start + self.plane.width() as usize)?);
        Some(((upper >> 4) * (256 - fy) + (lower >> 4) * fy) >> 8)
    }

    fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        self.plane.resize(size[0] + 2 * MARGIN, size[1] + 2 * MARGIN);
    }

    /// Writes every row; `pixels(y, row)` those of the picture itself.
    fn write(&mut self, pool: &ThreadPool, pixels: impl Fn(u32, &mut [u8]) + Sync) {
        let [width, height] = self.size.map(|length| length as usize);
        let margin = MARGIN as usize;
        for_each_row(
            pool,
            &mut self.plane,
            #[inline(always)]
            |y, row| {
                let y = (y as usize).saturating_sub(margin).min(height - 1);
                pixels(y as u32, &mut row[margin..margin + width]);
                let (first, last) = (row[margin], row[margin + width - 1]);
                row[..margin].fill(first);
                row[margin + width..].fill(last);
            },
        );
    }

    fn take<T: Texel>(&mut self, pool: &ThreadPool, color: &Plane<T>, valid: Rect) {
        self.resize([valid.width, valid.height]);
        self.write(
            pool,
            #[inline(always)]
            |y, row| {
                let texels = &color.row(valid.y + y)[valid.x as usize..];
                T::luma8_run(&texels[..row.len()], row);
            },
        );
    }

    /// Half as large, each pixel the mean of four.
    fn halve(&mut self, pool: &ThreadPool, finer: &Self) {
        self.resize(finer.size.map(|length| length / 2));
        let margin = MARGIN as usize;
        self.write(
            pool,
            #[inline(always)]
            |y, row| {
                let rows = [0, 1].map(|below| &finer.plane.row(2 * y + below + MARGIN)[margin..]);
                let (upper, lower) = (rows[0].as_chunks::<2>().0, rows[1].as_chunks::<2>().0);
                for (luma, (upper, lower)) in row.iter_mut().zip(upper.iter().zip(lower)) {
                    let sum = upper.iter().chain(lower).map(|luma| u16::from(*luma)).sum::<u16>();
                    *luma = ((sum + 2) >> 2) as u8;
                }
            },
        );
    }
}

/// All sizes of one key, the finest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Pyramid {
    levels: Vec<Level>,
    count: usize,
}

impl Pyramid {
    /// Makes the finest of these that of `key`, whose valid rectangle is at least two blocks in
    /// size.
    pub(super) fn update(&mut self, pool: &ThreadPool, key: &KeyFrame) {
        self.levels.resize_with(HALVINGS + 1, Level::default);
        let finest = &mut self.levels[0];
        match key.compared() {
            ColorPlane::Rgba8(color) => finest.take(pool, color, key.valid),
            ColorPlane::Rgb10a2(color) => finest.take(pool, color, key.valid),
            ColorPlane::Rgba16f(color) => finest.take(pool, color, key.valid),
        }
        self.count = 1;
    }

    /// Makes the others, if they are not there yet.
    pub(super) fn complete(&mut self, pool: &ThreadPool) {
        if self.count > 1 {
            return;
        }
        for index in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(index);
            let finer = &finer[index - 1];
            if finer.size.iter().any(|length| length / 2 < 2 * BLOCK) {
                break;
            }
            coarser[0].halve(pool, finer);
            self.count += 1;
        }
    }

    /// The levels that were made, the finest first.
    pub(super) fn levels(&self) -> &[Level] {
        &self.levels[..self.count]
    }

    /// The picture itself.
    pub(super) fn finest(&self) -> &Level {
        &self.levels[0]
    }
}
