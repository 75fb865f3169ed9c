//! The shaders of [`super`].

use crate::backend::shader::{Binding, COMMON, Entry, Extent, Shader, Slot};

/// What the scatter reads of a key, derived from it once.
pub const SOURCE: Shader = Shader {
    file: "source.wgsl",
    parts: &[COMMON, include_str!("source.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Velocity),
        Binding::Read(Slot::Depth),
        Binding::Write(Slot::Held),
        Binding::Write(Slot::Near),
    ],
    entries: &[Entry::tiles("take_key", Extent::Cells)],
};

/// Equations (1) to (4).
pub const SCATTER: Shader = Shader {
    file: "scatter.wgsl",
    parts: &[COMMON, include_str!("scatter.wgsl")],
    cleared: &[Slot::Top, Slot::Splat],
    bindings: &[
        Binding::Read(Slot::Held),
        Binding::Read(Slot::Near),
        Binding::Write(Slot::Top),
        Binding::Write(Slot::Splat),
    ],
    entries: &[
        Entry::tiles("scatter_top", Extent::Cells),
        Entry::tiles("scatter_splat", Extent::Cells),
    ],
};
