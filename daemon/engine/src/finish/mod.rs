//! Finishing: blur in the in-between frames, made up for in the key. Whatever made the pictures.
//!
//! Didyk et al. 2010, *Perceptually-motivated real-time temporal upsampling of 3D content for
//! high-refresh-rate displays*, sections 5.1 and 6. Fine detail of a made picture is what is wrong
//! first; at a high refresh rate the eye adds up N pictures and cannot tell which of them the
//! detail came from. So in-between frames lose theirs, and the key has it N times over. With `o` a
//! picture, `b` its blur ([`pyramid`]) and `l` the light that the display makes of a level:
//!
//! ```text
//! (1) i = b, or where no key could make up for it, or the two would be seen to flicker, as close to
//!     b as can be
//! (2) key = the level whose light is nearest to N l(o) - (N - 1) l(i)
//! ```
//!
//! ([`compensate`]; the arithmetic is `foreframe_perception::compensation`, integers from tables.)
//! Light of N frames is N times the original's within half a level per frame, by the display that
//! the stream or the configuration names. Where the picture is flat nothing changes. How many
//! frames come between two keys is not known before; [`ledger`] keeps account.
//!
//! Departures from the paper: (1) gives in-between frames exactly what the key cannot take; the
//! paper keeps the original where it is darker. All of a picture is blurred, reliable or not: what
//! the paper adds where its grid is not distorted is what the key cannot take, and that is added
//! everywhere.
//!
//! Finishing comes last, over the valid rectangle, and off by default.

pub mod compensate;
pub mod config;
mod lanes;
pub mod ledger;
pub mod pyramid;
pub mod shares;

use rayon::ThreadPool;

pub use config::{FinishConfig, FinishMode, UnknownFinish};
pub use ledger::{Ledger, Part};
use pyramid::Pyramid;
use shares::{Shares, Split};

use crate::color::ColorPlane;
use crate::format::StreamFormat;
use crate::plane::Rect;

/// What finishing keeps of one stream.
#[derive(Debug)]
pub struct Finish {
    /// Who pays for whom.
    pub ledger: Ledger,
    shares: Shares,
    pyramid: Pyramid,
}

impl Finish {
    /// For a stream of `format`; None where it is off. `ppd` is the angular size of a pixel.
    #[must_use]
    pub fn new(format: &StreamFormat, config: &FinishConfig, ppd: Option<f32>) -> Option<Self> {
        let shares = Shares::new(format, config, ppd)?;
        Some(Self { ledger: Ledger::default(), shares, pyramid: Pyramid::default() })
    }

    /// What a backend makes `part` with; None where it stays as it is.
    pub(crate) fn split(&mut self, part: Part) -> Option<Split<'_>> {
        self.shares.of(part)
    }

    /// Finishes `picture`, of which `valid` is the part that holds the image.
    pub fn apply(&mut self, pool: &ThreadPool, part: Part, valid: Rect, picture: &mut ColorPlane) {
        let Some(split) = self.shares.of(part) else { return };
        pyramid::pyramid(pool, picture, valid, &mut self.pyramid);
        compensate::compensate(pool, &split, valid, &self.pyramid, picture);
    }
}

#[cfg(test)]
mod tests;
