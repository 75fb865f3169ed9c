//! The reference of [`super`].

use rayon::ThreadPool;

use super::VoxelScratch;
use crate::color::{ColorPlane, Texel};
use crate::field::FieldMap;
use crate::fill::far_side::NO_CELL;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::blend::blend;
use crate::warp::linear::one_cell;
use crate::warp::resolve::{CellClass, HOLE};
use crate::warp::sample::sample;
use crate::warp::scatter::{NO_SOURCE, source_of};
use crate::warp::{for_each_valid_row, moved};

/// Depth keys of one surface in two keys may differ by one part in 2 to this power, as in motion
/// that is composed over several frames.
pub const SAME_SURFACE_SHIFT: u32 = 3;

/// The keys around a frame and where between them it lies.
#[derive(Clone, Copy, Debug)]
pub struct Between<'a> {
    /// The key before the frame.
    pub older: &'a KeyFrame,
    /// The key after it.
    pub newer: &'a KeyFrame,
    /// From the frame to the newer key, in spans of the newer key's motion.
    pub phase: Phase,
}

/// The part that the older key has in a frame between two.
#[derive(Clone, Copy, Debug)]
pub struct OlderPart {
    /// From that key to the frame, in spans of the newer key's motion.
    pub ahead: Phase,
    /// Its share, 1/256.
    pub weight: u32,
}

/// The part that `between.older` has; None where nothing is known of how surfaces came to the newer
/// key: then the frame is the mean of both.
#[must_use]
pub fn older_part(between: &Between<'_>) -> Option<OlderPart> {
    let Between { older, newer, phase } = *between;
    let whole = Phase::at(newer.content_time, older.content_time, newer.motion_span()?);
    // A frame lies between the keys, so neither share is 0.
    let weight = (phase.q12() * 256 + whole.q12() / 2) / whole.q12().max(1);
    Some(OlderPart {
        ahead: Phase::from_q12(whole.q12() - phase.q12()),
        weight: weight.clamp(0, 256).cast_unsigned(),
    })
}

/// Makes the frame between two keys into `out`, which has their size and format. `map` is the map
/// of the newer key's field grid; `scratch` has taken that key if it has a velocity field.
pub fn warp_voxel(
    pool: &ThreadPool,
    between: &Between<'_>,
    map: &FieldMap,
    scratch: &mut VoxelScratch,
    out: &mut ColorPlane,
) {
    let Between { older, newer, phase } = *between;
    let Some(OlderPart { ahead, weight }) = older_part(between) else {
        blend(pool, &older.color, &newer.color, out);
        return;
    };
    scratch.resolve(pool, map, phase, older);
    let has_depth = !newer.depth.data().is_empty()
        && !older.depth.data().is_empty()
        && !scratch.source.is_still();
    let frame = Frame {
        has_depth,
        field: scratch,
        map,
        older,
        valid: newer.valid,
        phase,
        ahead,
        older_weight: weight,
        one_cell: one_cell(map),
    };
    match (&older.color, &newer.color, out) {
        (ColorPlane::Rgba8(a), ColorPlane::Rgba8(b), ColorPlane::Rgba8(out)) => {
            filter(pool, &frame, [a, b], out);
        }
        (ColorPlane::Rgb10a2(a), ColorPlane::Rgb10a2(b), ColorPlane::Rgb10a2(out)) => {
            filter(pool, &frame, [a, b], out);
        }
        (ColorPlane::Rgba16f(a), ColorPlane::Rgba16f(b), ColorPlane::Rgba16f(out)) => {
            filter(pool, &frame, [a, b], out);
        }
        _ => unreachable!("all keys of a stream have its format"),
    }
}

/// Everything that a pixel reads beside colour.
struct Frame<'a> {
    /// Whether depths of the two keys can be compared. Where nothing moves none are kept.
    has_depth: bool,
    field: &'a VoxelScratch,
    map: &'a FieldMap,
    older: &'a KeyFrame,
    valid: Rect,
    /// From the frame to the newer key, and from the older key to the frame, in motion spans.
    phase: Phase,
    ahead: Phase,
    older_weight: u32,
    /// Mean of a cell's width and height, Q8 pixels.
    one_cell: i32,
}

fn filter<T: Texel>(
    pool: &ThreadPool,
    frame: &Frame<'_>,
    [older, newer]: [&Plane<T>; 2],
    out: &mut Plane<T>,
) {
    for_each_valid_row(pool, frame.valid, newer, out, |index_y, row| {
        let cell_y = frame.map.y.cell_of(index_y);
        for (index_x, texel) in (0..).zip(row) {
            let cell = [frame.map.x.cell_of(index_x), cell_y];
            let p = [frame.valid.x + index_x, frame.valid.y + index_y];
            let p = p.map(|p| (p << 8).cast_signed());
            *texel = match frame.shown(cell, p) {
                Some(surface) => frame.filtered([older, newer], p, surface),
                None => frame.hole([older, newer], cell, p),
            };
        }
    });
}

/// A surface that comes to a pixel.
#[derive(Clone, Copy)]
struct Surface {
    depth: u32,
    /// Older minus newer position.
    turned: Velocity,
}

impl Frame<'_> {
    /// The surface that comes to pixel centre `p` in `cell`. None in a hole.
    fn shown(&self, cell: [u32; 2], p: [i32; 2]) -> Option<Surface> {
        let field = self.field;
        if field.class.at(cell[0], cell[1]) == CellClass::Smooth {
            let source = source_of(field.splat.at(cell[0], cell[1]));
            let depth = field.source.depth.data().get(source).copied().unwrap_or(0);
            return Some(Surface { depth, turned: field.source.velocity.data()[source] });
        }
        let (mut best, mut smallest) = (None::<Surface>, i32::MAX);
        for candidate in self.candidates(cell) {
            let [dx, dy] = moved(candidate, self.phase);
            let Some(near) = self.newer_at([p[0] - dx, p[1] - dy]) else { continue };
            let [near_dx, near_dy] = moved(near.turned, self.phase);
            let error = (near_dx - dx).abs() + (near_dy - dy).abs();
            if error > self.one_cell {
                continue;
            }
            let is_better = best.is_none_or(|best| {
                let is_one = best.depth.abs_diff(near.depth) <= best.depth.max(near.depth) >> 8;
                if is_one { error < smallest } else { near.depth > best.depth }
            });
            if is_better {
                (best, smallest) = (Some(Surface { turned: candidate, ..near }), error);
            }
        }
        best
    }

    /// The turned velocities that 3x3 cells carry, in reading order.
    fn candidates(&self, [cell_x, cell_y]: [u32; 2]) -> impl Iterator<Item = Velocity> + '_ {
        let carried = &self.field.carried;
        let columns = cell_x.saturating_sub(1)..=(cell_x + 1).min(carried.width() - 1);
        let rows = cell_y.saturating_sub(1)..=(cell_y + 1).min(carried.height() - 1);
        let cells = rows.flat_map(move |y| columns.clone().map(move |x| (x, y)));
        let velocity = |(x, y)| {
            let [x, y] = carried.at(x, y);
            Velocity { x, y }
        };
        cells.map(velocity).filter(|velocity| *velocity != HOLE)
    }

    /// What the newer key shows at the pixel nearest to `q`. None outside.
    fn newer_at(&self, q: [i32; 2]) -> Option<Surface> {
        let [x, y] = index_of(q, self.valid)?;
        let (cell_x, cell_y) = (self.map.x.cell_of(x), self.map.y.cell_of(y));
        let source = &self.field.source;
        let cell = cell_y as usize * source.velocity.width() as usize + cell_x as usize;
        let depth = source.depth.data().get(cell).copied().unwrap_or(0);
        Some(Surface { depth, turned: source.velocity.data()[cell] })
    }

    /// Depth key of the older key at the pixel nearest to `q`. None outside, and where depths
    /// cannot be compared.
    fn older_depth_at(&self, q: [i32; 2]) -> Option<u32> {
        let [x, y] = index_of(q, self.older.valid).filter(|_| self.has_depth)?;
        let map = &self.field.older_map;
        Some(self.older.depth.at(map.x.cell_of(x), map.y.cell_of(y)))
    }

    /// (1) to (3).
    fn filtered<T: Texel>(
        &self,
        [older, newer]: [&Plane<T>; 2],
        p: [i32; 2],
        surface: Surface,
    ) -> T {
        let [q1, q0] = self.places(p, surface.turned);
        let in_newer = sample(newer, self.valid, q1[0], q1[1]);
        let is_inside = index_of(q0, self.older.valid).is_some();
        let is_same = self.older_depth_at(q0).is_none_or(|depth| {
            depth.abs_diff(surface.depth) <= (depth.max(surface.depth) >> SAME_SURFACE_SHIFT)
        });
        if !(is_inside && is_same) {
            return in_newer;
        }
        let in_older = sample(older, self.older.valid, q0[0], q0[1]);
        T::mix(in_newer, in_older, self.older_weight)
    }

    /// (4).
    fn hole<T: Texel>(
        &self,
        [older, newer]: [&Plane<T>; 2],
        [cell_x, cell_y]: [u32; 2],
        p: [i32; 2],
    ) -> T {
        let field = self.field;
        let is_hole = field.splat.at(cell_x, cell_y) == NO_SOURCE;
        let cell = cell_y * field.splat.width() + cell_x;
        let far = if is_hole { field.far.at(cell_x, cell_y) } else { cell };
        if far == NO_CELL {
            return sample(older, self.older.valid, p[0], p[1]);
        }
        let source = source_of(field.splat.data()[far as usize]);
        let depth = field.source.depth.data().get(source).copied().unwrap_or(0);
        let [q1, q0] = self.places(p, field.source.velocity.data()[source]);
        let is_hidden = self
            .older_depth_at(q0)
            .is_some_and(|older| older - (older >> SAME_SURFACE_SHIFT) > depth);
        if is_hidden {
            sample(newer, self.valid, q1[0], q1[1])
        } else {
            sample(older, self.older.valid, q0[0], q0[1])
        }
    }

    /// (1): the places in the newer and in the older key of what comes to `p`.
    fn places(&self, p: [i32; 2], turned: Velocity) -> [[i32; 2]; 2] {
        let ([back_x, back_y], [on_x, on_y]) =
            (moved(turned, self.phase), moved(turned, self.ahead));
        [[p[0] - back_x, p[1] - back_y], [p[0] + on_x, p[1] + on_y]]
    }
}

/// Column and row in `valid` of the pixel nearest to `q`, Q8. None outside.
fn index_of(q: [i32; 2], valid: Rect) -> Option<[u32; 2]> {
    let x = u32::try_from(((q[0] + 128) >> 8) - valid.x.cast_signed()).ok()?;
    let y = u32::try_from(((q[1] + 128) >> 8) - valid.y.cast_signed()).ok()?;
    (x < valid.width && y < valid.height).then_some([x, y])
}
