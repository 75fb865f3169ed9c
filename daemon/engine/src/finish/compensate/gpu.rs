//! The shader of [`super`].

use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, Shader, Slot};

/// Equations (0) to (3), of the picture in [`Slot::Out`], in its place.
pub const COMPENSATE: Shader = Shader {
    file: "compensate.wgsl",
    parts: &[COMMON, COLOR, include_str!("compensate.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Color),
        Binding::Write(Slot::Out),
        Binding::Read(Slot::SmoothLevel),
        Binding::Read(Slot::Lights),
        Binding::Read(Slot::Weights),
    ],
    entries: &[Entry::tiles("compensate", Extent::Pixels)],
};
