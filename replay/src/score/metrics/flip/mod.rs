//! LDR-FLIP: how visible a difference is when one flips between two pictures (Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström, Fairchild 2020, *FLIP: A Difference Evaluator for Alternating
//! Images*, Proc. ACM Comput. Graph. Interact. Tech. 3(2), doi 10.1145/3406183).
//!
//! Steps, with the sections of that paper: spatial filtering by contrast sensitivity in an opponent
//! space (4.1.1), clamping to the colour cube, CIELAB with chroma scaled by lightness after Hunt
//! (4.1.2), HyAB distance and its error map (4.1.3); edges and points of the luminance (4.2); the
//! feature difference sharpens the colour difference by an exponent (4.3).
//!
//! What a truth contributes is worked out once ([`FlipTruth`]) and shared by every comparison.

mod color;
mod features;
mod filters;

use color::{Lab, hunt_lab, hyab, linear_rgb_of, opponent_of};
use features::Features;
use filters::{filter_by_contrast_sensitivity, opponent_planes};
use foreframe_engine::Plane;

use super::{Srgb8, assert_same_size};

/// Viewing conditions of the published tool: 0.7 m from a 3840 pixel, 0.7 m wide display.
pub const PIXELS_PER_DEGREE: f32 = 67.0;

/// Exponent on the HyAB distance (q_c in 4.1.3).
const COLOR_EXPONENT: f32 = 0.7;
/// Fraction of the largest colour distance at which the error map bends (p_c in 4.1.3).
const COLOR_BEND: f32 = 0.4;
/// Value of the error map at the bend (p_t in 4.1.3).
const COLOR_BEND_VALUE: f32 = 0.95;
/// Exponent on the feature difference (q_f in 4.2) is one half: a square root in the code.
const FEATURE_SCALE: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// A truth, prepared for any number of comparisons.
#[derive(Clone, Debug)]
pub struct FlipTruth {
    prepared: Prepared,
}

impl FlipTruth {
    /// Prepares `truth` for comparisons at [`PIXELS_PER_DEGREE`].
    #[must_use]
    pub fn new(truth: &Srgb8) -> Self {
        Self { prepared: Prepared::new(truth) }
    }

    /// Mean FLIP of `output` against this truth, 0 to 1; 0 where they are equal.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn mean_flip(&self, output: &Srgb8) -> f64 {
        let truth = &self.prepared;
        let output = Prepared::new(output);
        assert_eq!(truth.size, output.size, "output and truth have one size");
        let largest = largest_color_distance();
        let colors = output.lab.iter().zip(&truth.lab);
        let features = output.features.iter().zip(&truth.features);
        let errors = colors.zip(features).map(|((output, truth), (seen, expected))| {
            let color = color_error(hyab(*output, *truth).powf(COLOR_EXPONENT), largest);
            let feature = (FEATURE_SCALE * seen.difference(*expected)).sqrt();
            f64::from(color.powf(1.0 - feature))
        });
        errors.sum::<f64>() / truth.lab.len().max(1) as f64
    }
}

/// Mean FLIP of one pair of pictures at [`PIXELS_PER_DEGREE`], 0 to 1.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn flip(output: &Srgb8, truth: &Srgb8) -> f64 {
    assert_same_size(output, truth);
    FlipTruth::new(truth).mean_flip(output)
}

/// What either picture goes through alone.
#[derive(Clone, Debug)]
struct Prepared {
    size: (u32, u32),
    /// CIELAB of the filtered picture, chroma scaled after Hunt.
    lab: Vec<Lab>,
    features: Vec<Features>,
}

impl Prepared {
    fn new(picture: &Srgb8) -> Self {
        let opponent = opponent_planes(picture);
        let features = features::detect(&opponent[0], PIXELS_PER_DEGREE);
        let filtered = filter_by_contrast_sensitivity(&opponent, PIXELS_PER_DEGREE);
        let [y, cx, cz] = filtered.each_ref().map(Plane::data);
        let pixels = y.iter().zip(cx).zip(cz).map(|((y, cx), cz)| [*y, *cx, *cz]);
        let lab = pixels.map(|opponent| {
            hunt_lab(linear_rgb_of(opponent).map(|channel| channel.clamp(0.0, 1.0)))
        });
        Self { size: (picture.width(), picture.height()), lab: lab.collect(), features }
    }
}

/// Distance of the two corners of the colour cube that are farthest apart, green and blue.
fn largest_color_distance() -> f32 {
    let corner = |rgb: [f32; 3]| hunt_lab(linear_rgb_of(opponent_of(rgb)));
    hyab(corner([0.0, 1.0, 0.0]), corner([0.0, 0.0, 1.0])).powf(COLOR_EXPONENT)
}

/// Maps a colour distance to 0..1, steeper below the bend (4.1.3).
fn color_error(distance: f32, largest: f32) -> f32 {
    let bend = COLOR_BEND * largest;
    if distance < bend {
        COLOR_BEND_VALUE / bend * distance
    } else {
        let above = (distance - bend) / (largest - bend);
        (COLOR_BEND_VALUE + above * (1.0 - COLOR_BEND_VALUE)).min(1.0)
    }
}

#[cfg(test)]
mod tests;
