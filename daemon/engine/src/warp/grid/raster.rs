//! Draws the warped mesh, a band of target rows at a time.
//!
//! Bands are [`BAND`] rows whatever the number of threads, and what a pixel becomes depends on the
//! triangles over it alone. Each band takes two passes, equation (3): the largest depth of every
//! pixel, then, ascending by cell id, the first triangle within the tolerance of it. A band with no
//! turned-over triangle has one candidate per pixel, (4), and skips the first.

use rayon::prelude::*;

use super::mesh::{Mesh, MeshTriangle};
use super::triangle::{SourceMap, Spans, cross, pixel_range};
use crate::color::Texel;
use crate::plane::{Plane, Rect};
use crate::warp::sample::sample;

/// Rows of a band: 23 of them at 720p share evenly over a few threads, and
/// triangles that reach over two bands are few.
const BAND: usize = 32;

/// Marks a pixel that has its colour: no depth (31 bits) comes within the tolerance of it.
const TAKEN: u32 = u32::MAX;

/// Depth buffer of the whole picture, of which each band owns its rows.
#[derive(Debug, Default)]
pub(super) struct Bands {
    depth: Vec<u32>,
}

impl Bands {
    /// Draws `mesh` over `color` into `out`; outside `valid` the pixels are copied.
    pub(super) fn draw<T: Texel>(
        &mut self,
        mesh: &Mesh,
        color: &Plane<T>,
        valid: Rect,
        out: &mut Plane<T>,
    ) {
        let width = color.width() as usize;
        self.depth.resize(color.data().len(), 0);
        out.data_mut()
            .par_chunks_mut(width * BAND)
            .zip(self.depth.par_chunks_mut(width * BAND))
            .enumerate()
            .for_each(|(band, (rows, depth))| {
                let top = band * BAND;
                copy_outside(rows, &color.data()[top * width..][..rows.len()], width, top, valid);
                let lines = [top, top + rows.len() / width].map(to_pixel);
                let [first, end] =
                    [to_pixel(valid.y as usize), to_pixel((valid.y + valid.height) as usize)];
                let clip = Clip {
                    rows: [lines[0].max(first), lines[1].min(end)],
                    columns: [valid.x, valid.x + valid.width].map(|x| to_pixel(x as usize)),
                    top: lines[0],
                    width,
                };
                Band { mesh, color, valid, clip }.draw(rows, depth);
            });
    }
}

/// Copies the pixels of a band that lie outside `valid`.
fn copy_outside<T: Texel>(rows: &mut [T], key: &[T], width: usize, top: usize, valid: Rect) {
    let (left, right) = (valid.x as usize, (valid.x + valid.width) as usize);
    let inside = valid.y as usize..(valid.y + valid.height) as usize;
    for ((row, key), y) in rows.chunks_mut(width).zip(key.chunks(width)).zip(top..) {
        if inside.contains(&y) {
            row[..left].copy_from_slice(&key[..left]);
            row[right..].copy_from_slice(&key[right..]);
        } else {
            row.copy_from_slice(key);
        }
    }
}

fn to_pixel(index: usize) -> i32 {
    i32::try_from(index).expect("planes are at most 8192 pixels wide and high")
}

/// What a band may draw, in pixels: rows and columns as first and end.
#[derive(Clone, Copy)]
struct Clip {
    rows: [i32; 2],
    columns: [i32; 2],
    /// First row of the band's slices, and pixels of one row of them.
    top: i32,
    width: usize,
}

impl Clip {
    /// Calls `draw(y, first column, pixels)` for each part of a triangle inside, with
    /// `pixels` the indices in the band.
    #[inline]
    #[expect(clippy::cast_sign_loss, reason = "clipped to the band, which starts at 0")]
    fn spans(
        &self,
        triangle: &MeshTriangle,
        mut draw: impl FnMut(i32, i32, std::ops::Range<usize>),
    ) {
        let [first, last] = pixel_range(triangle.moved, 1);
        let first = first.max(self.rows[0]);
        let mut spans = Spans::new(triangle.moved, first);
        for y in first..(last + 1).min(self.rows[1]) {
            let [from, to] = spans.next();
            let (from, to) = (from.max(self.columns[0]), to.min(self.columns[1]));
            if from < to {
                let row = (y - self.top) as usize * self.width;
                draw(y, from, row + from as usize..row + to as usize);
            }
        }
    }

    /// Whether pixel rows of the band lie between `low` and `high`, 1/16 px.
    fn meets(&self, [low, high]: [i32; 2]) -> bool {
        (low + 15) >> 4 < self.rows[1] && high >> 4 >= self.rows[0]
    }
}

struct Band<'a, T> {
    mesh: &'a Mesh,
    color: &'a Plane<T>,
    valid: Rect,
    clip: Clip,
}

impl<T: Texel> Band<'_, T> {
    fn draw(&self, rows: &mut [T], depth: &mut [u32]) {
        if self.has_folds() {
            self.nearest(depth);
            for triangle in self.upright() {
                self.paint_nearest(&triangle, rows, depth);
            }
        } else {
            for triangle in self.upright() {
                let map = SourceMap::new(&triangle);
                self.clip
                    .spans(&triangle, |y, x, pixels| self.paint(&map, y, x, &mut rows[pixels]));
            }
        }
    }

    fn triangles(&self) -> impl Iterator<Item = MeshTriangle> {
        let rows = self.mesh.cell_rows().filter(|&(_, extent)| self.clip.meets(extent));
        rows.flat_map(|(row, _)| self.mesh.triangles(row)).filter(|triangle| {
            let [a, b, c] = triangle.moved.map(|point| point[1]);
            self.clip.meets([a.min(b).min(c), a.max(b).max(c)])
        })
    }

    fn has_folds(&self) -> bool {
        self.triangles().any(|triangle| orientation(&triangle) < 0)
    }

    /// Triangles that cover pixels: those that kept their orientation.
    fn upright(&self) -> impl Iterator<Item = MeshTriangle> {
        self.triangles().filter(|triangle| orientation(triangle) > 0)
    }

    /// First pass: the largest depth over each pixel.
    fn nearest(&self, depth: &mut [u32]) {
        depth.fill(0);
        for triangle in self.upright() {
            let key = depth_bits(&triangle);
            self.clip.spans(&triangle, |_, _, pixels| {
                for nearest in &mut depth[pixels] {
                    *nearest = key.max(*nearest);
                }
            });
        }
    }

    /// Second pass, for one triangle: takes what is not taken and within tolerance.
    fn paint_nearest(&self, triangle: &MeshTriangle, rows: &mut [T], depth: &mut [u32]) {
        let key = depth_bits(triangle);
        let map = SourceMap::new(triangle);
        self.clip.spans(triangle, |y, x, pixels| {
            let mut run = 0;
            let (rows, depth) = (&mut rows[pixels.clone()], &mut depth[pixels]);
            // Runs of pixels that pass are painted together.
            while run < depth.len() {
                let passes = |nearest: &u32| key >= nearest - (nearest >> 8);
                let skipped = depth[run..].iter().take_while(|nearest| !passes(nearest)).count();
                let start = run + skipped;
                let count = depth[start..].iter().take_while(|nearest| passes(nearest)).count();
                run = start + count;
                depth[start..run].fill(TAKEN);
                self.paint(&map, y, x + to_pixel(start), &mut rows[start..run]);
            }
        });
    }

    /// Colours successive pixels of row `y` from column `x` on.
    #[inline]
    fn paint(&self, map: &SourceMap, y: i32, x: i32, pixels: &mut [T]) {
        if let Some(source) = self.whole_pixels(map, y, x, pixels.len()) {
            pixels.copy_from_slice(source);
            return;
        }
        for (pixel, x) in pixels.iter_mut().zip(x..) {
            let [source_x, source_y] = map.at(x, y);
            *pixel = sample(self.color, self.valid, source_x, source_y);
        }
    }

    /// The key's pixels that `count` pixels from (`x`, `y`) on show, where the triangle moved by
    /// whole pixels and they lie inside `valid`.
    fn whole_pixels(&self, map: &SourceMap, y: i32, x: i32, count: usize) -> Option<&[T]> {
        let [source_x, source_y] = map.at(x, y);
        if !map.is_shift() || (source_x | source_y) & 0xff != 0 {
            return None;
        }
        let (first, row) = (source_x >> 8, source_y >> 8);
        let first = u32::try_from(first).ok().filter(|&first| first >= self.valid.x)? as usize;
        let row = u32::try_from(row).ok().filter(|&row| row >= self.valid.y)?;
        let fits = first + count <= (self.valid.x + self.valid.width) as usize
            && row < self.valid.y + self.valid.height;
        fits.then(|| &self.color.row(row)[first..first + count])
    }
}

fn orientation(triangle: &MeshTriangle) -> i32 {
    let [a, b, c] = triangle.moved;
    cross(a, b, c)
}

/// Depth of a triangle in the 31 bits that leave room for [`TAKEN`].
fn depth_bits(triangle: &MeshTriangle) -> u32 {
    triangle.depth >> 1
}
