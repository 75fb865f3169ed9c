//! The mesh over one key: vertices, where they move, and how cells are cut into triangles.
//!
//! Positions are 1/16 px of the colour plane, the centre of pixel `i` at `16 * i`. The field has
//! one free vertex per neighbourhood (8, 4 or 2 field cells per axis, whichever covers nearest to 8
//! pixels, so that a coarse field does not coarsen the grid), and a frame of border vertices that
//! never move lies on the edge of the valid rectangle. Rows and columns of vertices keep their
//! order, so cells are simple quadrilaterals before the warp and at least one diagonal cuts each
//! into two triangles of positive orientation.

use rayon::prelude::*;

use super::pyramid::{Field, difference};
use super::triangle::{Point, cross};
use crate::field::{FieldAxis, FieldMap};
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::Rect;
use crate::warp::displacement;

/// Farthest way of a vertex, 1/16 px. Two vertices of a cell then stay within 1031 px of
/// each other, and edge functions within 30 bits.
pub const FARTHEST: i32 = 504 * 16;

/// One vertex of the mesh over the key.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Vertex {
    /// Position in the key, 1/16 px.
    pub(super) source: Point,
    /// Of the surface that it stands on; zero on the border.
    pub(super) velocity: Velocity,
    /// Depth key of that surface, larger is nearer.
    pub(super) depth: u32,
}

/// Which two corners of a cell a cut joins.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum Diagonal {
    /// Top left to bottom right.
    #[default]
    Falling,
    /// Bottom left to top right.
    Rising,
}

/// Vertices and cells of one key, and where the vertices are at one phase.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    /// Vertices per row, frame included.
    columns: usize,
    /// Where the cells of the key's field lie.
    map: FieldMap,
    /// Row by row; `columns * rows` of them.
    vertices: Vec<Vertex>,
    /// Positions at the phase of the last [`Mesh::advance`], 1/16 px.
    moved: Vec<Point>,
    /// Cuts of the cells, row by row, `columns - 1` a row.
    diagonals: Vec<Diagonal>,
    /// First and last moved y of each row of cells, 1/16 px.
    extents: Vec<[i32; 2]>,
}

/// One triangle of the mesh: its corners in positive order, and what decides at fold-overs.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshTriangle {
    pub(super) source: [Point; 3],
    pub(super) moved: [Point; 3],
    pub(super) depth: u32,
}

impl Mesh {
    /// Builds the mesh of `key`, whose velocity is not empty.
    pub(super) fn snap(&mut self, key: &KeyFrame) {
        let field = Field { velocity: &key.velocity, depth: &key.depth };
        let layout = Layout::new(key.valid, key.velocity.width(), key.velocity.height());
        self.map.update(key.valid, [layout.width, layout.height], key.field_offset);
        if !key.depth.data().is_empty() {
            let size = (key.depth.width(), key.depth.height());
            assert_eq!(size, (layout.width, layout.height), "depth and velocity share one grid");
        }
        let (columns, rows) = (layout.columns() as usize, layout.rows() as usize);
        self.columns = columns;
        self.vertices.resize(columns * rows, Vertex::default());
        self.moved.resize(columns * rows, Point::default());
        self.diagonals.resize((columns - 1) * (rows - 1), Diagonal::Falling);
        self.extents.resize(rows - 1, [0; 2]);

        let map = &self.map;
        self.vertices.par_chunks_mut(columns).zip(0..layout.rows()).for_each(|(line, row)| {
            for (vertex, column) in line.iter_mut().zip(0..) {
                *vertex = layout.vertex(map, &field, column, row);
            }
        });
        let vertices = &self.vertices;
        self.diagonals.par_chunks_mut(columns - 1).enumerate().for_each(|(row, line)| {
            for (column, diagonal) in line.iter_mut().enumerate() {
                let first = row * columns + column;
                *diagonal = choose_diagonal(corners(vertices, first, columns));
            }
        });
    }

    /// Moves the vertices to `phase`, equation (1).
    pub(super) fn advance(&mut self, phase: Phase) {
        for (moved, vertex) in self.moved.iter_mut().zip(&self.vertices) {
            let [x, y] = displacement(vertex.velocity, phase).map(sixteenths);
            *moved = [vertex.source[0] + x, vertex.source[1] + y];
        }
        let rows = self.moved.windows(2 * self.columns).step_by(self.columns);
        for (extent, two_rows) in self.extents.iter_mut().zip(rows) {
            let low = two_rows.iter().map(|point| point[1]).min().unwrap_or(0);
            let high = two_rows.iter().map(|point| point[1]).max().unwrap_or(0);
            *extent = [low, high];
        }
    }

    /// Rows of cells, each with its first and last y after the warp, 1/16 px.
    pub(super) fn cell_rows(&self) -> impl Iterator<Item = (usize, [i32; 2])> {
        self.extents.iter().copied().enumerate()
    }

    /// Triangles of one row of cells, ascending by cell id.
    pub(super) fn triangles(&self, row: usize) -> impl Iterator<Item = MeshTriangle> {
        (0..self.columns - 1).flat_map(move |column| {
            let first = row * self.columns + column;
            let diagonal = self.diagonals[row * (self.columns - 1) + column];
            let quad = corners(&self.vertices, first, self.columns);
            let moved = corners(&self.moved, first, self.columns);
            cut(diagonal).map(|ids| MeshTriangle {
                source: ids.map(|id| quad[id].source),
                moved: ids.map(|id| moved[id]),
                depth: ids.map(|id| quad[id].depth).into_iter().fold(u32::MAX, u32::min),
            })
        })
    }

    /// Writes down vertices and cuts as the shader reads them; returns columns and rows of cells.
    pub(super) fn write_words(
        &self,
        vertices: &mut Vec<[u32; 4]>,
        cuts: &mut Vec<u32>,
    ) -> [u32; 2] {
        vertices.clear();
        vertices.extend(self.vertices.iter().map(|vertex| {
            let [x, y] = vertex.source.map(i32::cast_unsigned);
            let Velocity { x: vx, y: vy } = vertex.velocity;
            let velocity = u32::from(vx.cast_unsigned()) | u32::from(vy.cast_unsigned()) << 16;
            [x, y, velocity, vertex.depth]
        }));
        cuts.clear();
        cuts.extend(self.diagonals.iter().map(|cut| u32::from(*cut == Diagonal::Rising)));
        [self.columns - 1, self.extents.len()]
            .map(|count| u32::try_from(count).expect("a mesh is no finer than half of its field"))
    }

    #[cfg(test)]
    pub(super) fn vertices(&self) -> (&[Vertex], usize) {
        (&self.vertices, self.columns)
    }
}

/// Corners of a cell: top left, top right, bottom left, bottom right.
fn corners<T: Copy>(vertices: &[T], first: usize, columns: usize) -> [T; 4] {
    let below = first + columns;
    [vertices[first], vertices[first + 1], vertices[below], vertices[below + 1]]
}

/// The corners of the two triangles of a cell, in positive order.
fn cut(diagonal: Diagonal) -> [[usize; 3]; 2] {
    match diagonal {
        Diagonal::Falling => [[0, 1, 3], [0, 3, 2]],
        Diagonal::Rising => [[0, 1, 2], [1, 3, 2]],
    }
}

/// The diagonal that lies inside the cell; where both do, the one along which motion differs less,
/// so that a discontinuity runs along a cut and not across it.
fn choose_diagonal(quad: [Vertex; 4]) -> Diagonal {
    let fits = |diagonal| {
        cut(diagonal).iter().all(|&[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|id| quad[id].source);
            cross(a, b, c) >= 0
        })
    };
    let falling = difference(quad[0].velocity, quad[3].velocity);
    let rising = difference(quad[2].velocity, quad[1].velocity);
    match (fits(Diagonal::Falling), fits(Diagonal::Rising)) {
        (true, false) => Diagonal::Falling,
        (false, true) => Diagonal::Rising,
        _ if rising < falling => Diagonal::Rising,
        _ => Diagonal::Falling,
    }
}

/// A displacement in Q8 px as the mesh takes it: rounded to 1/16 px, limited to [`FARTHEST`].
fn sixteenths(q8: i32) -> i32 {
    ((q8 + 8) >> 4).clamp(-FARTHEST, FARTHEST)
}

/// How neighbourhoods cover the field and the field covers the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// Cells of the field per row.
    width: u32,
    /// Rows of cells of the field.
    height: u32,
    /// Cells of a neighbourhood per axis.
    side: u32,
}

impl Layout {
    pub(super) fn new(valid: Rect, width: u32, height: u32) -> Self {
        let coarser = |times: u32| {
            let squared = |length: u32| u64::from(length) * u64::from(length);
            let limit = u64::from(times);
            squared(valid.width) > limit * squared(width)
                || squared(valid.height) > limit * squared(height)
        };
        // A side covers nearest to 8 pixels on a log scale: the ratio switches at sqrt(2), sqrt(8).
        let side = match (coarser(2), coarser(8)) {
            (_, true) => 2,
            (true, false) => 4,
            (false, false) => 8,
        };
        Self { width, height, side }
    }

    /// Vertices per row, frame included.
    pub(super) fn columns(&self) -> u32 {
        self.width.div_ceil(self.side) + 2
    }

    /// Rows of vertices, frame included.
    pub(super) fn rows(&self) -> u32 {
        self.height.div_ceil(self.side) + 2
    }

    /// Field cells of the neighbourhood of a free vertex.
    pub(super) fn neighbourhood(&self, column: u32, row: u32) -> Rect {
        let (x, y) = ((column - 1) * self.side, (row - 1) * self.side);
        let width = self.side.min(self.width - x);
        let height = self.side.min(self.height - y);
        Rect { x, y, width, height }
    }

    fn vertex(&self, map: &FieldMap, field: &Field<'_>, column: u32, row: u32) -> Vertex {
        let inner_column = column.clamp(1, self.columns() - 2);
        let inner_row = row.clamp(1, self.rows() - 2);
        let cells = self.neighbourhood(inner_column, inner_row);
        let regular = [cells.x + cells.width / 2, cells.y + cells.height / 2];
        if [inner_column, inner_row] == [column, row] {
            let offset = field.snap(cells, regular).offset();
            let x = regular[0].wrapping_add_signed(offset[0]);
            let y = regular[1].wrapping_add_signed(offset[1]);
            let source = [centre(&map.x, x), centre(&map.y, y)];
            return Vertex { source, velocity: field.velocity(x, y), depth: field.depth(x, y) };
        }
        let source = [
            on_frame(&map.x, column, self.columns()).unwrap_or_else(|| centre(&map.x, regular[0])),
            on_frame(&map.y, row, self.rows()).unwrap_or_else(|| centre(&map.y, regular[1])),
        ];
        let depth = field.depth(regular[0], regular[1]);
        Vertex { source, velocity: Velocity::default(), depth }
    }
}

/// Centre of a field cell, 1/16 px. Jitter may carry it past the frame; the vertex stops there.
fn centre(axis: &FieldAxis, cell: u32) -> i32 {
    let [first, last] = frame(axis);
    ((axis.centre(cell) + 8) >> 4).clamp(first, last)
}

/// Where the frame lies, 1/16 px: the outer edges of the first and the last pixel.
fn frame(axis: &FieldAxis) -> [i32; 2] {
    let edge = |pixels: u32| (pixels * 16).cast_signed() - 8;
    [edge(axis.first_pixel()), edge(axis.first_pixel() + axis.pixels())]
}

/// Position of the frame if `index` of `count` vertices is on it.
fn on_frame(axis: &FieldAxis, index: u32, count: u32) -> Option<i32> {
    let [first, last] = frame(axis);
    match index {
        0 => Some(first),
        _ if index + 1 == count => Some(last),
        _ => None,
    }
}
