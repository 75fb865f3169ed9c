//! What a hole shows: (3) to (5) of [`super`].

use super::cpu::Frame;
use super::previous::Way;
use crate::fill::far_side::NO_CELL;
use crate::warp::displacement;
use crate::warp::scatter::{NO_SOURCE, source_of};

/// The surface that the holes of a cell continue.
#[derive(Clone, Copy)]
pub(super) struct FarSurface {
    /// The cell, and the source that it shows.
    pub(super) cell: u32,
    pub(super) source: u32,
    pub(super) depth: u32,
    displacement: [i32; 2],
}

/// The surface that holes in `cell` continue; None where nothing is resolved.
pub(super) fn far_surface(frame: &Frame<'_>, cell: [u32; 2]) -> Option<FarSurface> {
    let cell = far_cell(frame, cell)?;
    let source = source_of(frame.field.splat.data()[cell as usize]);
    Some(FarSurface {
        cell,
        source: u32::try_from(source).expect("a source has 25 bits"),
        depth: frame.field.source.depth.data()[source],
        displacement: displacement(frame.field.source.velocity.data()[source], frame.phase),
    })
}

/// Where pixel centre `p` of a hole in `cell` is read, which continues `far`. `way` keeps for the
/// others of the cell where that was in the keys before.
pub(super) fn hole_place(
    frame: &Frame<'_>,
    far: Option<FarSurface>,
    cell: [u32; 2],
    way: &mut Option<Way>,
    p: [i32; 2],
) -> HolePlace {
    let Some(far) = far else { return HolePlace::Key(p) };
    let [dx, dy] = far.displacement;
    // (3)
    let q = clamp(frame, [p[0] - dx, p[1] - dy]);
    if is_far(frame, q, far.depth) {
        return HolePlace::Key(far_place(frame, q, far.depth));
    }
    // (4)
    let way = way.get_or_insert_with(|| Way::new(frame, &far, cell));
    let seen = frame.memory.place(frame, way, [p[0] - dx, p[1] - dy]);
    if let Some((key, place)) = seen {
        return HolePlace::Older(key, place);
    }
    // (5)
    HolePlace::Key(stretched(frame, far, p))
}

/// Where a hole is read.
pub(super) enum HolePlace {
    /// In the key.
    Key([i32; 2]),
    /// In a key before, counted from 0.
    Older(u8, [i32; 2]),
}

/// (5).
fn stretched(frame: &Frame<'_>, far: FarSurface, p: [i32; 2]) -> [i32; 2] {
    let FarSurface { cell, source, depth, displacement: [dx, dy] } = far;
    let (width, map) = (frame.field.splat.width(), frame.map);
    let within = |p: i32, centre: i32, cell_px: i32| p.clamp(centre - cell_px, centre + cell_px);
    let half = frame.one_cell >> 1;
    let edge = [
        within(p[0], map.x.centre(cell % width), half),
        within(p[1], map.y.centre(cell / width), half),
    ];
    let q = clamp(frame, [edge[0] - dx, edge[1] - dy]);
    if is_far(frame, q, depth) {
        return far_place(frame, q, depth);
    }
    let q = [map.x.centre(source % width), map.y.centre(source / width)];
    nearest_pixel(clamp(frame, q))
}

/// The cell that a hole pixel continues: the far side of its own cell if that is a hole, else the
/// farthest surface in 3x3 around it, the first in reading order among equals.
fn far_cell(frame: &Frame<'_>, [cell_x, cell_y]: [u32; 2]) -> Option<u32> {
    let splat = &frame.field.splat;
    let (width, height) = (splat.width(), splat.height());
    let resolved = |x: u32, y: u32| {
        let cell = y * width + x;
        let far = if splat.at(x, y) == NO_SOURCE { frame.field.far.at(x, y) } else { cell };
        (far != NO_CELL).then_some(far)
    };
    if splat.at(cell_x, cell_y) == NO_SOURCE {
        return resolved(cell_x, cell_y);
    }
    let rows = cell_y.saturating_sub(1)..=(cell_y + 1).min(height - 1);
    let columns = cell_x.saturating_sub(1)..=(cell_x + 1).min(width - 1);
    let cells = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    cells
        .filter_map(|(x, y)| resolved(x, y))
        .min_by_key(|cell| frame.field.source.depth.data()[source_of(splat.data()[*cell as usize])])
}

/// Clamps to the pixel centres of the valid rectangle.
pub(super) fn clamp(frame: &Frame<'_>, q: [i32; 2]) -> [i32; 2] {
    let valid = frame.valid;
    let bound = |q: i32, start: u32, length: u32| {
        q.clamp((start << 8).cast_signed(), ((start + length - 1) << 8).cast_signed())
    };
    [bound(q[0], valid.x, valid.width), bound(q[1], valid.y, valid.height)]
}

/// Whether the key shows at the pixel nearest to `q` nothing nearer than `depth`.
fn is_far(frame: &Frame<'_>, q: [i32; 2], depth: u32) -> bool {
    frame.surface_at(q).is_some_and(|near| near.depth - (near.depth >> 8) <= depth)
}

/// `q` itself where all the pixels around it are far, else the nearest one, which is.
fn far_place(frame: &Frame<'_>, q: [i32; 2], depth: u32) -> [i32; 2] {
    let [x, y] = q.map(|q| q & !0xff);
    let corners = [[x, y], [x + 256, y], [x, y + 256], [x + 256, y + 256]];
    let mixes_near = corners.into_iter().any(|corner| !is_far(frame, clamp(frame, corner), depth));
    if mixes_near { nearest_pixel(q) } else { q }
}

pub(super) fn nearest_pixel(q: [i32; 2]) -> [i32; 2] {
    q.map(|q| (q + 128) & !0xff)
}
