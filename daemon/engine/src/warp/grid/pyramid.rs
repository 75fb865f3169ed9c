//! Where in a neighbourhood the motion field changes most.
//!
//! The gradient of a field cell is the largest difference of velocity (Chebyshev, 1/32 px) to its
//! four neighbours, counted on **one side** of a discontinuity only: the nearer one, where depth
//! (dilated as the motion was, 3x3) is larger; at equal depth the faster one; at equal
//! speed both. A vertex that snaps to the maximum thus stands on the nearer surface, takes its
//! motion, and the outline moves with what it outlines; what stretches is the farther surface
//! behind it.
//!
//! An entry has 16 bits, as in Didyk et al. 2010, section 6: 6 bits of magnitude on a quarter-octave
//! scale, 2 x 5 bits of position relative to the regular place of the vertex. Entries are ordered by
//! magnitude, then nearness to that place, then position, so a maximum is unique and does not
//! depend on the order of combining. Below 1/4 px per cell the magnitude is 0: a vertex in smooth
//! motion stays where it is.

use crate::key::Velocity;
use crate::plane::{Plane, Rect};

/// Cells per axis of the largest neighbourhood.
pub(super) const LARGEST: usize = 8;

/// Differences below this, in 1/32 px per cell, are smooth motion: scaling by a quarter, faster
/// than any zoom between two keys of a watchable sequence, and far below a visible discontinuity.
const SMALLEST_STEP: i32 = 8;

/// One pixel of the pyramid: how large a gradient was and where.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Entry(u16);

impl Entry {
    /// Loses against every cell that exists.
    pub(super) const ABSENT: Self = Self(0);

    /// `offset` is relative to the regular place, -15 to 15 cells per axis; `magnitude` is 0 to 63.
    #[expect(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "5 bits each")]
    pub(super) fn new(magnitude: u16, offset: [i32; 2]) -> Self {
        let [x, y] = offset.map(|axis| (axis + 16) as u16 & 31);
        Self(magnitude << 10 | y << 5 | x)
    }

    pub(super) fn magnitude(self) -> u16 {
        self.0 >> 10
    }

    /// Cells from the regular place to where the gradient was.
    pub(super) fn offset(self) -> [i32; 2] {
        [i32::from(self.0 & 31) - 16, i32::from(self.0 >> 5 & 31) - 16]
    }

    /// Sorts by magnitude, then nearness to the regular place, then position.
    fn rank(self) -> u32 {
        let [x, y] = self.offset();
        let nearness = 63 - (x.unsigned_abs() + y.unsigned_abs());
        u32::from(self.magnitude()) << 16 | nearness << 10 | u32::from(1023 - (self.0 & 1023))
    }

    /// The larger of the two.
    pub(super) fn max(self, other: Self) -> Self {
        if other.rank() > self.rank() { other } else { self }
    }
}

/// Takes a neighbourhood of `LARGEST` cells per axis up the pyramid, level by level, 2x2 to 1.
pub(super) fn maximum(mut level: [[Entry; LARGEST]; LARGEST]) -> Entry {
    let mut size = LARGEST;
    while size > 1 {
        size /= 2;
        for y in 0..size {
            for x in 0..size {
                let (left, right) = (2 * x, 2 * x + 1);
                let (top, bottom) = (2 * y, 2 * y + 1);
                let upper = level[top][left].max(level[top][right]);
                let lower = level[bottom][left].max(level[bottom][right]);
                level[y][x] = upper.max(lower);
            }
        }
    }
    level[0][0]
}

/// A difference of velocity in 1/32 px as 6 bits: four steps per octave from [`SMALLEST_STEP`] up,
/// 0 below it. Monotone; the largest difference of two velocities gives 56.
#[expect(clippy::cast_sign_loss, reason = "a magnitude is not negative")]
pub(super) fn magnitude_code(difference: i32) -> u16 {
    if difference < SMALLEST_STEP {
        return 0;
    }
    let octave = difference.ilog2();
    let quarter = difference as u32 >> (octave - 2) & 3;
    let code = (octave - SMALLEST_STEP.ilog2()) * 4 + quarter + 1;
    u16::try_from(code.min(63)).expect("6 bits")
}

/// The motion field as the grid sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Field<'a> {
    pub(super) velocity: &'a Plane<Velocity>,
    /// Empty without a depth plane, else of the size of `velocity`.
    pub(super) depth: &'a Plane<u32>,
}

impl Field<'_> {
    /// Velocity of a cell; a surface that cannot be tracked is held.
    pub(super) fn velocity(&self, x: u32, y: u32) -> Velocity {
        held(self.velocity.at(x, y))
    }

    /// Depth of the surface whose motion a cell has: the nearest in 3x3, as motion was dilated.
    pub(super) fn depth(&self, x: u32, y: u32) -> u32 {
        if self.depth.data().is_empty() {
            return 0;
        }
        let columns = x.saturating_sub(1)..(x + 2).min(self.depth.width());
        (y.saturating_sub(1)..(y + 2).min(self.depth.height()))
            .flat_map(|row| columns.clone().map(move |column| self.depth.at(column, row)))
            .max()
            .unwrap_or(0)
    }

    /// Code of the gradient at a cell, one-sided as the head of this file says.
    pub(super) fn gradient(&self, x: u32, y: u32) -> u16 {
        let here = self.velocity(x, y);
        let mut largest = 0;
        let mut compare = |to_x: u32, to_y: u32| {
            let there = self.velocity(to_x, to_y);
            let code = magnitude_code(difference(here, there));
            if code > largest && self.is_in_front([x, y], here, [to_x, to_y], there) {
                largest = code;
            }
        };
        if x > 0 {
            compare(x - 1, y);
        }
        if x + 1 < self.velocity.width() {
            compare(x + 1, y);
        }
        if y > 0 {
            compare(x, y - 1);
        }
        if y + 1 < self.velocity.height() {
            compare(x, y + 1);
        }
        largest
    }

    fn is_in_front(&self, a: [u32; 2], va: Velocity, b: [u32; 2], vb: Velocity) -> bool {
        let (depth_a, depth_b) = (self.depth(a[0], a[1]), self.depth(b[0], b[1]));
        depth_a > depth_b || (depth_a == depth_b && speed(va) >= speed(vb))
    }

    /// The entry of the neighbourhood `cells`, relative to `regular`.
    pub(super) fn snap(&self, cells: Rect, regular: [u32; 2]) -> Entry {
        if self.is_smooth(cells) {
            return Entry::new(0, [0, 0]);
        }
        let mut level = [[Entry::ABSENT; LARGEST]; LARGEST];
        for (row, y) in level.iter_mut().zip(cells.y..cells.y + cells.height) {
            for (entry, x) in row.iter_mut().zip(cells.x..cells.x + cells.width) {
                let offset = [x.wrapping_sub(regular[0]), y.wrapping_sub(regular[1])];
                *entry = Entry::new(self.gradient(x, y), offset.map(u32::cast_signed));
            }
        }
        maximum(level)
    }

    /// Whether no two velocities in `cells` and the cells around them differ enough to count.
    fn is_smooth(&self, cells: Rect) -> bool {
        let left = cells.x.saturating_sub(1) as usize;
        let right = (cells.x + cells.width + 1).min(self.velocity.width()) as usize;
        let top = cells.y.saturating_sub(1);
        let bottom = (cells.y + cells.height + 1).min(self.velocity.height());
        let (mut low, mut high) = ([i16::MAX; 2], [i16::MIN; 2]);
        for y in top..bottom {
            for velocity in &self.velocity.row(y)[left..right] {
                low = [low[0].min(velocity.x), low[1].min(velocity.y)];
                high = [high[0].max(velocity.x), high[1].max(velocity.y)];
            }
        }
        (0..2).all(|axis| i32::from(high[axis]) - i32::from(low[axis]) < SMALLEST_STEP)
    }
}

fn held(velocity: Velocity) -> Velocity {
    if velocity.is_trackable() { velocity } else { Velocity::default() }
}

/// The larger of the differences of the two axes, in 1/32 px.
pub(super) fn difference(a: Velocity, b: Velocity) -> i32 {
    let x = (i32::from(a.x) - i32::from(b.x)).abs();
    let y = (i32::from(a.y) - i32::from(b.y)).abs();
    x.max(y)
}

fn speed(velocity: Velocity) -> i32 {
    i32::from(velocity.x).abs() + i32::from(velocity.y).abs()
}
