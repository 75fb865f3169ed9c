//! Where the cells of a field lie, in floats: for trajectories, which are worked out in pixels.
//!
//! The same places as [`crate::field::FieldMap`], in pixels of the colour plane with the centre of
//! pixel `i` at `i`.

use crate::key::KeyFrame;

/// The cells of one key's field.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Grid {
    /// Columns and rows.
    pub cells: [u32; 2],
    /// Centre of the first cell, pixels.
    pub first: [f32; 2],
    /// From one cell to the next, pixels.
    pub step: [f32; 2],
}

impl Grid {
    /// The grid of `key`'s field, which is that of its motion or, without motion, of its depth.
    #[must_use]
    pub fn of(key: &KeyFrame) -> Self {
        let field = [key.displacement.width(), key.displacement.height()];
        let depth = [key.depth.width(), key.depth.height()];
        Self::with_cells(key, if field[0] > 0 { field } else { depth })
    }

    /// The grid of a field of `key` that has so many columns and rows.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "sizes up to 8192 and offsets of 256 are exact")]
    pub fn with_cells(key: &KeyFrame, cells: [u32; 2]) -> Self {
        let valid = key.valid;
        let step = [0, 1].map(|axis| {
            let length = [valid.width, valid.height][axis];
            length as f32 / cells[axis].max(1) as f32
        });
        let first = [0, 1].map(|axis| {
            let start = [valid.x, valid.y][axis] as f32;
            start + 0.5 * step[axis] - 0.5 + key.field_offset[axis] as f32 / 256.0
        });
        Self { cells, first, step }
    }

    /// Centre of a cell, pixels.
    #[must_use]
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "cells up to 8192 are exact")]
    pub fn centre(&self, x: u32, y: u32) -> [f32; 2] {
        [self.first[0] + x as f32 * self.step[0], self.first[1] + y as f32 * self.step[1]]
    }

    /// A position in cells: 0 at the centre of the first one.
    #[must_use]
    #[inline(always)]
    pub fn place(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [(x - self.first[0]) / self.step[0], (y - self.first[1]) / self.step[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::{Plane, Rect};
    use crate::testing::map_of;

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "positions of a small picture")]
    fn cells_lie_where_the_field_map_has_them() {
        let key = KeyFrame {
            valid: Rect { x: 3, y: 5, width: 64, height: 30 },
            displacement: Plane::new(32, 20),
            velocity: Plane::new(32, 20),
            field_offset: [77, -40],
            ..KeyFrame::default()
        };
        let (grid, map) = (Grid::of(&key), map_of(&key));
        for (x, y) in [(0, 0), (31, 19), (7, 11)] {
            let [px, py] = grid.centre(x, y);
            assert!(((px * 256.0) as i32 - map.x.centre(x)).abs() <= 1);
            assert!(((py * 256.0) as i32 - map.y.centre(y)).abs() <= 1);
            let [back_x, back_y] = grid.place([px, py]);
            assert!((back_x - x as f32).abs() < 1e-4 && (back_y - y as f32).abs() < 1e-4);
        }
    }
}
