//! (2) and (3) of [`super`]: whether the change of light goes on, and where to.

use super::TILE;
use super::change::Change;
use crate::key::Velocity;
use crate::phase::Phase;
use crate::plane::Plane;
use crate::warp::displacement;

/// Tiles around one that are judged with it, per side.
const AROUND: u32 = 1;
/// Tiles that a change may have moved by, per side.
const REACH: i32 = 2;
/// Added to the sums of squares of (2): those of nine tiles that changed by a fiftieth each.
const LITTLE: f32 = 0.003_6;
/// Part of the squares of its surroundings that a tile may have: one alone is no light.
const ALONE: f32 = 0.5;
/// R^2 from which on a change was foreseen.
const FORESEEN: f32 = 0.5;
/// By how much more R^2 has to be for a change to have moved.
const MOVED: f32 = 0.05;

/// c' of (2) where the surfaces of the newest key are, with a margin of tiles that did not change.
#[derive(Clone, Debug, Default)]
pub(super) struct Foreseen {
    before: Plane<f32>,
    now: Plane<f32>,
}

/// Tiles of the margin: what a window reaches beyond the border.
const MARGIN: u32 = AROUND + REACH.unsigned_abs();

impl Foreseen {
    /// Takes the changes `before` along to where those that are now came from, whose motion span is
    /// `ratio` times as long.
    pub(super) fn carry(&mut self, changes: &Plane<Change>, before: &Plane<Change>, ratio: f32) {
        let [width, height] = [changes.width(), changes.height()];
        for plane in [&mut self.before, &mut self.now] {
            plane.resize(width + 2 * MARGIN, height + 2 * MARGIN);
            plane.data_mut().fill(0.0);
        }
        for row in 0..height {
            let inside = MARGIN as usize..(MARGIN + width) as usize;
            let carried = &mut self.before.row_mut(row + MARGIN)[inside.clone()];
            let now = &mut self.now.row_mut(row + MARGIN)[inside];
            for (column, (carried, now)) in (0..).zip(carried.iter_mut().zip(now)) {
                let change = changes.at(column, row);
                let was = came_from([column, row], change.motion, [width - 1, height - 1]);
                *carried = ratio * before.at(was[0], was[1]).octaves;
                *now = change.octaves;
            }
        }
    }

    /// (3) of a tile.
    pub(super) fn goes_on(&self, [column, row]: [u32; 2]) -> f32 {
        let at = [column + MARGIN, row + MARGIN];
        let now = window(&self.now, at);
        let squares = sum_of(&now, &now) + LITTLE;
        let largest = now.as_flattened().iter().fold(0.0_f32, |most, c| most.max(c * c));
        if squares <= 2.0 * LITTLE || largest > ALONE * squares {
            return 0.0;
        }
        let (mut best, mut goes_on) = (0.0, 0.0);
        for down in -REACH..=REACH {
            for right in -REACH..=REACH {
                let from = [at[0].wrapping_add_signed(-right), at[1].wrapping_add_signed(-down)];
                let then = window(&self.before, from);
                let (both, older) = (sum_of(&now, &then), sum_of(&then, &then) + LITTLE);
                let stays = (right, down) == (0, 0);
                let foreseen = both * both / (older * squares);
                let alike = foreseen + if stays { MOVED } else { 0.0 };
                if both > 0.0 && foreseen > FORESEEN && alike > best {
                    best = alike;
                    goes_on = (both / older).min(1.0) * self.now.at(from[0], from[1]);
                }
            }
        }
        goes_on
    }
}

/// The 3x3 tiles around one.
#[inline(always)]
fn window(plane: &Plane<f32>, [column, row]: [u32; 2]) -> [[f32; 3]; 3] {
    std::array::from_fn(|y| {
        let tiles = &plane.row(row - AROUND + y as u32)[(column - AROUND) as usize..];
        *tiles.first_chunk().expect("a margin is that wide")
    })
}

#[inline(always)]
fn sum_of(a: &[[f32; 3]; 3], b: &[[f32; 3]; 3]) -> f32 {
    let rows = a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
    rows.sum()
}

/// The tile that the middle of one was in, a motion span ago.
fn came_from(tile: [u32; 2], motion: Velocity, last: [u32; 2]) -> [u32; 2] {
    let d = displacement(motion, Phase::ONE);
    let was = |axis: usize| {
        let place = (tile[axis] * TILE + TILE / 2).cast_signed() - (d[axis] >> 8);
        (place.max(0).cast_unsigned() / TILE).min(last[axis])
    };
    [was(0), was(1)]
}
