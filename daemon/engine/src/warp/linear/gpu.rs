//! The shaders of [`super`].

use super::previous::MOST_KEYS;
use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, FIELD, Shader, Slot};

/// Text that both share: which surface a pixel of a broken cell shows, and which a hole continues.
pub const HOLES: &str = include_str!("holes.wgsl");

/// Equations (1) to (3), and (5); lists the pixels that (4) may show instead.
pub const LINEAR: Shader = Shader {
    file: "linear.wgsl",
    parts: &[COMMON, FIELD, COLOR, HOLES, include_str!("linear.wgsl")],
    cleared: &[Slot::Hidden],
    bindings: &[
        Binding::Read(Slot::Color),
        Binding::Write(Slot::Out),
        Binding::Read(Slot::Tables),
        Binding::Read(Slot::Held),
        Binding::Read(Slot::Near),
        Binding::Read(Slot::Carried),
        Binding::Read(Slot::Origin),
        Binding::Read(Slot::Broken),
        Binding::Write(Slot::Hidden),
    ],
    entries: &[
        Entry::tiles("warp_linear", Extent::Pixels),
        Entry::lines("warp_broken", Extent::Listed(Slot::Broken)),
        Entry { name: "count_groups", extent: Extent::One, workgroup: [1, 1] },
    ],
};

/// Where the colours of the keys before are, from the newest on.
pub const OLDER_COLORS: [Slot; MOST_KEYS] =
    [Slot::Older, Slot::SecondOlder, Slot::ThirdOlder, Slot::FourthOlder];

/// Which of the keys before each of [`PREVIOUS`] shows, counted from 0.
pub const LEVELS: [&str; MOST_KEYS] = [
    "override LEVEL: u32 = 0u;\n",
    "override LEVEL: u32 = 1u;\n",
    "override LEVEL: u32 = 2u;\n",
    "override LEVEL: u32 = 3u;\n",
];

macro_rules! previous {
    ($key:literal) => {
        Shader {
            file: "previous.wgsl",
            parts: &[COMMON, FIELD, COLOR, HOLES, LEVELS[$key], include_str!("previous.wgsl")],
            cleared: &[],
            bindings: &[
                Binding::Read(OLDER_COLORS[$key]),
                Binding::Write(Slot::Out),
                Binding::Read(Slot::Tables),
                Binding::Read(Slot::Held),
                Binding::Read(Slot::Near),
                Binding::Read(Slot::Carried),
                Binding::Read(Slot::Origin),
                Binding::Read(Slot::Was),
                Binding::Read(Slot::Hidden),
            ],
            entries: &[Entry::lines("fill_from_previous", Extent::Listed(Slot::Hidden))],
        }
    };
}

/// Equation (4), over what [`LINEAR`] made: one shader for each of the keys before.
pub const PREVIOUS: [Shader; MOST_KEYS] = [previous!(0), previous!(1), previous!(2), previous!(3)];
