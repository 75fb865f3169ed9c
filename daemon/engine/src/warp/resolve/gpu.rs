//! The shaders of [`super`].

use crate::backend::shader::{Binding, COMMON, Entry, Extent, Shader, Slot};

/// Equation (1).
pub const RESOLVE: Shader = Shader {
    file: "resolve.wgsl",
    parts: &[COMMON, include_str!("resolve.wgsl")],
    cleared: &[Slot::Holes],
    bindings: &[
        Binding::Read(Slot::Held),
        Binding::Read(Slot::Splat),
        Binding::Write(Slot::Carried),
        Binding::Write(Slot::Origin),
        Binding::Write(Slot::Holes),
    ],
    entries: &[
        Entry::tiles("resolve", Extent::Cells),
        Entry { name: "count_groups", extent: Extent::One, workgroup: [1, 1] },
    ],
};

/// Equation (2).
pub const CLASSIFY: Shader = Shader {
    file: "classify.wgsl",
    parts: &[COMMON, include_str!("classify.wgsl")],
    cleared: &[Slot::Broken],
    bindings: &[Binding::Read(Slot::Carried), Binding::Write(Slot::Broken)],
    entries: &[
        Entry::tiles("classify", Extent::CellStrips),
        Entry { name: "count_groups", extent: Extent::One, workgroup: [1, 1] },
    ],
};
