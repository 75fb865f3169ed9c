//! The reference of [`super`].

use std::cell::RefCell;

use foreframe_perception::tracking::tracked_share;
use rayon::ThreadPool;

use super::{DilateParams, MAX_DISPLACEMENT_PX};
use crate::bands::{for_each_chunk, for_each_row};
use crate::key::Velocity;
use crate::plane::Plane;
use crate::trajectory::steps::steps;

/// Rows that share what is known of the rows between them.
const BAND_ROWS: usize = 32;

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
    if depth.data().is_empty() {
        for_each_row(
            pool,
            velocity,
            #[inline(always)]
            |y, row| quantise_row(displacement.row(y), px_per_span, row),
        );
        return;
    }
    let width = velocity.width() as usize;
    let last = displacement.height() - 1;
    for_each_chunk(
        pool,
        velocity.data_mut(),
        BAND_ROWS * width,
        #[inline(always)]
        |band, velocities| {
            // Taken and put back, as a closure given to the thread's storage is not made for AVX2.
            let mut rows = ROWS.take();
            let first = band * BAND_ROWS as u32;
            let mut next = first.saturating_sub(1);
            for (y, velocities) in (first..).zip(velocities.chunks_mut(width)) {
                let around = [y.saturating_sub(1), y, (y + 1).min(last)];
                for y in next..=around[2] {
                    rows[y as usize % 3].update(depth.row(y), displacement.row(y), px_per_span);
                }
                next = around[2] + 1;
                dilate_row(depth.row(y), around.map(|y| &rows[y as usize % 3]), velocities);
            }
            ROWS.set(rows);
        },
    );
}

thread_local! {
    /// Row `y` is at `y % 3`. Kept from band to band.
    static ROWS: RefCell<[RowMaxima; 3]> = RefCell::default();
}

/// The nearest of each three neighbouring cells of a row.
#[derive(Debug, Default)]
struct RowMaxima {
    /// Velocity of each cell itself.
    own: Vec<Velocity>,
    /// Depth key of the nearest, the leftmost among equals.
    depth: Vec<u32>,
    /// Its velocity, as a word: what a wide register chooses between.
    word: Vec<u32>,
}

impl RowMaxima {
    #[inline(always)]
    fn update(&mut self, depth: &[u32], displacement: &[[f32; 2]], px_per_span: Option<f32>) {
        let Self { own, depth: max, word } = self;
        max.resize(depth.len(), 0);
        word.resize(depth.len(), 0);
        own.resize(depth.len(), Velocity::default());
        quantise_row(displacement, px_per_span, own);
        let last = depth.len() - 1;
        let cell = |x: usize| (depth[x], zerocopy::transmute!(own[x]));
        // Beyond the border there is nothing: depth 0 is never nearer.
        let none = (0, 0);
        for x in [0, last] {
            let left = if x > 0 { cell(x - 1) } else { none };
            let right = if x < last { cell(x + 1) } else { none };
            (max[x], word[x]) = nearest(left, cell(x), right);
        }
        let cells = max[1..].iter_mut().zip(&mut word[1..]);
        for ((max, word), (depth, own)) in cells.zip(depth.windows(3).zip(own.windows(3))) {
            let [left, here, right] = [0, 1, 2].map(|i| (depth[i], zerocopy::transmute!(own[i])));
            (*max, *word) = nearest(left, here, right);
        }
    }
}

/// The one of largest depth key, the first among equals.
#[inline(always)]
fn nearest(first: (u32, u32), second: (u32, u32), third: (u32, u32)) -> (u32, u32) {
    let nearer = |a: (u32, u32), b: (u32, u32)| {
        let takes_second = b.0 > a.0;
        (a.0.max(b.0), pick(takes_second, b.1, a.1))
    };
    nearer(nearer(first, second), third)
}

/// `if first { a } else { b }`, without the choice between two addresses that a compiler makes of
/// it: wide registers choose between values alone.
#[inline(always)]
fn pick(first: bool, a: u32, b: u32) -> u32 {
    b ^ ((a ^ b) & u32::from(first).wrapping_neg())
}

/// (1) and (2) for a row of cells with depth keys `centres`, between the row above and the one
/// below, which are the row itself at the border.
#[inline(always)]
fn dilate_row(centres: &[u32], [above, here, below]: [&RowMaxima; 3], velocities: &mut [Velocity]) {
    let length = centres.len();
    let rows = [above, here, below].map(|row| (&row.depth[..length], &row.word[..length]));
    let own: &[u32] = zerocopy::transmute_ref!(&here.own[..length]);
    let velocities = &mut velocities[..length];
    for x in 0..length {
        let cells = rows.map(|(depth, word)| (depth[x], word[x]));
        let (max, word) = nearest(cells[0], cells[1], cells[2]);
        let takes_nearest = max - centres[x] > max >> 8;
        velocities[x] = zerocopy::transmute!(pick(takes_nearest, word, own[x]));
    }
}

/// (3) and (4) for a row of cells. `px_per_span` is pixels per span of a speed of one degree per
/// second, where motion is damped.
#[inline(always)]
pub fn quantise_row(displacement: &[[f32; 2]], px_per_span: Option<f32>, row: &mut [Velocity]) {
    if px_per_span.is_some() {
        for (velocity, &displacement) in row.iter_mut().zip(displacement) {
            *velocity = quantise(displacement, px_per_span);
        }
        return;
    }
    // Without damping both parts go the same way, one after the other.
    for (row, displacement) in row.chunks_mut(BLOCK).zip(displacement.chunks(BLOCK)) {
        let mut parts = [0; 2 * BLOCK];
        for (part, &d) in parts.iter_mut().zip(displacement.as_flattened()) {
            *part = if d.abs() <= MAX_DISPLACEMENT_PX { steps(d) } else { i16::MIN };
        }
        for (velocity, [x, y]) in row.iter_mut().zip(parts.as_chunks::<2>().0) {
            let is_known = (*x != i16::MIN) & (*y != i16::MIN);
            let none = |part: i16| if is_known { part } else { i16::MIN };
            *velocity = Velocity { x: none(*x), y: none(*y) };
        }
    }
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
#[inline(always)]
fn quantise([dx, dy]: [f32; 2], px_per_span: Option<f32>) -> Velocity {
    // Written so that NaN fails it, and without a branch.
    let is_known = (dx.abs() <= MAX_DISPLACEMENT_PX) & (dy.abs() <= MAX_DISPLACEMENT_PX);
    let share = px_per_span
        .map_or(1.0, |px_per_span| tracked_share(libm::sqrtf(dx * dx + dy * dy) / px_per_span));
    let velocity = Velocity { x: steps(dx * share), y: steps(dy * share) };
    if is_known { velocity } else { Velocity::UNTRACKABLE }
}
