//! What a key's own motion makes of a block, pixel by pixel.

use super::BLOCK;
use super::luma::Level;
use crate::key::KeyFrame;
use crate::plane::{Plane, Rect};
use crate::trajectory::grid::Grid;
use crate::trajectory::surface::is_same_surface;

const SIDE: usize = BLOCK as usize;
/// Pixels that count, row by row.
pub(super) type Mask = [[bool; SIDE]; SIDE];
/// Motion that is looked at, pixels: any beyond leads out of the largest picture.
const MOST_PX: f32 = 8192.0;

/// The fields of a key and of the one that it came from.
pub(super) struct Own<'a> {
    motion: &'a Plane<[f32; 2]>,
    grid: Cells,
    valid: Rect,
    /// Of both, with the older one's grid, where both have depth.
    depths: Option<(&'a Plane<u32>, &'a Plane<u32>, Cells)>,
}

/// A block by the motion of its pixels.
pub(super) struct Seen {
    /// Those that the older key shows: what was hidden, or came in over the border, tells nothing.
    pub(super) mask: Mask,
    /// What their own motion leaves of (1), without the mean.
    pub(super) error: u32,
}

impl<'a> Own<'a> {
    pub(super) fn new(key: &'a KeyFrame, older: &'a KeyFrame) -> Self {
        let has_both = !key.depth.data().is_empty() && !older.depth.data().is_empty();
        Self {
            motion: &key.displacement,
            grid: Cells::of(key),
            valid: key.valid,
            depths: has_both.then(|| (&key.depth, &older.depth, Cells::of(older))),
        }
    }

    pub(super) fn valid(&self) -> Rect {
        self.valid
    }

    /// Motion at the centre of the block at `at`, Q8 pixels; 0 where none is known.
    #[inline(always)]
    pub(super) fn at_centre(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        let middle = BLOCK.cast_signed() / 2;
        self.motion_of(self.grid.nearest([x + middle, y + middle]))
    }

    /// The same near its corners.
    #[inline(always)]
    pub(super) fn near_corners(&self, at: [i32; 2]) -> [[i32; 2]; 4] {
        let (near, far) = (1, BLOCK.cast_signed() - 2);
        [[near, near], [far, near], [near, far], [far, far]]
            .map(|[x, y]| self.motion_of(self.grid.nearest([at[0] + x, at[1] + y])))
    }

    /// The block at `at` by the motion of each pixel.
    pub(super) fn seen(&self, [now, then]: [&Level; 2], at: [i32; 2]) -> Seen {
        let mut mask = [[false; SIDE]; SIDE];
        let mut r = [[0; SIDE]; SIDE];
        let columns: [u32; SIDE] =
            std::array::from_fn(|i| self.grid.nearest_to(0, at[0] + i as i32));
        for (row, (mask, r)) in (0..).zip(mask.iter_mut().zip(&mut r)) {
            let y = self.grid.nearest_to(1, at[1] + row);
            let luma = now.run::<SIDE>(at[0], at[1] + row);
            for (i, &x) in columns.iter().enumerate() {
                let d = self.motion_of([x, y]);
                let from = [((at[0] + i as i32) << 8) - d[0], ((at[1] + row) << 8) - d[1]];
                if let Some(was) = then.sample(from)
                    && self.was_seen([x, y], from)
                {
                    mask[i] = true;
                    r[i] = was - 16 * i32::from(luma[i]);
                }
            }
        }
        Seen { error: in_any_light(&r, &mask), mask }
    }

    /// Whether the older key shows the surface of a cell where it came from, as far as depth tells.
    #[inline(always)]
    fn was_seen(&self, [x, y]: [u32; 2], from: [i32; 2]) -> bool {
        let Some((depth, older, grid)) = &self.depths else { return true };
        let [then_x, then_y] = grid.nearest(from.map(|from| (from + 128) >> 8));
        is_same_surface(depth.at(x, y), older.at(then_x, then_y))
    }

    /// Motion of a cell, Q8 pixels; 0 where none is known.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "motion is rounded")]
    fn motion_of(&self, [x, y]: [u32; 2]) -> [i32; 2] {
        let [dx, dy] = self.motion.at(x, y);
        let is_known = dx.is_finite() & dy.is_finite();
        let q8 = |d: f32| (d.clamp(-MOST_PX, MOST_PX) * 256.0) as i32;
        if is_known { [q8(dx), q8(dy)] } else { [0; 2] }
    }
}

/// Sum of what is left of differences in sixteenths, without their mean, over those that count.
pub(super) fn in_any_light(r: &[[i32; SIDE]; SIDE], counts: &Mask) -> u32 {
    let counted = || {
        let of = r.as_flattened().iter().zip(counts.as_flattened());
        of.filter(|(_, counts)| **counts).map(|(r, _)| *r)
    };
    let mean = counted().sum::<i32>() / i32::try_from(counted().count().max(1)).unwrap_or(1);
    counted().map(|r| (r - mean).unsigned_abs()).sum::<u32>() >> 4
}

/// Which cells of a field are nearest to pixels of a level.
struct Cells {
    /// Of pixel 0, in cells, with a half to round.
    first: [f32; 2],
    /// Per pixel.
    step: [f32; 2],
    last: [u32; 2],
}

impl Cells {
    /// Of a key's field, for levels of its valid rectangle.
    #[expect(clippy::cast_precision_loss, reason = "positions up to 8192 are exact")]
    fn of(key: &KeyFrame) -> Self {
        let grid = Grid::of(key);
        let place = grid.place([key.valid.x as f32, key.valid.y as f32]);
        Self {
            first: place.map(|place| place + 0.5),
            step: grid.step.map(|step| 1.0 / step),
            last: grid.cells.map(|cells| cells.saturating_sub(1)),
        }
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "clamped to the grid")]
    #[expect(clippy::cast_sign_loss, reason = "casts of floats to integers saturate at 0")]
    #[expect(clippy::cast_precision_loss, reason = "positions up to 8192 are exact")]
    fn nearest_to(&self, axis: usize, pixel: i32) -> u32 {
        let place = self.first[axis] + pixel as f32 * self.step[axis];
        (place as u32).min(self.last[axis])
    }

    #[inline(always)]
    fn nearest(&self, [x, y]: [i32; 2]) -> [u32; 2] {
        [self.nearest_to(0, x), self.nearest_to(1, y)]
    }
}
