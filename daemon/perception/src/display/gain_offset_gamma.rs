//! The gain-offset-gamma model of a display and its inverse.
//!
//! Denes 2020, equations 4.1 and 4.2, after Berns 1996: each channel's code to the power of its
//! gamma is its share of full light; the shares mix to CIE XYZ by a matrix, and the black level is
//! added. Vectors are rows, as printed: `XYZ = rgb^gamma x M + B`.

use glam::{DMat3, DVec3};

use crate::PerceptionError;

/// A display as a gain-offset-gamma model.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GainOffsetGamma {
    gamma: [f64; 3],
    black: DVec3,
    xyz_from_rgb: DMat3,
    rgb_from_xyz: DMat3,
}

impl GainOffsetGamma {
    /// The model with these constants.
    ///
    /// `gamma` of red, green and blue; `black_xyz` is the light of a black screen, XYZ with Y in
    /// cd/m2; `rgb_from_xyz` is the matrix of equation 4.2, row by row, for row vectors.
    ///
    /// # Errors
    /// If a gamma is not above 0, a black level is negative, or the matrix has no inverse.
    pub fn new(
        gamma: [f64; 3],
        black_xyz: [f64; 3],
        rgb_from_xyz: [[f64; 3]; 3],
    ) -> Result<Self, PerceptionError> {
        for value in gamma {
            PerceptionError::check_positive("gamma", value)?;
        }
        for value in black_xyz {
            let is_inside = value.is_finite() && value >= 0.0;
            PerceptionError::check("black_xyz", "0 or more", value, is_inside)?;
        }
        // A row vector times a matrix is the transposed matrix times a column.
        let rgb_from_xyz = DMat3::from_cols_array_2d(&rgb_from_xyz);
        let determinant = rgb_from_xyz.determinant();
        let is_inside = determinant.is_finite() && determinant.abs() > 1e-15;
        PerceptionError::check(
            "determinant of rgb_from_xyz",
            "other than 0",
            determinant,
            is_inside,
        )?;
        let black = DVec3::from_array(black_xyz);
        Ok(Self { gamma, black, xyz_from_rgb: rgb_from_xyz.inverse(), rgb_from_xyz })
    }

    /// Gamma of red, green and blue.
    #[must_use]
    pub fn gamma(&self) -> [f64; 3] {
        self.gamma
    }

    /// Light of a black screen, XYZ.
    #[must_use]
    pub fn black_xyz(&self) -> [f64; 3] {
        self.black.to_array()
    }

    /// Share of full light of each channel, black level left out: `code^gamma`.
    ///
    /// Codes outside 0 to 1 keep their sign and go on outside 0 to 1.
    #[must_use]
    pub fn light(&self, codes: [f64; 3]) -> [f64; 3] {
        core::array::from_fn(|channel| signed_power(codes[channel], self.gamma[channel]))
    }

    /// Codes for these shares of full light, the inverse of [`Self::light`].
    #[must_use]
    pub fn codes_of_light(&self, light: [f64; 3]) -> [f64; 3] {
        core::array::from_fn(|channel| signed_power(light[channel], 1.0 / self.gamma[channel]))
    }

    /// Light of a pixel, CIE 1931 XYZ with Y in cd/m2 (equation 4.1).
    #[must_use]
    pub fn xyz(&self, codes: [f64; 3]) -> [f64; 3] {
        (self.xyz_from_rgb * DVec3::from_array(self.light(codes)) + self.black).to_array()
    }

    /// Codes of a pixel that gives this light (equation 4.2).
    ///
    /// Light that the display cannot show gives codes outside 0 to 1.
    #[must_use]
    pub fn codes(&self, xyz: [f64; 3]) -> [f64; 3] {
        let light = self.rgb_from_xyz * (DVec3::from_array(xyz) - self.black);
        self.codes_of_light(light.to_array())
    }

    /// Luminance of a pixel, cd/m2.
    #[must_use]
    pub fn luminance(&self, codes: [f64; 3]) -> f64 {
        self.xyz(codes)[1]
    }

    /// Luminance that each channel adds at full, cd/m2.
    #[must_use]
    pub fn channel_luminance(&self) -> [f64; 3] {
        core::array::from_fn(|channel| self.xyz_from_rgb.col(channel).y)
    }
}

/// `|base|^exponent` with the sign of `base`.
fn signed_power(base: f64, exponent: f64) -> f64 {
    libm::copysign(libm::pow(base.abs(), exponent), base)
}

#[cfg(test)]
mod tests {
    use super::super::DisplayProfile;
    use super::*;

    const HALF_A_LEVEL: f64 = 0.5 / 255.0;

    /// Every measured model: the plain ones and those at high refresh rates.
    fn models() -> Vec<(String, GainOffsetGamma)> {
        let profiles: Vec<_> = DisplayProfile::builtins().collect();
        let high = profiles.iter().flat_map(|profile| {
            let named = |high: &super::super::HighRefresh| {
                (format!("{} at {} Hz", profile.name(), high.refresh_hz), high.model)
            };
            profile.high_refresh().iter().map(named)
        });
        let plain = profiles.iter().map(|profile| (profile.name().to_owned(), *profile.model()));
        plain.chain(high).collect()
    }

    #[test]
    fn the_inverse_gives_back_every_level_of_every_channel_of_every_profile() {
        assert_eq!(models().len(), 10);
        for (name, model) in models() {
            for level in 0..=255_u8 {
                let code = f64::from(level) / 255.0;
                for (channel, others) in [0, 1, 2].into_iter().zip([0.0, 0.37, 1.0]) {
                    let mut codes = [others; 3];
                    codes[channel] = code;
                    let back = model.codes(model.xyz(codes));
                    for (found, expected) in back.into_iter().zip(codes) {
                        assert!(
                            (found - expected).abs() < HALF_A_LEVEL,
                            "{name}: {codes:?} came back as {back:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn an_inverse_with_another_gamma_would_be_found() {
        let profile = DisplayProfile::builtin("asus-pg279q").unwrap();
        let mut other = *profile.model();
        other.gamma[1] += 0.1;
        let back = other.codes(profile.model().xyz([0.5; 3]));
        assert!((back[1] - 0.5).abs() > HALF_A_LEVEL, "{back:?}");
    }

    #[test]
    fn light_outside_the_display_gives_codes_outside_0_to_1() {
        let profile = DisplayProfile::builtin("asus-pg279q").unwrap();
        let model = profile.model();
        let [x, y, z] = model.xyz([1.0; 3]);
        assert!(model.codes([x * 1.1, y * 1.1, z * 1.1]).iter().all(|&code| code > 1.0));
        let dark = model.codes(model.black_xyz().map(|value| value * 0.5));
        assert!(dark.iter().all(|&code| code < 0.0), "{dark:?}");
    }

    #[test]
    fn channels_add_up_to_white_above_black() {
        for (name, model) in models() {
            let sum: f64 = model.channel_luminance().iter().sum();
            let white = model.luminance([1.0; 3]) - model.black_xyz()[1];
            assert!((sum - white).abs() < 1e-9, "{name}");
        }
    }

    #[test]
    fn constants_that_make_no_display_are_refused() {
        let matrix = [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]];
        assert!(GainOffsetGamma::new([2.2; 3], [0.1; 3], matrix).is_ok());
        assert!(GainOffsetGamma::new([0.0, 2.2, 2.2], [0.1; 3], matrix).is_err());
        assert!(GainOffsetGamma::new([2.2; 3], [-0.1, 0.1, 0.1], matrix).is_err());
        assert!(GainOffsetGamma::new([2.2; 3], [f64::NAN; 3], matrix).is_err());
        assert!(GainOffsetGamma::new([2.2; 3], [0.1; 3], [[0.01; 3]; 3]).is_err());
    }
}
