//! The pyramid of visibility, Watson and Ahumada 2017.
//!
//! At medium and high frequencies the logarithm of sensitivity falls in straight lines:
//! `ln S = c0 + cW W + cF F + cL ln Y`. The sentence below equation 7.4 of Denes 2020 swaps the
//! axes: `cW` goes with temporal frequency W and `cF` with spatial frequency F, as equation 7.5 and
//! the signs say. Logarithms are natural.

/// The constants of a pyramid.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PyramidOfVisibility {
    /// At no frequency and 1 cd/m2.
    pub c0: f64,
    /// Per Hz.
    pub per_hz: f64,
    /// Per cycle per degree.
    pub per_cpd: f64,
    /// Per e-fold of cd/m2.
    pub per_log_luminance: f64,
}

impl PyramidOfVisibility {
    /// Watson and Ahumada 2017, fit to Robson's data (Denes 2020, table 7.1, first row).
    pub const ROBSON: Self = Self::new(2.1900, -0.0600, -0.0650, 0.3880);
    /// Fit to all markings of flicker (table 7.1).
    pub const FIT_TO_ALL: Self = Self::new(1.9993, -0.1059, -0.0242, 0.9102);
    /// The three fits of the cross-validation (table 7.1).
    pub const CROSS: [Self; 3] = [
        Self::new(2.1946, -0.1025, -0.0362, 0.8581),
        Self::new(1.9982, -0.1146, -0.0113, 0.9782),
        Self::new(1.5741, -0.1006, -0.0128, 0.9265),
    ];

    const fn new(c0: f64, per_hz: f64, per_cpd: f64, per_log_luminance: f64) -> Self {
        Self { c0, per_hz, per_cpd, per_log_luminance }
    }

    /// Sensitivity at `hz` and `cpd` with eyes adapted to `luminance` cd/m2 (equation 7.4).
    /// Domain: 0 and up, luminance above 0. At 0 cd/m2 it is 0.
    #[must_use]
    pub fn sensitivity(&self, hz: f64, cpd: f64, luminance: f64) -> f64 {
        let log = self.per_log_luminance * libm::log(luminance);
        libm::exp(self.c0 + self.per_hz * hz + self.per_cpd * cpd + log)
    }

    /// The frequencies in Hz and in cpd at which full contrast is just seen: the corners of the
    /// window of visibility (Watson et al. 1986). Negative where nothing is seen at all.
    #[must_use]
    pub fn corners(&self, luminance: f64) -> [f64; 2] {
        let height = self.c0 + self.per_log_luminance * libm::log(luminance);
        [-height / self.per_hz, -height / self.per_cpd]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_falls_with_both_frequencies_and_rises_with_light() {
        let rows = [PyramidOfVisibility::ROBSON, PyramidOfVisibility::FIT_TO_ALL];
        for row in rows.into_iter().chain(PyramidOfVisibility::CROSS) {
            let base = row.sensitivity(45.0, 4.0, 78.0);
            assert!(row.sensitivity(46.0, 4.0, 78.0) < base);
            assert!(row.sensitivity(45.0, 5.0, 78.0) < base);
            assert!(row.sensitivity(45.0, 4.0, 79.0) > base);
        }
    }

    #[test]
    fn full_contrast_is_at_threshold_on_the_edge_of_the_window() {
        for row in [PyramidOfVisibility::ROBSON, PyramidOfVisibility::FIT_TO_ALL] {
            let [hz, cpd] = row.corners(100.0);
            for share in [0.0, 0.3, 1.0] {
                let edge = row.sensitivity(hz * share, cpd * (1.0 - share), 100.0);
                assert!((edge - 1.0).abs() < 1e-12, "{share}");
            }
        }
        // Watson and Ahumada's constants put the limits where they are known to be: flicker fusion
        // near 60 Hz and acuity near 60 cpd (Denes 2020, section 3.1.1).
        let [hz, cpd] = PyramidOfVisibility::ROBSON.corners(100.0);
        assert!((hz - 66.3).abs() < 0.1 && (cpd - 61.2).abs() < 0.1, "{hz} Hz, {cpd} cpd");
    }

    #[test]
    fn the_temporal_axis_is_the_one_with_the_steeper_fit_to_flicker() {
        // Exchanging the axes, as the printed sentence does, would make 60 Hz at 2 cpd as visible
        // as 2 Hz at 60 cpd: thirty times too visible.
        let fit = PyramidOfVisibility::FIT_TO_ALL;
        assert!(fit.sensitivity(2.0, 60.0, 78.0) > 30.0 * fit.sensitivity(60.0, 2.0, 78.0));
    }
}
