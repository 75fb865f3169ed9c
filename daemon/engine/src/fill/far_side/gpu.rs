//! The shader of [`super`].

use crate::backend::shader::{Binding, COMMON, Entry, Extent, Shader, Slot};

/// Equations (1) to (3), after two sweeps that find the resolved cells on all four sides.
pub const FAR_SIDE: Shader = Shader {
    file: "far_side.wgsl",
    parts: &[COMMON, include_str!("far_side.wgsl")],
    cleared: &[],
    bindings: &[
        Binding::Write(Slot::Origin),
        Binding::Read(Slot::Near),
        Binding::Write(Slot::StackedRows),
        Binding::Write(Slot::BesideColumns),
        Binding::Read(Slot::Holes),
    ],
    entries: &[
        Entry::lines("sweep_columns", Extent::CellColumns),
        Entry::lines("sweep_rows", Extent::CellRows),
        Entry::lines("far_side", Extent::Listed(Slot::Holes)),
    ],
};
