//! Edges and points of the luminance (Andersson et al. 2020, 4.2).
//!
//! First and second derivatives of a Gaussian whose standard deviation is half a feature width, in
//! x and in y. The positive and the negative weights of a derivative each sum up to 1 in size.

use foreframe_engine::Plane;

use super::super::blur::{along_x, along_y, normalised, taps};

/// Width of the features that are looked for, in degrees (w in 4.2).
const FEATURE_WIDTH_DEGREES: f64 = 0.082;

/// Strength of features at one pixel, each the length of a gradient.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Features {
    edge: f32,
    point: f32,
}

impl Features {
    /// The larger of the differences in edges and in points.
    pub(super) fn difference(self, other: Self) -> f32 {
        (self.edge - other.edge).abs().max((self.point - other.point).abs())
    }
}

/// Features of the Y plane of YCxCz.
pub(super) fn detect(lightness: &Plane<f32>, pixels_per_degree: f32) -> Vec<Features> {
    let sigma = 0.5 * FEATURE_WIDTH_DEGREES * f64::from(pixels_per_degree);
    let radius = (3.0 * sigma).ceil() as usize;
    let gauss = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let smooth = normalised(&taps(radius, gauss));
    let first = balanced(&taps(radius, |x| -x * gauss(x)));
    let second = balanced(&taps(radius, |x| (x * x / (sigma * sigma) - 1.0) * gauss(x)));

    // Y of YCxCz spans -16 to 100; features are measured on 0 to 1.
    let values = lightness.data().iter().map(|y| (y + 16.0) / 116.0).collect();
    let luminance = Plane::from_vec(lightness.width(), lightness.height(), values);
    let smooth_x = along_x(&luminance, &smooth);
    let edge_x = along_y(&along_x(&luminance, &first), &smooth);
    let edge_y = along_y(&smooth_x, &first);
    let point_x = along_y(&along_x(&luminance, &second), &smooth);
    let point_y = along_y(&smooth_x, &second);

    let edges = edge_x.data().iter().zip(edge_y.data());
    let points = point_x.data().iter().zip(point_y.data());
    edges
        .zip(points)
        .map(|((ex, ey), (px, py))| Features {
            edge: (ex * ex + ey * ey).sqrt(),
            point: (px * px + py * py).sqrt(),
        })
        .collect()
}

/// Scales the positive taps to a sum of 1 and the negative ones to a sum of -1.
fn balanced(taps: &[f64]) -> Vec<f32> {
    let positive: f64 = taps.iter().filter(|tap| **tap > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|tap| **tap < 0.0).sum::<f64>();
    taps.iter().map(|tap| (tap / if *tap > 0.0 { positive } else { negative }) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Y plane of a picture with this luminance, 0 to 1.
    fn lightness(pixel: impl Fn(u32, u32) -> f32) -> Plane<f32> {
        let pixels = (0..40 * 40).map(|i| 116.0 * pixel(i % 40, i / 40) - 16.0).collect();
        Plane::from_vec(40, 40, pixels)
    }

    fn at(features: &[Features], x: usize, y: usize) -> Features {
        features[y * 40 + x]
    }

    #[test]
    fn a_flat_plane_has_no_features() {
        let none = Features { edge: 0.0, point: 0.0 };
        for features in detect(&lightness(|_, _| 0.7), 67.0) {
            assert!(features.difference(none) < 1e-5);
        }
    }

    #[test]
    fn a_step_is_an_edge_and_a_line_is_a_point_feature() {
        let step = detect(&lightness(|x, _| if x < 20 { 0.0 } else { 1.0 }), 67.0);
        let on_step = at(&step, 20, 20);
        assert!(on_step.edge > 0.8, "{on_step:?}");
        let line = detect(&lightness(|x, _| if x / 3 == 6 { 1.0 } else { 0.0 }), 67.0);
        let on_line = at(&line, 19, 20);
        assert!(on_line.point > 5.0 * on_line.edge, "{on_line:?}");
    }

    #[test]
    fn features_do_not_depend_on_the_axis() {
        let upright = detect(&lightness(|x, _| if x < 20 { 0.0 } else { 1.0 }), 67.0);
        let lying = detect(&lightness(|_, y| if y < 20 { 0.0 } else { 1.0 }), 67.0);
        for (x, y) in [(18, 9), (20, 20), (25, 30)] {
            assert!(at(&upright, x, y).difference(at(&lying, y, x)) < 1e-5);
        }
    }
}
