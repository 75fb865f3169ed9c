//! The memory of liquid crystals: what a frame shows depends on the frame before.
//!
//! Denes 2020, equations 4.3 and 4.4: the code that a steady picture would need for the light that
//! two alternating codes give, as a symmetric quadratic of both. It is measured for pairs of frames
//! at one refresh rate, and its inverse finds the code to send after a given one.

use crate::PerceptionError;

/// The quadratic of equation 4.3 for each channel.
///
/// It is taken only as rising in the newer code over 0 to 1: that is checked where it is made.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LcdModel {
    /// `p1 p2 p3 p4` for red, green, blue.
    parameters: [[f64; 4]; 3],
}

/// What to send, and what it leaves undone.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LcdInverse {
    /// The code to send, 0 to 1.
    pub code: f64,
    /// Merged code that was asked for minus the one that comes out. 0 unless `code` was clamped:
    /// above 0 where the display cannot be bright enough after the previous code, below where it
    /// cannot be dark enough.
    pub residual: f64,
}

impl LcdModel {
    /// The model with these parameters, `p1 p2 p3 p4` per channel.
    ///
    /// # Errors
    /// If a parameter is not finite, or more light is not more light: each channel's quadratic must
    /// rise with the newer code over 0 to 1, whatever the older.
    pub fn new(parameters: [[f64; 4]; 3]) -> Result<Self, PerceptionError> {
        for [p1, p2, p3, p4] in parameters {
            let constant = PerceptionError::check("lcd p4", "a number", p4, p4.is_finite());
            constant?;
            // The slope is linear in both codes, so that its least is at a corner.
            for (newer, older) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)] {
                let slope = 2.0 * p1 * newer + p2 * older + p3;
                PerceptionError::check_positive("slope of the lcd model", slope)?;
            }
        }
        Ok(Self { parameters })
    }

    /// The merged code of `newer` after `older` (equation 4.3): its light, by the
    /// gain-offset-gamma model, is the mean light of the two frames. Channel 0 to 2.
    ///
    /// Near black it can be slightly below 0, which is no light at all.
    #[must_use]
    pub fn merged(&self, channel: usize, newer: f64, older: f64) -> f64 {
        let [p1, p2, p3, p4] = self.parameters[channel];
        p1 * (newer * newer + older * older) + p2 * newer * older + p3 * (newer + older) + p4
    }

    /// The code to send after `older` so that both merge to `merged`, clamped to 0 to 1, with the
    /// residual that clamping leaves (section 4.5).
    #[must_use]
    pub fn newer(&self, channel: usize, merged: f64, older: f64) -> LcdInverse {
        let [p1, p2, p3, p4] = self.parameters[channel];
        let linear = p2 * older + p3;
        let constant = p1 * older * older + p3 * older + p4 - merged;
        let code = rising_root(p1, linear, constant).clamp(0.0, 1.0);
        LcdInverse { code, residual: merged - self.merged(channel, code, older) }
    }
}

/// Where `a x^2 + b x + c` crosses 0 going up, near 0 to 1. Where it never does, or only beyond its
/// lowest point, the answer is below 0: the value sought is less than any that there is.
fn rising_root(a: f64, b: f64, c: f64) -> f64 {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        // With a > 0 the curve lies above the value, with a < 0 below.
        return if a > 0.0 { -1.0 } else { 2.0 };
    }
    // Citardauq form: no cancellation, and right for a = 0. b > 0 by construction.
    -2.0 * c / (b + libm::sqrt(discriminant))
}

#[cfg(test)]
mod tests {
    use super::super::DisplayProfile;
    use super::*;

    fn models() -> Vec<LcdModel> {
        let asus = DisplayProfile::builtin("asus-pg279q").unwrap();
        let models: Vec<_> = asus.high_refresh().iter().map(|high| high.lcd).collect();
        assert_eq!(models.len(), 3);
        models
    }

    fn levels() -> impl Iterator<Item = f64> + Clone {
        (0..=255_u8).step_by(3).map(|level| f64::from(level) / 255.0)
    }

    #[test]
    fn a_code_sent_after_any_other_is_found_again() {
        for model in models() {
            for channel in 0..3 {
                for older in levels() {
                    for newer in levels() {
                        let merged = model.merged(channel, newer, older);
                        let found = model.newer(channel, merged, older);
                        assert!((found.code - newer).abs() < 0.5 / 255.0, "{newer} after {older}");
                        assert!(found.residual.abs() < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_reached_is_clamped_and_the_residual_tells_what_is_missing() {
        let mut clamped = [0, 0];
        for model in models() {
            for channel in 0..3 {
                for older in levels() {
                    for merged in levels() {
                        let found = model.newer(channel, merged, older);
                        let got = model.merged(channel, found.code, older);
                        assert!((0.0..=1.0).contains(&found.code));
                        assert!((got + found.residual - merged).abs() < 1e-12);
                        if found.residual > 1e-9 {
                            clamped[1] += 1;
                            assert!((found.code - 1.0).abs() < 1e-15, "missing light at {found:?}");
                        } else if found.residual < -1e-9 {
                            clamped[0] += 1;
                            assert!(found.code.abs() < 1e-15, "light too much at {found:?}");
                        }
                    }
                }
            }
        }
        assert!(clamped[0] > 1000 && clamped[1] > 1000, "both clamps were met: {clamped:?}");
    }

    #[test]
    fn the_order_of_a_pair_does_not_matter_and_a_steady_code_nearly_keeps_itself() {
        for model in models() {
            for channel in 0..3 {
                let pair = model.merged(channel, 0.2, 0.9);
                assert!((pair - model.merged(channel, 0.9, 0.2)).abs() < 1e-15);
                for code in levels() {
                    // The fit is least squares over all pairs; on the diagonal it is off by this
                    // much.
                    let merged = model.merged(channel, code, code);
                    assert!((merged - code).abs() < 0.08, "{code} merges to {merged}");
                }
            }
        }
    }

    #[test]
    fn a_quadratic_that_falls_is_no_display() {
        let asus = [0.2054, -0.3433, 0.4986, -0.0259];
        assert!(LcdModel::new([asus; 3]).is_ok());
        assert!(LcdModel::new([asus, [0.2, -0.5, 0.4, 0.0], asus]).is_err());
        assert!(LcdModel::new([asus, [0.2, -0.3, 0.5, f64::NAN], asus]).is_err());
    }
}
