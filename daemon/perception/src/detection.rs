//! From contrast to the probability that it is seen.

/// Slope of the psychometric function in the models of banding and of flicker (Denes 2020, below
/// equation 6.7 and section 7.2).
pub const SLOPE: f64 = 2.0;

/// Probability of seeing a contrast of `normalised`: 1 is the threshold, where it is 0.5.
///
/// `P = 1 - exp(ln(0.5) * c^beta)`, the Weibull function of Denes 2020, equation 6.7. Equation 7.6
/// of the same text is meant to be this one; as printed it is negative. Domain: 0 and up; range 0
/// to 1. NaN gives NaN.
#[must_use]
pub fn probability(normalised: f64, slope: f64) -> f64 {
    1.0 - libm::exp(-core::f64::consts::LN_2 * libm::pow(normalised, slope))
}

/// Probability that at least one of independent detectors sees something: `1 - prod(1 - P)`
/// (Denes 2020, equation 6.8). 0 for none.
#[must_use]
pub fn any(probabilities: impl IntoIterator<Item = f64>) -> f64 {
    1.0 - probabilities.into_iter().fold(1.0, |missed, probability| missed * (1.0 - probability))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_is_seen_half_of_the_time() {
        assert!((probability(1.0, SLOPE) - 0.5).abs() < 1e-15);
        assert!((probability(1.0, 3.5) - 0.5).abs() < 1e-15);
        assert!(probability(0.0, SLOPE).abs() < 1e-15);
        assert!(probability(4.0, SLOPE) > 0.9999);
    }

    #[test]
    fn detectors_add_up_as_independent_chances_do() {
        assert!(any([]).abs() < 1e-15);
        assert!((any([0.5, 0.5]) - 0.75).abs() < 1e-15);
        assert!((any([0.2, 0.0]) - 0.2).abs() < 1e-15);
        assert!((any([0.3, 1.0]) - 1.0).abs() < 1e-15);
    }
}
