//! The equations of Denes 2020, chapter 5, and its table 5.1.

use proptest::prelude::*;

use super::table::{Conditions, Row, row};
use super::*;
use crate::plane::Plane;

/// A picture with detail that the display can show sharpened.
fn soft(width: usize, height: usize) -> Plane {
    Plane::from_fn(width, height, |x, y| {
        0.4 + 0.05 * libm::sinf(x as f32 * 1.3) + 0.05 * libm::cosf(y as f32 * 0.9)
    })
}

/// Full contrast: sharpening cannot be shown.
fn hard(width: usize, height: usize) -> Plane {
    Plane::from_fn(width, height, |x, y| f32::from(u8::from((x / 5 + y / 3) % 2 == 0)))
}

fn largest_difference(a: &Plane, b: &Plane) -> f32 {
    a.zip(b, |a, b| (a - b).abs()).max()
}

#[test]
fn savings_are_the_published_ones() {
    assert!((pixels_saved(0.5) - 0.375).abs() < 1e-15);
    assert!((pixels_saved(0.4) - 0.42).abs() < 1e-15);
    // 37 to 49 % from 1/2 down to 1/8 (table 5.1).
    assert!((pixels_saved(0.125) - 0.492).abs() < 1e-3);
}

#[test]
fn a_still_picture_is_whole_in_the_sum_of_an_even_and_an_odd_frame() {
    for reduction in [0.25, 0.4, 0.5, 0.7] {
        for picture in [soft(40, 24), hard(40, 24)] {
            let mut trm = TemporalMultiplexing::new([40, 24], reduction, 2.2).unwrap();
            let even = trm.even(&picture).unwrap();
            let odd = trm.odd(&trm.reduce(&picture)).unwrap();
            let mean = even.zip(&odd, f32::midpoint);
            let error = largest_difference(&mean, &picture);
            assert!(error < 1e-5, "{reduction}: {error}");
        }
    }
}

#[test]
fn without_the_residual_what_was_clipped_would_be_lost() {
    let picture = hard(40, 24);
    let mut trm = TemporalMultiplexing::new([40, 24], 0.5, 2.2).unwrap();
    let even = trm.even(&picture).unwrap();
    let bare = restored(&trm.reduce(&picture), [40, 24], 2.2);
    let mean = even.zip(&bare, f32::midpoint);
    assert!(largest_difference(&mean, &picture) > 0.1);
}

#[test]
fn the_residual_is_left_out_where_the_picture_moves() {
    assert!((motion_weight(0.3, 0.3) - 1.0).abs() < 1e-7);
    assert!((motion_weight(0.0, 0.0) - 1.0).abs() < 1e-7);
    // At a Michelson contrast of s1 it is 1/e (equation 5.6).
    let (before, now) = (0.5 * (1.0 + S1), 0.5 * (1.0 - S1));
    assert!((motion_weight(before, now) - libm::expf(-1.0)).abs() < 1e-6);
    assert!(motion_weight(1.0, 0.0) < 1e-4);
    assert!(motion_weight(0.5, 0.45) > 0.99);
}

#[test]
fn frames_of_another_size_are_refused() {
    let mut trm = TemporalMultiplexing::new([40, 24], 0.5, 2.2).unwrap();
    assert_eq!(trm.low_size(), [20, 12]);
    assert!(trm.even(&soft(20, 12)).is_err());
    assert!(trm.odd(&soft(40, 24)).is_err());
    assert!(TemporalMultiplexing::new([40, 24], 0.0, 2.2).is_err());
    assert!(TemporalMultiplexing::new([40, 24], 1.1, 2.2).is_err());
    assert!(TemporalMultiplexing::new([40, 24], 0.5, 0.0).is_err());
}

#[test]
fn techniques_show_what_they_are_named_for() {
    let render = |time: f64| Plane::filled(4, 4, 0.1 * time as f32 + 0.1);
    let means = |technique| -> Vec<f64> {
        let frames = sequence(technique, 4, 2.2, [0.0; 2], render).unwrap();
        frames.iter().map(|frame| (frame.mean() * 100.0).round()).collect()
    };
    assert_eq!(means(Technique::Full), [10.0, 20.0, 30.0, 40.0]);
    assert_eq!(means(Technique::HalfRate), [10.0, 10.0, 30.0, 30.0]);
    assert_eq!(means(Technique::BlackFrames), [10.0, 0.0, 30.0, 0.0]);
    assert_eq!(means(Technique::Interlace), [5.0, 10.0, 15.0, 20.0]);
    assert_eq!(means(Technique::SmoothFrames), [10.0, 10.0, 30.0, 30.0]);
    assert_eq!(means(Technique::Multiplexing(0.5)), [10.0, 20.0, 30.0, 40.0]);
}

fn rows() -> Vec<Row> {
    Technique::ALL.map(|technique| row(technique, &Conditions::DEFAULT).unwrap()).to_vec()
}

#[test]
fn table_5_1_comes_out_in_the_published_order() {
    let rows = rows();
    let [full, reprojection, half, interlace, bfi, ncsfi, trm] = rows[..] else {
        panic!("seven techniques")
    };
    for row in [&full, &reprojection, &half, &ncsfi, &trm] {
        assert!((row.peak_luminance - 1.0).abs() < 1e-3, "{row:?}");
    }
    for row in [&interlace, &bfi] {
        assert!((row.peak_luminance - 0.5).abs() < 1e-3, "{row:?}");
    }
    // "Strong" blur for half the rate, "reduced" for all others.
    for row in [&reprojection, &interlace, &bfi, &ncsfi, &trm] {
        assert!(row.blur_px < 0.8 * half.blur_px, "{row:?} against {half:?}");
    }
    // Smooth frames reduce it less than black frames do; multiplexing is on par with the full rate
    // (below figure 5.6).
    assert!(ncsfi.blur_px > 1.1 * bfi.blur_px, "{ncsfi:?} {bfi:?}");
    assert!((trm.blur_px / full.blur_px - 1.0).abs() < 0.1, "{trm:?} {full:?}");
    // None, none, moderate, severe, mild, mild.
    for row in [&full, &reprojection, &half] {
        assert!(row.flicker < 1e-6, "{row:?}");
    }
    assert!(bfi.flicker > interlace.flicker, "{bfi:?} {interlace:?}");
    assert!(interlace.flicker > ncsfi.flicker && interlace.flicker > trm.flicker);
    assert!(ncsfi.flicker > 1e-4 && trm.flicker > 1e-4);
    for row in &rows[1..6] {
        assert!((row.pixels_saved - 0.5).abs() < 1e-12);
    }
    assert!((trm.pixels_saved - 0.375).abs() < 1e-12);
}

proptest! {
    #[test]
    fn reduced_and_restored_frames_stay_in_the_range_of_the_picture(
        values in prop::collection::vec(0.0_f32..=1.0, 12 * 8),
        reduction in 0.1_f64..=1.0,
        gamma in 1.0_f32..3.0,
    ) {
        let picture = Plane::new(12, 8, values).unwrap();
        let size = reduced_size([12, 8], reduction).unwrap();
        let low = restored(&reduced(&picture, size, gamma), [12, 8], gamma);
        prop_assert!(low.values().iter().all(|light| (-1e-6..=1.0 + 1e-5).contains(light)));
        let mut trm = TemporalMultiplexing::new([12, 8], reduction, gamma).unwrap();
        let even = trm.even(&picture).unwrap();
        let odd = trm.odd(&trm.reduce(&picture)).unwrap();
        for frame in [even, odd] {
            prop_assert!(frame.values().iter().all(|light| (0.0..=1.0).contains(light)));
        }
    }
}
