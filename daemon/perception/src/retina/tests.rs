//! Laws of retinal images, and the claim that a higher rate is nearer to the real motion.

use proptest::prelude::*;

use super::*;

const WIDTH: usize = 96;

/// Light of a pattern that has moved by `shift` pixels, each pixel the mean of what it covers.
fn pattern(shift: f64) -> Plane {
    let mean = |at: f64| {
        let part = |at: f64| {
            let at = at - shift;
            0.5 + 0.3 * libm::sin(at * 0.7) + 0.2 * libm::copysign(1.0, libm::sin(at * 0.23))
        };
        (0..8).map(|sub| part(at + (f64::from(sub) + 0.5) / 8.0)).sum::<f64>() / 8.0
    };
    Plane::from_fn(WIDTH, 3, |x, _| mean(x as f64) as f32)
}

/// What a display at `rate` shows of motion of `speed` pixels per second, from time 0.
fn shown(rate: f64, speed: f64, seconds: f64) -> Vec<Plane> {
    let count = (rate * seconds).ceil() as usize;
    (0..count).map(|frame| pattern(speed * frame as f64 / rate)).collect()
}

fn retina(frames: &[Plane], rate: f64, speed: f64) -> Plane {
    let frames: Vec<_> = lit_frames(frames, rate, 1.0).collect();
    retinal_image(&frames, 0.05, FUSION_S, |_, _| [speed, 0.0]).unwrap()
}

/// Root of the mean square difference away from the left and right border.
fn difference(a: &Plane, b: &Plane) -> f64 {
    let inner = 24..WIDTH - 24;
    let square = |x: usize| {
        let way = f64::from(a.at(x as isize, 1) - b.at(x as isize, 1));
        way * way
    };
    libm::sqrt(inner.clone().map(square).sum::<f64>() / inner.len() as f64)
}

#[test]
fn a_higher_rate_is_nearer_to_real_motion_where_the_eye_follows() {
    for speed in [60.0, 240.0, 480.0] {
        let real = retina(&shown(2880.0, speed, 0.1), 2880.0, speed);
        let errors = [40.0, 60.0, 120.0, 240.0]
            .map(|rate| difference(&retina(&shown(rate, speed, 0.1), rate, speed), &real));
        assert!(errors.windows(2).all(|two| two[0] > two[1]), "{speed} px/s: {errors:?}");
    }
}

#[test]
fn frames_repeated_at_three_times_the_rate_are_the_same_picture_on_the_retina() {
    let frames = shown(40.0, 240.0, 0.1);
    let repeated: Vec<_> = frames.iter().flat_map(|frame| [frame, frame, frame]).cloned().collect();
    let once = retina(&frames, 40.0, 240.0);
    let thrice = retina(&repeated, 120.0, 240.0);
    assert!(difference(&once, &thrice) < 1e-6, "three repeats at 120 Hz are 40 Hz");
}

/// Columns over which an edge rises from 1 % to 99 % on the retina.
fn edge_width(rate: f64, persistence: f64, speed: f64) -> f64 {
    let edge = |shift: f64| {
        Plane::from_fn(256, 1, |x, _| (128.0 + shift - x as f64).clamp(0.0, 1.0) as f32)
    };
    let frames: Vec<_> = (0..24).map(|frame| edge(speed * f64::from(frame) / rate)).collect();
    let lit: Vec<_> = lit_frames(&frames, rate, persistence).collect();
    // Whole frames, so that no window sees a part of one.
    let window = (FUSION_S * rate).ceil() / rate;
    let image = retinal_image(&lit, 1.0 / rate, window, |_, _| [speed, 0.0]).unwrap();
    let full = f64::from(image.at(0, 0));
    (1..256)
        .map(|x| f64::from(image.at(x - 1, 0) - image.at(x, 0)) / full)
        .filter(|step| *step > 0.01)
        .count() as f64
}

#[test]
fn hold_blur_is_as_wide_as_the_way_of_the_eye_during_a_frame_and_persistence_shortens_it() {
    // Denes 2020, equation 8.4: v p / f, here 12, 6 and 3 pixels, to the pixel of the edge itself.
    for (rate, persistence, expected) in [(60.0, 1.0, 12.0), (120.0, 1.0, 6.0), (60.0, 0.25, 3.0)] {
        let found = edge_width(rate, persistence, 720.0);
        assert!((found - expected).abs() <= 1.5, "{rate} Hz {persistence}: {found} px");
    }
}

#[test]
fn the_convolution_of_equation_7_is_the_integral_for_whole_steps() {
    // Lee and Didyk 2018, equation 7: frames shifted back, added, and blurred by a box of v pixels.
    let (rate, step) = (120.0, 4.0);
    let frames: Vec<_> = (0..3).map(|frame| pattern(step * f64::from(frame))).collect();
    let lit: Vec<_> = lit_frames(&frames, rate, 1.0).collect();
    let image = retinal_image(&lit, 0.0, 3.0 / rate, |_, _| [step * rate, 0.0]).unwrap();
    for x in 24..WIDTH - 24 {
        // In the middle of the window, 1.5 frames in, the path of frame k starts 4 (k - 1.5) px
        // off.
        let mut sum = 0.0;
        for (index, frame) in frames.iter().enumerate() {
            let first = x as f64 + 0.5 + step * (index as f64 - 1.5);
            for tap in 0..400 {
                let at = (first + step * (f64::from(tap) + 0.5) / 400.0).floor();
                sum += f64::from(frame.at(at as isize, 1)) / 1200.0;
            }
        }
        assert!((f64::from(image.at(x as isize, 1)) - sum).abs() < 2e-3, "column {x}");
    }
}

#[test]
fn light_that_is_off_half_of_the_time_is_half_of_the_light() {
    let frames = vec![Plane::filled(8, 8, 0.8); 12];
    let lit: Vec<_> = lit_frames(&frames, 120.0, 0.5).collect();
    let image = retinal_image(&lit, 0.0, FUSION_S, |_, _| [300.0, -200.0]).unwrap();
    assert!(image.values().iter().all(|light| (light - 0.4).abs() < 1e-6));
}

#[test]
fn imperfect_pursuit_blurs_along_the_motion_alone() {
    let line = Plane::from_fn(64, 64, |x, _| f32::from(u8::from(x == 32)));
    let ppd = 56.0;
    let across = pursuit_blurred(&line, [20.0 * ppd, 0.0], ppd, Motion::Predictable).unwrap();
    let width = pursuit_width(20.0, Motion::Predictable) * ppd;
    assert!((f64::from(across.at(32, 10)) - 1.0 / width).abs() < 0.01, "a box of {width} px");
    let along = pursuit_blurred(&line, [0.0, 20.0 * ppd], ppd, Motion::Predictable).unwrap();
    assert!(along.zip(&line, |a, b| (a - b).abs()).max() < 1e-6);
    let still = pursuit_blurred(&line, [0.0; 2], ppd, Motion::Unpredictable).unwrap();
    assert_eq!(still, line);
}

#[test]
fn a_gaze_of_its_own_per_receptor_follows_objects_of_their_own() {
    let frames = shown(120.0, 240.0, 0.1);
    let lit: Vec<_> = lit_frames(&frames, 120.0, 1.0).collect();
    let split = |x: usize, _: usize| if x < WIDTH / 2 { [0.0, 0.0] } else { [240.0, 0.0] };
    let mixed = retinal_image(&lit, 0.05, FUSION_S, split).unwrap();
    let followed = retina(&frames, 120.0, 240.0);
    assert!((mixed.at(60, 1) - followed.at(60, 1)).abs() < 1e-7);
    assert!((30..46).any(|x| (mixed.at(x, 1) - followed.at(x, 1)).abs() > 0.02));
}

#[test]
fn what_cannot_be_collected_is_refused() {
    let (small, large) = (Plane::filled(2, 2, 0.0), Plane::filled(3, 2, 0.0));
    let lit = |light| LitFrame { light, from_s: 0.0, until_s: 1.0 };
    let still = |_, _| [0.0; 2];
    assert!(retinal_image(&[], 0.0, 1.0, still).is_err());
    assert!(retinal_image(&[lit(&small), lit(&large)], 0.0, 1.0, still).is_err());
    assert!(retinal_image(&[lit(&small)], 0.0, 0.0, still).is_err());
}

proptest! {
    #[test]
    fn a_still_picture_is_itself_and_light_neither_appears_nor_is_lost(
        values in prop::collection::vec(0.0_f32..1.0, 24),
        speed in prop::array::uniform2(-500.0_f64..500.0),
    ) {
        let plane = Plane::new(6, 4, values).unwrap();
        let frames = vec![plane.clone(); 4];
        let lit: Vec<_> = lit_frames(&frames, 100.0, 1.0).collect();
        let still = retinal_image(&lit, 0.0, 0.04, |_, _| [0.0; 2]).unwrap();
        prop_assert!(still.zip(&plane, |a, b| (a - b).abs()).max() < 1e-6);
        let moved = retinal_image(&lit, 0.0, 0.04, |_, _| speed).unwrap();
        let (low, high) = plane.values().iter().fold((1.0_f32, 0.0_f32), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
        prop_assert!(moved.values().iter().all(|&light| light >= low - 1e-5 && light <= high + 1e-5));
    }
}
