//! Achromatic sensitivity to still gratings, Barten 2004.
//!
//! Denes 2020 uses it without printing it (below equations 6.5 and 8.13). This is the simplified
//! formula of Barten, *Formula for the contrast sensitivity of the human eye* (2004), for the
//! standard observer, foveal.

/// Size of the stimulus where a model states none, deg. Denes does not say which was used. The
/// choice matters below 1 cpd, which neither of the models that use it samples at its default.
pub const STIMULUS_DEG: f64 = 10.0;

/// Sensitivity to a grating of `cpd` cycles per degree at a mean luminance of `luminance` cd/m2, on
/// a square stimulus of `stimulus_deg` degrees.
///
/// Domain: all above 0; made for photopic luminance. Range: 0 and up; below 1 means that no
/// contrast is seen. A `cpd` of 0 gives 0.
#[must_use]
pub fn sensitivity(cpd: f64, luminance: f64, stimulus_deg: f64) -> f64 {
    let square = cpd * cpd;
    let optics = libm::exp(-0.0016 * square * libm::pow(1.0 + 100.0 / luminance, 0.08));
    let integration = 1.0 + 144.0 / (stimulus_deg * stimulus_deg) + 0.64 * square;
    // 1 - exp(-x) without cancellation: x is tiny at low frequencies.
    let inhibition = -libm::expm1(-0.02 * square);
    let noise = 63.0 / libm::pow(luminance, 0.83) + 1.0 / inhibition;
    5200.0 * optics / libm::sqrt(integration * noise)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_at_a_few_cycles_per_degree_and_both_sides_fall() {
        let at = |cpd| sensitivity(cpd, 100.0, STIMULUS_DEG);
        let peak =
            (1..400).map(|step| f64::from(step) * 0.1).max_by(|a, b| at(*a).total_cmp(&at(*b)));
        assert!((2.0..6.0).contains(&peak.unwrap()), "{peak:?}");
        assert!((200.0..700.0).contains(&at(peak.unwrap())));
        assert!(at(0.1) < at(1.0) && at(64.0) < at(30.0));
        assert!(at(0.0).abs() < 1e-9);
    }

    #[test]
    fn more_light_and_a_larger_stimulus_help() {
        assert!(sensitivity(8.0, 200.0, 10.0) > sensitivity(8.0, 20.0, 10.0));
        assert!(sensitivity(1.0, 100.0, 20.0) > sensitivity(1.0, 100.0, 2.0));
    }

    #[test]
    fn one_value_worked_out_by_hand() {
        // u = 4, L = 100, X0 = 10: 5200 exp(-0.0256 * 1.05702) / sqrt(12.68 * (1.37786 + 3.65239)).
        let found = sensitivity(4.0, 100.0, 10.0);
        assert!((found - 633.7).abs() < 1.0, "{found}");
    }
}
