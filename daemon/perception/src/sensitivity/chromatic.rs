//! Chromatic sensitivity, Mantiuk et al. 2020.
//!
//! Denes 2020 uses the chromatic sensitivity of Kim et al. 2013 without printing it. This is its
//! published successor, which is fitted to that data and four other sets: Mantiuk, Kim, Ashraf, Xu,
//! Luo, Martinovic and Wuerger, *Practical color contrast sensitivity functions for luminance
//! levels up to 10000 cd/m2*, Color and Imaging Conference 28, 2020, the cone-contrast model with
//! the constants of the authors' published implementation. A truncated log-parabola of spatial
//! frequency (low-pass: colour has no falling side at low frequencies), a hyperbola of luminance,
//! and Rovamo's 1993 model of the size of the stimulus.
//!
//! Contrast is what goes with it: increments of each cone's response over the response to the
//! background, mixed to the two opponent mechanisms. Scales of the cones cancel.

/// One opponent mechanism.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChromaticChannel {
    /// Peak sensitivity: `a (1 + b / L)^-c`.
    peak: [f64; 3],
    /// Frequency up to which it is flat, cpd.
    flat_cpd: f64,
    bandwidth: f64,
    area_exponent: f64,
    critical_area: f64,
    /// Weights of the contrasts of the long, medium and short cones.
    weights: [f64; 3],
}

/// Red to green.
pub const RED_GREEN: ChromaticChannel = ChromaticChannel {
    peak: [468.431, 12.2482, 0.522_667],
    flat_cpd: 0.10048,
    bandwidth: 2.82971,
    area_exponent: 1.70328,
    critical_area: 1.06655,
    weights: [1.0, -0.932_581, 0.003_704_7],
};

/// Yellow to violet.
pub const YELLOW_VIOLET: ChromaticChannel = ChromaticChannel {
    peak: [12_799.1, 160.831, 0.358_707],
    flat_cpd: 1.03772e-7,
    bandwidth: 5.28354,
    area_exponent: 1.44676,
    critical_area: 0.389_358,
    weights: [-0.001_238_83, -1.07013, 1.0],
};

/// Rovamo's frequency of the size model, in the unit of the fit.
const SIZE_FREQUENCY: f64 = 0.65;

impl ChromaticChannel {
    /// Contrast of an increment `delta` on a background, both as responses of the long, medium and
    /// short cones in any scale. 0 where the background has no response.
    #[must_use]
    pub fn contrast(&self, background: [f64; 3], delta: [f64; 3]) -> f64 {
        let cone = |index: usize| {
            let base = background[index];
            if base > 0.0 { self.weights[index] * delta[index] / base } else { 0.0 }
        };
        (cone(0) + cone(1) + cone(2)).abs()
    }

    /// Sensitivity to a grating of `cpd` at `luminance` cd/m2 over `area` square degrees. Domain:
    /// all above 0; fitted to 0.06 to 32 cpd and 0.0002 to 10000 cd/m2.
    #[must_use]
    pub fn sensitivity(&self, cpd: f64, luminance: f64, area: f64) -> f64 {
        let [height, half, slope] = self.peak;
        let peak = height * libm::pow(1.0 + half / luminance, -slope);
        let decades = libm::log10(cpd.max(self.flat_cpd)) - libm::log10(self.flat_cpd);
        let width = 0.5 * libm::exp2(self.bandwidth);
        let fall = libm::pow(10.0, decades * decades / width);
        let critical = self.critical_area + area * SIZE_FREQUENCY;
        let size = libm::pow(area, self.area_exponent) * cpd * cpd;
        peak / fall * libm::sqrt(size / (critical + size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_is_low_pass_and_finer_colour_than_luminance_is_not_seen() {
        for channel in [RED_GREEN, YELLOW_VIOLET] {
            let at = |cpd| channel.sensitivity(cpd, 100.0, 100.0);
            assert!(at(0.5) > at(2.0) && at(2.0) > at(8.0) && at(8.0) > at(30.0));
            let luminance = crate::sensitivity::barten::sensitivity(16.0, 100.0, 10.0);
            assert!(at(16.0) < luminance / 2.0);
        }
    }

    #[test]
    fn red_green_at_1_cpd_worked_out_by_hand() {
        // Peak 468.431 (1.122482)^-0.522667 = 440.98; log10(1 / 0.10048) = 0.99792, squared over
        // 0.5 2^2.82971 = 3.5547 is 0.28015, so a fall of 1.9061; size: 100^1.70328 = 2551.0 over
        // 2551.0 + 66.067, root 0.98730.
        let found = RED_GREEN.sensitivity(1.0, 100.0, 100.0);
        assert!((found - 228.4).abs() < 0.5, "{found}");
    }

    #[test]
    fn contrast_is_zero_for_light_alone_nearly_and_not_for_colour() {
        let white = [0.65, 0.35, 0.009];
        let more = white.map(|cone| cone * 0.01);
        assert!(RED_GREEN.contrast(white, more) < 0.001);
        assert!(YELLOW_VIOLET.contrast(white, more) < 0.001);
        assert!(RED_GREEN.contrast(white, [0.0065, -0.0065, 0.0]) > 0.02);
        assert!(RED_GREEN.contrast([0.0; 3], more).abs() < 1e-15);
    }
}
