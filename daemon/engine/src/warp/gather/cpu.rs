//! The reference of [`super`].

use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::color::{ColorPlane, Texel};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::displacement;

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
    let valid = field.valid;
    for_each_row(
        pool,
        out,
        #[inline(always)]
        |y, row| {
            row.copy_from_slice(color.row(y));
            if !(valid.y..valid.y + valid.height).contains(&y) {
                return;
            }
            let columns = &mut row[valid.x as usize..][..valid.width as usize];
            for (block, texels) in (0..).zip(columns.chunks_mut(BLOCK)) {
                let (mut xs, mut ys) = ([0; BLOCK], [0; BLOCK]);
                let (xs, ys) = (&mut xs[..texels.len()], &mut ys[..texels.len()]);
                for (index, (x, y_from)) in
                    (block * BLOCK as u32..).zip(xs.iter_mut().zip(&mut *ys))
                {
                    [*x, *y_from] = position(field, index, y - valid.y);
                }
                T::sample_each(color, valid, xs, ys, texels);
            }
        },
    );
}

/// Pixels whose positions are computed before they are read.
const BLOCK: usize = 64;

/// Where (1) reads pixel `index_x`, `index_y` of the valid rectangle.
fn position(field: &Field<'_>, index_x: u32, index_y: u32) -> [i32; 2] {
    let cell = (field.map.x.cell_of(index_x), field.map.y.cell_of(index_y));
    let [dx, dy] = displacement(field.velocity.at(cell.0, cell.1), field.phase);
    let x = ((field.valid.x + index_x) << 8).cast_signed() - dx;
    [x, ((field.valid.y + index_y) << 8).cast_signed() - dy]
}
