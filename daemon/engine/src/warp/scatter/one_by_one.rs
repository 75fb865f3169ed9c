//! The reference of [`super`]: one source cell after the other.

use super::{NO_SOURCE, SOURCE_BITS, SourceField, phase_in_cells, shift};
use crate::field::FieldMap;
use crate::phase::Phase;
use crate::plane::Plane;

/// Splats `source` into `splat`; `top` keeps the depth keys of (2).
pub fn scatter(
    source: &SourceField,
    map: &FieldMap,
    phase: Phase,
    top: &mut Plane<u32>,
    splat: &mut Plane<u32>,
) {
    let (width, height) = (source.velocity.width(), source.velocity.height());
    top.resize(width, height);
    splat.resize(width, height);
    top.data_mut().fill(0);
    splat.data_mut().fill(NO_SOURCE);
    let scale = [phase_in_cells(phase, &map.x), phase_in_cells(phase, &map.y)];
    for_each_splat(source, scale, |cell, depth, _| {
        let top = &mut top.data_mut()[cell];
        *top = (*top).max(depth);
    });
    for_each_splat(source, scale, |cell, depth, candidate| {
        let top = top.data()[cell];
        if depth >= top - (top >> 8) {
            let splat = &mut splat.data_mut()[cell];
            *splat = (*splat).min(candidate);
        }
    });
}

/// Calls `splat(target cell, depth key, candidate of (3))` for the 2x2 cells around where each
/// source cell lands.
fn for_each_splat(source: &SourceField, scale: [i32; 2], mut splat: impl FnMut(usize, u32, u32)) {
    let (width, height) = (source.velocity.width(), source.velocity.height());
    for cell in (0..height).flat_map(|y| (0..width).map(move |x| [x, y])) {
        for_each_corner(source, scale, cell, |x, y, depth, candidate| {
            if x < width && y < height {
                splat(y as usize * width as usize + x as usize, depth, candidate);
            }
        });
    }
}

/// Calls `splat(column, row, depth key, candidate of (3))` for the 2x2 cells around where source
/// cell (`x`, `y`) lands, which may lie outside the grid: above and left of it numbers wrap.
#[inline(always)]
fn for_each_corner(
    source: &SourceField,
    scale: [i32; 2],
    [x, y]: [u32; 2],
    mut splat: impl FnMut(u32, u32, u32, u32),
) {
    let velocity = source.velocity.at(x, y);
    let depth = source.depth.at(x, y);
    let target = [
        (x << 8).cast_signed() + shift(velocity.x, scale[0]),
        (y << 8).cast_signed() + shift(velocity.y, scale[1]),
    ];
    for [right, down] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
        let cell = [(target[0] >> 8) + right, (target[1] >> 8) + down];
        let away = [0, 1].map(|axis| (target[axis] - (cell[axis] << 8)).unsigned_abs());
        if away[0] < 256 && away[1] < 256 {
            let candidate =
                ((away[0] + away[1]) >> 2 << SOURCE_BITS) | (y * source.velocity.width() + x);
            splat(cell[0].cast_unsigned(), cell[1].cast_unsigned(), depth, candidate);
        }
    }
}
