//! Spatio-temporal sensitivity under controlled eye motion, Kelly 1979.
//!
//! `S = (6.1 + 7.3 |log10(v/3)|^3) v a^2 exp(-2 a (v + 2) / 45.9)`, with retinal velocity
//! `v = f / rho`. Kelly has `a = 2 pi rho`. Denes 2020 fitted thresholds of judder (table 8.3) that
//! are of the size of this function only with `a = rho`; those thresholds are what we use, so this
//! is what goes with them. A factor of 2 pi would make judder vanish at any rate.

/// Frequencies at which the search for the peak starts: eight to a decade from 0.05 to 100 cpd, so
/// that the highest of them is next to the peak.
const COARSE_STEPS: i32 = 26;
/// Halvings of the interval around the highest of them.
const FINE_STEPS: i32 = 24;

/// Sensitivity to a grating of `cpd` that drifts past at `hz`. Domain: both 0 and up; where either
/// is 0 there is no motion, and it is 0.
#[must_use]
pub fn band_pass(cpd: f64, hz: f64) -> f64 {
    if !(cpd > 0.0 && hz > 0.0) {
        return 0.0;
    }
    let velocity = hz / cpd;
    let log = libm::log10(velocity / 3.0).abs();
    let gain = 6.1 + 7.3 * log * log * log;
    gain * velocity * cpd * cpd * libm::exp(-2.0 * cpd * (velocity + 2.0) / 45.9)
}

/// Frequency of the highest sensitivity at `hz`, cpd.
#[must_use]
pub fn peak_cpd(hz: f64) -> f64 {
    let coarse = |step: i32| 0.05 * libm::pow(10.0, f64::from(step) / 8.0);
    let higher = |a: &i32, b: &i32| band_pass(coarse(*a), hz).total_cmp(&band_pass(coarse(*b), hz));
    let best = (0..=COARSE_STEPS).max_by(higher).unwrap_or_default();
    let (mut low, mut high) = (coarse(best - 1), coarse(best + 1));
    for _ in 0..FINE_STEPS {
        let third = (high - low) / 3.0;
        if band_pass(low + third, hz) < band_pass(high - third, hz) {
            low += third;
        } else {
            high -= third;
        }
    }
    f64::midpoint(low, high)
}

/// The same, held at its peak below the frequency of the peak, because the copies of a spectrum
/// that judder consists of have a width (Denes 2020, below equation 8.18, figure 8.8 right).
#[must_use]
pub fn low_pass(cpd: f64, hz: f64) -> f64 {
    band_pass(cpd.max(peak_cpd(hz)), hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_grating_worked_out_by_hand() {
        // 30 deg/s at 50 Hz is 1.667 cpd: (6.1 + 7.3) 30 1.667^2 exp(-2 1.667 32 / 45.9) = 109.3.
        let found = band_pass(50.0 / 30.0, 50.0);
        assert!((found - 109.3).abs() < 0.2, "{found}");
    }

    #[test]
    fn the_low_pass_form_never_rises_with_frequency_and_meets_the_other_at_its_peak() {
        for hz in [10.0, 50.0, 72.0, 120.0] {
            let peak = peak_cpd(hz);
            assert!((low_pass(peak, hz) - band_pass(peak, hz)).abs() < 1e-12);
            let mut last = f64::INFINITY;
            for step in 0..300 {
                let cpd = 0.1 * libm::pow(1.02, f64::from(step));
                let value = low_pass(cpd, hz);
                assert!(value <= last * (1.0 + 1e-6), "{cpd} cpd at {hz} Hz");
                assert!(value >= band_pass(cpd, hz) * (1.0 - 1e-6));
                last = value;
            }
        }
    }

    #[test]
    fn a_faster_flicker_is_seen_less() {
        for pair in [40.0, 50.0, 60.0, 72.0, 83.0, 120.0].windows(2) {
            assert!(low_pass(1.0, pair[0]) > low_pass(1.0, pair[1]), "{pair:?}");
        }
        assert!(band_pass(0.0, 50.0).abs() < 1e-12 && band_pass(1.0, 0.0).abs() < 1e-12);
    }
}
