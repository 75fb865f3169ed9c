//! Reads the field of a key at a place between cells, from those that lie on one surface.

use super::grid::Grid;
use crate::key::KeyFrame;

/// Depth keys of one surface may differ by this fraction (a shift of 4: one sixteenth) a few cells
/// apart: ground seen at a low angle differs by as much, and what turns before a wall by little
/// more.
const DEPTH_SHIFT_BESIDE: u32 = 4;
/// The same (one eighth) from one key to the next: what comes near does so by as much.
const DEPTH_SHIFT_BEFORE: u32 = 3;

/// Whether two depth keys of one picture, of places beside each other, may be of one surface.
#[must_use]
#[inline(always)]
pub fn is_same_surface(a: u32, b: u32) -> bool {
    a.abs_diff(b) <= (a.max(b) >> DEPTH_SHIFT_BESIDE) + 1
}

/// Whether the depth keys of a place in one key and of where it was in the key before may be of one
/// surface.
#[must_use]
#[inline(always)]
pub fn was_same_surface(now: u32, then: u32) -> bool {
    now.abs_diff(then) <= (now.max(then) >> DEPTH_SHIFT_BEFORE) + 1
}

/// [`Around::nearest`] of the cells around `position` (pixels): most often it is the nearest of all,
/// which one look tells. None outside the picture.
#[must_use]
#[inline(always)]
pub fn nearest_cell(
    key: &KeyFrame,
    grid: &Grid,
    position: [f32; 2],
    depth: Option<u32>,
) -> Option<(u32, u32)> {
    let place = grid.place(position);
    let (x, y) = (nearest(place[0], grid.cells[0])?, nearest(place[1], grid.cells[1])?);
    if is_on(key, x, y, depth) {
        return Some((x, y));
    }
    Around::new(grid, position)?.nearest(key, depth)
}

/// The 2x2 cells around a place with their weights.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Around {
    /// Column, row and weight. Cells of weight 0 may repeat others.
    pub cells: [(u32, u32, f32); 4],
}

impl Around {
    /// Around `position` (pixels); None outside the picture.
    #[must_use]
    #[inline(always)]
    pub fn new(grid: &Grid, position: [f32; 2]) -> Option<Self> {
        let place = grid.place(position);
        let (x, y) = (axis(place[0], grid.cells[0])?, axis(place[1], grid.cells[1])?);
        let cell = |i: usize, j: usize| (x[i].0, y[j].0, x[i].1 * y[j].1);
        Some(Self { cells: [cell(0, 0), cell(1, 0), cell(0, 1), cell(1, 1)] })
    }

    /// Of those cells on the surface of depth key `depth` (any, where `key` has no depth), the one
    /// of the largest weight.
    #[must_use]
    pub fn nearest(&self, key: &KeyFrame, depth: Option<u32>) -> Option<(u32, u32)> {
        let mut best = (0.0, None);
        for (x, y, weight) in self.cells {
            if weight > best.0 && is_on(key, x, y, depth) {
                best = (weight, Some((x, y)));
            }
        }
        best.1
    }

    /// The depth key of `key` here, from the cells on the surface of depth key `depth`: between
    /// them on a plane, as the inverse of distance is linear in the picture. None without depth.
    #[must_use]
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "24 bits of depth are enough")]
    pub fn depth(&self, key: &KeyFrame, depth: u32) -> Option<f32> {
        if key.depth.data().is_empty() {
            return None;
        }
        let (mut weights, mut sum) = (0.0, 0.0);
        for (x, y, weight) in self.cells {
            if weight > 0.0 && is_on(key, x, y, Some(depth)) {
                weights += weight;
                sum += weight * key.depth.at(x, y) as f32;
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }

    /// The motion of `key` here, from the cells on the surface of depth key `depth` whose motion is
    /// known.
    #[must_use]
    #[inline(always)]
    pub fn motion(&self, key: &KeyFrame, depth: Option<u32>) -> Option<[f32; 2]> {
        let (mut weights, mut sum) = (0.0, [0.0; 2]);
        for (x, y, weight) in self.cells {
            let [dx, dy] = key.displacement.at(x, y);
            if weight > 0.0 && dx.is_finite() && dy.is_finite() && is_on(key, x, y, depth) {
                weights += weight;
                sum = [sum[0] + weight * dx, sum[1] + weight * dy];
            }
        }
        (weights > 0.0).then(|| [sum[0] / weights, sum[1] / weights])
    }
}

#[inline(always)]
fn is_on(key: &KeyFrame, x: u32, y: u32, depth: Option<u32>) -> bool {
    match depth {
        Some(depth) if !key.depth.data().is_empty() => was_same_surface(depth, key.depth.at(x, y)),
        _ => true,
    }
}

/// The cell nearest to a place along one axis, the first of two. None where [`axis`] has none.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "clamped to the grid")]
#[expect(clippy::cast_sign_loss, reason = "clamped to the grid")]
#[expect(clippy::cast_precision_loss, reason = "cells up to 8192 are exact")]
fn nearest(place: f32, cells: u32) -> Option<u32> {
    if !(-0.5..=cells as f32 - 0.5).contains(&place) {
        return None;
    }
    Some((place.clamp(0.0, (cells - 1) as f32) - 0.5).ceil() as u32)
}

/// The two cells around a place along one axis, with their weights. None outside the picture, which
/// reaches half a cell beyond the outer centres, and for NaN.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "clamped to the grid")]
#[expect(clippy::cast_sign_loss, reason = "clamped to the grid")]
#[expect(clippy::cast_precision_loss, reason = "cells up to 8192 are exact")]
fn axis(place: f32, cells: u32) -> Option<[(u32, f32); 2]> {
    if !(-0.5..=cells as f32 - 0.5).contains(&place) {
        return None;
    }
    let last = cells - 1;
    let clamped = place.clamp(0.0, last as f32);
    let low = clamped as u32;
    let way = clamped - low as f32;
    Some([(low, 1.0 - way), ((low + 1).min(last), way)])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::plane::Rect;
    use crate::testing::{hash, plane};

    proptest! {
        #[test]
        fn one_look_finds_the_cell_that_four_looks_find(
            cells in prop::array::uniform2(1_u32..9),
            position in prop::array::uniform2(-3.0_f32..20.0),
            depth in prop::option::of(prop::sample::select(vec![100_u32, 1000, 9000])),
            seed: u32,
        ) {
            let depths = |x, y| [100, 1000, 9000][hash(x, y, seed) as usize % 3];
            let key = KeyFrame {
                valid: Rect { x: 1, y: 0, width: 2 * cells[0], height: 2 * cells[1] },
                depth: plane(cells[0], cells[1], depths),
                ..KeyFrame::default()
            };
            let grid = Grid::of(&key);
            let slowly = Around::new(&grid, position).and_then(|it| it.nearest(&key, depth));
            prop_assert_eq!(nearest_cell(&key, &grid, position, depth), slowly);
        }
    }

    #[test]
    fn depth_between_the_cells_is_that_of_their_surface_alone_and_none_without_a_depth_plane() {
        let depth = |x, _| if x < 3 { 1000 + 10 * x } else { 9000 };
        let key =
            KeyFrame { valid: Rect::full(4, 4), depth: plane(4, 4, depth), ..KeyFrame::default() };
        let at = |x| Around::new(&Grid::of(&key), [x, 1.5]).unwrap();
        let found = at(1.25).depth(&key, 1000).unwrap();
        assert!((found - 1012.5).abs() < 1e-3, "on a plane, between its cells: {found}");
        assert_eq!(at(2.5).depth(&key, 1000), Some(1020.0), "beside something nearer");
        assert_eq!(at(2.5).depth(&key, 9000), Some(9000.0));
        assert_eq!(at(1.25).depth(&key, 90_000), None);
        assert_eq!(at(1.25).depth(&KeyFrame::default(), 1000), None);
    }
}
