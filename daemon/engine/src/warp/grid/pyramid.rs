//! Where in a neighbourhood the motion field changes most.
//!
//! The gradient of a field cell is the largest difference of velocity (Chebyshev, 1/32 px) to its
//! four neighbours, counted on **one side** of a discontinuity only: the nearer one, where depth
//! (dilated as the motion was, 3x3) is larger; at equal depth the faster one; at equal
//! speed both. A vertex that snaps to the maximum thus stands on the nearer surface, takes its
//! motion, and the outline moves with what it outlines; what stretches is the farther surface
//! behind it.
//!
//! An entry has 16 bits, as in Didyk et al. 2010, section 6: 6 bits of magnitude on a
//! quarter-octave scale, 2 x 5 bits of position relative to the regular place of the vertex.
//! Entries are ordered by magnitude, then nearness to that place, then position, so a maximum is
//! unique and does not depend on the order of combining. Below 1/4 px per cell the magnitude is 0:
//! a vertex in smooth motion stays where it is.

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

    /// The entry of the neighbourhood `cells`, relative to `regular`.
    pub(super) fn snap(&self, cells: Rect, regular: [u32; 2]) -> Entry {
        let motion = self.motion_around(cells);
        if is_smooth(&motion) {
            return Entry::new(0, [0, 0]);
        }
        let gradients = gradients(&motion, &self.depth_around(cells));
        let mut level = [[Entry::ABSENT; LARGEST]; LARGEST];
        for ((row, codes), y) in
            level.iter_mut().zip(gradients).zip(cells.y..cells.y + cells.height)
        {
            for ((entry, code), x) in row.iter_mut().zip(codes).zip(cells.x..cells.x + cells.width)
            {
                let offset = [x.wrapping_sub(regular[0]), y.wrapping_sub(regular[1])];
                *entry = Entry::new(code, offset.map(u32::cast_signed));
            }
        }
        maximum(level)
    }

    /// Velocities of `cells` and one cell around; beyond the field its border goes on.
    fn motion_around(&self, cells: Rect) -> Window<Velocity> {
        let (width, height) = (self.velocity.width(), self.velocity.height());
        let columns: [u32; WINDOW] = around(cells.x, width, 1);
        around::<WINDOW>(cells.y, height, 1).map(|y| {
            let row = self.velocity.row(y);
            columns.map(|x| held(row[x as usize]))
        })
    }

    /// [`Field::depth`] of the same cells.
    fn depth_around(&self, cells: Rect) -> Window<u32> {
        let mut nearest = [[0; WINDOW]; WINDOW];
        if self.depth.data().is_empty() {
            return nearest;
        }
        const WIDER: usize = WINDOW + 2;
        let columns: [u32; WIDER] = around(cells.x, self.depth.width(), 2);
        let rows = around::<WIDER>(cells.y, self.depth.height(), 2).map(|y| {
            let depths = columns.map(|x| self.depth.row(y)[x as usize]);
            std::array::from_fn(|x| depths[x].max(depths[x + 1]).max(depths[x + 2]))
        });
        for (y, row) in nearest.iter_mut().enumerate() {
            let [above, here, below]: [[u32; WINDOW]; 3] = [rows[y], rows[y + 1], rows[y + 2]];
            *row = std::array::from_fn(|x| above[x].max(here[x]).max(below[x]));
        }
        nearest
    }
}

/// Cells per axis of a neighbourhood and one cell around it.
const WINDOW: usize = LARGEST + 2;

type Window<T> = [[T; WINDOW]; WINDOW];

/// Indices from `margin` before `first` on, kept inside `0..count`.
fn around<const N: usize>(first: u32, count: u32, margin: u32) -> [u32; N] {
    let mut at = 0;
    [(); N].map(|()| {
        let index = (first + at).saturating_sub(margin).min(count - 1);
        at += 1;
        index
    })
}

/// Codes of the gradients of a neighbourhood, one-sided as the head of this file says.
///
/// Row by row without branches, so that it vectorises; the code is monotone, so it is taken once,
/// of the largest difference.
fn gradients(motion: &Window<Velocity>, depth: &Window<u32>) -> [[u16; LARGEST]; LARGEST] {
    let across = motion.map(|row| row.map(|velocity| i32::from(velocity.x)));
    let down = motion.map(|row| row.map(|velocity| i32::from(velocity.y)));
    let mut codes = [[0; LARGEST]; LARGEST];
    for (y, row) in codes.iter_mut().enumerate() {
        let mut largest = [0_i32; LARGEST];
        for (row_there, shift) in [(y, 1), (y + 1, 0), (y + 1, 2), (y + 2, 1)] {
            for (x, largest) in largest.iter_mut().enumerate() {
                let here = [across[y + 1][x + 1], down[y + 1][x + 1]];
                let there = [across[row_there][x + shift], down[row_there][x + shift]];
                let (near, far) = (depth[y + 1][x + 1], depth[row_there][x + shift]);
                let is_as_fast = here[0].abs() + here[1].abs() >= there[0].abs() + there[1].abs();
                let is_in_front = (near > far) | ((near == far) & is_as_fast);
                let step = (here[0] - there[0]).abs().max((here[1] - there[1]).abs());
                *largest = (*largest).max(step * i32::from(is_in_front));
            }
        }
        *row = largest.map(magnitude_code);
    }
    codes
}

/// Whether no two velocities of a window differ enough to count.
fn is_smooth(motion: &Window<Velocity>) -> bool {
    let (mut low, mut high) = ([i16::MAX; 2], [i16::MIN; 2]);
    for velocity in motion.as_flattened() {
        low = [low[0].min(velocity.x), low[1].min(velocity.y)];
        high = [high[0].max(velocity.x), high[1].max(velocity.y)];
    }
    (0..2).all(|axis| i32::from(high[axis]) - i32::from(low[axis]) < SMALLEST_STEP)
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
