//! From pixels to visual degrees.
//!
//! Two measures are in use, and published figures follow either: over a whole screen (Denes 2020,
//! equation 3.1), and where the line of sight meets the screen. They differ because a degree covers
//! more of a flat screen the farther it is from the middle.

use crate::PerceptionError;

/// Centimetres per inch.
pub const CM_PER_INCH: f64 = 2.54;

/// A flat screen before an eye.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Viewing {
    size_px: [u32; 2],
    pixel_cm: f64,
    distance_cm: f64,
}

impl Viewing {
    /// A screen of square pixels, `diagonal_inch` from corner to corner, seen from `distance_cm`.
    ///
    /// # Errors
    /// If a size or the distance is not above 0.
    pub fn new(
        size_px: [u32; 2],
        diagonal_inch: f64,
        distance_cm: f64,
    ) -> Result<Self, PerceptionError> {
        for side in size_px {
            PerceptionError::check_positive("size_px", side.into())?;
        }
        PerceptionError::check_positive("diagonal_inch", diagonal_inch)?;
        PerceptionError::check_positive("distance_cm", distance_cm)?;
        let pixel_cm = diagonal_inch * CM_PER_INCH / diagonal(size_px);
        Ok(Self { size_px, pixel_cm, distance_cm })
    }

    /// Pixels per degree as the mean over the diagonal (Denes 2020, equation 3.1).
    #[must_use]
    pub fn ppd_over_diagonal(&self) -> f64 {
        self.mean_ppd(diagonal(self.size_px))
    }

    /// Pixels per degree as the mean over a row.
    #[must_use]
    pub fn ppd_over_width(&self) -> f64 {
        self.mean_ppd(self.size_px[0].into())
    }

    /// Pixels per degree in the middle of the screen.
    #[must_use]
    pub fn ppd_at_centre(&self) -> f64 {
        (self.distance_cm / self.pixel_cm).to_radians()
    }

    /// Horizontal field of view, deg.
    #[must_use]
    pub fn width_deg(&self) -> f64 {
        self.extent_deg(self.size_px[0].into())
    }

    /// Vertical field of view, deg.
    #[must_use]
    pub fn height_deg(&self) -> f64 {
        self.extent_deg(self.size_px[1].into())
    }

    fn mean_ppd(&self, extent_px: f64) -> f64 {
        extent_px / self.extent_deg(extent_px)
    }

    fn extent_deg(&self, extent_px: f64) -> f64 {
        let half = extent_px * self.pixel_cm / (2.0 * self.distance_cm);
        2.0 * libm::atan(half).to_degrees()
    }
}

/// The distance from which a diagonal of `diagonal_px` pixels and `diagonal_inch` has `ppd` pixels
/// per degree, cm (Denes 2020, equation 3.2, for any `ppd` instead of 120). Infinite or negative
/// where no distance is close enough: the diagonal would have to cover 180 degrees.
#[must_use]
pub fn distance_for_ppd(diagonal_px: f64, diagonal_inch: f64, ppd: f64) -> f64 {
    let half = (diagonal_px / ppd / 2.0).to_radians();
    diagonal_inch * CM_PER_INCH / (2.0 * libm::tan(half))
}

/// Pixels from corner to corner.
#[must_use]
pub fn diagonal([width, height]: [u32; 2]) -> f64 {
    libm::hypot(width.into(), height.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asus(distance_cm: f64) -> Viewing {
        Viewing::new([2560, 1440], 27.0, distance_cm).unwrap()
    }

    #[test]
    fn the_published_angular_resolutions_come_out() {
        // Denes 2020: section 5.2.4 gives 56 ppd at 75 cm, which is the middle of the screen;
        // section 7.2 gives 52 ppd at 65 cm, which is the mean over a row.
        assert!((asus(75.0).ppd_at_centre() - 56.0).abs() < 0.5);
        assert!((asus(65.0).ppd_over_width() - 52.0).abs() < 0.5);
        // Section 8.3.1: 41 degrees at 80 cm; section 8.1: 30 degrees at 108 cm, rounded down.
        assert!((asus(80.0).width_deg() - 41.0).abs() < 0.5);
        assert!((asus(108.0).width_deg() - 30.0).abs() < 1.0);
    }

    #[test]
    fn the_published_distances_for_120_ppd_come_out() {
        // Denes 2020, section 3.1.1: a 15.6 inch laptop from 123 cm, a 4K panel of that size from
        // 60 cm, and more than 120 ppd for 3.5 inches of 960x640 from 53 cm.
        let laptop = distance_for_ppd(diagonal([1920, 1080]), 15.6, 120.0);
        assert!((laptop - 123.0).abs() < 0.5, "{laptop}");
        let fine = distance_for_ppd(diagonal([3840, 2160]), 15.6, 120.0);
        assert!((fine - 60.0).abs() < 0.5, "{fine}");
        let phone = Viewing::new([960, 640], 3.5, 53.0).unwrap();
        assert!(phone.ppd_over_diagonal() > 120.0);
    }

    #[test]
    fn distance_and_resolution_are_inverses() {
        let viewing = asus(91.0);
        let ppd = viewing.ppd_over_diagonal();
        assert!((distance_for_ppd(diagonal([2560, 1440]), 27.0, ppd) - 91.0).abs() < 1e-9);
    }

    #[test]
    fn the_edge_of_a_screen_has_more_pixels_to_the_degree_than_its_middle() {
        let viewing = asus(50.0);
        assert!(viewing.ppd_over_diagonal() > viewing.ppd_over_width());
        assert!(viewing.ppd_over_width() > viewing.ppd_at_centre());
        assert!(Viewing::new([0, 1440], 27.0, 50.0).is_err());
        assert!(Viewing::new([2560, 1440], 27.0, f64::NAN).is_err());
    }
}
