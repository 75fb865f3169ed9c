//! The reference of [`super`].

use rayon::ThreadPool;

use crate::color::{ColorPlane, Texel};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::sample::{Listed, sample_run};
use crate::warp::{displacement, for_each_valid_row};

/// Warps `key` to `phase` into `out`, which has the key's size and format. `map` is the map of
/// the key's field grid; the key has a velocity field.
pub fn warp_gather(
    pool: &ThreadPool,
    key: &KeyFrame,
    map: &FieldMap,
    phase: Phase,
    out: &mut ColorPlane,
) {
    let field = Field { velocity: &key.velocity, map, valid: key.valid, phase };
    match (&key.color, out) {
        (ColorPlane::Rgba8(color), ColorPlane::Rgba8(out)) => warp(pool, &field, color, out),
        (ColorPlane::Rgb10a2(color), ColorPlane::Rgb10a2(out)) => warp(pool, &field, color, out),
        (ColorPlane::Rgba16f(color), ColorPlane::Rgba16f(out)) => warp(pool, &field, color, out),
        _ => unreachable!("the engine gives the output the format of the key"),
    }
}

struct Field<'a> {
    velocity: &'a Plane<Velocity>,
    map: &'a FieldMap,
    valid: Rect,
    phase: Phase,
}

fn warp<T: Texel>(pool: &ThreadPool, field: &Field<'_>, color: &Plane<T>, out: &mut Plane<T>) {
    for_each_valid_row(
        pool,
        field.valid,
        color,
        out,
        #[inline(always)]
        |index_y, row| {
            for (block, texels) in (0..).zip(row.chunks_mut(BLOCK)) {
                gather_block(field, color, [block * BLOCK as u32, index_y], texels);
            }
        },
    );
}

/// Pixels whose positions are computed before they are read.
const BLOCK: usize = 64;

/// The pixels from (`index_x`, `index_y`) of the valid rectangle on.
#[inline(always)]
fn gather_block<T: Texel>(
    field: &Field<'_>,
    color: &Plane<T>,
    [index_x, index_y]: [u32; 2],
    texels: &mut [T],
) {
    let valid = field.valid;
    let [p_x, p_y] = [valid.x + index_x, valid.y + index_y].map(|p| (p << 8).cast_signed());
    let cell_of = field.map.x.cell_of_each(index_x, texels.len());
    let velocities = field.velocity.row(field.map.y.cell_of(index_y));
    let (first, last) = (usize::from(cell_of[0]), usize::from(cell_of[texels.len() - 1]));
    let velocities = &velocities[first..=last];
    if velocities.iter().all(|velocity| *velocity == velocities[0]) {
        let [dx, dy] = displacement(velocities[0], field.phase);
        sample_run(color, valid, [p_x - dx, p_y - dy], texels);
        return;
    }
    let (mut xs, mut ys) = ([0; BLOCK], [0; BLOCK]);
    let (xs, ys) = (&mut xs[..texels.len()], &mut ys[..texels.len()]);
    let places = xs.iter_mut().zip(&mut *ys).zip(cell_of);
    for (p_x, ((x, y), cell)) in (p_x..).step_by(256).zip(places) {
        let [dx, dy] = displacement(velocities[usize::from(*cell) - first], field.phase);
        (*x, *y) = (p_x - dx, p_y - dy);
    }
    T::sample_each(color, valid, &Listed { xs, ys }, texels);
}
