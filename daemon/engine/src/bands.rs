//! Shares rows among threads. Which thread makes a row never changes what is in it.
//!
//! Rows are made with the widest registers there are ([`crate::simd`]): mark the closures
//! `#[inline(always)]`.

use rayon::ThreadPool;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use crate::plane::Plane;
use crate::simd::widest;

/// Rows that one piece of work has at least: waking a thread for fewer costs more than it saves.
const MIN_ROWS: usize = 8;

/// Calls `row(y, pixels)` for every row of `plane`.
pub fn for_each_row<T: Send>(
    pool: &ThreadPool,
    plane: &mut Plane<T>,
    row: impl Fn(u32, &mut [T]) + Sync,
) {
    let width = plane.width() as usize;
    for_each_chunk(
        pool,
        plane.data_mut(),
        MIN_ROWS * width,
        #[inline(always)]
        |chunk, rows| {
            for (y, pixels) in (chunk * MIN_ROWS as u32..).zip(rows.chunks_mut(width)) {
                row(y, pixels);
            }
        },
    );
}

/// Calls `chunk(i, part)` for every `i`-th run of `length` elements of `data`, which is enough for
/// a thread to wake up for.
#[expect(clippy::cast_possible_truncation, reason = "planes have at most 8192 rows")]
pub fn for_each_chunk<T: Send>(
    pool: &ThreadPool,
    data: &mut [T],
    length: usize,
    chunk: impl Fn(u32, &mut [T]) + Sync,
) {
    if length == 0 {
        return;
    }
    let chunk = |(i, part): (usize, &mut [T])| {
        widest(
            #[inline(always)]
            || chunk(i as u32, part),
        );
    };
    if pool.current_num_threads() == 1 || data.len() <= length {
        data.chunks_mut(length).enumerate().for_each(chunk);
    } else {
        pool.install(|| data.par_chunks_mut(length).enumerate().for_each(chunk));
    }
}

/// Calls `row(y, row of a, row of b)` for every row of two planes of the same height.
#[expect(clippy::cast_possible_truncation, reason = "planes have at most 8192 rows")]
pub fn for_each_row_of_two<A: Send, B: Send>(
    pool: &ThreadPool,
    a: &mut Plane<A>,
    b: &mut Plane<B>,
    row: impl Fn(u32, &mut [A], &mut [B]) + Sync,
) {
    let lengths = [a.width() as usize, b.width() as usize];
    if lengths.contains(&0) {
        return;
    }
    pool.install(|| {
        let a = a.data_mut().par_chunks_mut(lengths[0]);
        let rows = a.zip(b.data_mut().par_chunks_mut(lengths[1]));
        rows.enumerate().with_min_len(MIN_ROWS).for_each(|(y, (a, b))| {
            widest(
                #[inline(always)]
                || row(y as u32, a, b),
            );
        });
    });
}

/// Calls `band(first_row, rows of a, rows of b)` for every run of `rows` rows of two planes of the
/// same width.
#[expect(clippy::cast_possible_truncation, reason = "planes have at most 8192 rows")]
pub fn for_each_band<A: Send, B: Send>(
    pool: &ThreadPool,
    a: &mut Plane<A>,
    b: &mut Plane<B>,
    rows: usize,
    band: impl Fn(u32, &mut [A], &mut [B]) + Sync,
) {
    let length = rows * a.width() as usize;
    if length == 0 {
        return;
    }
    pool.install(|| {
        let parts = a.data_mut().par_chunks_mut(length).zip(b.data_mut().par_chunks_mut(length));
        parts.enumerate().for_each(|(i, (a, b))| {
            widest(
                #[inline(always)]
                || band((i * rows) as u32, a, b),
            );
        });
    });
}
