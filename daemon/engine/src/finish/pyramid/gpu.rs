//! The shader of [`super`].

use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, Shader, Slot};

/// Equations (1), (2) and (4), of the picture in [`Slot::Out`].
pub const PYRAMID: Shader = Shader {
    file: "pyramid.wgsl",
    parts: &[COMMON, COLOR, include_str!("pyramid.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Color),
        Binding::Write(Slot::Out),
        Binding::Write(Slot::HalfLevel),
        Binding::Write(Slot::QuarterLevel),
        Binding::Write(Slot::SmoothLevel),
    ],
    entries: &[
        Entry::tiles("down_to_half", Extent::HalfPixels),
        Entry::tiles("down_to_quarter", Extent::QuarterPixels),
        Entry::tiles("up_to_half", Extent::HalfPixels),
    ],
};
