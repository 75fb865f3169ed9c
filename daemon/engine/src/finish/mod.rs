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
//! A picture is blurred only where what was foreseen of it is not to be relied on ([`selection`]),
//! or all over where [`FinishConfig::is_whole`] says so.
//!
//! Departures from the paper: (1) gives in-between frames exactly what the key cannot take; the
//! paper keeps the original where it is darker, and gives back nothing where its grid is distorted,
//! which loses or adds light there. The paper's distortion fades in what is given back; here it
//! fades in the blur itself, in the key and in the in-between frames alike, so that light is kept
//! for every weight. All over is what the paper calls desirable in theory: it also takes detail out
//! of the frames that are held longest, which makes moving things sharper on the retina.
//!
//! Finishing comes last, over the valid rectangle, and off by default.

pub mod compensate;
pub mod config;
mod lanes;
pub mod ledger;
pub mod pyramid;
pub mod selection;
pub mod shares;

use rayon::ThreadPool;

pub use config::{FinishConfig, FinishMode, UnknownFinish};
pub use ledger::{Ledger, Part};
use pyramid::Pyramid;
use selection::Selection;
use shares::{Shares, Split};

use crate::color::ColorPlane;
use crate::evidence::Evidence;
use crate::field::FieldMap;
use crate::format::StreamFormat;
use crate::key::KeyFrame;
use crate::phase::Phase;
use crate::plane::Rect;

/// What finishing keeps of one stream.
#[derive(Debug)]
pub struct Finish {
    /// Who pays for whom.
    pub ledger: Ledger,
    /// Where pictures are blurred; None where all over.
    selection: Option<Selection>,
    shares: Shares,
    pyramid: Pyramid,
}

impl Finish {
    /// For a stream of `format`; None where it is off. `ppd` is the angular size of a pixel.
    #[must_use]
    pub fn new(format: &StreamFormat, config: &FinishConfig, ppd: Option<f32>) -> Option<Self> {
        let shares = Shares::new(format, config, ppd)?;
        let selection = (!config.is_whole).then(Selection::default);
        Some(Self { ledger: Ledger::default(), selection, shares, pyramid: Pyramid::default() })
    }

    /// A key has come, `older` before it; its field lies as `map` says, if it has one.
    pub fn take_key(
        &mut self,
        pool: &ThreadPool,
        key: &KeyFrame,
        older: Option<&KeyFrame>,
        map: &FieldMap,
        evidence: Option<&Evidence>,
    ) {
        self.ledger.on_key(key.is_cut);
        let Some(selection) = &mut self.selection else { return };
        let since_older = older.filter(|_| !key.is_cut).map(|older| match key.motion_span() {
            Some(span) => Phase::at(key.content_time, older.content_time, span),
            None => Phase::ZERO,
        });
        selection.take_key(pool, key, map, evidence, since_older, self.ledger.oldest_age());
    }

    /// A late camera has changed the field of the newest key.
    pub fn take_field(&mut self, key: &KeyFrame, map: &FieldMap) {
        if let Some(selection) = &mut self.selection {
            selection.take_field(key, map);
        }
    }

    /// What the next picture is, which shows the scene at `phase` after the newest key.
    pub(crate) fn next_part(&mut self, phase: Phase) -> Part {
        let part = self.ledger.next_part();
        if part != Part::Plain {
            self.turn_to(phase, self.ledger.age());
        }
        part
    }

    /// Makes the selection that of `phase` after the newest key, by the key `age` before it.
    pub fn turn_to(&mut self, phase: Phase, age: u8) {
        if let Some(selection) = &mut self.selection {
            selection.turn_to(phase, age);
        }
    }

    /// What a backend makes `part` with; None where it stays as it is.
    pub(crate) fn split(&mut self, part: Part) -> Option<Split<'_>> {
        let weights = self.selection.as_ref().and_then(Selection::weights);
        self.shares.of(part).map(|split| Split { weights, ..split })
    }

    /// Finishes `picture`, of which `valid` is the part that holds the image.
    pub fn apply(&mut self, pool: &ThreadPool, part: Part, valid: Rect, picture: &mut ColorPlane) {
        let weights = self.selection.as_ref().and_then(Selection::weights);
        if weights.is_some_and(|it| it.data().iter().all(|weight| *weight == 0)) {
            return;
        }
        let Some(split) = self.shares.of(part) else { return };
        let split = Split { weights, ..split };
        pyramid::pyramid(pool, picture, valid, weights, &mut self.pyramid);
        compensate::compensate(pool, &split, valid, &self.pyramid, picture);
    }
}

#[cfg(test)]
mod tests;
