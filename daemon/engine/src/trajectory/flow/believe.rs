//! When a block's flow is believed, and when the whole of it.

use super::Step;
use super::block::contrast;
use super::luma::Level;
use super::search::Block;
use crate::plane::Plane;

/// Steps of luma that every pixel of a block may differ by without anything having moved: dither,
/// noise, the rounding of an encoder.
pub(super) const NOISE: u32 = 2 * 64;
/// Part of what standing still leaves of (1) that may be left, in quarters.
const WORTH_QUARTERS: u32 = 3;

/// What is thought of a block's flow.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum Belief {
    /// There is no texture that could tell.
    #[default]
    Flat,
    /// It explains the block.
    Explained,
    /// Nothing does.
    Unexplained,
}

/// The flow of the block at `at` and what is thought of it, where `step` leaves `error` of (1) and
/// standing still leaves `still`.
pub(super) fn believe(now: &Level, at: [i32; 2], step: Step, error: u32, still: u32) -> Block {
    let contrast = contrast(now, at);
    // Half of the contrast is what another picture of the same brightness would leave.
    let is_explained = |error: u32| 2 * error <= contrast + 2 * NOISE;
    let is_worth_it = 4 * error < WORTH_QUARTERS * still;
    let is_flat = contrast <= NOISE;
    let step = if is_worth_it || is_flat && error <= still { step } else { [0; 2] };
    let belief = match () {
        () if !is_explained(error.min(still)) => Belief::Unexplained,
        () if is_flat => Belief::Flat,
        () => Belief::Explained,
    };
    Block { step, belief }
}

/// Whether at least half of the blocks are explained, or flat: two pictures of different places
/// have hardly any in common.
pub(super) fn is_believable(blocks: &Plane<Block>) -> bool {
    let count = |belief: Belief| blocks.data().iter().filter(|b| b.belief == belief).count();
    count(Belief::Unexplained) <= count(Belief::Explained) + count(Belief::Flat)
}
