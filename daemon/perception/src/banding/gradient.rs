//! A gradient between two colours: its steps at a bit depth, and the depth that hides them.

use super::{Seen, Step, seen};
use crate::PerceptionError;

/// The most bits per channel that are tried.
pub const MOST_BITS: u8 = 16;
/// Places along the gradient that are looked at.
const PLACES: u32 = 33;
/// Widths that are tried for the worst, from the narrowest that pixels can show to a period of ten
/// degrees, a quarter of an octave apart: the sensitivity changes by a few percent between two.
const NARROWEST_PX: f64 = 2.0;
const WIDEST_DEG: f64 = 10.0;

/// A straight gradient in codes of 0 to 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gradient {
    from: [f64; 3],
    to: [f64; 3],
}

/// How wide a step of the gradient is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum BandWidth {
    /// The whole gradient has this many pixels.
    Over(f64),
    /// Whatever is seen best at each place.
    Worst,
}

impl Gradient {
    /// A gradient between two different colours.
    ///
    /// # Errors
    /// If a code is outside 0 to 1, or there is nothing between the colours.
    pub fn new(from: [f64; 3], to: [f64; 3]) -> Result<Self, PerceptionError> {
        for code in from.into_iter().chain(to) {
            let is_inside = (0.0..=1.0).contains(&code);
            PerceptionError::check("code of a gradient", "0 to 1", code, is_inside)?;
        }
        let gradient = Self { from, to };
        PerceptionError::check_positive("difference of a gradient", gradient.span())?;
        Ok(gradient)
    }

    /// The largest way of a channel.
    fn span(&self) -> f64 {
        (0..3).map(|channel| (self.to[channel] - self.from[channel]).abs()).fold(0.0, f64::max)
    }

    fn code(&self, share: f64) -> [f64; 3] {
        let way = |channel: usize| {
            let (from, to) = (self.from[channel], self.to[channel]);
            (from + (to - from) * share).clamp(0.0, 1.0)
        };
        core::array::from_fn(way)
    }

    /// Probability of seeing steps at `bits` per channel where they are seen best.
    ///
    /// `xyz` turns codes into light, CIE XYZ with Y in cd/m2. The steps are those of the channel
    /// that goes farthest, along the gradient: exact where all channels that change do so alike, as
    /// in greys and primaries.
    ///
    /// # Errors
    /// If `bits` is not 1 to 16, or `ppd` or the width is not above 0.
    pub fn seen(
        &self,
        bits: u8,
        width: BandWidth,
        ppd: f64,
        xyz: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<Seen, PerceptionError> {
        let is_inside = (1..=MOST_BITS).contains(&bits);
        PerceptionError::check("bits", "1 to 16", bits.into(), is_inside)?;
        PerceptionError::check_positive("ppd", ppd)?;
        if let BandWidth::Over(pixels) = width {
            PerceptionError::check_positive("width of the gradient", pixels)?;
        }
        let levels = f64::from((1_u32 << bits) - 1);
        let steps = self.span() * levels;
        // A gradient of less than a level is one step, along the same direction.
        let share = 1.0 / steps;
        let mut most = Seen::default();
        for place in 0..PLACES {
            let start = (f64::from(place) / f64::from(PLACES - 1)).min((1.0 - share).max(0.0));
            let [from_xyz, to_xyz] = [start, start + share].map(|share| xyz(self.code(share)));
            for width_px in widths(width, steps, ppd) {
                let found = seen(&Step { from_xyz, to_xyz, width_px }, ppd);
                if found.any() > most.any() {
                    most = found;
                }
            }
        }
        Ok(most)
    }

    /// The fewest bits per channel from which on steps are seen at most half of the time. None if
    /// 16 do not do.
    ///
    /// # Errors
    /// As [`Self::seen`].
    pub fn least_bits(
        &self,
        width: BandWidth,
        ppd: f64,
        xyz: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Result<Option<u8>, PerceptionError> {
        let mut least = None;
        // From above: far fewer bits can hide steps that are too slow to be seen, which is no help.
        for bits in (1..=MOST_BITS).rev() {
            if self.seen(bits, width, ppd, &xyz)?.any() > 0.5 {
                break;
            }
            least = Some(bits);
        }
        Ok(least)
    }
}

fn widths(width: BandWidth, steps: f64, ppd: f64) -> Vec<f64> {
    match width {
        BandWidth::Over(pixels) => vec![pixels / steps.max(1.0)],
        BandWidth::Worst => {
            let quarters = (4.0 * libm::log2(WIDEST_DEG * ppd / NARROWEST_PX)).max(0.0) as u32;
            (0..=quarters).map(|step| NARROWEST_PX * libm::exp2(f64::from(step) / 4.0)).collect()
        }
    }
}
