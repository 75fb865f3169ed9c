//! The reference of [`super`].

use rayon::ThreadPool;

use super::LinearScratch;
use crate::bands::for_each_row;
use crate::color::{ColorPlane, Texel};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::displacement;
use crate::warp::resolve::{CellClass, HOLE};
use crate::warp::sample::sample;

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
    scratch.resolve(pool, map, phase);
    let cell_px = map.x.pixels().div_ceil(map.x.cells()) + map.y.pixels().div_ceil(map.y.cells());
    let frame = Frame {
        field: scratch,
        map,
        valid: key.valid,
        phase,
        one_cell: (cell_px << 7).cast_signed(),
    };
    match (&key.color, out) {
        (ColorPlane::Rgba8(color), ColorPlane::Rgba8(out)) => gather(pool, &frame, color, out),
        (ColorPlane::Rgb10a2(color), ColorPlane::Rgb10a2(out)) => gather(pool, &frame, color, out),
        (ColorPlane::Rgba16f(color), ColorPlane::Rgba16f(out)) => gather(pool, &frame, color, out),
        _ => unreachable!("the engine gives the output the format of the key"),
    }
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

/// A place in the key and the surface that the key shows there.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    pub(super) depth: u32,
    pub(super) velocity: Velocity,
}

fn gather<T: Texel>(pool: &ThreadPool, frame: &Frame<'_>, color: &Plane<T>, out: &mut Plane<T>) {
    let valid = frame.valid;
    for_each_row(pool, out, |y, row| {
        if !(valid.y..valid.y + valid.height).contains(&y) {
            row.copy_from_slice(color.row(y));
            return;
        }
        let (left, right) = (valid.x as usize, (valid.x + valid.width) as usize);
        row[..left].copy_from_slice(&color.row(y)[..left]);
        row[right..].copy_from_slice(&color.row(y)[right..]);
        gather_row(frame, color, y - valid.y, &mut row[left..right]);
    });
}

/// One row of the valid rectangle.
fn gather_row<T: Texel>(frame: &Frame<'_>, color: &Plane<T>, index_y: u32, row: &mut [T]) {
    let map = frame.map;
    let class = frame.field.class.row(map.y.cell_of(index_y));
    let mut columns = Columns::new(frame, index_y);
    for (index_x, texel) in (0..).zip(row) {
        let p = [frame.valid.x + index_x, frame.valid.y + index_y].map(|p| (p << 8).cast_signed());
        *texel = match class[map.x.cell_of(index_x) as usize] {
            CellClass::Smooth => {
                let [dx, dy] = columns.displacement(index_x);
                sample(color, frame.valid, p[0] - dx, p[1] - dy)
            }
            CellClass::Broken => broken_pixel(frame, color, [index_x, index_y], p),
        };
    }
}

/// Displacements of the two cell columns around a pixel, interpolated down to its row.
struct Columns<'a> {
    frame: &'a Frame<'a>,
    above: &'a [Velocity],
    below: &'a [Velocity],
    way_y: i32,
    /// The left column, and the displacements in it and in the next one.
    left: u32,
    pair: [[i32; 2]; 2],
}

impl<'a> Columns<'a> {
    fn new(frame: &'a Frame<'a>, index_y: u32) -> Self {
        let (y, way) = frame.map.y.before(index_y);
        let carried = &frame.field.carried;
        let mut columns = Self {
            frame,
            above: carried.row(y),
            below: carried.row((y + 1).min(carried.height() - 1)),
            way_y: way.cast_signed(),
            left: 0,
            pair: [[0; 2]; 2],
        };
        columns.pair = [columns.column(0), columns.column(1)];
        columns
    }

    fn column(&self, x: u32) -> [i32; 2] {
        let x = (x as usize).min(self.above.len() - 1);
        let above = displacement(self.above[x], self.frame.phase);
        let below = displacement(self.below[x], self.frame.phase);
        lerp(above, below, self.way_y)
    }

    /// (1) for the pixel `index_x`; to be asked for from left to right.
    fn displacement(&mut self, index_x: u32) -> [i32; 2] {
        let (left, way) = self.frame.map.x.before(index_x);
        if left != self.left {
            let next = if left == self.left + 1 { self.pair[1] } else { self.column(left) };
            self.pair = [next, self.column(left + 1)];
            self.left = left;
        }
        lerp(self.pair[0], self.pair[1], way.cast_signed())
    }
}

/// `a + ((b - a) way + 128) / 256`, rounded down. Displacements stay below 2^20, so nothing
/// overflows; in a smooth cell they differ by half a pixel at most.
fn lerp(a: [i32; 2], b: [i32; 2], way: i32) -> [i32; 2] {
    [a[0] + (((b[0] - a[0]) * way + 128) >> 8), a[1] + (((b[1] - a[1]) * way + 128) >> 8)]
}

impl Frame<'_> {
    /// The surface that the key shows at the pixel nearest to `q`; None outside.
    pub(super) fn surface_at(&self, q: [i32; 2]) -> Option<Surface> {
        let x = ((q[0] + 128) >> 8) - self.valid.x.cast_signed();
        let y = ((q[1] + 128) >> 8) - self.valid.y.cast_signed();
        let (x, y) = (u32::try_from(x).ok()?, u32::try_from(y).ok()?);
        if x >= self.valid.width || y >= self.valid.height {
            return None;
        }
        let (cell_x, cell_y) = (self.map.x.cell_of(x), self.map.y.cell_of(y));
        let source = &self.field.source;
        Some(Surface {
            depth: source.depth.at(cell_x, cell_y),
            velocity: source.velocity.at(cell_x, cell_y),
        })
    }
}

/// (2), and where it finds nothing, (3) and (4), for the pixel `index` of the valid rectangle,
/// whose centre is `p`.
fn broken_pixel<T: Texel>(frame: &Frame<'_>, color: &Plane<T>, index: [u32; 2], p: [i32; 2]) -> T {
    let carried = &frame.field.carried;
    let (cell_x, cell_y) = (frame.map.x.cell_of(index[0]), frame.map.y.cell_of(index[1]));
    let mut best: Option<Candidate> = None;
    let mut last = HOLE;
    for y in cell_y.saturating_sub(1)..=(cell_y + 1).min(carried.height() - 1) {
        for x in cell_x.saturating_sub(1)..=(cell_x + 1).min(carried.width() - 1) {
            let velocity = carried.at(x, y);
            if velocity == HOLE || velocity == last {
                continue;
            }
            last = velocity;
            let candidate = Candidate::new(frame, p, velocity);
            if candidate.is_some_and(|found| best.is_none_or(|best| found.beats(&best))) {
                best = candidate;
            }
        }
    }
    match best {
        Some(best) => sample(color, frame.valid, best.q[0], best.q[1]),
        None => super::fill::hole_pixel(frame, color, [cell_x, cell_y], p),
    }
}

/// A place in the key that a pixel may show.
#[derive(Clone, Copy)]
struct Candidate {
    q: [i32; 2],
    depth: u32,
    /// `e` of (2).
    error: i32,
}

impl Candidate {
    /// None where the surface at q does not come to p.
    fn new(frame: &Frame<'_>, p: [i32; 2], velocity: Velocity) -> Option<Self> {
        let [dx, dy] = displacement(velocity, frame.phase);
        let q = [p[0] - dx, p[1] - dy];
        let near = frame.surface_at(q)?;
        let [near_dx, near_dy] = displacement(near.velocity, frame.phase);
        let error = (near_dx - dx).abs() + (near_dy - dy).abs();
        (error <= frame.one_cell).then_some(Self { q, depth: near.depth, error })
    }

    fn beats(&self, other: &Self) -> bool {
        if self.depth < other.depth - (other.depth >> 8) {
            return false;
        }
        other.depth < self.depth - (self.depth >> 8) || self.error < other.error
    }
}
