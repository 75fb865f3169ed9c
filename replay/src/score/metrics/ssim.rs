//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004, *Image quality assessment: from
//! error visibility to structural similarity*, (13)) on luma, 8-bit levels.
//!
//! Gaussian window of 11x11 pixels, sigma 1.5, K1 = 0.01, K2 = 0.03, L = 255; weighted population
//! moments. The mean is taken over the positions at which the window lies inside the picture; of
//! a picture smaller than the window, over all positions with the border repeated.

use foreframe_engine::Plane;

use super::blur::{along_x, along_y, normalised, taps};
use super::{Srgb8, assert_same_size, luma};

const WINDOW_RADIUS_PX: u32 = 5;
const SIGMA_PX: f64 = 1.5;
const C1: f32 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f32 = (0.03 * 255.0) * (0.03 * 255.0);

/// Mean SSIM of two pictures, -1 to 1; 1 where they are equal.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn ssim(output: &Srgb8, truth: &Srgb8) -> f64 {
    assert_same_size(output, truth);
    let window = normalised(&taps(WINDOW_RADIUS_PX as usize, |x| {
        (-x * x / (2.0 * SIGMA_PX * SIGMA_PX)).exp()
    }));
    let mean = |plane: &Plane<f32>| along_y(&along_x(plane, &window), &window);
    let (x, y) = (centred_luma(output), centred_luma(truth));
    let (mu_x, mu_y) = (mean(&x), mean(&y));
    let (xx, yy, xy) = (mean(&product(&x, &x)), mean(&product(&y, &y)), mean(&product(&x, &y)));

    let inside = |size: u32| {
        let margin = if size > 2 * WINDOW_RADIUS_PX { WINDOW_RADIUS_PX } else { 0 };
        margin..size - margin
    };
    let mut sum = 0.0;
    for row in inside(truth.height()) {
        for column in inside(truth.width()) {
            let of = |plane: &Plane<f32>| plane.at(column, row);
            let (centred_x, centred_y) = (of(&mu_x), of(&mu_y));
            let variances = of(&xx) - centred_x * centred_x + of(&yy) - centred_y * centred_y;
            let covariance = of(&xy) - centred_x * centred_y;
            let (mean_x, mean_y) = (centred_x + CENTRE, centred_y + CENTRE);
            let luminance = (2.0 * mean_x * mean_y + C1) / (mean_x * mean_x + mean_y * mean_y + C1);
            let contrast_structure = (2.0 * covariance + C2) / (variances + C2);
            sum += f64::from(luminance * contrast_structure);
        }
    }
    sum / (inside(truth.height()).len() * inside(truth.width()).len()).max(1) as f64
}

/// Subtracted before the moments are taken, so that their differences keep more digits.
const CENTRE: f32 = 128.0;

fn centred_luma(picture: &Srgb8) -> Plane<f32> {
    let values = picture.data().iter().map(|pixel| luma(*pixel) - CENTRE).collect();
    Plane::from_vec(picture.width(), picture.height(), values)
}

fn product(a: &Plane<f32>, b: &Plane<f32>) -> Plane<f32> {
    let values = a.data().iter().zip(b.data()).map(|(a, b)| a * b).collect();
    Plane::from_vec(a.width(), a.height(), values)
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{from_fn, map, textured};
    use super::*;

    /// The definition, position by position in double precision.
    fn by_definition(output: &Srgb8, truth: &Srgb8) -> f64 {
        let weight = |x: i32, y: i32| (-f64::from(x * x + y * y) / 4.5).exp();
        let offsets = || (-5..=5).flat_map(|y| (-5..=5).map(move |x| (x, y)));
        let total: f64 = offsets().map(|(x, y)| weight(x, y)).sum();
        let value = |p: &Srgb8, x: i32, y: i32| f64::from(luma(p.at(x as u32, y as u32)));
        let (mut sum, mut positions) = (0.0, 0.0);
        for y in 5..truth.height() as i32 - 5 {
            for x in 5..truth.width() as i32 - 5 {
                let mean = |f: &dyn Fn(i32, i32) -> f64| {
                    let terms = offsets().map(|(i, j)| weight(i, j) / total * f(x + i, y + j));
                    terms.sum::<f64>()
                };
                let mu_x = mean(&|x, y| value(output, x, y));
                let mu_y = mean(&|x, y| value(truth, x, y));
                let var_x = mean(&|x, y| (value(output, x, y) - mu_x).powi(2));
                let var_y = mean(&|x, y| (value(truth, x, y) - mu_y).powi(2));
                let cov = mean(&|x, y| (value(output, x, y) - mu_x) * (value(truth, x, y) - mu_y));
                let (c1, c2) = (6.5025, 58.5225);
                sum += (2.0 * mu_x * mu_y + c1) * (2.0 * cov + c2)
                    / ((mu_x * mu_x + mu_y * mu_y + c1) * (var_x + var_y + c2));
                positions += 1.0;
            }
        }
        sum / positions
    }

    #[test]
    fn equal_pictures_have_one() {
        for (width, height) in [(64, 40), (11, 11), (5, 3), (1, 1)] {
            let truth = textured(width, height, 4);
            assert!((ssim(&truth, &truth) - 1.0).abs() < 1e-6, "{width}x{height}");
        }
    }

    #[test]
    fn it_equals_the_definition() {
        let truth = textured(29, 23, 1);
        for output in [textured(29, 23, 2), map(&truth, |v| v / 2), map(&truth, |v| v | 15)] {
            let (found, expected) = (ssim(&output, &truth), by_definition(&output, &truth));
            assert!((found - expected).abs() < 1e-5, "expected {expected}, found {found}");
        }
    }

    #[test]
    fn flat_pictures_leave_the_luminance_term_alone() {
        let (dark, bright) = (from_fn(20, 20, |_, _| [50; 3]), from_fn(20, 20, |_, _| [100; 3]));
        let expected = (2.0 * 50.0 * 100.0 + 6.5025) / (2500.0 + 10_000.0 + 6.5025);
        assert!((ssim(&dark, &bright) - expected).abs() < 1e-5);
    }

    #[test]
    fn an_inverted_picture_is_worse_than_noise_and_noise_worse_than_an_offset() {
        let truth = textured(48, 48, 1);
        let inverted = ssim(&map(&truth, |v| 255 - v), &truth);
        let other = ssim(&textured(48, 48, 9), &truth);
        let offset = ssim(&map(&truth, |v| v.saturating_add(4)), &truth);
        assert!(inverted < other && other < offset && offset < 1.0, "{inverted} {other} {offset}");
    }

    #[test]
    fn one_wrong_pixel_is_seen() {
        let truth = textured(48, 48, 1);
        let mut output = truth.clone();
        output.row_mut(20)[20] = [255, 0, 255];
        assert!(ssim(&output, &truth) < 0.9999);
    }
}
