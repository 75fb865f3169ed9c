//! What a key's own motion makes of a block, pixel by pixel.

use super::BLOCK;
use super::luma::Level;
use crate::key::KeyFrame;
use crate::plane::{Plane, Rect};
use crate::trajectory::grid::Grid;
use crate::trajectory::surface::was_same_surface;

/// Pixels of a block per axis, and blocks that are looked at together.
pub(super) const SIDE: usize = BLOCK as usize;
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

    /// Motion at the centres of the blocks at columns `x` and row `y`, Q8 pixels, right and down;
    /// 0 where none is known.
    #[inline(always)]
    pub(super) fn at_centres(&self, x: [i32; SIDE], y: i32) -> [[i32; SIDE]; 2] {
        let middle = BLOCK.cast_signed() / 2;
        let row = self.motion.row(self.grid.nearest_to(1, y + middle));
        let mut across = x;
        for x in &mut across {
            *x += middle;
        }
        let columns = self.grid.nearest_each(0, across);
        let mut found = [[0.0; SIDE]; 2];
        for i in 0..SIDE {
            [found[0][i], found[1][i]] = row[columns[i] as usize];
        }
        let mut steps = [[0; SIDE]; 2];
        for i in 0..SIDE {
            [steps[0][i], steps[1][i]] = q8([found[0][i], found[1][i]]);
        }
        steps
    }

    /// The same near its corners.
    #[inline(always)]
    pub(super) fn near_corners(&self, at: [i32; 2]) -> [[i32; 2]; 4] {
        let (near, far) = (1, BLOCK.cast_signed() - 2);
        [[near, near], [far, near], [near, far], [far, far]]
            .map(|[x, y]| self.motion_of(self.grid.nearest([at[0] + x, at[1] + y])))
    }

    /// The block at `at` by the motion of each pixel.
    #[inline(always)]
    pub(super) fn seen(&self, [now, then]: [&Level; 2], at: [i32; 2]) -> Seen {
        let mut mask = [[false; SIDE]; SIDE];
        let mut r = [[0; SIDE]; SIDE];
        let mut across = [at[0]; SIDE];
        for (i, x) in (0..).zip(&mut across) {
            *x += i;
        }
        let columns = self.grid.nearest_each(0, across);
        for (down, (mask, r)) in (at[1]..).zip(mask.iter_mut().zip(&mut r)) {
            let y = self.grid.nearest_to(1, down);
            let luma = now.run::<SIDE>(at[0], down);
            // Step by step for all pixels of the row, which suits wide registers.
            let cells = self.motion.row(y);
            let mut motion = [[0.0; 2]; SIDE];
            for i in 0..SIDE {
                motion[i] = cells[columns[i] as usize];
            }
            let mut from = [[0; SIDE]; 2];
            for i in 0..SIDE {
                let [dx, dy] = q8(motion[i]);
                from[0][i] = (across[i] << 8) - dx;
                from[1][i] = (down << 8) - dy;
            }
            *mask = self.were_seen(columns, y, from);
            for i in 0..SIDE {
                if mask[i] {
                    match then.sample([from[0][i], from[1][i]]) {
                        Some(was) => r[i] = was - 16 * i32::from(luma[i]),
                        None => mask[i] = false,
                    }
                }
            }
        }
        Seen { error: in_any_light(&r, &mask), mask }
    }

    /// Whether the older key shows the surfaces of cells of row `y` where they came from, as far as
    /// depth tells.
    #[inline(always)]
    fn were_seen(&self, columns: [u32; SIDE], y: u32, from: [[i32; SIDE]; 2]) -> [bool; SIDE] {
        let Some((depth, older, grid)) = &self.depths else { return [true; SIDE] };
        let mut pixels = from;
        for from in pixels.as_flattened_mut() {
            *from = (*from + 128) >> 8;
        }
        let (xs, ys) = (grid.nearest_each(0, pixels[0]), grid.nearest_each(1, pixels[1]));
        let depth = depth.row(y);
        let (mut now, mut then, mut were_seen) = ([0; SIDE], [0; SIDE], [false; SIDE]);
        for i in 0..SIDE {
            (now[i], then[i]) = (depth[columns[i] as usize], older.at(xs[i], ys[i]));
        }
        for i in 0..SIDE {
            were_seen[i] = was_same_surface(now[i], then[i]);
        }
        were_seen
    }

    /// Motion of a cell, Q8 pixels; 0 where none is known.
    #[inline(always)]
    fn motion_of(&self, [x, y]: [u32; 2]) -> [i32; 2] {
        q8(self.motion.at(x, y))
    }
}

/// Motion in Q8 pixels, rounded towards 0; 0 where it is not known.
#[inline(always)]
fn q8([dx, dy]: [f32; 2]) -> [i32; 2] {
    // Adding this moves a whole number of up to 22 bits into the low bits of the mantissa: a cast
    // would saturate, one number at a time.
    const MAGIC: f32 = 12_582_912.0;
    let is_known = dx.is_finite() & dy.is_finite();
    let steps = |d: f32| {
        let whole = (d.clamp(-MOST_PX, MOST_PX) * 256.0).trunc();
        let bits = (whole + MAGIC).to_bits().cast_signed() - MAGIC.to_bits().cast_signed();
        if is_known { bits } else { 0 }
    };
    [steps(dx), steps(dy)]
}

/// Sum of what is left of differences in sixteenths, without their mean, over those that count.
#[inline(always)]
pub(super) fn in_any_light(r: &[[i32; SIDE]; SIDE], counts: &Mask) -> u32 {
    let (r, counts) = (r.as_flattened(), counts.as_flattened());
    let (mut sum, mut count) = (0, 0);
    for (r, counts) in r.iter().zip(counts) {
        sum += if *counts { *r } else { 0 };
        count += i32::from(*counts);
    }
    let mean = sum / count.max(1);
    let mut left = 0;
    for (r, counts) in r.iter().zip(counts) {
        left += if *counts { (r - mean).unsigned_abs() } else { 0 };
    }
    left >> 4
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

    /// [`Cells::nearest_to`] of each.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "positions up to 8192 are exact")]
    fn nearest_each(&self, axis: usize, pixels: [i32; SIDE]) -> [u32; SIDE] {
        const TWO_TO_23: f32 = 8_388_608.0;
        let (first, step, last) = (self.first[axis], self.step[axis], self.last[axis] as f32);
        let mut cells = [0; SIDE];
        for (cell, pixel) in cells.iter_mut().zip(pixels) {
            let place = (first + pixel as f32 * step).max(0.0).min(last).floor();
            *cell = (place + TWO_TO_23).to_bits() - TWO_TO_23.to_bits();
        }
        cells
    }

    #[inline(always)]
    fn nearest(&self, [x, y]: [i32; 2]) -> [u32; 2] {
        [self.nearest_to(0, x), self.nearest_to(1, y)]
    }
}
