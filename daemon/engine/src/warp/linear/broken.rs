//! Where the pixels of broken cells are read: (2) of [`super`].
//!
//! The broken pixels of a row are listed first and then looked at together: they lie on edges, a
//! few here and a few there, and wide steps should be full.

#[cfg(target_arch = "x86_64")]
mod avx2;

use super::cpu::{BLOCK, Frame};
use super::fill::{FarSurface, HolePlace, far_surface, hole_place};
use super::previous::Way;
use crate::color::Texel;
use crate::key::Velocity;
use crate::plane::{Plane, Rect};
#[cfg(target_arch = "x86_64")]
use crate::simd::has_avx2;
use crate::warp::moved;
use crate::warp::resolve::{CellClass, HOLE};
use crate::warp::sample::Listed;

/// Cells whose classes are looked at together.
const CLASSES: usize = 32;
/// Cells of a 3x3 neighbourhood.
const NEIGHBOURS: usize = 9;

/// A pixel that is read in a key before the newest: its column, the key, counted from 0, and the
/// place.
pub(super) type OlderPixel = (u16, u8, [i32; 2]);

/// The pixels of a row that lie in broken cells, from left to right.
#[derive(Debug, Default)]
pub(super) struct BrokenRow {
    /// Column, counted from the left of the valid rectangle, and cell.
    pixels: Vec<[u16; 2]>,
    /// Where each is read, Q8 pixels, x and y.
    places: [Vec<i32>; 2],
    /// Those that are read in keys before: column, which key, and where.
    older: Vec<OlderPixel>,
}

impl BrokenRow {
    /// Lists the broken pixels of row `index_y` of the valid rectangle, and where they are read.
    #[inline(always)]
    pub(super) fn update(&mut self, frame: &Frame<'_>, index_y: u32) {
        self.pixels.clear();
        self.places.iter_mut().for_each(Vec::clear);
        self.older.clear();
        let classes = frame.field.class.row(frame.map.y.cell_of(index_y));
        for (group, classes) in classes.chunks(CLASSES).enumerate() {
            let mut rest = broken_among(classes);
            while rest != 0 {
                let cell = group * CLASSES + rest.trailing_zeros() as usize;
                let pixels = frame.map.x.pixels_of(cell);
                self.pixels.extend(pixels.map(|column| [column, cell].map(|i| i as u16)));
                rest &= rest - 1;
            }
        }
        if self.pixels.is_empty() {
            return;
        }
        #[cfg(target_arch = "x86_64")]
        if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            unsafe {
                avx2::places(frame, index_y, &self.pixels, &mut self.places, &mut self.older);
            };
            return;
        }
        let mut holes = Holes::new(frame, index_y);
        for &pixel in &self.pixels {
            let [column, cell] = pixel.map(u32::from);
            let p = frame.centre([column, index_y]);
            let found = place(frame, [cell, holes.cell_y], p);
            let place = found.unwrap_or_else(|| holes.place(pixel, &mut self.older));
            self.places[0].push(place[0]);
            self.places[1].push(place[1]);
        }
    }

    /// The pixels that are read in keys before.
    pub(super) fn older(&self) -> impl Iterator<Item = OlderPixel> {
        self.older.iter().copied()
    }

    /// The pixels of the block that begins at column `first`, a bit for each. `rest` counts those
    /// that were taken so far.
    #[inline(always)]
    pub(super) fn take(&self, rest: &mut usize, first: u32) -> u64 {
        let mut taken = 0;
        for [column, _] in &self.pixels[*rest..] {
            let i = u32::from(*column) - first;
            if i >= u64::BITS {
                break;
            }
            taken |= 1 << i;
            *rest += 1;
        }
        taken
    }

    /// Reads them all, into their columns of `row`.
    #[inline(always)]
    pub(super) fn read<T: Texel>(&self, color: &Plane<T>, valid: Rect, row: &mut [T]) {
        let [xs, ys] = self.places.each_ref().map(|places| places.chunks(BLOCK));
        for (pixels, (xs, ys)) in self.pixels.chunks(BLOCK).zip(xs.zip(ys)) {
            let mut texels = [T::default(); BLOCK];
            T::sample_each(color, valid, &Listed { xs, ys }, &mut texels[..xs.len()]);
            for ([column, _], texel) in pixels.iter().zip(texels) {
                row[usize::from(*column)] = texel;
            }
        }
    }
}

/// Bit `i` is set where cell `i` of at most [`CLASSES`] is broken.
#[inline(always)]
fn broken_among(classes: &[CellClass]) -> u32 {
    #[cfg(target_arch = "x86_64")]
    if let (Some(classes), true) = (classes.first_chunk(), has_avx2()) {
        // SAFETY: the processor has AVX2, asked for just above.
        return unsafe { avx2::broken_among(classes) };
    }
    let bits =
        classes.iter().zip(0..).map(|(class, i)| u32::from(*class == CellClass::Broken) << i);
    bits.fold(0, |all, bit| all | bit)
}

/// The holes of a row, from left to right.
struct Holes<'a> {
    frame: &'a Frame<'a>,
    index_y: u32,
    cell_y: u32,
    /// The cell that was looked at last, and what its holes continue.
    last: Option<(u16, Option<FarSurface>)>,
    /// Where that was in the keys before, once a hole has asked.
    way: Option<Way>,
}

impl<'a> Holes<'a> {
    fn new(frame: &'a Frame<'a>, index_y: u32) -> Self {
        Self { frame, index_y, cell_y: frame.map.y.cell_of(index_y), last: None, way: None }
    }

    /// Where the pixel in `column` and `cell`, to which no candidate comes, is read.
    fn place(&mut self, [column, cell]: [u16; 2], older: &mut Vec<OlderPixel>) -> [i32; 2] {
        let far = match self.last {
            Some((last, far)) if last == cell => far,
            _ => {
                self.way = None;
                far_surface(self.frame, [u32::from(cell), self.cell_y])
            }
        };
        self.last = Some((cell, far));
        let (cell, p) = ([u32::from(cell), self.cell_y], [u32::from(column), self.index_y]);
        match hole_place(self.frame, far, cell, &mut self.way, self.frame.centre(p)) {
            HolePlace::Key(place) => place,
            HolePlace::Older(key, place) => {
                older.push((column, key, place));
                place
            }
        }
    }
}

/// Where in the key the surface is that comes to `p`, a pixel of `cell`, if one does.
fn place(frame: &Frame<'_>, [cell_x, cell_y]: [u32; 2], p: [i32; 2]) -> Option<[i32; 2]> {
    let carried = &frame.field.carried;
    let rows = cell_y.saturating_sub(1)..=(cell_y + 1).min(carried.height() - 1);
    let columns = cell_x.saturating_sub(1)..=(cell_x + 1).min(carried.width() - 1);
    // Depth, error and place of those that come to p.
    let mut found = [(0, i32::MAX, p); NEIGHBOURS];
    let mut nearest = 0;
    let cells = rows.flat_map(|y| columns.clone().map(move |x| carried.at(x, y)));
    for ([x, y], found) in cells.zip(&mut found) {
        let velocity = Velocity { x, y };
        if velocity == HOLE {
            continue;
        }
        let [dx, dy] = moved(velocity, frame.phase);
        let q = [p[0] - dx, p[1] - dy];
        let Some(surface) = frame.surface_at(q) else { continue };
        let [near_dx, near_dy] = moved(surface.velocity, frame.phase);
        let error = (near_dx - dx).abs() + (near_dy - dy).abs();
        if error <= frame.one_cell {
            *found = (surface.depth, error, q);
            nearest = nearest.max(surface.depth);
        }
    }
    let near = found.into_iter().filter(|(depth, ..)| *depth >= nearest - (nearest >> 8));
    let best = near.min_by_key(|(_, error, _)| *error);
    best.filter(|(_, error, _)| *error < i32::MAX).map(|(.., q)| q)
}
