//! The pixels of a broken cell: (2) of [`super`].

use super::cpu::Frame;
use super::fill::hole_pixel;
use crate::color::Texel;
use crate::key::Velocity;
use crate::plane::Plane;
use crate::warp::moved;
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
                found.displacements[found.count] = moved(Velocity { x, y }, frame.phase);
                found.count += usize::from(is_new);
            }
            above = row;
        }
        found
    }

    /// Where in the key the surface is that comes to `p`, if one does.
    ///
    /// Whether a candidate is good is as random as the edges that broken cells lie on, so that
    /// nothing branches on it.
    #[inline(always)]
    fn shown(&self, frame: &Frame<'_>, p: [i32; 2]) -> Option<[i32; 2]> {
        // Of candidates that do not come to p: no depth, and no error is larger.
        let mut found = [(0, i32::MAX); NEIGHBOURS];
        let mut nearest = 0;
        let candidates = &self.displacements[..self.count.min(NEIGHBOURS)];
        for (&[dx, dy], found) in candidates.iter().zip(&mut found) {
            let (surface, is_inside) = frame.surface_near([p[0] - dx, p[1] - dy]);
            let [near_dx, near_dy] = moved(surface.velocity, frame.phase);
            let error = (near_dx - dx).abs() + (near_dy - dy).abs();
            let comes = is_inside & (error <= frame.one_cell);
            *found = if comes { (surface.depth, error) } else { (0, i32::MAX) };
            nearest = nearest.max(found.0);
        }
        let (mut best, mut smallest) = (0, i32::MAX);
        for (i, &(depth, error)) in found[..candidates.len()].iter().enumerate() {
            let is_better = (depth >= nearest - (nearest >> 8)) & (error < smallest);
            (best, smallest) = if is_better { (i, error) } else { (best, smallest) };
        }
        let [dx, dy] = self.displacements[best];
        (smallest < i32::MAX).then_some([p[0] - dx, p[1] - dy])
    }
}
