//! Where a picture is blurred: only where what was foreseen of it is not to be relied on.
//!
//! Didyk et al. 2010, section 5.1, let the blur grow with the distortion of their grid: where it is
//! torn or bent, detail is wrong first. Here a weight says so, 0 to [`FULL`] per tile of 8x8 pixels
//! of the valid rectangle, worked out from the newest key alone ([`tiles`]). With `v` the field's
//! velocities, in pixels per motion span, over a tile and a cell around it:
//!
//! ```text
//! (1) r = max v - min v, the larger axis                        how far the tile is torn or bent
//! (2) d = smooth step of r from 1/2 to 2 pixels                 1/16 and 1/4 of a tile's side
//! (3) c = smooth step of the share of contrast that the error of the rung in use has cost, from
//!     1/4 to 3/4; 1 where only a part of the motion goes on     methods with evidence alone
//! (4) w = max(d, c), over the tile, over what lies within r of it and a tile more, then [1 2 1]^2
//! ```
//!
//! w is 1 where no velocity is known. (4) reaches over what will be uncovered, which lies no
//! further than r from the edge that uncovers it. A pan, a slow zoom and a still camera blur
//! nothing.
//!
//! The weight belongs to the surface: at phase p a tile has the weight of the place that it came
//! from by the velocity at its middle ([`Selection::weights`]),
//!
//! ```text
//! (5) w_p(y) = w(y - v(y) p)                                    between tiles linear, in 1/256 tile
//! ```
//!
//! and a pixel that of the tiles around it, linearly ([`row_weights`]). The picture is then split
//! with `o + w (b - o)` in the place of its blur `b` (`super::compensate`), the key and its
//! in-between frames alike, so that nothing changes in the law of light: it holds for any blur.
//! It holds at each pixel of a surface that stands still, and along the path of one that moves as
//! far as w is the same at both ends of (5): exactly inside and outside the selection, and at its
//! soft border but for what rounding to tiles and the resampling of (5) change.
//!
//! In-between frames have the weights of the key that paid for them. If that is not the newest, its
//! weights have come along with the surfaces by (5), key by key.
//!
//! Integers from the quantised field on, but for (3), which is rounded to them. Made on the CPU
//! whatever the backend: a byte per 64 pixels. Exactness: `Exact`.

#[cfg(test)]
mod tests;
mod tiles;

use rayon::ThreadPool;

use crate::evidence::Evidence;
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::Plane;
use crate::warp::displacement;

/// Pixels of a tile's side.
pub const TILE: u32 = 8;
/// The weight of a tile that is blurred as far as it can be.
pub const FULL: u8 = 128;
/// Keys whose weights are kept. What older ones paid for is shown with the oldest that are.
const KEPT: usize = 4;

/// Where pictures of one stream are blurred.
#[derive(Debug, Default)]
pub struct Selection {
    /// By how many keys ago they paid: of the newest key first. Empty before the first.
    by_age: Vec<Plane<u8>>,
    scratch: tiles::Scratch,
    /// Velocity in the middle of each tile.
    motion: Plane<Velocity>,
    /// (5) of the picture being made.
    now: Plane<u8>,
}

impl Selection {
    /// Takes in the newest key, whose field lies as `map` says, if it has one. `since_older` is the
    /// phase that lies between it and the key before, None after a cut; `older` is how many keys
    /// before it have paid for what is still to be shown.
    pub fn take_key(
        &mut self,
        pool: &ThreadPool,
        key: &KeyFrame,
        map: &FieldMap,
        evidence: Option<&Evidence>,
        since_older: Option<Phase>,
        older: usize,
    ) {
        let size = [key.valid.width, key.valid.height].map(|side| side.div_ceil(TILE));
        tiles::motion(key, map, size, &mut self.motion);
        let mut newest = self.make_room(size, since_older, older);
        tiles::weights(pool, key, map, evidence, &mut self.scratch, size, &mut newest);
        self.by_age.insert(0, newest);
    }

    /// The newest key goes on otherwise than it did: its field is `key`'s now. What that uncovers
    /// beside what was to be uncovered is not blurred.
    pub fn take_field(&mut self, key: &KeyFrame, map: &FieldMap) {
        if let Some(newest) = self.by_age.first() {
            let size = [newest.width(), newest.height()];
            tiles::motion(key, map, size, &mut self.motion);
        }
    }

    /// Brings along the weights of the keys before, and gives room for those of one more.
    fn make_room(&mut self, size: [u32; 2], since_older: Option<Phase>, older: usize) -> Plane<u8> {
        let is_same_size = self.by_age.first().is_some_and(|it| [it.width(), it.height()] == size);
        let mut newest = Plane::default();
        match since_older.filter(|_| is_same_size) {
            Some(phase) => {
                self.by_age.truncate(older);
                for weights in &mut self.by_age {
                    moved(weights, &self.motion, phase, &mut self.now);
                    std::mem::swap(weights, &mut self.now);
                }
                if self.by_age.len() == KEPT {
                    newest = self.by_age.pop().unwrap_or_default();
                }
            }
            None => self.by_age.clear(),
        }
        newest
    }

    /// Takes in a key that is to be blurred as `weights` say and moves by `motion`, per tile.
    #[cfg(test)]
    pub(super) fn take_weights(
        &mut self,
        weights: Plane<u8>,
        motion: Plane<Velocity>,
        since_older: Option<Phase>,
        older: usize,
    ) {
        self.motion = motion;
        self.make_room([weights.width(), weights.height()], since_older, older);
        self.by_age.insert(0, weights);
    }

    /// Works out (5) at `phase` after the newest key, of the weights of the key that came `age`
    /// keys before it.
    pub fn turn_to(&mut self, phase: Phase, age: u8) {
        let place = usize::from(age).min(self.by_age.len().saturating_sub(1));
        if let Some(weights) = self.by_age.get(place) {
            moved(weights, &self.motion, phase, &mut self.now);
        }
    }

    /// (5) of the phase that it was turned to, per tile. None before the first key.
    #[must_use]
    pub fn weights(&self) -> Option<&Plane<u8>> {
        (!self.by_age.is_empty()).then_some(&self.now)
    }
}

/// (5): `weights` of where each tile came from.
fn moved(weights: &Plane<u8>, motion: &Plane<Velocity>, phase: Phase, out: &mut Plane<u8>) {
    let (width, height) = (weights.width(), weights.height());
    out.resize(width, height);
    let last = [width, height].map(|side| (side as i32 - 1) << 8);
    for y in 0..height {
        let velocities = motion.row(y);
        for (x, out) in (0..).zip(out.row_mut(y)) {
            let [dx, dy] = displacement(velocities[x as usize], phase);
            if (dx, dy) == (0, 0) {
                *out = weights.at(x, y);
                continue;
            }
            // Q8 pixels are Q11 tiles.
            let at = [(x, dx, last[0]), (y, dy, last[1])]
                .map(|(tile, moved, last)| ((tile as i32) * 256 - (moved >> 3)).clamp(0, last));
            let [(left, right, way_x), (above, below, way_y)] = [(at[0], width), (at[1], height)]
                .map(|(at, count)| {
                    let tile = (at >> 8) as u32;
                    (tile, (tile + 1).min(count - 1), (at & 255) as u32)
                });
            let between = |y: u32| {
                let [first, second] = [left, right].map(|x| u32::from(weights.at(x, y)));
                (256 - way_x) * first + way_x * second
            };
            let sum = (256 - way_y) * between(above) + way_y * between(below);
            *out = ((sum + (1 << 15)) >> 16) as u8;
        }
    }
}

/// The weights of a row of pixels: of tiles around, linearly. `y` and the pixels are counted from
/// the corner of the valid rectangle; of `row` as many are written as there are. `columns` is room
/// to work in. Returns whether any is above 0.
pub fn row_weights(weights: &Plane<u8>, y: u32, columns: &mut Vec<u16>, row: &mut [u8]) -> bool {
    let place = 2 * y as i32 + 1 - TILE as i32;
    let (above, way) = (place.div_euclid(16), place.rem_euclid(16) as u16);
    let line = |y: i32| weights.row(y.clamp(0, weights.height() as i32 - 1) as u32);
    columns.clear();
    columns.extend(
        line(above)
            .iter()
            .zip(line(above + 1))
            .map(|(above, below)| (16 - way) * u16::from(*above) + way * u16::from(*below)),
    );
    let (Some(first), Some(last)) = (columns.first().copied(), columns.last().copied()) else {
        return false;
    };
    if columns.iter().all(|weight| *weight == 0) {
        row.fill(0);
        return false;
    }
    let rounded = |weight: u16| ((16 * weight + 128) >> 8) as u8;
    let half = (TILE as usize / 2).min(row.len());
    let (head, rest) = row.split_at_mut(half);
    head.fill(rounded(first));
    let pairs = columns.iter().zip(columns.iter().skip(1).chain([&last]));
    for ((first, second), pixels) in pairs.zip(rest.chunks_mut(TILE as usize)) {
        for (way, pixel) in (1..16).step_by(2).zip(pixels) {
            *pixel = (((16 - way) * first + way * second + 128) >> 8) as u8;
        }
    }
    true
}
