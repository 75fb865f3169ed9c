//! The reference of [`super`].

use rayon::ThreadPool;

use super::{NO_CELL, NO_ROW};
use crate::bands::for_each_row;
use crate::plane::Plane;
use crate::warp::scatter::{NO_SOURCE, SourceField, source_of};

/// Cells that are skipped together where none is a hole.
const GROUP: usize = 32;

/// Buffers of the search.
#[derive(Clone, Debug, Default)]
pub struct FarScratch {
    above: Plane<u16>,
    below: Plane<u16>,
}

/// Fills `far` with the cell of (3) for each hole of `splat`, and leaves the rest unspecified.
pub fn far_side(
    pool: &ThreadPool,
    source: &SourceField,
    splat: &Plane<u32>,
    scratch: &mut FarScratch,
    far: &mut Plane<u32>,
) {
    let (width, height) = (splat.width(), splat.height());
    far.resize(width, height);
    let FarScratch { above, below } = scratch;
    pool.install(|| {
        rayon::join(|| sweep(splat, 0..height, above), || sweep(splat, (0..height).rev(), below))
    });
    for_each_row(
        pool,
        far,
        #[inline(always)]
        |y, row| {
            let splats = splat.row(y);
            let mut left = None;
            let mut x = 0;
            while x < width {
                let rest = &splats[x as usize..];
                if rest[0] != NO_SOURCE {
                    // A whole group at once, or one cell.
                    let has_hole = |group: &&[u32; GROUP]| {
                        group.iter().fold(false, |any, splat| any | (*splat == NO_SOURCE))
                    };
                    let group = rest.first_chunk().filter(|group| !has_hole(group));
                    x += group.map_or(1, |group| group.len() as u32);
                    left = Some(x - 1);
                    continue;
                }
                let run = splats[x as usize..].iter().take_while(|splat| **splat == NO_SOURCE);
                let end = x + u32::try_from(run.count()).expect("a row has at most 8192 cells");
                let right = (end < width).then_some(end);
                for hole in x..end {
                    let side = |cell: u32, way: u32| Side { cell, way };
                    let beside = Sides {
                        first: left.map(|left| side(y * width + left, hole - left)),
                        second: right.map(|right| side(y * width + right, right - hole)),
                    };
                    let vertical = |row: u16| {
                        let row = u32::from(row);
                        (row != u32::from(NO_ROW))
                            .then(|| side(row * width + hole, row.abs_diff(y)))
                    };
                    let stacked = Sides {
                        first: vertical(above.at(hole, y)),
                        second: vertical(below.at(hole, y)),
                    };
                    let (sides, others) = if stacked.run() < beside.run() {
                        (stacked, beside)
                    } else {
                        (beside, stacked)
                    };
                    let depth = |side: Side| {
                        source.depth.data()[source_of(splat.data()[side.cell as usize])]
                    };
                    let mut far = sides.farther(depth);
                    if sides.is_open() {
                        far = farther(far, others.farther(depth), depth);
                    }
                    row[hole as usize] = far.map_or(NO_CELL, |side| side.cell);
                }
                x = end;
            }
        },
    );
}

/// For each hole, the last row so far, in the order of `rows`, that is resolved in its column. The
/// rest is unspecified.
#[expect(clippy::cast_possible_truncation, reason = "a plane has at most 8192 rows")]
fn sweep(splat: &Plane<u32>, rows: impl Iterator<Item = u32>, nearest: &mut Plane<u16>) {
    nearest.resize(splat.width(), splat.height());
    let mut before = None;
    for y in rows {
        for (group, splats) in splat.row(y).chunks(GROUP).enumerate() {
            if !splats.iter().fold(false, |any, splat| any | (*splat == NO_SOURCE)) {
                continue;
            }
            let columns = (group * GROUP) as u32..;
            for (x, _) in columns.zip(splats).filter(|(_, splat)| **splat == NO_SOURCE) {
                let row = before.map_or(NO_ROW, |before| match splat.at(x, before) {
                    NO_SOURCE => nearest.at(x, before),
                    _ => before as u16,
                });
                nearest.row_mut(y)[x as usize] = row;
            }
        }
        before = Some(y);
    }
}

/// A resolved cell and how far it is from the hole.
#[derive(Clone, Copy)]
struct Side {
    cell: u32,
    way: u32,
}

/// The resolved cells on both sides of a hole along one axis.
struct Sides {
    first: Option<Side>,
    second: Option<Side>,
}

impl Sides {
    /// (1).
    fn run(&self) -> u32 {
        match (&self.first, &self.second) {
            (Some(first), Some(second)) => first.way + second.way,
            (Some(only), None) | (None, Some(only)) => 2 * only.way,
            (None, None) => u32::MAX,
        }
    }

    /// Whether the hole reaches the border of the image on one of them.
    fn is_open(&self) -> bool {
        self.first.is_none() || self.second.is_none()
    }

    /// (3) along this axis.
    fn farther(&self, depth: impl Fn(Side) -> u32) -> Option<Side> {
        farther(self.first, self.second, depth)
    }
}

/// (3) of two sides.
fn farther(first: Option<Side>, second: Option<Side>, depth: impl Fn(Side) -> u32) -> Option<Side> {
    let Some((first, second)) = first.zip(second) else {
        return first.or(second);
    };
    let (a, b) = (depth(first), depth(second));
    let takes_second =
        if a < b - (b >> 8) { false } else { b < a - (a >> 8) || second.way < first.way };
    Some(if takes_second { second } else { first })
}
