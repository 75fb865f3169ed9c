//! Laws of the banding model, and published depths that it must agree with.

use super::*;
use crate::display::DisplayProfile;
use crate::display::transfer::{pq_to_luminance, srgb_to_linear};

/// D65 white of luminance 1.
const WHITE: [f64; 3] = [0.9505, 1.0, 1.089];

fn grey(luminance: f64) -> [f64; 3] {
    WHITE.map(|value| value * luminance)
}

fn asus() -> impl Fn([f64; 3]) -> [f64; 3] {
    let profile = DisplayProfile::builtin("asus-pg279q").unwrap();
    move |codes| profile.model().xyz(codes)
}

fn ramp(from: f64, to: f64) -> Gradient {
    Gradient::new([from; 3], [to; 3]).unwrap()
}

#[test]
fn a_grating_at_threshold_is_seen_half_of_the_time_and_its_harmonics_add() {
    // Steps of 8 px at 60 ppd: harmonics at 7.5, 15, 22.5 and 30 cpd.
    let luminance = 100.0;
    let sensitivity = barten::sensitivity(7.5, luminance, barten::STIMULUS_DEG);
    let contrast = core::f64::consts::PI / sensitivity;
    let step = Step {
        from_xyz: grey(luminance * (1.0 - contrast / 2.0)),
        to_xyz: grey(luminance * (1.0 + contrast / 2.0)),
        width_px: 8.0,
    };
    let expected = any((1..=4).map(|k| {
        let share = barten::sensitivity(7.5 * f64::from(k), luminance, 10.0) / sensitivity;
        probability(share / f64::from(k), SLOPE)
    }));
    let found = seen(&step, 60.0).achromatic;
    assert!((found - expected).abs() < 1e-9 && found > 0.5, "{found} against {expected}");
}

#[test]
fn larger_steps_are_seen_more_and_none_are_not_seen() {
    let at = |change: f64| {
        seen(&Step { from_xyz: grey(50.0), to_xyz: grey(50.0 + change), width_px: 20.0 }, 56.0)
    };
    assert!(at(0.0).any().abs() < 1e-12);
    let rising = [0.05, 0.1, 0.2, 0.4, 0.8].map(|change| at(change).any());
    assert!(rising.windows(2).all(|two| two[0] < two[1]), "{rising:?}");
    assert!(at(0.2).red_green < 0.01 && at(0.2).achromatic > 0.1, "{:?}", at(0.2));
    let dark = Step { from_xyz: [0.0; 3], to_xyz: [0.0; 3], width_px: 20.0 };
    assert_eq!(seen(&dark, 56.0), Seen::default());
}

#[test]
fn a_change_of_colour_alone_is_seen_by_the_channel_that_it_excites() {
    let from = grey(50.0);
    let red = |share: f64| [from[0] * (1.0 + share), from[1], from[2]];
    // Along the line on which only the short cones change.
    let blue = |share: f64| {
        let more = from[2] * share;
        [from[0] + 0.03286 / 0.15514 * more, from[1], from[2] + more]
    };
    let at = |to_xyz| seen(&Step { from_xyz: from, to_xyz, width_px: 60.0 }, 56.0);
    let (red, blue) = (at(red(0.05)), at(blue(0.3)));
    assert!(red.red_green > 0.5 && red.achromatic < 1e-9, "{red:?}");
    assert!(
        blue.yellow_violet > 0.5 && blue.red_green < 0.05 && blue.achromatic < 1e-9,
        "{blue:?}"
    );
}

#[test]
fn every_bit_more_is_seen_less_where_the_worst_width_is_taken() {
    for gradient in [ramp(0.0, 1.0), ramp(0.4, 0.6)] {
        let mut last = 2.0;
        for bits in 5..=12 {
            let found = gradient.seen(bits, BandWidth::Worst, 56.0, asus()).unwrap().any();
            assert!(found < last || last > 1.0 - 1e-9, "{bits} bits: {found} after {last}");
            last = found;
        }
        assert!(last < 0.5, "{last}");
    }
}

#[test]
fn pq_needs_more_than_ten_bits_and_twelve_do() {
    // SMPTE ST 2084 was made so that 12 bits stay below Barten's threshold at all levels, and is
    // known to be slightly above it with 10 (Miller, Nezamabadi and Daly 2013).
    let pq = |codes: [f64; 3]| grey(pq_to_luminance(codes[1]));
    let bits = ramp(0.15, 0.75).least_bits(BandWidth::Worst, 60.0, pq).unwrap();
    assert!(matches!(bits, Some(11 | 12)), "{bits:?}");
}

#[test]
fn bright_greys_of_srgb_need_more_than_eight_bits_and_dark_ones_more_than_bright() {
    let srgb = |codes: [f64; 3]| grey(100.0 * srgb_to_linear(codes[1]));
    let bright = ramp(0.5, 1.0).least_bits(BandWidth::Worst, 60.0, srgb).unwrap();
    assert!(matches!(bright, Some(9 | 10)), "{bright:?}");
    // A level of a power law is a larger share of little light.
    let dark = ramp(0.2, 0.5).least_bits(BandWidth::Worst, 60.0, srgb).unwrap();
    assert!(dark > bright, "{dark:?} against {bright:?}");
    // Blue alone has little luminance and needs fewer.
    let blue = Gradient::new([0.2, 0.2, 0.2], [0.2, 0.2, 1.0]).unwrap();
    let fewer = blue.least_bits(BandWidth::Worst, 56.0, asus()).unwrap();
    let grey = ramp(0.2, 1.0).least_bits(BandWidth::Worst, 56.0, asus()).unwrap();
    assert!(fewer < grey, "{fewer:?} against {grey:?}");
}

#[test]
fn a_gradient_has_one_step_per_level() {
    // Two bits, so three steps over 90 pixels, of which the darkest is seen best.
    let linear = |codes: [f64; 3]| grey(20.0 + 0.45 * codes[1]);
    let found = ramp(0.0, 1.0).seen(2, BandWidth::Over(90.0), 56.0, linear).unwrap();
    let step = Step { from_xyz: grey(20.0), to_xyz: grey(20.15), width_px: 30.0 };
    assert!((found.achromatic - seen(&step, 56.0).achromatic).abs() < 1e-9, "{found:?}");
    let less = Step { to_xyz: grey(20.14), ..step };
    assert!((found.achromatic - seen(&less, 56.0).achromatic).abs() > 1e-3);
}

#[test]
fn a_gradient_of_known_width_is_seen_no_more_than_at_the_worst_width() {
    let gradient = ramp(0.3, 0.7);
    let worst = gradient.seen(7, BandWidth::Worst, 56.0, asus()).unwrap().any();
    for pixels in [60.0, 400.0, 2560.0] {
        let found = gradient.seen(7, BandWidth::Over(pixels), 56.0, asus()).unwrap().any();
        assert!(found <= worst + 0.02, "{pixels}: {found} against {worst}");
    }
}

#[test]
fn what_is_no_gradient_is_refused() {
    assert!(Gradient::new([0.5; 3], [0.5; 3]).is_err());
    assert!(Gradient::new([-0.1; 3], [0.5; 3]).is_err());
    assert!(Gradient::new([f64::NAN; 3], [0.5; 3]).is_err());
    let gradient = ramp(0.0, 1.0);
    assert!(gradient.seen(0, BandWidth::Worst, 56.0, asus()).is_err());
    assert!(gradient.seen(17, BandWidth::Worst, 56.0, asus()).is_err());
    assert!(gradient.seen(8, BandWidth::Over(0.0), 56.0, asus()).is_err());
    assert!(gradient.seen(8, BandWidth::Worst, 0.0, asus()).is_err());
}
