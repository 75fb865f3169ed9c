//! The reference of [`super`].

use rayon::ThreadPool;

#[cfg(target_arch = "x86_64")]
use super::avx2;
use super::{CellClass, HOLE};
use crate::bands::for_each_row;
use crate::phase::Phase;
use crate::plane::Plane;
#[cfg(target_arch = "x86_64")]
use crate::simd::has_avx2;
use crate::warp::scatter::{NO_SOURCE, SourceField, source_of};

/// Largest difference of displacement in a smooth neighbourhood, Q8 pixels. Half a pixel: a
/// position that is off by less than that reads the same two pixels.
const SMOOTH_RANGE: i32 = 128;

/// (1).
pub fn resolve(
    pool: &ThreadPool,
    source: &SourceField,
    splat: &Plane<u32>,
    carried: &mut Plane<[i16; 2]>,
) {
    carried.resize(splat.width(), splat.height());
    let velocities = source.velocity.data();
    for_each_row(
        pool,
        carried,
        #[inline(always)]
        |y, row| {
            let splats = splat.row(y);
            let mut done = 0;
            #[cfg(target_arch = "x86_64")]
            if has_avx2() {
                // SAFETY: the processor has AVX2, asked for just above.
                done = unsafe { avx2::resolve(velocities, splats, row) };
            }
            for (velocity, &splat) in row.iter_mut().zip(splats).skip(done) {
                let shown = if splat == NO_SOURCE { HOLE } else { velocities[source_of(splat)] };
                *velocity = [shown.x, shown.y];
            }
        },
    );
}

/// The largest range of velocities of (2): `(range p) >> 9 <= SMOOTH_RANGE` up to it.
#[must_use]
pub fn smooth_limit(phase: Phase) -> u16 {
    let limit = (((SMOOTH_RANGE + 1) << 9) - 1) / phase.q12().max(1);
    u16::try_from(limit).unwrap_or(u16::MAX)
}

/// (2).
pub fn classify(
    pool: &ThreadPool,
    carried: &Plane<[i16; 2]>,
    phase: Phase,
    class: &mut Plane<CellClass>,
) {
    let (width, height) = (carried.width(), carried.height());
    class.resize(width, height);
    let limit = smooth_limit(phase);
    for_each_row(
        pool,
        class,
        #[inline(always)]
        |y, row| {
            let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| carried.row(y));
            for (block, classes) in row.chunks_mut(BLOCK).enumerate() {
                classify_block(&rows, block * BLOCK, limit, classes);
            }
        },
    );
}

/// Cells whose ranges are computed together.
const BLOCK: usize = 64;

/// Classes of the cells from `first` on.
#[inline(always)]
fn classify_block(rows: &[&[[i16; 2]]; 3], first: usize, limit: u16, classes: &mut [CellClass]) {
    // Smallest and largest of each column, from the one before the block to the one after it;
    // beyond the grid the column at its edge again, which changes neither.
    let (mut min, mut max) = ([[0; 2]; BLOCK + 2], [[0; 2]; BLOCK + 2]);
    let last = rows[0].len() - 1;
    let (from, to) = (first.saturating_sub(1), (first + classes.len()).min(last));
    let skipped = from + 1 - first;
    let columns = rows.map(|row| row[from..=to].as_flattened());
    let into = |ranges: &mut [[i16; 2]; BLOCK + 2], pick: fn(i16, i16) -> i16| {
        let flat = ranges[skipped..].as_flattened_mut();
        let cells = columns[0].iter().zip(columns[1]).zip(columns[2]);
        for (range, ((above, here), below)) in flat.iter_mut().zip(cells) {
            *range = pick(pick(*above, *here), *below);
        }
        if skipped > 0 {
            ranges[0] = ranges[1];
        }
        let end = to + 1 - first;
        ranges[classes.len() + 1] = ranges[end];
    };
    into(&mut min, i16::min);
    into(&mut max, i16::max);
    for (i, class) in classes.iter_mut().enumerate() {
        let agrees = |axis: usize| {
            let min = min[i][axis].min(min[i + 1][axis]).min(min[i + 2][axis]);
            let max = max[i][axis].max(max[i + 1][axis]).max(max[i + 2][axis]);
            let range = max.wrapping_sub(min).cast_unsigned();
            (min != HOLE.x) & (range <= limit)
        };
        *class = if agrees(0) & agrees(1) { CellClass::Smooth } else { CellClass::Broken };
    }
}
