//! Peak signal-to-noise ratio of whole pictures, 8-bit levels, peak 255.

use super::{Srgb8, assert_same_size};

/// What a mean squared error of 0 counts as.
pub const MAX_PSNR_DB: f64 = 100.0;

/// Weights of red, green and blue in luminance (Falchetto et al. 2007, (1.2) and (1.3)).
const LUMINANCE_WEIGHTS: [f64; 3] = [0.299, 0.587, 0.114];

/// PSNR over all three channels together, in dB.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn psnr_rgb_db(output: &Srgb8, truth: &Srgb8) -> f64 {
    assert_same_size(output, truth);
    let sums = squared_errors(output.data().iter().zip(truth.data()));
    let samples = truth.data().len() * 3;
    psnr_db(sums.iter().sum(), samples)
}

/// `PSNR_Y` of Falchetto et al. 2007, (1.3): the weighted mean of the PSNR of red, green and blue
/// in dB; each channel without error counts as [`MAX_PSNR_DB`].
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn psnr_y_db(output: &Srgb8, truth: &Srgb8) -> f64 {
    assert_same_size(output, truth);
    weighted_psnr_db(squared_errors(output.data().iter().zip(truth.data())), truth.data().len())
}

/// (1.3) for `pixels` pixels whose squared errors per channel sum up to `sums`.
pub(super) fn weighted_psnr_db(sums: [u64; 3], pixels: usize) -> f64 {
    let channels = sums.into_iter().zip(LUMINANCE_WEIGHTS);
    channels.map(|(sum, weight)| weight * psnr_db(sum, pixels)).sum()
}

/// Sums of squared errors per channel.
pub(super) fn squared_errors<'a>(
    pairs: impl Iterator<Item = (&'a [u8; 3], &'a [u8; 3])>,
) -> [u64; 3] {
    let mut sums = [0; 3];
    for (output, truth) in pairs {
        for channel in 0..3 {
            let error = u64::from(output[channel].abs_diff(truth[channel]));
            sums[channel] += error * error;
        }
    }
    sums
}

fn psnr_db(squared_error: u64, samples: usize) -> f64 {
    if squared_error == 0 {
        return MAX_PSNR_DB;
    }
    let mean = squared_error as f64 / samples as f64;
    (10.0 * (255.0 * 255.0 / mean).log10()).min(MAX_PSNR_DB)
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{from_fn, map, textured};
    use super::*;

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-9, "expected {expected}, found {found}");
    }

    #[test]
    fn a_perfect_picture_counts_as_100_db() {
        let truth = textured(37, 21, 1);
        near(psnr_rgb_db(&truth, &truth), 100.0);
        near(psnr_y_db(&truth, &truth), 100.0);
    }

    #[test]
    fn an_offset_of_d_levels_in_every_sample_is_20_log10_of_255_over_d() {
        let truth = map(&textured(37, 21, 1), |v| v.min(240));
        for offset in [1_u8, 5, 15] {
            let output = map(&truth, |v| v + offset);
            let expected = 20.0 * (255.0 / f64::from(offset)).log10();
            near(psnr_rgb_db(&output, &truth), expected);
            near(psnr_y_db(&output, &truth), expected);
        }
    }

    #[test]
    fn the_channels_are_pooled_in_rgb_and_weighted_in_decibels_in_y() {
        let truth = from_fn(8, 8, |_, _| [100, 100, 100]);
        let output = from_fn(8, 8, |_, _| [110, 100, 100]);
        let of_ten = 20.0 * 25.5_f64.log10();
        near(psnr_rgb_db(&output, &truth), of_ten + 10.0 * 3.0_f64.log10());
        near(psnr_y_db(&output, &truth), 0.299 * of_ten + 0.701 * 100.0);
    }

    #[test]
    fn it_is_symmetric_and_falls_as_the_error_grows() {
        let truth = map(&textured(16, 16, 3), |v| v.min(200));
        let (small, large) = (map(&truth, |v| v + 3), map(&truth, |v| v + 30));
        near(psnr_y_db(&small, &truth), psnr_y_db(&truth, &small));
        assert!(psnr_rgb_db(&small, &truth) > psnr_rgb_db(&large, &truth));
        assert!(psnr_y_db(&small, &truth) > psnr_y_db(&large, &truth));
    }

    #[test]
    fn one_wrong_pixel_is_seen() {
        let truth = textured(64, 64, 1);
        let mut output = truth.clone();
        output.data_mut()[77][2] ^= 1;
        assert!(psnr_rgb_db(&output, &truth) < 100.0);
        assert!(psnr_y_db(&output, &truth) < 100.0);
    }

    #[test]
    #[should_panic(expected = "one size")]
    fn pictures_of_different_sizes_are_refused() {
        std::hint::black_box(psnr_rgb_db(&textured(8, 8, 1), &textured(9, 8, 1)));
    }
}
