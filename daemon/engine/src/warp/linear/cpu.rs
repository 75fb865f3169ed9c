//! The reference of [`super`].

use rayon::ThreadPool;

use super::LinearScratch;
use super::between::with_row_cells;
use super::broken::broken_cell;
use crate::color::{ColorPlane, Texel};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::for_each_valid_row;
use crate::warp::resolve::CellClass;
use crate::warp::sample::{Positions as _, sample, sample_run};

/// Warps `key` to `phase` into `out`, which has the key's size and format. `map` is the map of
/// the key's field grid; `scratch` has taken the key.
pub fn warp_linear(
    pool: &ThreadPool,
    key: &KeyFrame,
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
    let frame = Frame { field: scratch, map, valid: key.valid, phase, one_cell: one_cell(map) };
    match (&key.color, out) {
        (ColorPlane::Rgba8(color), ColorPlane::Rgba8(out)) => gather(pool, &frame, color, out),
        (ColorPlane::Rgb10a2(color), ColorPlane::Rgb10a2(out)) => gather(pool, &frame, color, out),
        (ColorPlane::Rgba16f(color), ColorPlane::Rgba16f(out)) => gather(pool, &frame, color, out),
        _ => unreachable!("the engine gives the output the format of the key"),
    }
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
}

/// The surface that the key shows at a place.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    pub(super) depth: u32,
    pub(super) velocity: Velocity,
}

fn gather<T: Texel>(pool: &ThreadPool, frame: &Frame<'_>, color: &Plane<T>, out: &mut Plane<T>) {
    for_each_valid_row(
        pool,
        frame.valid,
        color,
        out,
        #[inline(always)]
        |index_y, row| gather_row(frame, color, index_y, row),
    );
}

/// Pixels that are read together where they all move alike.
const BLOCK: usize = 64;
/// Cells whose classes are looked at together.
const CLASSES: usize = 32;

/// One row of the valid rectangle.
#[inline(always)]
fn gather_row<T: Texel>(frame: &Frame<'_>, color: &Plane<T>, index_y: u32, row: &mut [T]) {
    let cell_y = frame.map.y.cell_of(index_y);
    let class = frame.field.class.row(cell_y);
    // Wide steps hold the cells of grids that are no finer than colour.
    let is_finer = frame.map.x.cells() > frame.map.x.pixels();
    with_row_cells(
        frame,
        index_y,
        #[inline(always)]
        |cells| {
            for (block, texels) in (0..).zip(row.chunks_mut(BLOCK)) {
                let first = block * BLOCK as u32;
                let p = [frame.valid.x + first, frame.valid.y + index_y];
                if let Some([dx, dy]) = cells.shared(frame, first, texels.len()) {
                    let [p_x, p_y] = p.map(|p| (p << 8).cast_signed());
                    sample_run(color, frame.valid, [p_x - dx, p_y - dy], texels);
                    continue;
                }
                let positions = cells.positions(frame, [first, index_y], texels.len());
                if is_finer {
                    for (i, texel) in texels.iter_mut().enumerate() {
                        let [x, y] = positions.at(i);
                        *texel = sample(color, frame.valid, x, y);
                    }
                } else {
                    T::sample_each(color, frame.valid, &positions, texels);
                }
            }
        },
    );
    for (group, classes) in class.chunks(CLASSES).enumerate() {
        if !classes.iter().fold(false, |any, class| any | (*class == CellClass::Broken)) {
            continue;
        }
        let cells = (group * CLASSES..).zip(classes);
        for (cell, _) in cells.filter(|(_, class)| **class == CellClass::Broken) {
            let pixels = frame.map.x.pixels_of(cell);
            let first = frame.valid.x + pixels.start as u32;
            let p = [first, frame.valid.y + index_y].map(|p| (p << 8).cast_signed());
            broken_cell(frame, color, [cell as u32, cell_y], p, &mut row[pixels]);
        }
    }
}

impl Frame<'_> {
    /// The surface that the key shows at the pixel nearest to `q`; None outside.
    #[inline(always)]
    pub(super) fn surface_at(&self, q: [i32; 2]) -> Option<Surface> {
        let (surface, is_inside) = self.surface_near(q);
        is_inside.then_some(surface)
    }

    /// The surface that the key shows at the pixel of the valid rectangle nearest to `q`, and
    /// whether `q` lies on that pixel.
    #[inline(always)]
    pub(super) fn surface_near(&self, q: [i32; 2]) -> (Surface, bool) {
        let x = ((q[0] + 128) >> 8) - self.valid.x.cast_signed();
        let y = ((q[1] + 128) >> 8) - self.valid.y.cast_signed();
        let last = [self.valid.width, self.valid.height].map(|length| length.cast_signed() - 1);
        let inside = [x.clamp(0, last[0]), y.clamp(0, last[1])];
        let [column, row] = inside.map(i32::cast_unsigned);
        let source = &self.field.source;
        let (cell_x, cell_y) = (self.map.x.cell_of(column), self.map.y.cell_of(row));
        let cell = cell_y as usize * source.depth.width() as usize + cell_x as usize;
        let surface =
            Surface { depth: source.depth.data()[cell], velocity: source.velocity.data()[cell] };
        (surface, inside == [x, y])
    }
}
