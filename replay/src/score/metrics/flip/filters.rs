//! Spatial filtering by the eye's contrast sensitivity (Andersson et al. 2020, 4.1.1).
//!
//! Each channel of YCxCz has a sum of Gaussians a * sqrt(pi / b) * exp(-(pi * x)^2 / b), x in
//! degrees, fitted to contrast sensitivity; the kernel is cut at three standard deviations of the
//! widest and normalised. Every Gaussian is separable, so a sum of two takes two separable passes.

use foreframe_engine::Plane;
use std::f64::consts::PI;

use super::super::Srgb8;
use super::super::blur::{along_x, along_y, taps};
use super::color::opponent_of;

/// (a, b) of the Gaussians of one channel; b in square degrees.
type Sensitivity = &'static [(f64, f64)];

/// Table 1: achromatic, red-green, blue-yellow.
const SENSITIVITIES: [Sensitivity; 3] =
    [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

/// Largest b of the table: the kernels of all channels are cut where its Gaussian is.
const WIDEST_B: f64 = 0.04;

/// Taps beyond this share of the sum are below what a float adds to it.
const NEGLIGIBLE: f64 = 1e-9;

/// Linear light of an encoded channel, both 0 to 1 (IEC 61966-2-1).
fn linear_of_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The YCxCz planes of a picture.
pub(super) fn opponent_planes(picture: &Srgb8) -> [Plane<f32>; 3] {
    let table: [f32; 256] = std::array::from_fn(|v| linear_of_srgb(v as f32 / 255.0));
    let mut planes = [0; 3].map(|_| Plane::new(picture.width(), picture.height()));
    for (i, pixel) in picture.data().iter().enumerate() {
        let opponent = opponent_of(pixel.map(|level| table[usize::from(level)]));
        for (plane, value) in planes.iter_mut().zip(opponent) {
            plane.data_mut()[i] = value;
        }
    }
    planes
}

/// What of the planes an eye can resolve at this angular resolution.
pub(super) fn filter_by_contrast_sensitivity(
    planes: &[Plane<f32>; 3],
    pixels_per_degree: f32,
) -> [Plane<f32>; 3] {
    let channel = |plane: &Plane<f32>, sensitivity: Sensitivity| {
        let kernels = kernels_of(sensitivity, f64::from(pixels_per_degree));
        let mut filtered = kernels.iter().map(|kernel| along_y(&along_x(plane, kernel), kernel));
        let first = filtered.next().unwrap_or_default();
        filtered.fold(first, |mut sum, more| {
            for (sum, more) in sum.data_mut().iter_mut().zip(more.data()) {
                *sum += more;
            }
            sum
        })
    };
    std::array::from_fn(|i| channel(&planes[i], SENSITIVITIES[i]))
}

/// One-dimensional kernels of which each is applied along both axes and the results summed up;
/// the sum of all weights of all kernels in two dimensions is 1.
fn kernels_of(sensitivity: Sensitivity, pixels_per_degree: f64) -> Vec<Vec<f32>> {
    let sigma = (WIDEST_B / (2.0 * PI * PI)).sqrt();
    let radius = (3.0 * sigma * pixels_per_degree).ceil() as usize;
    let kernels: Vec<Vec<f64>> = sensitivity
        .iter()
        .map(|(a, b)| {
            let amplitude = (a * (PI / b).sqrt()).sqrt();
            taps(radius, |x| amplitude * (-(PI * x / pixels_per_degree).powi(2) / b).exp())
        })
        .collect();
    let sum_2d: f64 = kernels.iter().map(|kernel| kernel.iter().sum::<f64>().powi(2)).sum();
    let scale = 1.0 / sum_2d.sqrt();
    kernels
        .iter()
        .map(|kernel| kernel.iter().map(|tap| tap * scale).collect::<Vec<f64>>())
        .map(|kernel| {
            let outer = kernel.iter().take_while(|tap| **tap < NEGLIGIBLE).count();
            kernel[outer..kernel.len() - outer].iter().map(|tap| *tap as f32).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kernel_keeps_a_flat_plane() {
        for sensitivity in SENSITIVITIES {
            let kernels = kernels_of(sensitivity, 67.0);
            let sum: f32 = kernels.iter().map(|k| k.iter().sum::<f32>().powi(2)).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        }
    }

    #[test]
    fn colour_is_blurred_more_than_lightness() {
        let mut dot = Plane::new(41, 41);
        dot.row_mut(20)[20] = 1.0;
        let planes = [dot.clone(), dot.clone(), dot];
        let [y, cx, cz] = filter_by_contrast_sensitivity(&planes, 67.0).map(|p| p.at(20, 20));
        assert!(y > cx && cx > 5.0 * cz, "{y} {cx} {cz}");
    }

    #[test]
    fn the_blur_grows_with_the_angular_resolution() {
        let width_at = |ppd| kernels_of(SENSITIVITIES[2], ppd)[0].len();
        assert_eq!(width_at(67.0), 2 * 10 + 1);
        assert!(width_at(134.0) > width_at(67.0));
    }
}
