//! Where the newest key's motion explains its picture no better than standing still would.
//!
//! Evidence compares motion with motion: of vectors that are wrong in the same way key after key (a
//! sign, a scale, noise) it knows nothing, nor of a cut that nobody declared. Luma does: what the
//! key shows at x, the key before has shown at x - D, if D is right. Over samples that have moved:
//!
//! ```text
//! (5) r = L(x) - L'(x - D) - m,  s = L(x) - L'(x) - m      L, L' luma of the newest key, the one before
//! (6) motion is worth it where  sum of r^2 < WORTH sum of s^2
//! ```
//!
//! with m the mean of r over the region of 8x8 samples, moved or not: a change of brightness drops
//! out. Vectors that a client gets wrong are wrong in the whole picture, while foliage and thin
//! things may fail (6) with the best of vectors. So all regions are trusted where the picture as a
//! whole passes (6); where it fails, those that pass it with the regions around them. What is not
//! trusted is held: between those two keys its motion would have been no better.
//!
//! A key whose whole picture has little in common with the one before, where it came from, whose
//! regions are not as bright as they were either, and whose motion, if there is any, fails (6), is
//! a cut that nobody declared. Noise fails the first and passes the second, a change of light the
//! other way round; where much is covered and uncovered, motion passes (6).
//!
//! Sums are integers, and do not depend on the order.

use rayon::ThreadPool;

use crate::bands::for_each_chunk;
use crate::color::{ColorPlane, Texel};
use crate::key::KeyFrame;
use crate::plane::{Plane, Rect};
use crate::trajectory::lattice::Lattice;
use crate::warp::sample::sample;

/// Samples of a region per axis.
const REGION: u32 = 8;
/// Part of the contrast of standing still that may be left. Above 1 motion would do harm; this much
/// below it, so that chance does not decide where both are alike.
const WORTH: f64 = 0.9;
/// Motion that counts, pixels: less changes luma less than its own interpolation does.
const MOVED_PX: f32 = 0.5;
/// Fewest samples that tell: the ratio of two sums over so many is good to a fifth.
const MIN_SAMPLES: i64 = 24;
/// Lattice points of which all are read; of more, every other one or every fourth, in turn.
const MANY_POINTS: u32 = 4096;
const FOUR_TIMES: u32 = 4 * MANY_POINTS;
/// How far along those that are read lie in the next row: not below each other.
const TURN_STEP: u32 = 3;
/// Correlation of a picture with the one before below which it is another: a surface that is seen
/// again has most of its contrast in common with itself, two places have what chance gives them.
const SAME: f64 = 0.3;

/// Sum and sum of squares of some differences.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Spread {
    count: i64,
    sum: i64,
    squares: i64,
}

#[expect(clippy::cast_precision_loss, reason = "sums of luma over a picture have below 2^53")]
impl Spread {
    #[inline(always)]
    fn add(&mut self, value: i64) {
        self.count += 1;
        self.sum += value;
        self.squares += value * value;
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum += other.sum;
        self.squares += other.squares;
    }

    fn mean(&self) -> f64 {
        self.sum as f64 / self.count.max(1) as f64
    }

    fn squares_about(&self, m: f64) -> f64 {
        self.squares as f64 - 2.0 * m * self.sum as f64 + m * m * self.count as f64
    }

    fn variance(&self) -> f64 {
        (self.squares_about(self.mean()) / self.count.max(1) as f64).max(0.0)
    }
}

/// What the samples of a region say, (5) without m.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Sums {
    /// r and s where something has moved.
    moved: Spread,
    still: Spread,
    /// r everywhere, and luma of the newest key and of where it came from.
    residual: Spread,
    luma: [Spread; 2],
}

/// Sums of r^2 and s^2, and of how many.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Worth {
    count: i64,
    moved: f64,
    still: f64,
}

impl Worth {
    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.moved += other.moved;
        self.still += other.still;
    }

    /// (6), by enough samples.
    fn is_proven(&self) -> bool {
        self.count >= MIN_SAMPLES && self.moved < WORTH * self.still
    }

    /// (6). Where little has moved, or all is flat, nothing speaks against motion.
    fn is_given(&self) -> bool {
        let is_flat = self.moved <= 0.0 && self.still <= 0.0;
        self.count < MIN_SAMPLES || is_flat || self.is_proven()
    }
}

impl Sums {
    fn merge(&mut self, other: &Self) {
        self.moved.merge(&other.moved);
        self.still.merge(&other.still);
        self.residual.merge(&other.residual);
        self.luma[0].merge(&other.luma[0]);
        self.luma[1].merge(&other.luma[1]);
    }

    /// With m taken off.
    fn worth(&self) -> Worth {
        let m = self.residual.mean();
        let (moved, still) = (self.moved.squares_about(m), self.still.squares_about(m));
        Worth { count: self.moved.count, moved, still }
    }

    /// Correlation of luma with what it was where it came from, by the variance of their
    /// difference.
    fn correlation(&self) -> f64 {
        let [now, then] = [self.luma[0].variance(), self.luma[1].variance()];
        if now + then <= 0.0 { 1.0 } else { 1.0 - self.residual.variance() / (now + then) }
    }
}

/// Where motion is trusted, by region.
#[derive(Clone, Debug, Default)]
pub(super) struct Trust {
    sums: Plane<Sums>,
    /// Whether each region is trusted.
    is_trusted: Plane<bool>,
    is_cut: bool,
}

impl Trust {
    /// Looks at what the motion of `key`, whose field is that of `lattice`, makes of `older`, which
    /// it points back to. `turn` says which of the samples are read, where not all are.
    pub(super) fn update(
        &mut self,
        pool: &ThreadPool,
        key: &KeyFrame,
        lattice: &Lattice,
        older: &KeyFrame,
        turn: u32,
    ) {
        let [columns, rows] = lattice.points().map(|points| points.div_ceil(REGION));
        self.is_trusted.resize(columns, rows);
        self.is_trusted.data_mut().fill(true);
        self.is_cut = false;
        let is_in = |key: &KeyFrame| key.valid.fits(key.color.width(), key.color.height());
        if key.valid != older.valid || !is_in(key) || !is_in(older) {
            return;
        }
        self.sums.resize(columns, rows);
        match (key.compared(), older.compared()) {
            (ColorPlane::Rgba8(now), ColorPlane::Rgba8(then)) => {
                self.sum(pool, [now, then], key.valid, lattice, turn);
            }
            (ColorPlane::Rgb10a2(now), ColorPlane::Rgb10a2(then)) => {
                self.sum(pool, [now, then], key.valid, lattice, turn);
            }
            (ColorPlane::Rgba16f(now), ColorPlane::Rgba16f(then)) => {
                self.sum(pool, [now, then], key.valid, lattice, turn);
            }
            _ => return,
        }
        let mut all = Worth::default();
        self.sums.data().iter().for_each(|sums| all.merge(&sums.worth()));
        self.is_cut = !all.is_proven() && self.shows_another_place();
        if all.is_given() {
            return;
        }
        for row in 0..rows {
            for column in 0..columns {
                let mut around = Worth::default();
                for y in row.saturating_sub(1)..(row + 2).min(rows) {
                    for x in column.saturating_sub(1)..(column + 2).min(columns) {
                        around.merge(&self.sums.at(x, y).worth());
                    }
                }
                self.is_trusted.row_mut(row)[column as usize] = around.is_given();
            }
        }
    }

    /// Whether neither the picture nor its regions have anything in common with the one before.
    fn shows_another_place(&self) -> bool {
        let (mut all, mut regions) = (Sums::default(), Sums::default());
        for sums in self.sums.data() {
            all.merge(sums);
            let [now, then] = sums.luma.map(|luma| luma.sum / luma.count.max(1));
            regions.residual.add(now - then);
            regions.luma[0].add(now);
            regions.luma[1].add(then);
        }
        all.residual.count >= MIN_SAMPLES
            && all.correlation() < SAME
            && regions.correlation() < SAME
    }

    /// Whether the newest key shows another place than the one before.
    pub(super) fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Trusts everything.
    pub(super) fn clear(&mut self) {
        self.is_cut = false;
        self.is_trusted.resize(0, 0);
    }

    /// Whether some region is not trusted.
    pub(super) fn doubts(&self) -> bool {
        self.is_trusted.data().contains(&false)
    }

    /// Whether the motion of a sample is trusted.
    pub(super) fn of(&self, column: u32, row: u32) -> bool {
        let (column, row) = (column / REGION, row / REGION);
        column >= self.is_trusted.width()
            || row >= self.is_trusted.height()
            || self.is_trusted.at(column, row)
    }

    fn sum<T: Texel>(
        &mut self,
        pool: &ThreadPool,
        planes: [&Plane<T>; 2],
        valid: Rect,
        lattice: &Lattice,
        turn: u32,
    ) {
        let [columns, rows] = lattice.points();
        let step = Step { planes, valid, lattice };
        let every = match columns * rows {
            ..MANY_POINTS => 1,
            MANY_POINTS..FOUR_TIMES => 2,
            _ => 4,
        };
        for_each_region_row(pool, &mut self.sums, |row, sums| {
            sums.fill(Sums::default());
            for y in row * REGION..((row + 1) * REGION).min(rows) {
                for x in ((TURN_STEP * y + turn) % every..columns).step_by(every as usize) {
                    step.take_in(x, y, &mut sums[(x / REGION) as usize]);
                }
            }
        });
    }
}

/// Two pictures and the motion from the older to the newer.
struct Step<'a, T> {
    planes: [&'a Plane<T>; 2],
    valid: Rect,
    lattice: &'a Lattice,
}

impl<T: Texel> Step<'_, T> {
    /// (5) at a sample.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "positions in the picture, in Q8")]
    #[expect(clippy::cast_sign_loss, reason = "clamped to the picture")]
    fn take_in(&self, column: u32, row: u32, sums: &mut Sums) {
        let ([dx, dy], _) = self.lattice.at(column, row);
        let [x, y] = self.lattice.place(column, row);
        let [now, then] = self.planes;
        let pixel = |place: f32, start: u32, length: u32| {
            (place as i64 as u32).clamp(start, start + length - 1)
        };
        let Rect { x: left, y: top, width, height } = self.valid;
        let (x, y) = (pixel(x, left, width), pixel(y, top, height));
        let shown = i64::from(now.at(x, y).luma());
        let stood = i64::from(then.at(x, y).luma());
        let (from_x, from_y) = (x as f32 - dx, y as f32 - dy);
        let is_inside = (left as f32..=(left + width - 1) as f32).contains(&from_x)
            && (top as f32..=(top + height - 1) as f32).contains(&from_y);
        let mut was = stood;
        // Written so that NaN fails it.
        if is_inside && dx.abs().max(dy.abs()) >= MOVED_PX {
            let (from_x, from_y) = ((from_x * 256.0) as i32, (from_y * 256.0) as i32);
            was = i64::from(sample(then, self.valid, from_x, from_y).luma());
            sums.moved.add(shown - was);
            sums.still.add(shown - stood);
        }
        sums.residual.add(shown - was);
        sums.luma[0].add(shown);
        sums.luma[1].add(was);
    }
}

/// Calls `row(y, sums)` for every row of regions: each is work enough for a thread to wake up for.
fn for_each_region_row(
    pool: &ThreadPool,
    sums: &mut Plane<Sums>,
    row: impl Fn(u32, &mut [Sums]) + Sync,
) {
    let width = sums.width() as usize;
    for_each_chunk(
        pool,
        sums.data_mut(),
        width,
        #[inline(always)]
        |y, sums| row(y, sums),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Rgba8;
    use crate::testing::{hash, plane, pool};
    use crate::trajectory::grid::Grid;

    const SIZE: [u32; 2] = [192, 96];

    /// Blocks of noise of two sizes, about `base` bright.
    fn texture(x: i32, y: i32, seed: u32, base: u32) -> u32 {
        let at = |size: i32, range: u32| {
            let (x, y) = (x.div_euclid(size), y.div_euclid(size));
            hash(x.cast_unsigned(), y.cast_unsigned(), seed) % range
        };
        base + at(3, 40) + at(40, 60)
    }

    /// A picture that `shows` levels of grey, with the vectors `d`.
    fn key(d: [f32; 2], shows: impl Fn(i32, i32) -> u32) -> KeyFrame {
        let [width, height] = SIZE;
        KeyFrame {
            valid: Rect::full(width, height),
            color: ColorPlane::Rgba8(plane(width, height, |x, y| {
                Rgba8(0x01_01_01 * shows(x.cast_signed(), y.cast_signed()))
            })),
            displacement: plane(width, height, |_, _| d),
            ..KeyFrame::default()
        }
    }

    fn trust(older: &KeyFrame, newest: &KeyFrame) -> Trust {
        let (mut lattice, mut trust) = (Lattice::default(), Trust::default());
        lattice.update(&pool(2), newest, &Grid::of(newest));
        trust.update(&pool(2), newest, &lattice, older, 0);
        trust
    }

    #[test]
    fn right_vectors_are_trusted_and_wrong_ones_are_not() {
        let older = key([7.0, 2.0], |x, y| texture(x, y, 1, 20));
        let shows = |x: i32, y: i32| texture(x - 7, y - 2, 1, 20);
        assert!(!trust(&older, &key([7.0, 2.0], shows)).doubts());
        for wrong in [[-7.0, 2.0], [-7.0, -2.0], [28.0, 8.0]] {
            let trust = trust(&older, &key(wrong, shows));
            let regions = trust.is_trusted.data();
            let held = regions.iter().filter(|is_trusted| !**is_trusted).count();
            assert!(trust.doubts() && 2 * held > regions.len(), "{wrong:?}: {regions:?}");
            assert!(!trust.is_cut(), "{wrong:?}");
        }
    }

    #[test]
    fn light_that_changes_does_not_make_vectors_wrong() {
        let older = key([7.0, 2.0], |x, y| texture(x, y, 1, 20));
        let brighter = key([7.0, 2.0], |x, y| texture(x - 7, y - 2, 1, 120));
        let trust = trust(&older, &brighter);
        assert!(!trust.doubts() && !trust.is_cut());
    }

    #[test]
    fn another_place_is_a_cut_and_a_fast_pan_is_none() {
        let older = key([0.0; 2], |x, y| texture(x, y, 1, 20));
        for d in [[0.0; 2], [5.0, 1.0]] {
            assert!(trust(&older, &key(d, |x, y| texture(x, y, 9, 20))).is_cut(), "{d:?}");
        }
        // Bars before a wall: whatever shows the wall has shown a bar before.
        let bars = |at: i32| {
            move |x: i32, y: i32| {
                if (x - at).rem_euclid(6) < 3 { 255 } else { texture(x, y, 1, 20) / 4 }
            }
        };
        let mut moved = key([0.0; 2], bars(3));
        moved.displacement =
            plane(SIZE[0], SIZE[1], |x, _| if (x + 3) % 6 < 3 { [3.0, 0.0] } else { [0.0; 2] });
        assert!(!trust(&key([0.0; 2], bars(0)), &moved).is_cut());
        let pan = key([30.0, 0.0], |x, y| texture(x - 30, y, 1, 20));
        assert!(!trust(&older, &pan).is_cut());
        assert!(!trust(&older, &key([0.0; 2], |x, y| texture(x, y, 1, 20))).is_cut());
    }
}
