//! What the GPU backend has to know of a shader: its text, its buffers and its entry points.
//!
//! Each kernel describes its shader so in a `gpu.rs` beside its `cpu.rs`; [`crate::kernels`] lists
//! them, and [`super::gpu`] dispatches from the description. Plain data: tests read it without a
//! GPU.

/// The shader of a kernel.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// Its file, in the kernel's folder.
    pub file: &'static str,
    /// Its text: what it shares with others, then the file.
    pub parts: &'static [&'static str],
    /// Buffers whose every byte is 0 when it begins; of lists, what comes before the items.
    pub cleared: &'static [Slot],
    /// What is bound from slot 1 on, in order; slot 0 has [`crate::params::FrameParams`].
    pub bindings: &'static [Binding],
    /// Its entry points, in order.
    pub entries: &'static [Entry],
}

/// An entry point of a shader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Entry {
    /// Its name.
    pub name: &'static str,
    /// What an invocation is for.
    pub extent: Extent,
    /// Invocations of a workgroup. At most 256, which is what software adapters have.
    pub workgroup: [u32; 2],
}

/// What there is one invocation for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Extent {
    /// Each pixel of the output.
    Pixels,
    /// Each cell of the field grid.
    Cells,
    /// Each column of the field grid.
    CellColumns,
    /// Each row of the field grid.
    CellRows,
    /// Each [`STRIP`] rows of a column of the field grid.
    CellStrips,
    /// Each item of the list in a buffer, which begins with the groups of the dispatch.
    Listed(Slot),
    /// Each pixel of half of the valid rectangle, rounded up.
    HalfPixels,
    /// Each pixel of half of that.
    QuarterPixels,
    /// Nothing: there is one alone.
    One,
    /// Each triangle of the mesh.
    Triangles,
    /// [`crate::warp::grid::LANES`] for each triangle of the mesh, side by side.
    TriangleLanes,
}

/// A buffer as a shader sees it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Binding {
    /// It is only read.
    Read(Slot),
    /// It is written, and may be read.
    Write(Slot),
}

impl Binding {
    /// The buffer.
    #[must_use]
    pub const fn slot(self) -> Slot {
        match self {
            Self::Read(slot) | Self::Write(slot) => slot,
        }
    }
}

/// The buffers of the GPU backend: one plane each.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Slot {
    /// Colour of the newest key.
    Color,
    /// Colour of the key before it.
    Older,
    /// Colour of the key before that.
    SecondOlder,
    /// And of the one before.
    ThirdOlder,
    /// And of the one before.
    FourthOlder,
    /// Velocity of the newest key.
    Velocity,
    /// Acceleration of the newest key.
    Acceleration,
    /// Depth key of the newest key.
    Depth,
    /// Where cells lie: [`crate::params::map_words`].
    Tables,
    /// Velocity, 0 where none is known.
    Held,
    /// Depth key of the surface that the velocity is of.
    Near,
    /// Largest depth key that lands on a cell.
    Top,
    /// Nearest source that lands on a cell.
    Splat,
    /// Velocity that a cell shows.
    Carried,
    /// Source that a cell shows, or the far side of a hole.
    Origin,
    /// The cells that are holes.
    Holes,
    /// Nearest resolved rows above and below a cell.
    StackedRows,
    /// Nearest resolved columns left and right of a cell.
    BesideColumns,
    /// The broken cells.
    Broken,
    /// The pixels of holes that the newest key does not show.
    Hidden,
    /// Of some keys in turn the depth key of each cell, then how far each came since the key before;
    /// between two keys [`crate::warp::voxel::VoxelWords::past`].
    Was,
    /// Vertices of the mesh.
    Vertices,
    /// Which way its cells are cut.
    Cuts,
    /// Its triangles after the warp.
    Triangles,
    /// Largest depth of the triangles over a pixel.
    Nearest,
    /// The triangle that a pixel shows.
    Shown,
    /// The picture at half its size.
    HalfLevel,
    /// At a quarter.
    QuarterLevel,
    /// The blur at half its size.
    SmoothLevel,
    /// Light of levels: [`crate::params::light_words`].
    Lights,
    /// How far tiles are blurred, four to a word: [`crate::finish::selection`].
    Weights,
    /// How much brighter tiles are: [`crate::light::Light::gains`].
    Gains,
    /// The picture.
    Out,
}

/// Words of a list before its items.
pub const LIST_HEADER: u64 = 4;

impl Slot {
    /// How many there are.
    pub const COUNT: usize = Self::Out as usize + 1;

    /// Bytes that [`Shader::cleared`] means; None for all.
    #[must_use]
    pub const fn cleared_bytes(self) -> Option<u64> {
        match self {
            Self::Holes | Self::Broken | Self::Hidden => Some(4 * LIST_HEADER),
            _ => None,
        }
    }
}

/// Storage buffers that a shader binds at most.
pub const MOST_BINDINGS: u32 = 9;
/// Rows of [`Extent::CellStrips`].
pub const STRIP: u32 = 4;

/// Invocations of a workgroup over a plane.
const TILE: [u32; 2] = [16, 16];
/// Invocations of a workgroup over columns or rows.
const LINE: [u32; 2] = [64, 1];

/// Text that shaders share: parameters and arithmetic, first in every shader.
pub const COMMON: &str = include_str!("../common.wgsl");
/// Text for shaders that read or write colour.
pub const COLOR: &str = include_str!("../color/color.wgsl");
/// Text for shaders that go from pixels to cells.
pub const FIELD: &str = include_str!("../field.wgsl");

impl Entry {
    /// An entry point over a plane.
    #[must_use]
    pub const fn tiles(name: &'static str, extent: Extent) -> Self {
        Self { name, extent, workgroup: TILE }
    }

    /// An entry point over columns or rows.
    #[must_use]
    pub const fn lines(name: &'static str, extent: Extent) -> Self {
        Self { name, extent, workgroup: LINE }
    }
}
