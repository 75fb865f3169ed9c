//! The shaders of [`super`].

use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, FIELD, Shader, Slot};

/// Text that both share: which surface a pixel of a broken cell shows, and which a hole continues.
pub const HOLES: &str = include_str!("holes.wgsl");

/// Equations (1) to (3), and (5).
pub const LINEAR: Shader = Shader {
    file: "linear.wgsl",
    parts: &[COMMON, FIELD, COLOR, HOLES, include_str!("linear.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Color),
        Binding::Write(Slot::Out),
        Binding::Read(Slot::Tables),
        Binding::Read(Slot::Held),
        Binding::Read(Slot::Near),
        Binding::Read(Slot::Carried),
        Binding::Read(Slot::Origin),
        Binding::Read(Slot::Broken),
    ],
    entries: &[
        Entry::tiles("warp_linear", Extent::Pixels),
        Entry::lines("warp_broken", Extent::Listed(Slot::Broken)),
    ],
};

/// Equation (4), over what [`LINEAR`] made.
pub const PREVIOUS: Shader = Shader {
    file: "previous.wgsl",
    parts: &[COMMON, FIELD, COLOR, HOLES, include_str!("previous.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Older),
        Binding::Write(Slot::Out),
        Binding::Read(Slot::Tables),
        Binding::Read(Slot::Held),
        Binding::Read(Slot::Near),
        Binding::Read(Slot::Carried),
        Binding::Read(Slot::Origin),
        Binding::Read(Slot::Was),
    ],
    entries: &[Entry::tiles("fill_from_previous", Extent::Cells)],
};
