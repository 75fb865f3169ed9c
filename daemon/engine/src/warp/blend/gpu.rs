//! The shader of [`super`].

use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, Shader, Slot};

/// Equation (1).
pub const BLEND: Shader = Shader {
    file: "blend.wgsl",
    parts: &[COMMON, COLOR, include_str!("blend.wgsl")],
    cleared: &[],
    bindings: &[Binding::Read(Slot::Color), Binding::Write(Slot::Out), Binding::Read(Slot::Older)],
    entries: &[Entry::tiles("blend", Extent::Pixels)],
};
