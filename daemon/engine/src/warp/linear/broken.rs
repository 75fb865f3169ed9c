//! The pixels of a broken cell: (2) of [`super`].

use super::cpu::Frame;
use super::fill::hole_pixel;
use crate::color::Texel;
use crate::key::Velocity;
use crate::plane::Plane;
use crate::warp::displacement;
use crate::warp::resolve::HOLE;
use crate::warp::sample::sample;

/// Cells of a 3x3 neighbourhood.
const NEIGHBOURS: usize = 9;

/// Makes the pixels `texels` of a row that lie in `cell`, the centre of the first of them at `p`.
pub(super) fn broken_cell<T: Texel>(
    frame: &Frame<'_>,
    color: &Plane<T>,
    cell: [u32; 2],
    [p_x, p_y]: [i32; 2],
    texels: &mut [T],
) {
    let candidates = Candidates::around(frame, cell);
    for (p_x, texel) in (p_x..).step_by(256).zip(texels) {
        let p = [p_x, p_y];
        *texel = match candidates.shown(frame, p) {
            Some([x, y]) => sample(color, frame.valid, x, y),
            None => hole_pixel(frame, color, cell, p),
        };
    }
}

/// The displacements that 3x3 cells carry, in reading order, few of them twice.
struct Candidates {
    /// One more than there can be: the place of the next.
    displacements: [[i32; 2]; NEIGHBOURS + 1],
    count: usize,
}

impl Candidates {
    #[inline(always)]
    fn around(frame: &Frame<'_>, [cell_x, cell_y]: [u32; 2]) -> Self {
        let carried = &frame.field.carried;
        let mut found = Self { displacements: [[0; 2]; NEIGHBOURS + 1], count: 0 };
        let columns =
            cell_x.saturating_sub(1) as usize..=(cell_x + 1).min(carried.width() - 1) as usize;
        // Looking again changes nothing, so it is enough to leave out the repetitions that are
        // quick to see: of the cell to the left, and of the one above.
        let mut above: &[[i16; 2]] = &[[HOLE.x, HOLE.y]; 3];
        for y in cell_y.saturating_sub(1)..=(cell_y + 1).min(carried.height() - 1) {
            let row = &carried.row(y)[columns.clone()];
            let mut left = [HOLE.x, HOLE.y];
            for (&[x, y], &above) in row.iter().zip(above) {
                let is_new = ([x, y] != left) & ([x, y] != above) & ([x, y] != [HOLE.x, HOLE.y]);
                left = [x, y];
                found.displacements[found.count] = displacement(Velocity { x, y }, frame.phase);
                found.count += usize::from(is_new);
            }
            above = row;
        }
        found
    }

    /// Where in the key the surface is that comes to `p`, if one does.
    #[inline(always)]
    fn shown(&self, frame: &Frame<'_>, p: [i32; 2]) -> Option<[i32; 2]> {
        let at = |[dx, dy]: [i32; 2]| [p[0] - dx, p[1] - dy];
        // Of candidates that do not come to p: no depth, and no error is larger.
        let (mut depths, mut errors) = ([0; NEIGHBOURS], [i32::MAX; NEIGHBOURS]);
        let mut nearest = 0;
        let candidates = self.displacements[..self.count].iter();
        for ((&[dx, dy], depth), error) in candidates.zip(&mut depths).zip(&mut errors) {
            let Some(surface) = frame.surface_at(at([dx, dy])) else { continue };
            let [near_dx, near_dy] = displacement(surface.velocity, frame.phase);
            let apart = (near_dx - dx).abs() + (near_dy - dy).abs();
            if apart <= frame.one_cell {
                (*depth, *error) = (surface.depth, apart);
                nearest = nearest.max(surface.depth);
            }
        }
        let mut best = (i32::MAX, None);
        let found = depths.iter().zip(&errors).zip(&self.displacements[..self.count]);
        for ((&depth, &error), &displacement) in found {
            if depth >= nearest - (nearest >> 8) && error < best.0 {
                best = (error, Some(displacement));
            }
        }
        best.1.map(at)
    }
}
