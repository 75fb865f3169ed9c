//! The shader of [`super`].

use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, Shader, Slot};

/// Equations (1) and (2), of the picture in [`Slot::Out`], in its place.
pub const RELIGHT: Shader = Shader {
    file: "relight.wgsl",
    parts: &[COMMON, COLOR, include_str!("relight.wgsl")],
    cleared: &[],
    bindings: &[Binding::Read(Slot::Color), Binding::Write(Slot::Out), Binding::Read(Slot::Gains)],
    entries: &[Entry::tiles("relight", Extent::Pixels)],
};
