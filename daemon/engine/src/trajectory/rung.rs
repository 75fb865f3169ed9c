//! The rungs of the ladder, by name.

use super::world::MoverOrder;

/// A model of how a surface goes on from a key, cheapest first.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum Rung {
    /// It stays where it is.
    Hold,
    /// It moves with the whole image.
    Global,
    /// It goes on by its motion vector.
    #[default]
    Linear,
    /// It goes on by the affine map that its surroundings follow.
    Affine,
    /// It goes on by the change of its motion.
    Quadratic,
    /// It is seen by a camera that goes on, and goes on through the world itself if it moves.
    World(MoverOrder),
    /// It goes on by what the last two pictures show of it, where its motion does not explain them.
    Flow,
}

impl Rung {
    /// Name in reports, that of the method that takes it everywhere.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Global => "global",
            Self::Linear => "linear",
            Self::Affine => "affine",
            Self::Quadratic => "quadratic",
            Self::World(_) => "world",
            Self::Flow => "flow",
        }
    }
}
