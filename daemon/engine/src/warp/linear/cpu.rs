//! The reference of [`super`].

use rayon::ThreadPool;

use super::LinearScratch;
use super::between::{BLOCK, Between};
use crate::bands::for_each_row;
use crate::color::{ColorPlane, Texel};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::displacement;
use crate::warp::resolve::{CellClass, HOLE};
use crate::warp::sample::{sample, sample_run};

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

/// A place in the key and the surface that the key shows there.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    pub(super) depth: u32,
    pub(super) velocity: Velocity,
}

fn gather<T: Texel>(pool: &ThreadPool, frame: &Frame<'_>, color: &Plane<T>, out: &mut Plane<T>) {
    let valid = frame.valid;
    for_each_row(
        pool,
        out,
        #[inline(always)]
        |y, row| {
            if !(valid.y..valid.y + valid.height).contains(&y) {
                row.copy_from_slice(color.row(y));
                return;
            }
            let (left, right) = (valid.x as usize, (valid.x + valid.width) as usize);
            row[..left].copy_from_slice(&color.row(y)[..left]);
            row[right..].copy_from_slice(&color.row(y)[right..]);
            gather_row(frame, color, y - valid.y, &mut row[left..right]);
        },
    );
}

/// One row of the valid rectangle.
#[inline(always)]
fn gather_row<T: Texel>(frame: &Frame<'_>, color: &Plane<T>, index_y: u32, row: &mut [T]) {
    let class = frame.field.class.row(frame.map.y.cell_of(index_y));
    let p_y = ((frame.valid.y + index_y) << 8).cast_signed();
    let mut between = Between::new(frame, index_y);
    for (block, texels) in (0..).zip(row.chunks_mut(BLOCK)) {
        let first = block * BLOCK as u32;
        let p_x = ((frame.valid.x + first) << 8).cast_signed();
        between.go_to(first, texels.len());
        if let Some([dx, dy]) = between.shared() {
            sample_run(color, frame.valid, [p_x - dx, p_y - dy], texels);
        } else {
            let (mut xs, mut ys) = ([0; BLOCK], [0; BLOCK]);
            let (xs, ys) = (&mut xs[..texels.len()], &mut ys[..texels.len()]);
            between.positions([p_x, p_y], xs, ys);
            T::sample_each(color, frame.valid, xs, ys, texels);
        }
        let end = first + texels.len() as u32 - 1;
        let (left, right) = (frame.map.x.cell_of(first), frame.map.x.cell_of(end));
        let classes = &class[left as usize..=right as usize];
        if !classes.iter().fold(false, |any, class| any | (*class == CellClass::Broken)) {
            continue;
        }
        for (index_x, texel) in (first..).zip(texels) {
            if class[frame.map.x.cell_of(index_x) as usize] == CellClass::Broken {
                let p_x = ((frame.valid.x + index_x) << 8).cast_signed();
                *texel = broken_pixel(frame, color, [index_x, index_y], [p_x, p_y]);
            }
        }
    }
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
            let [vx, vy] = carried.at(x, y);
            let velocity = Velocity { x: vx, y: vy };
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
