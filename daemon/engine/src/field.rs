//! Where the cells of a field grid lie on the colour plane.
//!
//! The field grid (`fw` x `fh` cells) shares the valid rectangle (`w` x `h` pixels at `x`, `y`) out
//! evenly: cell `i` is centred `(2 i + 1) w / (2 fw)` pixels right of the rectangle's left edge,
//! plus the jitter offset. In Q8, where the centre of pixel `i` is `256 i`:
//!
//! ```text
//! (1) centre(i)  = 256 x + (2 i + 1) 256 w / (2 fw) - 128 + offset
//! (2) cell(p)    = ((256 (p - x) + 128 - offset) fw) / (256 w)        the cell that holds pixel p
//! (3) between(p) = ((256 (p - x) + 128 - offset) fw) / w - 128        Q8 position between centres
//! ```
//!
//! All divisions round towards minus infinity and results are clamped to the grid. The divisions
//! are done once per column and row, into tables, and not once per pixel.

use std::ops::Range;

use crate::plane::Rect;

/// One axis of the map.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct FieldAxis {
    start: u32,
    length: u32,
    cells: u32,
    offset: i32,
    centre: Vec<i32>,
    /// One entry more than pixels, so that a wide read of the last one stays inside.
    cell: Vec<u16>,
    before: Vec<[u16; 2]>,
    /// The first pixel of each cell, and the end of the last.
    pixels: Vec<u16>,
    /// Where a cell has 2^n pixels: 8 + n.
    shift: Option<u32>,
}

/// Both axes of the map between one valid rectangle and one field grid.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct FieldMap {
    /// Columns.
    pub x: FieldAxis,
    /// Rows.
    pub y: FieldAxis,
}

impl FieldMap {
    /// Makes this the map of a grid of `cells` (columns, rows) over `valid`, none of them empty.
    /// Does nothing where it is that map already.
    pub fn update(&mut self, valid: Rect, cells: [u32; 2], offset: [i32; 2]) {
        self.x.update(valid.x, valid.width, cells[0], offset[0]);
        self.y.update(valid.y, valid.height, cells[1], offset[1]);
    }
}

impl FieldAxis {
    #[expect(clippy::cast_possible_truncation, reason = "clamped to the grid, at most 8192 cells")]
    #[expect(clippy::cast_sign_loss, reason = "clamped to 0 and above before the cast")]
    fn update(&mut self, start: u32, length: u32, cells: u32, offset: i32) {
        if (self.start, self.length, self.cells, self.offset) == (start, length, cells, offset) {
            return;
        }
        (self.start, self.length, self.cells, self.offset) = (start, length, cells, offset);
        let (span, count) = (i64::from(length), i64::from(cells));
        let last = count - 1;
        self.centre.clear();
        self.centre.extend((0..count).map(|i| {
            let within = ((2 * i + 1) * 256 * span).div_euclid(2 * count) - 128;
            (i64::from(start) * 256 + within + i64::from(offset)) as i32
        }));
        self.cell.clear();
        self.before.clear();
        for pixel in 0..span {
            let place = (256 * pixel + 128 - i64::from(offset)) * count;
            self.cell.push(place.div_euclid(256 * span).clamp(0, last) as u16);
            let between = (place.div_euclid(span) - 128).clamp(0, last * 256);
            self.before.push([(between >> 8) as u16, (between & 0xff) as u16]);
        }
        self.pixels.clear();
        self.pixels.extend(
            (0..=cells).map(|i| self.cell.partition_point(|cell| u32::from(*cell) < i) as u16),
        );
        self.cell.push(last as u16);
        let ratio = length / cells;
        let is_whole = ratio.is_power_of_two() && ratio * cells == length;
        self.shift = is_whole.then(|| 8 + ratio.trailing_zeros());
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> u32 {
        self.cells
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> u32 {
        self.length
    }

    /// The first pixel that the grid covers.
    #[must_use]
    pub fn first_pixel(&self) -> u32 {
        self.start
    }

    /// Centre of a cell, Q8 pixels of the colour plane (1).
    #[must_use]
    pub fn centre(&self, cell: u32) -> i32 {
        self.centre[cell as usize]
    }

    /// The cell that holds pixel `first_pixel + index` (2).
    #[must_use]
    pub fn cell_of(&self, index: u32) -> u32 {
        u32::from(self.cell[index as usize])
    }

    /// The pixels, counted from the first, that a cell holds; none where cells are finer than that.
    #[must_use]
    pub fn pixels_of(&self, cell: usize) -> Range<usize> {
        usize::from(self.pixels[cell])..usize::from(self.pixels[cell + 1])
    }

    /// [`Self::cell_of`] of `count` pixels from `index` on.
    #[must_use]
    pub fn cell_of_each(&self, index: u32, count: usize) -> &[u16] {
        &self.cell[index as usize..][..count]
    }

    /// [`Self::cell_of`] of all pixels, and one more entry. Every entry is a cell of the grid.
    #[must_use]
    pub fn cell_of_all(&self) -> &[u16] {
        &self.cell
    }

    /// Where a cell has 2^n pixels, (2) without a division or a table: the addend and the shift of
    /// `(256 (p - x) + addend) >> shift`, which is still to be clamped to the grid.
    #[must_use]
    pub fn cell_by_shift(&self) -> Option<(i32, u32)> {
        self.shift.map(|shift| (128 - self.offset, shift))
    }

    /// The last cell whose centre is not right of or below pixel `first_pixel + index`, and the
    /// way to the next one in 1/256 (3). The way is 0 wherever there is no next one.
    #[must_use]
    pub fn before(&self, index: u32) -> (u32, u32) {
        let [cell, way] = self.before[index as usize];
        (u32::from(cell), u32::from(way))
    }

    /// [`Self::before`] of `count` pixels from `index` on: cell and way.
    #[must_use]
    pub fn before_each(&self, index: u32, count: usize) -> &[[u16; 2]] {
        &self.before[index as usize..][..count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(start: u32, length: u32, cells: u32, offset: i32) -> FieldAxis {
        let mut axis = FieldAxis::default();
        axis.update(start, length, cells, offset);
        axis
    }

    #[test]
    fn a_grid_of_the_same_size_puts_every_cell_on_its_pixel() {
        let axis = axis(3, 7, 7, 0);
        for i in 0..7 {
            assert_eq!(axis.centre(i), 256 * (3 + i.cast_signed()));
            assert_eq!(axis.cell_of(i), i);
            assert_eq!(axis.before(i), (i, 0));
        }
    }

    #[test]
    fn at_half_resolution_two_pixels_share_a_cell_and_lie_a_quarter_cell_from_its_centre() {
        let axis = axis(0, 8, 4, 0);
        assert_eq!((axis.cell_of(2), axis.cell_of(3)), (1, 1));
        assert_eq!(axis.centre(1), 2 * 256 + 128);
        assert_eq!(axis.before(2), (0, 192));
        assert_eq!(axis.before(3), (1, 64));
        assert_eq!((axis.before(0), axis.before(7)), ((0, 0), (3, 0)), "clamped at the border");
    }

    #[test]
    fn any_ratio_covers_every_cell_and_keeps_centres_inside_their_own_pixels() {
        for (length, cells) in [(853, 427), (640, 376), (17, 10), (9, 3), (1, 1), (5, 5), (7, 2)] {
            let axis = axis(11, length, cells, 0);
            let mut seen = vec![false; cells as usize];
            for index in 0..length {
                seen[axis.cell_of(index) as usize] = true;
            }
            assert!(seen.into_iter().all(|cell| cell), "{length} pixels, {cells} cells");
            let shared_out: Vec<_> = (0..cells as usize).flat_map(|i| axis.pixels_of(i)).collect();
            assert!(shared_out.into_iter().eq(0..length as usize), "each pixel is in one cell");
            assert!(
                axis.pixels_of(cells as usize / 2).all(|i| axis.cell_of(i as u32) == cells / 2)
            );
            for cell in 0..cells {
                let pixel = (axis.centre(cell) + 128).div_euclid(256).cast_unsigned();
                assert!((11..11 + length).contains(&pixel), "cell {cell} of {cells}");
            }
        }
    }

    #[test]
    fn cells_of_a_power_of_two_of_pixels_are_found_by_a_shift_and_no_others() {
        for (length, cells, offset) in
            [(8, 8, 0), (1920, 960, 0), (64, 16, 77), (64, 32, -700), (6, 3, 513)]
        {
            let axis = axis(3, length, cells, offset);
            let (addend, shift) = axis.cell_by_shift().expect("a power of two of pixels");
            for index in 0..length {
                let cell = (256 * index.cast_signed() + addend) >> shift;
                let cell = cell.clamp(0, cells.cast_signed() - 1).cast_unsigned();
                assert_eq!(cell, axis.cell_of(index), "{index} of {length}, {cells} cells");
            }
        }
        for (length, cells) in [(9, 3), (853, 427), (7, 2), (5, 8)] {
            assert_eq!(axis(3, length, cells, 0).cell_by_shift(), None);
        }
    }

    #[test]
    fn an_offset_moves_centres_and_cells_together() {
        let (plain, moved) = (axis(0, 16, 8, 0), axis(0, 16, 8, 256));
        assert_eq!(moved.centre(3), plain.centre(3) + 256);
        assert_eq!(moved.cell_of(9), plain.cell_of(8));
    }
}
