//! Judder: how visible the first copy of a moving line's spectrum is.
//!
//! Denes 2020, section 8.2.4. Showing motion as frames repeats its spectrum at multiples of the
//! refresh rate. The first copy has its peak at the refresh rate and at refresh rate over velocity
//! in space. Which form of the sensitivity goes with the fitted thresholds is said in
//! [`crate::sensitivity::kelly`].

use super::Motion;
use crate::sensitivity::kelly;

/// Power of the energy (table 8.3).
pub const POWER: f64 = 2.5747;

/// Energy threshold (table 8.3).
#[must_use]
pub fn threshold(motion: Motion) -> f64 {
    match motion {
        Motion::Predictable => 218.712,
        Motion::Unpredictable => 165.779,
    }
}

/// Spatial frequency of the first copy, cpd (equation 8.17). Infinite without motion.
#[must_use]
pub fn copy_cpd(refresh_hz: f64, velocity: f64) -> f64 {
    refresh_hz / velocity
}

/// Energy of judder (equation 8.18): 1 at threshold, 0 without motion.
#[must_use]
pub fn energy(refresh_hz: f64, velocity: f64, motion: Motion) -> f64 {
    if velocity <= 0.0 {
        return 0.0;
    }
    let seen = kelly::low_pass(copy_cpd(refresh_hz, velocity), refresh_hz);
    libm::pow(seen / threshold(motion), POWER)
}
