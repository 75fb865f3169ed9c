//! What is left of a picture that is made smaller and larger again.
//!
//! Per channel, beyond a border the pixel at the border again, W x H the full size and w x h the
//! reduced one:
//!
//! ```text
//! (1) R(i, j) = mean of the picture over columns i W / w .. (i + 1) W / w, rows alike
//! (2) G       = [1 2 1] x [1 2 1] / 16, n times: variance n / 2 per axis, reduced pixels^2
//! (3) n       = 2 (6.25 r^2 - 1/12), r^2 = w h / (W H): of the whole 2.5 pixels, less R's own
//! (4) U       = bilinear, pixel edges on pixel edges
//! ```
//!
//! A full picture becomes U G R, a reduced one U G, so that both lose the same where the
//! application renders what R would have made. 2.5 pixels is what Denes 2020, section 5.2.3, uses;
//! there the application filters. Channels have 16 bits on the way, levels to the left, each step
//! rounded to the nearest.

use std::cell::RefCell;

use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::color::{OrderedRgba16, Rgb10a2, Rgba8, Texel};
use crate::plane::{Plane, Rect};

/// Red, green, blue, alpha, in 16 bits.
type Wide = [u16; 4];

/// How many of 16 bits are behind the levels of a format.
pub(super) trait Fraction {
    const BITS: u32;
}

impl Fraction for Rgba8 {
    const BITS: u32 = 8;
}

impl Fraction for Rgb10a2 {
    const BITS: u32 = 6;
}

impl Fraction for OrderedRgba16 {
    const BITS: u32 = 0;
}

/// Buffers of the steps, kept from key to key.
#[derive(Debug, Default)]
pub(super) struct LowPass {
    small: Plane<Wide>,
    other: Plane<Wide>,
    axes: [Axis; 2],
    /// Of each column of the full size: [`between`].
    columns: Vec<(u32, u32, u32)>,
}

impl LowPass {
    /// U G R of `full`, by way of `size` (columns, rows), into `to`.
    pub(super) fn of_full<T: Texel + Fraction>(
        &mut self,
        pool: &ThreadPool,
        full: &Plane<T>,
        size: [u32; 2],
        to: &mut Plane<T>,
    ) {
        to.resize(full.width(), full.height());
        self.small.resize(size[0], size[1]);
        self.axes[0].update(size[0], full.width());
        self.axes[1].update(size[1], full.height());
        reduce(pool, full, &self.axes, &mut self.small);
        self.finish(pool, to);
    }

    /// U G of the part `valid` of `reduced` into `to`, which has its size.
    pub(super) fn of_reduced<T: Texel + Fraction>(
        &mut self,
        pool: &ThreadPool,
        reduced: &Plane<T>,
        valid: Rect,
        to: &mut Plane<T>,
    ) {
        self.small.resize(valid.width, valid.height);
        for_each_row(
            pool,
            &mut self.small,
            #[inline(always)]
            |y, row| {
                let texels = &reduced.row(valid.y + y)[valid.x as usize..];
                for (wide, texel) in row.iter_mut().zip(texels) {
                    let channels = texel.channels();
                    for (wide, level) in wide.iter_mut().zip(channels) {
                        *wide = level << T::BITS;
                    }
                }
            },
        );
        self.finish(pool, to);
    }

    /// (2) as often as (3) says, then (4).
    fn finish<T: Texel + Fraction>(&mut self, pool: &ThreadPool, to: &mut Plane<T>) {
        for _ in 0..passes([self.small.width(), self.small.height()], [to.width(), to.height()]) {
            self.other.resize(self.small.width(), self.small.height());
            smooth(pool, &self.small, &mut self.other);
            std::mem::swap(&mut self.small, &mut self.other);
        }
        let (width, small) = (to.width(), self.small.width());
        self.columns.clear();
        self.columns.extend((0..width).map(|x| between(x, width, small)));
        enlarge(pool, &self.small, &self.columns, to);
    }
}

/// (3).
fn passes(small: [u32; 2], full: [u32; 2]) -> u32 {
    let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    let wanted = 2.0 * (6.25 * area(small) / area(full) - 1.0 / 12.0);
    wanted.round().max(0.0) as u32
}

/// Where the pixels of a reduced axis come from on a full one.
#[derive(Debug, Default)]
struct Axis {
    /// Of each: the first pixel, and where its weights begin.
    parts: Vec<(u32, u32)>,
    /// Q8, adding up to 256 for each reduced pixel; and where the last ones end.
    weights: Vec<u32>,
}

impl Axis {
    fn update(&mut self, small: u32, full: u32) {
        let edge = |index: u32| u64::from(index) * u64::from(full) * 256 / u64::from(small);
        self.parts.clear();
        self.weights.clear();
        for index in 0..small {
            let (from, to) = (edge(index), edge(index + 1));
            self.parts.push(((from >> 8) as u32, self.weights.len() as u32));
            // Of the part up to a pixel's end, so that what rounding drops comes back further on.
            let (mut at, mut done) = (from, 0);
            while at < to {
                at = (((at >> 8) + 1) << 8).min(to);
                let up_to = (256 * (at - from) / (to - from)) as u32;
                self.weights.push(up_to - done);
                done = up_to;
            }
        }
        self.parts.push((full, self.weights.len() as u32));
    }

    /// The first pixel of reduced pixel `index`, and the weights of it and those behind it.
    #[inline(always)]
    fn of(&self, index: usize) -> (u32, &[u32]) {
        let (first, start) = self.parts[index];
        (first, &self.weights[start as usize..self.parts[index + 1].1 as usize])
    }
}

/// Calls `work` with a row of the thread, kept from row to row, whatever it holds.
#[inline(always)]
fn with_sums(work: impl FnOnce(&mut Vec<[u32; 4]>)) {
    thread_local! {
        static SUMS: RefCell<Vec<[u32; 4]>> = const { RefCell::new(Vec::new()) };
    }
    let mut sums = SUMS.take();
    work(&mut sums);
    SUMS.set(sums);
}

/// (1).
fn reduce<T: Texel + Fraction>(
    pool: &ThreadPool,
    full: &Plane<T>,
    axes: &[Axis; 2],
    small: &mut Plane<Wide>,
) {
    let shift = 16 - T::BITS;
    for_each_row(
        pool,
        small,
        #[inline(always)]
        |y, row| {
            with_sums(
                #[inline(always)]
                |sums| {
                    sums.clear();
                    sums.resize(full.width() as usize, [0; 4]);
                    let (first, weights) = axes[1].of(y as usize);
                    // 16 bits twice weighed with 8: the sum and a rounding fit 32.
                    for (line, weight) in (first..).zip(weights) {
                        for (sum, texel) in sums.iter_mut().zip(full.row(line)) {
                            let channels = texel.channels();
                            for (sum, level) in sum.iter_mut().zip(channels) {
                                *sum += u32::from(level) * weight;
                            }
                        }
                    }
                    for (x, wide) in row.iter_mut().enumerate() {
                        let (first, weights) = axes[0].of(x);
                        let mut sum = [1 << (shift - 1); 4];
                        for (part, weight) in sums[first as usize..].iter().zip(weights) {
                            for (sum, part) in sum.iter_mut().zip(part) {
                                *sum += part * weight;
                            }
                        }
                        for (wide, sum) in wide.iter_mut().zip(sum) {
                            *wide = (sum >> shift) as u16;
                        }
                    }
                },
            );
        },
    );
}

/// (2), once.
fn smooth(pool: &ThreadPool, from: &Plane<Wide>, to: &mut Plane<Wide>) {
    let last = from.height() - 1;
    for_each_row(
        pool,
        to,
        #[inline(always)]
        |y, row| {
            let (above, here) = (from.row(y.saturating_sub(1)), from.row(y));
            let below = from.row((y + 1).min(last));
            let column = |x: usize| {
                let mut sum = [0_u32; 4];
                for (channel, sum) in sum.iter_mut().enumerate() {
                    let [above, here, below] =
                        [above, here, below].map(|row| u32::from(row[x][channel]));
                    *sum = above + 2 * here + below;
                }
                sum
            };
            let (mut before, mut now) = (column(0), column(0));
            for x in 0..row.len() {
                let after = column((x + 1).min(row.len() - 1));
                for channel in 0..4 {
                    let sum = before[channel] + 2 * now[channel] + after[channel];
                    row[x][channel] = ((sum + 8) >> 4) as u16;
                }
                (before, now) = (now, after);
            }
        },
    );
}

/// The two pixels along an axis of `small` that pixel `index` of `full` lies between, and how far
/// it is from the first to the second, Q8.
fn between(index: u32, full: u32, small: u32) -> (u32, u32, u32) {
    let centre = u64::from(2 * index + 1) * 256 * u64::from(small) / (2 * u64::from(full));
    let place = (centre as u32).saturating_sub(128).min((small - 1) << 8);
    let first = place >> 8;
    (first, (first + 1).min(small - 1), place & 0xff)
}

/// (4).
fn enlarge<T: Texel + Fraction>(
    pool: &ThreadPool,
    small: &Plane<Wide>,
    columns: &[(u32, u32, u32)],
    to: &mut Plane<T>,
) {
    let height = to.height();
    for_each_row(
        pool,
        to,
        #[inline(always)]
        |y, row| {
            let (upper, lower, part) = between(y, height, small.height());
            let (upper, lower) = (small.row(upper), small.row(lower));
            with_sums(
                #[inline(always)]
                |mixed| {
                    mixed.resize(upper.len(), [0; 4]);
                    for (mixed, (upper, lower)) in mixed.iter_mut().zip(upper.iter().zip(lower)) {
                        for channel in 0..4 {
                            let sum = u32::from(upper[channel]) * (256 - part)
                                + u32::from(lower[channel]) * part;
                            mixed[channel] = (sum + 128) >> 8;
                        }
                    }
                    for (texel, (left, right, part)) in row.iter_mut().zip(columns) {
                        let (left, right) = (&mixed[*left as usize], &mixed[*right as usize]);
                        let mut channels = [0; 4];
                        for channel in 0..4 {
                            let sum = left[channel] * (256 - part) + right[channel] * part;
                            channels[channel] =
                                ((sum + (1 << (7 + T::BITS))) >> (8 + T::BITS)) as u16;
                        }
                        *texel = T::of_channels(channels);
                    }
                },
            );
        },
    );
}
