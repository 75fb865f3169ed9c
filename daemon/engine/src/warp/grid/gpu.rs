//! The shader of [`super`], and the mesh as it reads it.

use super::mesh::Mesh;
use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, Shader, Slot};
use crate::key::KeyFrame;

/// Bytes of one `Triangle` of the shader.
pub const TRIANGLE_BYTES: u64 = 64;

/// Invocations that share the rows of a triangle.
pub const LANES: u32 = 8;

/// Equations (1) to (3).
pub const GRID: Shader = Shader {
    file: "grid.wgsl",
    parts: &[COMMON, COLOR, include_str!("grid.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Color),
        Binding::Write(Slot::Out),
        Binding::Read(Slot::Vertices),
        Binding::Read(Slot::Cuts),
        Binding::Write(Slot::Triangles),
        Binding::Write(Slot::Nearest),
        Binding::Write(Slot::Shown),
    ],
    entries: &[
        Entry::tiles("clear_pixels", Extent::Pixels),
        Entry::lines("set_up", Extent::Triangles),
        Entry::lines("find_nearest", Extent::TriangleLanes),
        Entry::lines("choose_triangle", Extent::TriangleLanes),
        Entry::tiles("warp_grid", Extent::Pixels),
    ],
};

/// The mesh of one key, as words.
#[derive(Debug, Default)]
pub struct MeshWords {
    mesh: Mesh,
    /// Per vertex: x and y in 1/16 px, velocity, depth key.
    pub vertices: Vec<[u32; 4]>,
    /// Per cell: 1 where the cut rises.
    pub cuts: Vec<u32>,
    /// Columns and rows of cells.
    pub cells: [u32; 2],
}

impl MeshWords {
    /// Becomes the mesh of `key`, whose velocity is not empty.
    pub fn take_key(&mut self, key: &KeyFrame) {
        self.mesh.snap(key);
        self.cells = self.mesh.write_words(&mut self.vertices, &mut self.cuts);
    }
}
