//! Table 7.2 and the laws of the flicker model.

use super::*;
use crate::display::DisplayProfile;

/// The published resolution (Denes 2020, section 7.2).
const PPD: f64 = 52.0;
/// Peak luminance of the display of table 7.2, cd/m2.
const PEAK: f32 = 156.0;

fn model(refresh_hz: f64) -> FlickerModel {
    FlickerModel::new(refresh_hz, PPD).unwrap()
}

/// Codes of a picture with fine and coarse detail, even areas, and white. `detail` 1 has stripes of
/// nearly full contrast, 0.5 is what textures of rendered scenes come to.
fn picture(detail: f32) -> Plane {
    Plane::from_fn(192, 128, |x, y| {
        let code = match (x / 48, y / 64) {
            (0, 0) => f32::from(u8::from(x / 3 % 2 == 0)) - 0.5,
            (1, 0) => 0.4 * libm::sinf(x as f32 * 0.21) * libm::cosf(y as f32 * 0.17),
            (2, 0) => x as f32 / 192.0 - 0.5,
            (3, 0) => {
                if (x * 7 + y * 13) % 11 < 4 {
                    0.25
                } else {
                    -0.15
                }
            }
            (0, 1) => return 1.0,
            (1, 1) => {
                if (x + y) / 8 % 2 == 0 {
                    0.3
                } else {
                    -0.3
                }
            }
            (2, 1) => -0.1,
            _ => 0.1 + 0.2 * libm::sinf((x + 2 * y) as f32 * 0.5),
        };
        0.5 + detail * code
    })
}

/// Equation 7.9: the approximate display of the experiment, share of light of a code.
fn light(code: f32) -> f32 {
    (0.99917 * libm::pow(f64::from(code), 2.15) + 0.000_825) as f32
}

/// Equation 7.8: a blurred frame and the one that makes up for it, clipped, as luminance.
fn blur_pair(detail: f32, sigma_px: f32, gain: f32) -> [Plane; 2] {
    let original = picture(detail);
    let blurred = original.blurred(sigma_px).map(light);
    let sharp =
        original.map(light).zip(&blurred, |full, low| (2.0 * full - low).clamp(0.000_825, 1.0));
    [blurred, sharp].map(|frame| frame.map(|light| light * PEAK * gain))
}

/// Black and a frame of doubled luminance, clipped where the display ends or not.
fn black_frame_pair(most: f32) -> [Plane; 2] {
    let black = Plane::filled(192, 128, 0.000_825 * PEAK);
    [black, picture(1.0).map(|code| (2.0 * light(code)).min(most) * PEAK)]
}

fn peak([first, second]: &[Plane; 2], refresh_hz: f64) -> f32 {
    model(refresh_hz).map(first, second).unwrap().max()
}

#[test]
fn bands_have_the_published_frequencies_and_add_up_to_the_picture() {
    let frequencies: Vec<f64> = Bands::frequencies(PPD).collect();
    assert_eq!(frequencies, [26.0, 13.0, 6.5, 3.25, 1.625]);
    let picture = picture(1.0);
    let bands = Bands::split(&picture, PPD);
    assert_eq!(bands.iter().count(), 5);
    let sum = bands.iter().fold(picture.map(|_| 0.0), |sum, (band, _)| sum.zip(band, |a, b| a + b));
    assert!(sum.zip(&picture, |a, b| (a - b).abs()).max() < 1e-5);
}

#[test]
fn a_grating_is_strongest_in_the_band_of_its_frequency() {
    // An octave apart, from the finest band to the low-pass plane.
    for (pixels, expected) in [(3.5, 0), (7.0, 1), (14.0, 2), (28.0, 3), (112.0, 4)] {
        let phase = |x: usize| core::f32::consts::TAU * x as f32 / pixels;
        let grating = Plane::from_fn(240, 4, |x, _| libm::sinf(phase(x)));
        let bands = Bands::split(&grating, PPD);
        let energy = |plane: &Plane| plane.map(|value| value * value).mean();
        let energies: Vec<f64> = bands.iter().map(|(plane, _)| energy(plane)).collect();
        let strongest = (0..5).max_by(|a, b| energies[*a].total_cmp(&energies[*b]));
        assert_eq!(strongest, Some(expected), "{pixels} px: {energies:?}");
    }
}

#[test]
fn frames_that_come_back_later_flicker_more_and_the_threshold_is_where_half_see_it() {
    let pair = model(120.0);
    let three = pair.repeating_after(3).unwrap();
    assert!((three.flicker_hz() - 40.0).abs() < 1e-12 && (pair.flicker_hz() - 60.0).abs() < 1e-12);
    assert!(three.of_contrast(0.3, 4.0, 80.0) > pair.of_contrast(0.3, 4.0, 80.0));
    // A rate of 80 Hz with pairs repeats as often as 120 Hz with three frames.
    let slow = model(80.0).of_contrast(0.3, 4.0, 80.0);
    assert!((three.of_contrast(0.3, 4.0, 80.0) - slow).abs() < 1e-12);
    for (cpd, luminance) in [(1.625, 78.0), (13.0, 20.0)] {
        let threshold = pair.threshold_contrast(cpd, luminance);
        assert!((pair.of_contrast(threshold, cpd, luminance) - 0.5).abs() < 1e-12);
    }
    assert!(pair.repeating_after(1).is_err());
}

#[test]
fn even_flicker_of_full_contrast_has_the_published_probabilities() {
    // Mean 78 cd/m2 where the doubled frame is clipped at 156, and 156 where it is not.
    let at = |luminance| model(120.0).of_contrast(1.0, 1.625, luminance);
    assert!((at(78.0) - 0.25).abs() < 0.01, "{}", at(78.0));
    assert!((at(156.0) - 0.65).abs() < 0.01, "{}", at(156.0));
}

#[test]
fn black_frames_at_120_hz_are_seen_in_bright_regions_and_multiplexing_at_90_hz_is_not() {
    // Table 7.2. The sigma of the experiments is 2.5 pixels (section 5.2.3).
    let unclipped = black_frame_pair(f32::INFINITY);
    let map = model(120.0).map(&unclipped[0], &unclipped[1]).unwrap();
    assert!(map.at(24, 110) > 0.5, "bright area {}", map.at(24, 110));
    assert!(map.at(120, 110) < 0.2, "dim area {}", map.at(120, 110));
    for rate in [90.0, 100.0, 120.0, 144.0, 165.0] {
        let seen = peak(&blur_pair(0.5, 2.5, 1.0), rate);
        assert!(seen < 0.5, "multiplexing at {rate} Hz: {seen}");
        assert!(peak(&unclipped, rate) > seen, "black frames at {rate} Hz");
    }
    assert!(peak(&unclipped, 90.0) > 0.9);
    // Stripes of full contrast cannot be made up for within the range of the display. Without the
    // residual buffer, which this worst case leaves out, they are at threshold at 90 Hz.
    let stripes = peak(&blur_pair(1.0, 2.5, 1.0), 90.0);
    assert!((0.45..0.6).contains(&stripes), "{stripes}");
    assert!(peak(&blur_pair(1.0, 2.5, 1.0), 100.0) < 0.45);
}

#[test]
fn flicker_is_seen_less_at_higher_rates_and_more_with_light_and_with_blur() {
    let rates = [60.0, 72.0, 90.0, 120.0, 165.0];
    let by_rate = rates.map(|rate| peak(&blur_pair(0.5, 2.5, 1.0), rate));
    assert!(by_rate.windows(2).all(|two| two[0] > two[1]), "{by_rate:?}");
    let by_light = [0.25, 0.5, 1.0, 2.0].map(|gain| peak(&blur_pair(0.5, 2.5, gain), 90.0));
    assert!(by_light.is_sorted() && by_light[0] < by_light[3], "{by_light:?}");
    // Over the picture; at its worst pixel clipping ends the rise from 4 to 8 pixels.
    let by_blur = [1.0, 2.0, 4.0, 8.0].map(|sigma| {
        let [first, second] = blur_pair(1.0, sigma, 1.0);
        model(90.0).map(&first, &second).unwrap().mean()
    });
    assert!(by_blur.windows(2).all(|two| two[0] < two[1]), "{by_blur:?}");
}

#[test]
fn what_does_not_change_does_not_flicker_and_all_are_probabilities() {
    let frame = picture(1.0).map(|code| code * PEAK);
    assert!(model(40.0).map(&frame, &frame).unwrap().max() < 1e-6);
    let black = Plane::filled(192, 128, 0.0);
    assert!(model(40.0).map(&black, &black).unwrap().max() < 1e-6);
    let map = model(20.0).map(&frame, &black).unwrap();
    assert!(map.values().iter().all(|&seen| (-1e-6..=1.0 + 1e-6).contains(&seen)));
    assert!(model(20.0).map(&frame, &Plane::filled(3, 3, 0.0)).is_err());
    assert!(FlickerModel::new(0.0, 52.0).is_err() && FlickerModel::new(60.0, f64::NAN).is_err());
}

#[test]
fn the_display_of_the_stimuli_is_close_to_the_measured_profile() {
    let asus = DisplayProfile::builtin("asus-pg279q").unwrap();
    let white = asus.model().luminance([1.0; 3]);
    for level in (0..=255_u8).step_by(5) {
        let code = f32::from(level) / 255.0;
        let measured = asus.model().luminance([code.into(); 3]) / white;
        assert!((measured - f64::from(light(code))).abs() < 0.015, "{code}: {measured}");
    }
}

#[test]
fn a_difference_below_the_unseen_one_is_below_threshold_around_every_luminance() {
    for (rate, frames) in [(120.0, 3), (120.0, 2), (90.0, 2), (60.0, 2)] {
        let model = model(rate).repeating_after(frames).unwrap();
        let unseen = model.unseen_difference(|_| 1.0);
        let mut highest: f64 = 0.0;
        for step in 0..200 {
            let mean = unseen / 2.0 * libm::pow(1.02, f64::from(step));
            for cpd in Bands::frequencies(PPD) {
                highest = highest.max(model.of_contrast(unseen / (2.0 * mean), cpd, mean));
            }
        }
        assert!((highest - 0.5).abs() < 1e-9, "{highest}: {unseen} cd/m2 at {rate} Hz");
        // The lowest band, of 1.625 cpd, is the one that is seen best.
        let of_lowest = model.unseen_difference_of(1.625);
        assert!((of_lowest - unseen).abs() < 1e-9);
        assert!(model.unseen_difference(|cpd| if cpd < 6.0 { 0.1 } else { 1.0 }) > unseen);
    }
    let [slow, fast] = [3, 2]
        .map(|frames| model(120.0).repeating_after(frames).unwrap().unseen_difference(|_| 1.0));
    assert!(slow > 10.0 && slow < 40.0 && fast > 5.0 * slow, "{slow} {fast}");
}
