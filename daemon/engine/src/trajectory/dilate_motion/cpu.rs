//! The reference of [`super`].

use foreframe_perception::tracking::tracked_share;
use rayon::ThreadPool;

use super::{DilateParams, MAX_DISPLACEMENT_PX};
use crate::bands::for_each_row;
use crate::key::Velocity;
use crate::plane::Plane;

/// Dilates and quantises `displacement`. `depth` has its size or is empty.
pub fn dilate_motion(
    pool: &ThreadPool,
    params: &DilateParams,
    depth: &Plane<u32>,
    displacement: &Plane<[f32; 2]>,
    velocity: &mut Plane<Velocity>,
) {
    velocity.resize(displacement.width(), displacement.height());
    #[expect(clippy::cast_possible_truncation, reason = "seconds need no more than an f32")]
    let px_per_span = params
        .pixels_per_degree
        .map(|pixels_per_degree| pixels_per_degree * params.span.as_secs_f64() as f32);
    for_each_row(
        pool,
        velocity,
        #[inline(always)]
        |y, row| {
            let cells = row.iter_mut().zip(displacement.row(y));
            // A loop of its own without damping, which has no call in it.
            if px_per_span.is_none() {
                for (velocity, &displacement) in cells {
                    *velocity = quantise(displacement, None);
                }
            } else {
                for (velocity, &displacement) in cells {
                    *velocity = quantise(displacement, px_per_span);
                }
            }
            if depth.data().is_empty() {
                return;
            }
            for_each_block(depth, y, |first, near| {
                let centres = &depth.row(y)[first as usize..][..near.len()];
                for (step, (near, centres)) in
                    near.chunks(STEP).zip(centres.chunks(STEP)).enumerate()
                {
                    if near == centres {
                        continue;
                    }
                    let first = first + (step * STEP) as u32;
                    for (x, (&near, &centre)) in (first..).zip(near.iter().zip(centres)) {
                        if near != centre {
                            let (column, row_of) = nearest_in_3x3(depth, x, y, near);
                            let nearer = displacement.at(column, row_of);
                            row[x as usize] = quantise(nearer, px_per_span);
                        }
                    }
                }
            });
        },
    );
}

/// Copies to each cell of `to` what the cell of `from` that it takes its motion from holds, (2).
/// `depth` has the size of `from` or is empty.
pub fn dilate_cells<T: Copy + Default + Send + Sync>(
    pool: &ThreadPool,
    depth: &Plane<u32>,
    from: &Plane<T>,
    to: &mut Plane<T>,
) {
    to.resize(from.width(), from.height());
    for_each_row(
        pool,
        to,
        #[inline(always)]
        |y, row| {
            row.copy_from_slice(from.row(y));
            if depth.data().is_empty() {
                return;
            }
            for_each_block(depth, y, |first, near| {
                let centres = &depth.row(y)[first as usize..][..near.len()];
                for (x, (&near, &centre)) in (first..).zip(near.iter().zip(centres)) {
                    if near != centre {
                        let (column, row_of) = nearest_in_3x3(depth, x, y, near);
                        row[x as usize] = from.at(column, row_of);
                    }
                }
            });
        },
    );
}

/// The depth keys of the surfaces that the cells of row `y` take their motion from, (2), into
/// `dilated`.
#[inline(always)]
pub fn dilate_depth_row(depth: &Plane<u32>, y: u32, dilated: &mut [u32]) {
    for_each_block(depth, y, |first, near| {
        dilated[first as usize..][..near.len()].copy_from_slice(near);
    });
}

/// Cells whose maxima are computed together.
const BLOCK: usize = 64;
/// Cells that are skipped together where none takes another's motion.
const STEP: usize = 8;

/// Calls `block(first, keys)` with the depth keys of (2) for each run of cells of row `y`.
#[inline(always)]
fn for_each_block(depth: &Plane<u32>, y: u32, mut block: impl FnMut(u32, &[u32])) {
    let (width, height) = (depth.width() as usize, depth.height());
    let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| depth.row(y));
    for first in (0..width).step_by(BLOCK) {
        let end = (first + BLOCK).min(width);
        // Largest of each column, with one more column on either side; 0 beyond the grid.
        let mut columns = [0; BLOCK + 2];
        let (from, to) = (first.saturating_sub(1), (end + 1).min(width));
        let cells = rows[0][from..to].iter().zip(&rows[1][from..to]).zip(&rows[2][from..to]);
        for (max, ((above, here), below)) in columns[from + 1 - first..].iter_mut().zip(cells) {
            *max = (*above).max(*here).max(*below);
        }
        let mut near = [0; BLOCK];
        for (i, (near, &centre)) in near.iter_mut().zip(&rows[1][first..end]).enumerate() {
            let max = columns[i].max(columns[i + 1]).max(columns[i + 2]);
            *near = if max - centre > max >> 8 { max } else { centre };
        }
        block(first as u32, &near[..end - first]);
    }
}

/// (1): the first cell in reading order of the 3x3 around (`x`, `y`) that has depth key `max`,
/// which one of them has.
fn nearest_in_3x3(depth: &Plane<u32>, x: u32, y: u32, max: u32) -> (u32, u32) {
    let columns = x.saturating_sub(1)..=(x + 1).min(depth.width() - 1);
    let mut rows = y.saturating_sub(1)..=(y + 1).min(depth.height() - 1);
    let found = rows.find_map(|row| {
        let mut columns = columns.clone();
        columns.find(|column| depth.at(*column, row) == max).map(|column| (column, row))
    });
    found.unwrap_or((x, y))
}

/// (3) and (4). `px_per_span` is pixels per span of a speed of one degree per second.
#[expect(clippy::cast_possible_truncation, reason = "at most 1023 * 32, which fits an i16")]
#[inline(always)]
fn quantise([dx, dy]: [f32; 2], px_per_span: Option<f32>) -> Velocity {
    // Written so that NaN fails it, and without a branch.
    let is_known = (dx.abs() <= MAX_DISPLACEMENT_PX) & (dy.abs() <= MAX_DISPLACEMENT_PX);
    let share = px_per_span
        .map_or(1.0, |px_per_span| tracked_share(libm::sqrtf(dx * dx + dy * dy) / px_per_span));
    let steps = |d: f32| {
        let scaled = d * share * 32.0;
        let magnitude = (scaled.abs() + 0.5) as i32;
        (if scaled < 0.0 { -magnitude } else { magnitude }) as i16
    };
    let velocity = Velocity { x: steps(dx), y: steps(dy) };
    if is_known { velocity } else { Velocity::UNTRACKABLE }
}
