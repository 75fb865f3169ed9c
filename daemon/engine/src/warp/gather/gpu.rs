//! The shader of [`super`].

use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, FIELD, Shader, Slot};

/// Equation (1).
pub const GATHER: Shader = Shader {
    file: "gather.wgsl",
    parts: &[COMMON, FIELD, COLOR, include_str!("gather.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Color),
        Binding::Write(Slot::Out),
        Binding::Read(Slot::Tables),
        Binding::Read(Slot::Velocity),
    ],
    entries: &[Entry::tiles("warp_gather", Extent::Pixels)],
};
