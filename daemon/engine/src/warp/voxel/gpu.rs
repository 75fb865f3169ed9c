//! The shaders of [`super`], and what they read beside planes of the newest key.

use super::cpu::{Between, older_part};
use super::scratch::turn;
use crate::backend::shader::{Binding, COLOR, COMMON, Entry, Extent, FIELD, Shader, Slot};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::params::{FrameParams, place_words};
use crate::plane::Plane;
use crate::warp::linear::HOLES;

/// Text that both share: which surface comes to a pixel, and where the keys show it.
pub const SURFACES: &str = include_str!("surfaces.wgsl");

/// Equations (1), and (2) and (4) as far as the newest key goes.
pub const VOXEL: Shader = Shader {
    file: "voxel.wgsl",
    parts: &[COMMON, FIELD, COLOR, HOLES, SURFACES, include_str!("voxel.wgsl")],
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
        Entry::tiles("warp_smooth", Extent::Pixels),
        Entry::lines("warp_broken", Extent::Listed(Slot::Broken)),
    ],
};

/// Equations (2) to (4) as far as the older key goes, over what [`VOXEL`] made.
pub const VOXEL_OLDER: Shader = Shader {
    file: "older.wgsl",
    parts: &[COMMON, FIELD, COLOR, HOLES, SURFACES, include_str!("older.wgsl")],
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
    entries: &[Entry::tiles("add_older", Extent::Cells)],
};

/// What goes to the shaders beside colour and depth of the newest key.
#[derive(Debug, Default)]
pub struct VoxelWords {
    /// The newest key's velocities, turned round.
    pub turned: Plane<Velocity>,
    /// Depth keys of the key before, then for its columns and rows of pixels which cells hold them.
    pub past: Vec<u32>,
    is_still: bool,
    older_map: FieldMap,
}

impl VoxelWords {
    /// Becomes the field of `key`.
    pub fn take_key(&mut self, key: &KeyFrame) {
        turn(&key.velocity, &mut self.turned);
        self.is_still = (self.turned.data().iter())
            .all(|velocity| !velocity.is_trackable() || *velocity == Velocity::default());
        self.past.clear();
    }

    /// Fills [`VoxelWords::past`] for frames after `older`. Returns whether it was empty.
    pub fn take_older(&mut self, older: &KeyFrame) -> bool {
        if !self.past.is_empty() {
            return false;
        }
        if older.depth.data().is_empty() {
            // A binding cannot be empty.
            self.past.push(0);
            return true;
        }
        let cells = [older.depth.width(), older.depth.height()];
        self.older_map.update(older.valid, cells, older.field_offset);
        self.past.extend_from_slice(older.depth.data());
        place_words(&self.older_map.x, &mut self.past);
        place_words(&self.older_map.y, &mut self.past);
        true
    }

    /// The parameters of a frame between two keys, `params` being those of the newer one; None
    /// where the frame is the mean of both.
    #[must_use]
    pub fn params(&self, params: FrameParams, between: &Between<'_>) -> Option<FrameParams> {
        let part = older_part(between)?;
        Some(params.between([between.older, between.newer], part, self.is_still))
    }
}
