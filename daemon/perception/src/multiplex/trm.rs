//! Temporal resolution multiplexing: full and reduced frames in turn.
//!
//! Denes 2020, section 5.2. Even frames are rendered in full and sharpened by what the reduced ones
//! lack; odd frames are rendered small and restored. What the display cannot show of a sharpened
//! frame is kept as a residual and added to the next restored one where nothing moves.

use super::resample::{reduced, reduced_size, restored};
use super::{S1, S2};
use crate::PerceptionError;
use crate::plane::Plane;

/// The state between frames of one channel.
#[derive(Clone, PartialEq, Debug)]
pub struct TemporalMultiplexing {
    size: [usize; 2],
    low_size: [usize; 2],
    gamma: f32,
    /// After an even frame: what it would be if restored, and what of it was clipped.
    last: Option<Even>,
}

#[derive(Clone, PartialEq, Debug)]
struct Even {
    low: Plane,
    residual: Plane,
}

impl TemporalMultiplexing {
    /// For frames of `size` columns and rows, every second one with its sides reduced to
    /// `reduction`, resampled in light to the power of 1 over `gamma`.
    ///
    /// # Errors
    /// If `reduction` is not above 0 and at most 1, or `gamma` not above 0.
    pub fn new(size: [usize; 2], reduction: f64, gamma: f32) -> Result<Self, PerceptionError> {
        PerceptionError::check_positive("gamma", gamma.into())?;
        let low_size = reduced_size(size, reduction)?;
        Ok(Self { size, low_size, gamma, last: None })
    }

    /// The size at which odd frames are rendered.
    #[must_use]
    pub fn low_size(&self) -> [usize; 2] {
        self.low_size
    }

    /// What a frame that is rendered in full would be at the size of odd frames: for applications
    /// that cannot render small.
    #[must_use]
    pub fn reduce(&self, full: &Plane) -> Plane {
        reduced(full, self.low_size, self.gamma)
    }

    /// The frame to show for an even frame: `2 I - U D I` (equation 5.2), clipped to 0 to 1.
    ///
    /// # Errors
    /// If it is not of the full size.
    pub fn even(&mut self, full: &Plane) -> Result<Plane, PerceptionError> {
        check_size(self.size, full)?;
        let low = restored(&self.reduce(full), self.size, self.gamma);
        let wanted = full.zip(&low, |full, low| 2.0 * full - low);
        let shown = wanted.map(|light| light.clamp(0.0, 1.0));
        let residual = wanted.zip(&shown, |wanted, shown| wanted - shown);
        self.last = Some(Even { low, residual });
        Ok(shown)
    }

    /// The frame to show for an odd one: `U i` and the residual where nothing moves (equations 5.1,
    /// 5.4), clipped to 0 to 1. The first frame of all has no residual.
    ///
    /// # Errors
    /// If it is not of the reduced size.
    pub fn odd(&mut self, low: &Plane) -> Result<Plane, PerceptionError> {
        check_size(self.low_size, low)?;
        let mut shown = restored(low, self.size, self.gamma);
        if let Some(Even { low: before, residual }) = self.last.take() {
            let weight = before.zip(&shown, motion_weight);
            let added = weight.zip(&residual, |weight, residual| weight * residual);
            shown = shown.zip(&added, |light, added| (light + added).clamp(0.0, 1.0));
        }
        Ok(shown)
    }
}

/// Weight of the residual for the light of two successive low-resolution frames: 1 where they are
/// equal, near 0 where something moves (equations 5.5 and 5.6). Of no light at all: 1.
#[must_use]
pub fn motion_weight(before: f32, now: f32) -> f32 {
    let sum = before + now;
    if sum <= 0.0 {
        return 1.0;
    }
    let contrast = (before - now).abs() / sum;
    libm::expf(-libm::powf(contrast / S1, S2))
}

fn check_size([width, height]: [usize; 2], found: &Plane) -> Result<(), PerceptionError> {
    if (found.width(), found.height()) == (width, height) {
        return Ok(());
    }
    Err(PerceptionError::SizeDiffers {
        expected_width: width,
        expected_height: height,
        found_width: found.width(),
        found_height: found.height(),
    })
}
