//! A glance at two pictures in which nothing moves, to see whether they are the same.
//!
//! One in every [`ROWS`] rows of blocks is compared, and with each key the next ones, so that
//! what goes on over a scene at rest, as a shadow or a texture that runs, is found within so many
//! keys, and at once where it is that high. Pixels that are equal need no luma.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::ThreadPool;

use super::BLOCK;
use super::believe::NOISE;
use crate::bands::for_each_chunk;
use crate::color::{ColorPlane, Texel};
use crate::key::KeyFrame;
use crate::plane::{Plane, Rect};

/// Rows of blocks of which one is looked at.
const ROWS: u32 = 8;
/// Pixels of a row that are compared at once.
const RUN: usize = 16 * BLOCK as usize;

/// Whether no block of the rows that it is the turn of differs by more than noise. Both have the
/// same format and valid rectangle.
pub(super) fn is_same(pool: &ThreadPool, newest: &KeyFrame, older: &KeyFrame, turn: u32) -> bool {
    match (newest.compared(), older.compared()) {
        (ColorPlane::Rgba8(now), ColorPlane::Rgba8(then)) => {
            is_same_in(pool, [now, then], newest.valid, turn)
        }
        (ColorPlane::Rgb10a2(now), ColorPlane::Rgb10a2(then)) => {
            is_same_in(pool, [now, then], newest.valid, turn)
        }
        (ColorPlane::Rgba16f(now), ColorPlane::Rgba16f(then)) => {
            is_same_in(pool, [now, then], newest.valid, turn)
        }
        _ => false,
    }
}

fn is_same_in<T: Texel>(pool: &ThreadPool, planes: [&Plane<T>; 2], valid: Rect, turn: u32) -> bool {
    if valid.width < RUN as u32 && !valid.width.is_multiple_of(BLOCK) {
        return false; // Too narrow for that; a search tells.
    }
    // The last row of blocks reaches into the one before it where it is not whole.
    let Some(last) = valid.height.checked_sub(BLOCK) else { return false };
    let rows = (turn % ROWS..valid.height.div_ceil(BLOCK)).step_by(ROWS as usize);
    let mut starts: Vec<u32> = rows.map(|row| valid.y + (row * BLOCK).min(last)).collect();
    let differs = AtomicBool::new(false);
    let shared = starts.len().div_ceil(pool.current_num_threads());
    for_each_chunk(
        pool,
        &mut starts,
        shared,
        #[inline(always)]
        |_, starts| {
            for first in starts {
                if !is_same_row(planes, valid, *first) {
                    differs.store(true, Ordering::Relaxed);
                    return;
                }
            }
        },
    );
    !differs.into_inner()
}

/// Whether no block of the row of blocks from pixel row `first` on differs.
#[inline(always)]
fn is_same_row<T: Texel>(planes: [&Plane<T>; 2], valid: Rect, first: u32) -> bool {
    let columns = valid.x as usize..(valid.x + valid.width) as usize;
    columns.clone().step_by(RUN).all(|start| {
        let end = (start + RUN).min(columns.end);
        // The last block of a row reaches into the one before it where it is not whole.
        let run = end - (end - start).next_multiple_of(BLOCK as usize)..end;
        let mut sums = [0_u32; RUN / BLOCK as usize];
        for y in first..first + BLOCK {
            let [now, then] = planes.map(|plane| &plane.row(y)[run.clone()]);
            if now == then {
                continue;
            }
            let mut luma = [[0; RUN]; 2];
            T::luma8_run(now, &mut luma[0][..run.len()]);
            T::luma8_run(then, &mut luma[1][..run.len()]);
            let blocks = luma.each_ref().map(|luma| luma.as_chunks::<{ BLOCK as usize }>().0);
            for (sum, (now, then)) in sums.iter_mut().zip(blocks[0].iter().zip(blocks[1])) {
                let differences = now.iter().zip(then).map(|(now, then)| now.abs_diff(*then));
                *sum += differences.map(u32::from).sum::<u32>();
            }
        }
        sums.iter().all(|sum| *sum <= NOISE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgba8;
    use crate::testing::{hash, plane, pool};

    /// Turns at which a picture is not taken for one whose grey differs by `change`.
    fn found(change: impl Fn(u32, u32) -> u32) -> Vec<u32> {
        let (width, height) = (200, 157);
        let key = |change: &dyn Fn(u32, u32) -> u32| KeyFrame {
            valid: Rect { x: 3, y: 5, width: width - 3, height: height - 8 },
            color: ColorPlane::Rgba8(plane(width, height, |x, y| {
                Rgba8(0x01_01_01 * (hash(x, y, 0) % 200 + change(x, y)))
            })),
            ..KeyFrame::default()
        };
        let (older, newest) = (key(&|_, _| 0), key(&change));
        // However narrow: none of these may panic.
        for width in [8, 16, 17, 100, 127, 128, 129] {
            let valid = Rect { x: 0, y: 0, width, height: 16 };
            let keys = [&newest, &older].map(|key| KeyFrame { valid, ..key.clone() });
            is_same(&pool(1), &keys[0], &keys[1], 0);
        }
        (0..ROWS).filter(|turn| !is_same(&pool(2), &newest, &older, *turn)).collect()
    }

    #[test]
    fn what_changes_is_found_at_its_rows_turn_and_noise_never() {
        assert_eq!(found(|_, _| 0), []);
        assert_eq!(found(|x, y| hash(x, y, 7) % 2), [], "a step of luma here and there");
        let all: Vec<u32> = (0..ROWS).collect();
        assert_eq!(found(|_, _| 9), all);
        // One block in the row of blocks 11 of the valid rectangle, at either end of a run.
        for x in [3, 123, 131, 187] {
            let block = |at: u32, start: u32| (start..start + BLOCK).contains(&at);
            let change = |column: u32, y: u32| 9 * u32::from(block(column, x) && block(y, 5 + 88));
            assert_eq!(found(change), [11 % ROWS], "{x}");
        }
        // The lowest rows of pixels, which fill no block, and the columns at the right.
        assert_eq!(found(|_, y| 40 * u32::from(y > 152)), [149 / BLOCK % ROWS]);
        assert_eq!(found(|x, y| 40 * u32::from(x > 196 && y < 13)), [0]);
    }
}
