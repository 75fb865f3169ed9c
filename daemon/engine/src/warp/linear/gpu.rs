//! The shader of [`super`].

use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, FIELD, Shader, Slot};

/// Equations (1) to (4).
pub const LINEAR: Shader = Shader {
    file: "linear.wgsl",
    parts: &[COMMON, FIELD, COLOR, include_str!("linear.wgsl")],
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
