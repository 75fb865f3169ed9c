//! The reference of [`super`].

use rayon::ThreadPool;

use super::{CellClass, HOLE};
use crate::bands::for_each_row;
use crate::key::Velocity;
use crate::phase::Phase;
use crate::plane::Plane;
use crate::warp::scatter::{NO_SOURCE, SourceField, source_of};

/// Largest difference of displacement in a smooth neighbourhood, Q8 pixels. Half a pixel: a
/// position that is off by less than that reads the same two pixels.
const SMOOTH_RANGE: i32 = 128;

/// (1).
pub fn resolve(
    pool: &ThreadPool,
    source: &SourceField,
    splat: &Plane<u32>,
    carried: &mut Plane<Velocity>,
) {
    carried.resize(splat.width(), splat.height());
    let velocities = source.velocity.data();
    for_each_row(pool, carried, |y, row| {
        for (velocity, &splat) in row.iter_mut().zip(splat.row(y)) {
            *velocity = if splat == NO_SOURCE { HOLE } else { velocities[source_of(splat)] };
        }
    });
}

/// (2).
pub fn classify(
    pool: &ThreadPool,
    carried: &Plane<Velocity>,
    phase: Phase,
    class: &mut Plane<CellClass>,
) {
    let (width, height) = (carried.width(), carried.height());
    class.resize(width, height);
    for_each_row(pool, class, |y, row| {
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| carried.row(y));
        let mut columns = [Range::of_column(&rows, 0); 3];
        for (x, class) in row.iter_mut().enumerate() {
            columns = [columns[1], columns[2], columns[2]];
            if x + 1 < width as usize {
                columns[2] = Range::of_column(&rows, x + 1);
            }
            *class = columns[0].union(columns[1]).union(columns[2]).class(phase);
        }
    });
}

/// Smallest and largest velocity of some cells.
#[derive(Clone, Copy)]
struct Range {
    min: [i16; 2],
    max: [i16; 2],
}

impl Range {
    fn of_column(rows: &[&[Velocity]; 3], x: usize) -> Self {
        let [above, here, below] = rows.map(|row| {
            let v = [row[x].x, row[x].y];
            Self { min: v, max: v }
        });
        above.union(here).union(below)
    }

    fn union(self, other: Self) -> Self {
        Self {
            min: [self.min[0].min(other.min[0]), self.min[1].min(other.min[1])],
            max: [self.max[0].max(other.max[0]), self.max[1].max(other.max[1])],
        }
    }

    fn class(self, phase: Phase) -> CellClass {
        let agrees = |axis: usize| {
            let range = i32::from(self.max[axis]) - i32::from(self.min[axis]);
            self.min[axis] != HOLE.x && (range * phase.q12()) >> 9 <= SMOOTH_RANGE
        };
        if agrees(0) && agrees(1) { CellClass::Smooth } else { CellClass::Broken }
    }
}
