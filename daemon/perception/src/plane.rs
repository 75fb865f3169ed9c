//! One plane of numbers: luminance, light, a probability.
//!
//! Row by row, pixel centres at .5, f32. Beyond its border a plane goes on with the value at the
//! border. What is done to planes here is what several models need: pixel by pixel work, separable
//! filters, and bilinear reading.

use crate::PerceptionError;

/// Columns, rows and as many values, at least one of each.
#[derive(Clone, PartialEq, Debug)]
pub struct Plane {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Plane {
    /// A plane of `width * height` values, row by row. None if there are not as many, or none.
    #[must_use]
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Option<Self> {
        let count = width.checked_mul(height)?;
        (count > 0 && count == values.len()).then_some(Self { width, height, values })
    }

    /// A plane with one value everywhere.
    ///
    /// # Panics
    /// If a side is 0.
    #[must_use]
    pub fn filled(width: usize, height: usize, value: f32) -> Self {
        Self::from_fn(width, height, |_, _| value)
    }

    /// A plane with `value(x, y)` at each pixel.
    ///
    /// # Panics
    /// If a side is 0.
    #[must_use]
    pub fn from_fn(
        width: usize,
        height: usize,
        mut value: impl FnMut(usize, usize) -> f32,
    ) -> Self {
        assert!(width > 0 && height > 0, "expected a plane with pixels, found {width}x{height}");
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Self { width, height, values: pixels.map(|(x, y)| value(x, y)).collect() }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All values, row by row.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// All values, row by row.
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.values
    }

    /// The value of a pixel; beyond the border, of the nearest one inside.
    #[must_use]
    pub fn at(&self, x: isize, y: isize) -> f32 {
        let clamp = |at: isize, size: usize| at.clamp(0, size.cast_signed() - 1).cast_unsigned();
        self.values[clamp(y, self.height) * self.width + clamp(x, self.width)]
    }

    /// The plane with `change` applied to each value.
    #[must_use]
    pub fn map(&self, mut change: impl FnMut(f32) -> f32) -> Self {
        let values = self.values.iter().map(|&value| change(value)).collect();
        Self { values, ..*self }
    }

    /// Both planes, joined pixel by pixel.
    ///
    /// # Panics
    /// If they differ in size.
    #[must_use]
    pub fn zip(&self, other: &Self, mut join: impl FnMut(f32, f32) -> f32) -> Self {
        assert_eq!((self.width, self.height), (other.width, other.height), "planes of one size");
        let pairs = self.values.iter().zip(&other.values);
        Self { values: pairs.map(|(&a, &b)| join(a, b)).collect(), ..*self }
    }

    /// Nothing if `other` has the same size.
    ///
    /// # Errors
    /// Both sizes.
    pub fn check_same_size(&self, other: &Self) -> Result<(), PerceptionError> {
        if (self.width, self.height) == (other.width, other.height) {
            return Ok(());
        }
        Err(PerceptionError::SizeDiffers {
            expected_width: self.width,
            expected_height: self.height,
            found_width: other.width,
            found_height: other.height,
        })
    }

    /// The mean of all values.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|&value| f64::from(value)).sum::<f64>() / self.values.len() as f64
    }

    /// The largest value. NaN is passed over.
    #[must_use]
    pub fn max(&self) -> f32 {
        self.values.iter().copied().fold(f32::NEG_INFINITY, f32::max)
    }

    /// Convolved along rows and columns with `kernel` of odd length, its taps `spread` pixels
    /// apart.
    #[must_use]
    pub fn convolved(&self, kernel: &[f32], spread: usize) -> Self {
        self.convolved_along(kernel, spread, [1, 0]).convolved_along(kernel, spread, [0, 1])
    }

    fn convolved_along(&self, kernel: &[f32], spread: usize, [dx, dy]: [isize; 2]) -> Self {
        let half = (kernel.len() / 2).cast_signed();
        let spread = spread.cast_signed();
        Self::from_fn(self.width, self.height, |x, y| {
            let (x, y) = (x.cast_signed(), y.cast_signed());
            let taps = kernel.iter().zip(-half..).map(|(&weight, tap)| {
                let offset = tap * spread;
                weight * self.at(x + dx * offset, y + dy * offset)
            });
            taps.sum()
        })
    }

    /// Blurred by a Gaussian of `sigma` pixels, cut at three of them. No blur for 0 or less.
    #[must_use]
    pub fn blurred(&self, sigma: f32) -> Self {
        self.convolved(&gaussian(sigma), 1)
    }

    /// The value at (`x`, `y`) in pixels, between the four nearest centres.
    #[must_use]
    pub fn bilinear(&self, x: f32, y: f32) -> f32 {
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (across, down) = (x - left, y - top);
        let (left, top) = (left as isize, top as isize);
        let row = |y| {
            let (first, second) = (self.at(left, y), self.at(left + 1, y));
            first + (second - first) * across
        };
        let (first, second) = (row(top), row(top + 1));
        first + (second - first) * down
    }
}

/// Weights of a Gaussian of `sigma` pixels that add up to 1, cut at three of them.
#[must_use]
pub fn gaussian(sigma: f32) -> Vec<f32> {
    if sigma.is_nan() || sigma <= 0.0 {
        return vec![1.0];
    }
    let half = (3.0 * sigma).ceil() as i32;
    let weight = |tap: i32| {
        let way = f64::from(tap) / f64::from(sigma);
        libm::exp(-0.5 * way * way)
    };
    let sum: f64 = (-half..=half).map(weight).sum();
    (-half..=half).map(|tap| (weight(tap) / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_needs_exactly_its_values() {
        assert!(Plane::new(2, 2, vec![0.0; 4]).is_some());
        assert!(Plane::new(2, 2, vec![0.0; 3]).is_none());
        assert!(Plane::new(0, 2, vec![]).is_none());
        assert!(Plane::new(usize::MAX, 2, vec![]).is_none());
    }

    #[test]
    fn filters_keep_a_constant_and_the_sum_of_what_is_far_from_the_border() {
        let flat = Plane::filled(9, 7, 3.0);
        assert!(flat.blurred(2.0).values().iter().all(|value| (value - 3.0).abs() < 1e-5));
        let mut point = Plane::filled(31, 31, 0.0);
        point.values_mut()[15 * 31 + 15] = 1.0;
        let blurred = point.blurred(2.0);
        assert!((blurred.mean() * 961.0 - 1.0).abs() < 1e-5);
        assert!((blurred.at(17, 15) - blurred.at(15, 13)).abs() < 1e-7, "alike along both axes");
        assert!(blurred.at(15, 15) > blurred.at(17, 15));
        assert_eq!(point.blurred(0.0), point);
    }

    #[test]
    fn bilinear_reading_gives_pixels_at_their_centres_and_ramps_between() {
        let ramp = Plane::from_fn(5, 3, |x, y| (x + 10 * y) as f32);
        assert!((ramp.bilinear(2.5, 1.5) - 12.0).abs() < 1e-6);
        assert!((ramp.bilinear(3.0, 1.0) - 7.5).abs() < 1e-6);
        assert!((ramp.bilinear(-9.0, 99.0) - 20.0).abs() < 1e-6);
    }

    #[test]
    fn sizes_that_differ_are_told() {
        let error = Plane::filled(2, 3, 0.0).check_same_size(&Plane::filled(3, 2, 0.0));
        let text = error.unwrap_err().to_string();
        assert!(text.contains("2x3") && text.contains("3x2"), "{text}");
    }
}
