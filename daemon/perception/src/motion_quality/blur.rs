//! Blur on the retina from three causes, and the energy of a thin line that is left after it.
//!
//! Denes 2020, section 8.2.1 to 8.2.3. Each cause is a box or triangle in visual degrees, taken as
//! a Gaussian of the width over pi (equation 8.7). That is not the variance of a box; the
//! parameters were fitted with it, so it stays.

use core::f64::consts::PI;

use super::{Motion, Shown};
use crate::sensitivity::barten;

/// Background luminance of the fit, cd/m2 (below equation 8.13).
pub const LUMINANCE: f64 = 100.0;
/// Energy threshold (table 8.4).
pub const THRESHOLD: f64 = 383.5854;
/// Power of the energy (table 8.4).
pub const POWER: f64 = 1.83564;
/// Where the spectrum is sampled, cpd, an octave apart (equation 8.14).
pub const SAMPLES_CPD: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

/// `p_a` in s and `p_b` in deg of equation 8.5, from eye tracking (table 8.2).
#[must_use]
pub fn pursuit_parameters(motion: Motion) -> [f64; 2] {
    match motion {
        Motion::Predictable => [0.001_648, 0.079_818],
        Motion::Unpredictable => [0.004_978, 0.176_820],
    }
}

/// Width of the blur of a display that lights each frame for a share of its time, deg: the way of
/// the eye meanwhile, `v p / f` (equation 8.4 and section 8.4.1, low persistence).
#[must_use]
pub fn hold_width(velocity: f64, refresh_hz: f64, persistence: f64) -> f64 {
    velocity * persistence / refresh_hz
}

/// Width of the blur of imperfect pursuit, deg, in a window of 25 ms (equation 8.5).
#[must_use]
pub fn pursuit_width(velocity: f64, motion: Motion) -> f64 {
    let [per_velocity, constant] = pursuit_parameters(motion);
    per_velocity * velocity + constant
}

/// Standard deviation of the blur from resolution, deg: two boxes of a pixel (equations 8.6, 8.9).
#[must_use]
pub fn resolution_sigma(ppd: f64) -> f64 {
    core::f64::consts::SQRT_2 / (PI * ppd)
}

/// Standard deviation of all blur along the motion, deg (equations 8.8 and 8.10).
#[must_use]
pub fn parallel_sigma(shown: Shown, velocity: f64, motion: Motion) -> f64 {
    let hold = hold_width(velocity, shown.refresh_hz, shown.persistence) / PI;
    let pursuit = pursuit_width(velocity, motion) / PI;
    let resolution = resolution_sigma(shown.ppd);
    libm::sqrt(pursuit * pursuit + hold * hold + resolution * resolution)
}

/// Energy of a thin line blurred by `sigma` degrees (equations 8.12 to 8.14). It falls from the
/// energy of a sharp line towards 0.
#[must_use]
pub fn energy(sigma: f64) -> f64 {
    SAMPLES_CPD
        .into_iter()
        .map(|cpd| {
            let left = libm::exp(-2.0 * PI * PI * cpd * cpd * sigma * sigma);
            let seen = barten::sensitivity(cpd, LUMINANCE, barten::STIMULUS_DEG) * left;
            libm::pow(seen / THRESHOLD, POWER)
        })
        .sum()
}
