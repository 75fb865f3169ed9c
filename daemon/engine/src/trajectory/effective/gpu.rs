//! The shader of [`super`].

use crate::backend::shader::{Binding, COMMON, Entry, Extent, Shader, Slot};

/// Equation (1), into what the scatter reads.
pub const EFFECTIVE: Shader = Shader {
    file: "effective.wgsl",
    parts: &[COMMON, include_str!("effective.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Read(Slot::Velocity),
        Binding::Read(Slot::Acceleration),
        Binding::Write(Slot::Held),
    ],
    entries: &[Entry::tiles("effective_velocity", Extent::Cells)],
};
