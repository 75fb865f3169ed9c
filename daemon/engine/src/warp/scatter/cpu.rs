//! The reference of [`super`].

use std::ops::Range;

use rayon::ThreadPool;

use super::{NO_SOURCE, SOURCE_BITS};
use crate::bands::for_each_band;
use crate::field::{FieldAxis, FieldMap};
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::Plane;
use crate::trajectory::dilate_motion::dilate_depth_row;

/// Rows of a band. Few enough for its planes to stay in a core's cache, many enough that
/// few source rows are visited by two bands.
const BAND_ROWS: usize = 64;

/// What the scatter reads of a key; derived from it once.
#[derive(Clone, Debug, Default)]
pub struct SourceField {
    /// Velocity per cell, 0 where none is known.
    pub velocity: Plane<Velocity>,
    /// Depth key of the surface that the velocity is of.
    pub depth: Plane<u32>,
    /// Smallest and largest downward velocity of each row.
    reach: Vec<[i16; 2]>,
}

impl SourceField {
    /// Takes the field of `key`, which has a velocity field.
    ///
    /// Without depth, a faster surface counts as nearer, in steps of a pixel: it is what parallax
    /// does to a moving camera, and better than a fold-over that shows both surfaces at random.
    pub fn update(&mut self, pool: &ThreadPool, key: &KeyFrame) {
        let (width, height) = (key.velocity.width(), key.velocity.height());
        self.velocity.resize(width, height);
        self.depth.resize(width, height);
        let has_depth = !key.depth.data().is_empty();
        crate::bands::for_each_row(
            pool,
            &mut self.velocity,
            #[inline(always)]
            |y, row| {
                for (held, &velocity) in row.iter_mut().zip(key.velocity.row(y)) {
                    *held = if velocity.is_trackable() { velocity } else { Velocity::default() };
                }
            },
        );
        let velocity = &self.velocity;
        crate::bands::for_each_row(
            pool,
            &mut self.depth,
            #[inline(always)]
            |y, row| {
                if has_depth {
                    dilate_depth_row(&key.depth, y, row);
                    return;
                }
                for (depth, &Velocity { x, y }) in row.iter_mut().zip(velocity.row(y)) {
                    *depth = (u32::from(x.unsigned_abs()) + u32::from(y.unsigned_abs())) >> 5;
                }
            },
        );
        self.reach.clear();
        self.reach.extend((0..height).map(|y| {
            let rows = self.velocity.row(y).iter().map(|velocity| velocity.y);
            rows.fold([i16::MAX, i16::MIN], |[min, max], vy| [min.min(vy), max.max(vy)])
        }));
    }
}

/// `p_cell` of (1): the phase in the unit that turns velocities into Q8 cells.
#[expect(clippy::cast_possible_wrap, reason = "at most the phase, 16384")]
#[must_use]
pub fn phase_in_cells(phase: Phase, axis: &FieldAxis) -> i32 {
    let pixels = axis.pixels();
    ((phase.q12().cast_unsigned() * axis.cells() + pixels / 2) / pixels) as i32
}

/// Splats `source` into `splat`; `top` keeps the depth keys of (2).
pub fn scatter(
    pool: &ThreadPool,
    source: &SourceField,
    map: &FieldMap,
    phase: Phase,
    top: &mut Plane<u32>,
    splat: &mut Plane<u32>,
) {
    let (width, height) = (source.velocity.width(), source.velocity.height());
    top.resize(width, height);
    splat.resize(width, height);
    let scale = [phase_in_cells(phase, &map.x), phase_in_cells(phase, &map.y)];
    let band_rows = BAND_ROWS.min((height as usize).div_ceil(pool.current_num_threads()));
    for_each_band(
        pool,
        top,
        splat,
        band_rows,
        #[inline(always)]
        |first_row, top, splat| {
            top.fill(0);
            splat.fill(NO_SOURCE);
            let mut band = Band { source, scale, first_row, top, splat };
            band.visit(
                #[inline(always)]
                |top, _, depth, _| *top = (*top).max(depth),
            );
            band.visit(
                #[inline(always)]
                |top, splat, depth, candidate| {
                    let shows = depth >= *top - (*top >> 8);
                    *splat = (*splat).min(if shows { candidate } else { NO_SOURCE });
                },
            );
        },
    );
}

/// A run of target rows and what lands on it.
struct Band<'a> {
    source: &'a SourceField,
    scale: [i32; 2],
    first_row: u32,
    top: &'a mut [u32],
    splat: &'a mut [u32],
}

/// Cells of one velocity in a row that are splatted together: with fewer the loops do not pay.
const MIN_RUN: usize = 8;

impl Band<'_> {
    /// Calls `cell(top, splat, depth key, candidate of (3))` for each splat on the band.
    #[inline(always)]
    fn visit(&mut self, cell: impl Fn(&mut u32, &mut u32, u32, u32)) {
        let source = self.source;
        let width = source.velocity.width() as usize;
        let rows = (self.top.len() / width).cast_signed();
        let first_row = self.first_row as isize;
        let [scale_x, scale_y] = self.scale;
        for (y, &[slowest, fastest]) in (0_u32..).zip(&source.reach) {
            let land = |v: i16| ((y << 8).cast_signed() + shift(v, scale_y)) >> 8;
            let (from, to) =
                (land(slowest) as isize - first_row, land(fastest) as isize + 1 - first_row);
            if to < 0 || from >= rows {
                continue;
            }
            let velocities = source.velocity.row(y);
            let mut x = 0;
            while x < width {
                let velocity = velocities[x];
                let run = velocities[x..].iter().take_while(|other| **other == velocity).count();
                let cells = x..x + run;
                x = cells.end;
                let target_y = (y << 8).cast_signed() + shift(velocity.y, scale_y);
                let inside_y = (target_y >> 8) as isize - first_row;
                if inside_y < -1 || inside_y >= rows {
                    continue;
                }
                let moved = [shift(velocity.x, scale_x), target_y];
                if run >= MIN_RUN {
                    self.splat_run(y, cells, moved, &cell);
                    continue;
                }
                for x in cells {
                    self.splat_cell(y, x, moved, &cell);
                }
            }
        }
    }

    /// Splats cell (`x`, `y`), which lands `moved_x` right of its place in row `target_y`, Q8.
    #[inline(always)]
    fn splat_cell(
        &mut self,
        y: u32,
        x: usize,
        [moved_x, target_y]: [i32; 2],
        cell: impl Fn(&mut u32, &mut u32, u32, u32),
    ) {
        let width = self.source.velocity.width() as usize;
        let rows = (self.top.len() / width).cast_signed();
        let target_x = ((x << 8) as i32) + moved_x;
        let (left, fx) = (target_x >> 8, (target_x & 0xff).cast_unsigned());
        let (above, fy) = (target_y >> 8, (target_y & 0xff).cast_unsigned());
        let inside_y = above as isize - self.first_row as isize;
        // Most cells: all four inside.
        if !(0..rows - 1).contains(&inside_y) || !(0..width as i32 - 1).contains(&left) {
            self.splat_run(y, x..x + 1, [moved_x, target_y], cell);
            return;
        }
        let place = inside_y.cast_unsigned() * width + left as usize;
        let (depth, index) = (self.source.depth.row(y)[x], y * width as u32 + x as u32);
        let mut splat = |place: usize, way: u32| {
            let candidate = ((way >> 2) << SOURCE_BITS) | index;
            cell(&mut self.top[place], &mut self.splat[place], depth, candidate);
        };
        splat(place, fx + fy);
        if fx > 0 {
            splat(place + 1, 256 - fx + fy);
        }
        if fy > 0 {
            splat(place + width, fx + 256 - fy);
            if fx > 0 {
                splat(place + width + 1, 512 - fx - fy);
            }
        }
    }

    /// As [`Self::splat_cell`] for the cells `cells` of row `y`, which move alike.
    #[inline(always)]
    fn splat_run(
        &mut self,
        y: u32,
        cells: Range<usize>,
        [moved_x, target_y]: [i32; 2],
        cell: impl Fn(&mut u32, &mut u32, u32, u32),
    ) {
        let width = self.source.velocity.width() as usize;
        let rows = (self.top.len() / width).cast_signed();
        let (right_by, fx) = ((moved_x >> 8) as isize, (moved_x & 0xff).cast_unsigned());
        let (above, fy) = (target_y >> 8, (target_y & 0xff).cast_unsigned());
        let depths = self.source.depth.row(y);
        for (row, way_y) in [(above, fy), (above + 1, 256 - fy)] {
            let row = row as isize - self.first_row as isize;
            if way_y == 256 || row < 0 || row >= rows {
                continue;
            }
            for (right_by, way_x) in [(right_by, fx), (right_by + 1, 256 - fx)] {
                let end = width.saturating_add_signed(-right_by).min(cells.end);
                let start = 0_usize.saturating_add_signed(-right_by).max(cells.start);
                if way_x == 256 || start >= end {
                    continue;
                }
                let place = row.cast_unsigned() * width + start.wrapping_add_signed(right_by);
                let count = end - start;
                let (tops, splats) =
                    (&mut self.top[place..][..count], &mut self.splat[place..][..count]);
                let first =
                    ((way_x + way_y) >> 2 << SOURCE_BITS) | (y * width as u32 + start as u32);
                let targets = tops.iter_mut().zip(splats).zip(&depths[start..end]);
                for (candidate, ((top, splat), &depth)) in (first..).zip(targets) {
                    cell(top, splat, depth, candidate);
                }
            }
        }
    }
}

/// Displacement in Q8 cells of (1).
fn shift(v: i16, scale: i32) -> i32 {
    (i32::from(v) * scale + 256) >> 9
}
