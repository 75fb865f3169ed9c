//! Flicker: how likely a viewer sees that two frames alternate.
//!
//! Denes 2020, chapter 7. The difference of a pair of frames is split into bands of spatial
//! frequency; in each, contrast times sensitivity at half the refresh rate gives a probability, and
//! bands add up as independent detectors. The map is blurred by the size of a finger's mark, as the
//! parameters were fitted to areas that viewers painted.
//!
//! Frames are luminance in cd/m2. The eye is taken as still on the picture: for content that is
//! followed, align the frames first.

mod bands;

pub use bands::{Bands, LOWEST_CPD};

use crate::PerceptionError;
use crate::detection::{SLOPE, probability};
use crate::plane::Plane;
use crate::sensitivity::PyramidOfVisibility;

/// Standard deviation of the blur of the map, deg (section 7.2, fixed by the authors).
pub const POOLING_DEG: f64 = 0.36;

/// How and where a pair of frames is shown.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FlickerModel {
    /// Refresh rate, Hz.
    pub refresh_hz: f64,
    /// Frames after which the pattern repeats: 2 for a pair.
    pub frames: u32,
    /// Pixels per degree.
    pub ppd: f64,
    /// Sensitivity to flicker.
    pub sensitivity: PyramidOfVisibility,
}

impl FlickerModel {
    /// With the parameters that were fitted to all markings.
    ///
    /// # Errors
    /// If the rate or the resolution is not above 0.
    pub fn new(refresh_hz: f64, ppd: f64) -> Result<Self, PerceptionError> {
        PerceptionError::check_positive("refresh_hz", refresh_hz)?;
        PerceptionError::check_positive("ppd", ppd)?;
        let sensitivity = PyramidOfVisibility::FIT_TO_ALL;
        Ok(Self { refresh_hz, frames: 2, ppd, sensitivity })
    }

    /// The same for a pattern that repeats after `frames` frames, such as a key and `frames - 1`
    /// in-between frames. The model was fitted to pairs; for more frames, its frequency is that of
    /// the pattern.
    ///
    /// # Errors
    /// If there are fewer than 2.
    pub fn repeating_after(self, frames: u32) -> Result<Self, PerceptionError> {
        PerceptionError::check("frames of a pattern", "at least 2", frames.into(), frames >= 2)?;
        Ok(Self { frames, ..self })
    }

    /// The frequency at which the pattern repeats, Hz: half of the refresh rate for pairs.
    #[must_use]
    pub fn flicker_hz(&self) -> f64 {
        self.refresh_hz / f64::from(self.frames)
    }

    /// The contrast of a band that half of the viewers see. Above 1 none is seen by so many.
    #[must_use]
    pub fn threshold_contrast(&self, cpd: f64, luminance: f64) -> f64 {
        1.0 / self.sensitivity.sensitivity(self.flicker_hz(), cpd, luminance)
    }

    /// Probability of detection for a contrast of 0 to 1 in one band of `cpd`, at a mean luminance
    /// of `luminance` cd/m2 (equations 7.5 and 7.6; for the latter see [`probability`]).
    #[must_use]
    pub fn of_contrast(&self, contrast: f64, cpd: f64, luminance: f64) -> f64 {
        let seen = self.sensitivity.sensitivity(self.flicker_hz(), cpd, luminance);
        probability(contrast * seen, SLOPE)
    }

    /// The largest difference of luminance, cd/m2, between frames that fewer than half of the
    /// viewers see, whatever the luminance around which they alternate, where each band of the
    /// difference has at most the share `gain(cpd)` of it, 0 to 1.
    ///
    /// The mean of two frames is at least half of their difference, and sensitivity grows more
    /// slowly than luminance, so that a difference is seen best at that mean, with a contrast of 1.
    #[must_use]
    pub fn unseen_difference(&self, gain: impl Fn(f64) -> f64) -> f64 {
        let bands = Bands::frequencies(self.ppd);
        bands.fold(f64::INFINITY, |least, cpd| least.min(self.unseen(cpd, gain(cpd))))
    }

    /// The same for a difference that is all in one band of `cpd`.
    #[must_use]
    pub fn unseen_difference_of(&self, cpd: f64) -> f64 {
        self.unseen(cpd, 1.0)
    }

    fn unseen(&self, cpd: f64, gain: f64) -> f64 {
        let of_one = gain * self.sensitivity.sensitivity(self.flicker_hz(), cpd, 1.0);
        let mean = libm::pow(of_one, -1.0 / self.sensitivity.per_log_luminance);
        2.0 * mean
    }

    /// Probability of detection in each pixel when `first` and `second` alternate, both luminance
    /// in cd/m2 (equations 7.1 to 7.7). Where there is no light at all it is 0.
    ///
    /// # Errors
    /// If they differ in size.
    pub fn map(&self, first: &Plane, second: &Plane) -> Result<Plane, PerceptionError> {
        first.check_same_size(second)?;
        let difference = first.zip(second, |first, second| first - second);
        let sum = first.zip(second, |first, second| first + second);
        let bands = Bands::split(&difference, self.ppd);
        let mut missed = Plane::filled(first.width(), first.height(), 1.0);
        for (band, cpd) in bands.iter() {
            for (index, missed) in missed.values_mut().iter_mut().enumerate() {
                let sum = f64::from(sum.values()[index]);
                if sum > 0.0 {
                    let contrast = f64::from(band.values()[index]).abs() / sum;
                    *missed *= 1.0 - self.of_contrast(contrast, cpd, 0.5 * sum) as f32;
                }
            }
        }
        let seen = missed.map(|missed| 1.0 - missed);
        Ok(seen.blurred((POOLING_DEG * self.ppd) as f32))
    }
}

#[cfg(test)]
mod tests;
