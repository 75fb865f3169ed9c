//! Banding: how likely a viewer sees the steps of a quantised gradient, and how many bits hide
//! them.
//!
//! Denes 2020, chapter 6. The error between a gradient and its steps is a saw-tooth; each of its
//! first sixteen harmonics is a grating, seen with the sensitivity to its frequency, and harmonics
//! and channels add up as independent detectors. The gradient is smooth and nothing masks it: the
//! worst case.
//!
//! Two things differ from the text. Its chromatic contrasts (6.11) have a free variable that it
//! does not print, so that contrast and sensitivity of colour come together from the published
//! model in [`crate::sensitivity::chromatic`]. And harmonics beyond the display's Nyquist frequency
//! are left out, because no pixels show them.

mod gradient;

pub use gradient::{BandWidth, Gradient, MOST_BITS};

use crate::detection::{SLOPE, any, probability};
use crate::sensitivity::barten;
use crate::sensitivity::chromatic::{RED_GREEN, YELLOW_VIOLET};

/// Harmonics of the saw-tooth that matter (below equation 6.4).
pub const HARMONICS: u32 = 16;

/// One step of a quantised gradient, the same over and over.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// Light before the step, CIE XYZ with Y in cd/m2.
    pub from_xyz: [f64; 3],
    /// Light after it.
    pub to_xyz: [f64; 3],
    /// Pixels from step to step.
    pub width_px: f64,
}

/// Probability that the steps are seen, by what sees them.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Seen {
    /// By their luminance.
    pub achromatic: f64,
    /// By red to green.
    pub red_green: f64,
    /// By yellow to violet.
    pub yellow_violet: f64,
}

impl Seen {
    /// By any of them (equation 6.8).
    #[must_use]
    pub fn any(&self) -> f64 {
        any([self.achromatic, self.red_green, self.yellow_violet])
    }
}

/// Responses of the long, medium and short cones (equation 6.9). Scales do not matter to contrast;
/// the printed sign of the short cones, which is a slip, does not either.
#[must_use]
pub fn cones([x, y, z]: [f64; 3]) -> [f64; 3] {
    [0.15514 * x + 0.54312 * y - 0.03286 * z, -0.15514 * x + 0.45684 * y + 0.03286 * z, 0.00801 * z]
}

/// Frequency of harmonic `k` of steps `width_px` apart, cpd (equation 6.4).
#[must_use]
pub fn harmonic_cpd(k: u32, width_px: f64, ppd: f64) -> f64 {
    f64::from(k) * ppd / width_px
}

/// Probability of seeing steps at `ppd` pixels per degree (equations 6.2 to 6.8).
///
/// Each harmonic has the amplitude of the step over `k pi` (6.3). Nothing is seen of black on
/// black.
#[must_use]
pub fn seen(step: &Step, ppd: f64) -> Seen {
    let middle = core::array::from_fn(|i| f64::midpoint(step.from_xyz[i], step.to_xyz[i]));
    let change = core::array::from_fn(|i| step.to_xyz[i] - step.from_xyz[i]);
    let luminance = middle[1];
    if luminance <= 0.0 {
        return Seen::default();
    }
    let contrast = (change[1] / luminance).abs();
    let (background, delta) = (cones(middle), cones(change));
    let red_green = RED_GREEN.contrast(background, delta);
    let yellow_violet = YELLOW_VIOLET.contrast(background, delta);
    let area = barten::STIMULUS_DEG * barten::STIMULUS_DEG;
    let pooled = |contrast: f64, sensitivity: &dyn Fn(f64) -> f64| {
        any((1..=HARMONICS).filter_map(|k| {
            let cpd = harmonic_cpd(k, step.width_px, ppd);
            let share = 1.0 / (f64::from(k) * core::f64::consts::PI);
            let is_shown = cpd <= ppd / 2.0;
            is_shown.then(|| probability(contrast * share * sensitivity(cpd), SLOPE))
        }))
    };
    Seen {
        achromatic: pooled(contrast, &|cpd| {
            barten::sensitivity(cpd, luminance, barten::STIMULUS_DEG)
        }),
        red_green: pooled(red_green, &|cpd| RED_GREEN.sensitivity(cpd, luminance, area)),
        yellow_violet: pooled(yellow_violet, &|cpd| {
            YELLOW_VIOLET.sensitivity(cpd, luminance, area)
        }),
    }
}

#[cfg(test)]
mod tests;
