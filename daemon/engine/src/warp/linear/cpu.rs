//! The reference of [`super`].

use std::cell::RefCell;

use rayon::ThreadPool;

use super::LinearScratch;
use super::between::RowCells;
use super::broken::BrokenRow;
use super::previous::{MOST_KEYS, Memory, linked_keys};
use crate::color::{ColorPlane, Texel};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::for_each_valid_row;
use crate::warp::sample::{Listed, Positions as _, sample, sample_run};

/// Warps `key` to `phase` into `out`, which has the key's size and format. `past` are the keys before
/// it, from the newest on, `map` is the map of the key's field grid; `scratch` has taken the key.
pub fn warp_linear(
    pool: &ThreadPool,
    key: &KeyFrame,
    past: &[&KeyFrame],
    map: &FieldMap,
    phase: Phase,
    scratch: &mut LinearScratch,
    out: &mut ColorPlane,
) {
    if scratch.source.is_still() {
        out.copy_from(&key.color);
        return;
    }
    scratch.resolve(pool, map, phase);
    let mut frame = Frame::new(scratch, map, key.valid, phase);
    frame.memory = Memory::of(key, past);
    let past = &past[..linked_keys(key, past)];
    match (&key.color, out) {
        (ColorPlane::Rgba8(color), ColorPlane::Rgba8(out)) => {
            let older = planes(color, past, |color| match color {
                ColorPlane::Rgba8(plane) => Some(plane),
                _ => None,
            });
            gather(pool, &frame, color, older, out);
        }
        (ColorPlane::Rgb10a2(color), ColorPlane::Rgb10a2(out)) => {
            let older = planes(color, past, |color| match color {
                ColorPlane::Rgb10a2(plane) => Some(plane),
                _ => None,
            });
            gather(pool, &frame, color, older, out);
        }
        (ColorPlane::Rgba16f(color), ColorPlane::Rgba16f(out)) => {
            let older = planes(color, past, |color| match color {
                ColorPlane::Rgba16f(plane) => Some(plane),
                _ => None,
            });
            gather(pool, &frame, color, older, out);
        }
        _ => unreachable!("the engine gives the output the format of the key"),
    }
}

/// The colour of each key of `past`, and `color` where there are no more.
fn planes<'a, T>(
    color: &'a Plane<T>,
    past: &[&'a KeyFrame],
    of: impl Fn(&'a ColorPlane) -> Option<&'a Plane<T>>,
) -> [&'a Plane<T>; MOST_KEYS] {
    let mut planes = [color; MOST_KEYS];
    for (plane, older) in planes.iter_mut().zip(past.iter().filter_map(|key| of(&key.color))) {
        *plane = older;
    }
    planes
}

/// Mean of a cell's width and height, Q8 pixels.
#[must_use]
pub fn one_cell(map: &FieldMap) -> i32 {
    let cell_px = map.x.pixels().div_ceil(map.x.cells()) + map.y.pixels().div_ceil(map.y.cells());
    (cell_px << 7).cast_signed()
}

/// Everything that a pixel reads beside colour.
pub(super) struct Frame<'a> {
    pub(super) field: &'a LinearScratch,
    pub(super) map: &'a FieldMap,
    pub(super) valid: Rect,
    pub(super) phase: Phase,
    /// Mean of a cell's width and height, Q8 pixels.
    pub(super) one_cell: i32,
    /// The keys before, as far as holes may be filled from them.
    pub(super) memory: Memory<'a>,
}

/// The surface that the key shows at a place.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    pub(super) depth: u32,
    pub(super) velocity: Velocity,
}

fn gather<T: Texel>(
    pool: &ThreadPool,
    frame: &Frame<'_>,
    color: &Plane<T>,
    older: [&Plane<T>; MOST_KEYS],
    out: &mut Plane<T>,
) {
    for_each_valid_row(
        pool,
        frame.valid,
        color,
        out,
        #[inline(always)]
        |index_y, row| gather_row(frame, color, older, index_y, row),
    );
}

/// Pixels that are read together, a bit for each.
pub(super) const BLOCK: usize = u64::BITS as usize;

/// What a row of pixels needs, kept from row to row.
#[derive(Debug, Default)]
struct RowScratch {
    cells: RowCells,
    broken: BrokenRow,
}

thread_local! {
    static ROW: RefCell<RowScratch> = RefCell::default();
}

/// One row of the valid rectangle.
#[inline(always)]
fn gather_row<T: Texel>(
    frame: &Frame<'_>,
    color: &Plane<T>,
    older: [&Plane<T>; MOST_KEYS],
    index_y: u32,
    row: &mut [T],
) {
    // Taken and put back, as a closure given to the thread's storage is not made for AVX2.
    let mut scratch = ROW.take();
    scratch.cells.update(frame, index_y);
    scratch.broken.update(frame, index_y);
    let mut rest = 0;
    for (block, texels) in (0..).zip(row.chunks_mut(BLOCK)) {
        let first = block * BLOCK as u32;
        let broken = scratch.broken.take(&mut rest, first);
        gather_block(frame, color, &scratch.cells, broken, [first, index_y], texels);
    }
    scratch.broken.read(color, frame.valid, row);
    for (column, key, [x, y]) in scratch.broken.older() {
        row[column as usize] = sample(older[usize::from(key)], frame.valid, x, y);
    }
    ROW.set(scratch);
}

/// The pixels from `index` of the valid rectangle on, at most [`BLOCK`]: anything where a bit of
/// `broken` says that they lie in broken cells.
#[inline(always)]
fn gather_block<T: Texel>(
    frame: &Frame<'_>,
    color: &Plane<T>,
    cells: &RowCells,
    broken: u64,
    index: [u32; 2],
    texels: &mut [T],
) {
    let positions = cells.positions(frame, index, texels.len(), broken);
    if cells.is_finer {
        let (mut xs, mut ys) = ([0; BLOCK], [0; BLOCK]);
        let (xs, ys) = (&mut xs[..texels.len()], &mut ys[..texels.len()]);
        for (i, (x, y)) in xs.iter_mut().zip(ys.iter_mut()).enumerate() {
            [*x, *y] = positions.at(i);
        }
        return T::sample_each(color, frame.valid, &Listed { xs, ys }, texels);
    }
    let shared = if broken == 0 { cells.shared(frame, index[0], texels.len()) } else { None };
    if let Some([dx, dy]) = shared {
        let [p_x, p_y] = frame.centre(index);
        sample_run(color, frame.valid, [p_x - dx, p_y - dy], texels);
    } else {
        T::sample_each(color, frame.valid, &positions, texels);
    }
}

impl<'a> Frame<'a> {
    /// # Panics
    /// If the planes of `field` are not of the size that `map` is of.
    fn new(field: &'a LinearScratch, map: &'a FieldMap, valid: Rect, phase: Phase) -> Self {
        let cells = [map.x.cells(), map.y.cells()];
        let source = &field.source;
        let sizes = [
            [source.depth.width(), source.depth.height()],
            [source.velocity.width(), source.velocity.height()],
            [field.carried.width(), field.carried.height()],
            [field.class.width(), field.class.height()],
        ];
        assert_eq!(sizes, [cells; 4], "every plane of the field has the size of its grid");
        Self { field, map, valid, phase, one_cell: one_cell(map), memory: Memory::default() }
    }

    /// Centre of a pixel that is counted from the top left of the valid rectangle, Q8.
    #[inline(always)]
    pub(super) fn centre(&self, [column, row]: [u32; 2]) -> [i32; 2] {
        [self.valid.x + column, self.valid.y + row].map(|p| (p << 8).cast_signed())
    }

    /// The surface that the key shows at the pixel nearest to `q`; None outside.
    #[inline(always)]
    pub(super) fn surface_at(&self, q: [i32; 2]) -> Option<Surface> {
        // Left of or above the rectangle the difference wraps and is larger than any size.
        let column = (((q[0] + 128) >> 8) - self.valid.x.cast_signed()).cast_unsigned();
        let row = (((q[1] + 128) >> 8) - self.valid.y.cast_signed()).cast_unsigned();
        if column >= self.valid.width || row >= self.valid.height {
            return None;
        }
        let source = &self.field.source;
        let (cell_x, cell_y) = (self.map.x.cell_of(column), self.map.y.cell_of(row));
        let cell = cell_y as usize * source.depth.width() as usize + cell_x as usize;
        Some(Surface { depth: source.depth.data()[cell], velocity: source.velocity.data()[cell] })
    }
}
