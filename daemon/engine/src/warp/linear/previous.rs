//! Where the key before shows what a hole would: (4) of [`super`].

use super::cpu::Frame;
use super::fill::{FarSurface, clamp, nearest_pixel};
use crate::key::{KeyFrame, Velocity};
use crate::plane::Plane;

/// Depth keys of the far side in two keys may differ by this fraction (a shift of 5: 1/32). Of
/// three captures one gains 0.4 dB from 1/8 to 1/32 and half of that at 1/64, and one loses 0.1 dB
/// at 1/8 and nothing at 1/32.
pub const DEPTH_SHIFT: u32 = 5;

/// What holes read of the key before, beside its colour.
pub(super) struct Previous<'a> {
    /// Its depth, on a grid of the same size.
    pub(super) depth: &'a Plane<u32>,
    /// How far the newest key's surfaces came since.
    pub(super) came: &'a Plane<Velocity>,
}

/// Whether holes after `key` may show what `older`, the key before it, shows: its motion points
/// back to it, and both have depth, motion and one geometry.
#[must_use]
pub fn has_previous(key: &KeyFrame, older: &KeyFrame) -> bool {
    let size = |key: &KeyFrame| {
        let (color, depth) = (&key.color, &key.depth);
        [color.width(), color.height(), depth.width(), depth.height()]
    };
    key.motion_from == Some(older.content_time)
        && older.motion_from.is_some()
        && !key.depth.data().is_empty()
        && !key.velocity.data().is_empty()
        && !older.velocity.data().is_empty()
        && size(key) == size(older)
        && key.color.format() == older.color.format()
        && key.valid == older.valid
}

/// How far the surfaces of `key` came since the key before.
#[must_use]
pub fn came(key: &KeyFrame) -> &Plane<Velocity> {
    if key.came.data().is_empty() { &key.velocity } else { &key.came }
}

impl Previous<'_> {
    /// Where it shows what the surface `far` shows at `q` of the newest key, behind something; Q8
    /// pixels.
    pub(super) fn place(
        &self,
        frame: &Frame<'_>,
        far: &FarSurface,
        q: [i32; 2],
    ) -> Option<[i32; 2]> {
        let came = self.came.data()[far.source as usize];
        if !came.is_trackable() {
            return None;
        }
        // 1/32 pixels in Q8.
        let q = [q[0] - (i32::from(came.x) << 3), q[1] - (i32::from(came.y) << 3)];
        if !self.shows(frame, q, far.depth) {
            return None;
        }
        let [x, y] = q.map(|q| q & !0xff);
        let corners = [[x, y], [x + 256, y], [x, y + 256], [x + 256, y + 256]];
        let mixes = corners.into_iter().any(|at| !self.shows(frame, clamp(frame, at), far.depth));
        Some(if mixes { nearest_pixel(q) } else { q })
    }

    /// Whether it shows a surface of depth key `depth` at the pixel nearest to `q`.
    fn shows(&self, frame: &Frame<'_>, q: [i32; 2], depth: u32) -> bool {
        // Left of or above the rectangle the difference wraps and is larger than any size.
        let column = (((q[0] + 128) >> 8) - frame.valid.x.cast_signed()).cast_unsigned();
        let row = (((q[1] + 128) >> 8) - frame.valid.y.cast_signed()).cast_unsigned();
        if column >= frame.valid.width || row >= frame.valid.height {
            return false;
        }
        let was = self.depth.at(frame.map.x.cell_of(column), frame.map.y.cell_of(row));
        was.abs_diff(depth) <= (was.max(depth) >> DEPTH_SHIFT) + 1
    }
}
