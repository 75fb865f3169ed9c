//! What figures 2.7 and 5.6 of Denes 2020 show.

use super::*;

const PPD: f64 = 56.0;

fn spectrum(technique: Technique, refresh_hz: f64, velocity: f64) -> LineSpectrum {
    LineSpectrum::new(technique, refresh_hz, PPD, velocity, 1.0).unwrap()
}

fn window() -> Window {
    Window::new(&PyramidOfVisibility::ROBSON, 100.0).unwrap()
}

/// The harmonic by summing over time, frame by frame: what the closed form stands for.
fn by_sum(technique: Technique, m: i32, cpd: f64) -> f64 {
    let (refresh, velocity) = (120.0, 20.0);
    let spectrum = spectrum(technique, refresh, velocity);
    let steps = 20_000;
    let (mut real, mut imaginary) = (0.0, 0.0);
    for step in 0..steps {
        let time = 2.0 / refresh * (f64::from(step) + 0.5) / f64::from(steps);
        let index = (time * refresh) as usize;
        let frame = spectrum.frames[index];
        // Where the line is on the retina: its place in the frame minus that of the gaze.
        let drawn_at = velocity * index as f64 / refresh - frame.behind_deg;
        let x = drawn_at - velocity * time;
        let size = frame.sharp + frame.blurred * gaussian(cpd, frame.sigma_deg);
        let phase = -2.0 * PI * (cpd * x + spectrum.harmonic_hz(m) * time);
        real += size * libm::cos(phase) / f64::from(steps);
        imaginary += size * libm::sin(phase) / f64::from(steps);
    }
    libm::hypot(real, imaginary)
}

#[test]
fn the_closed_form_is_the_transform_of_the_retinal_signal() {
    for technique in Technique::ALL {
        for (m, cpd) in [(0, 0.0), (0, 7.0), (1, 3.0), (2, 5.0), (3, 11.0)] {
            let closed = spectrum(technique, 120.0, 20.0).amplitude(m, cpd);
            let summed = by_sum(technique, m, cpd);
            assert!((closed - summed).abs() < 1e-3, "{technique:?} {m} {cpd}: {closed} {summed}");
        }
    }
}

#[test]
fn copies_lie_at_the_refresh_rate_and_peak_at_rate_over_velocity() {
    // Denes 2020, equation 8.17.
    let full = spectrum(Technique::Full, 120.0, 20.0);
    assert!(full.amplitude(1, 6.0) < 1e-12, "no copy at half of the rate");
    assert!((full.amplitude(2, 120.0 / 20.0) - 1.0).abs() < 1e-9);
    assert!((full.harmonic_hz(2) - 120.0).abs() < 1e-12);
    let half = spectrum(Technique::HalfRate, 120.0, 20.0);
    assert!((half.amplitude(1, 60.0 / 20.0) - 1.0).abs() < 1e-9);
}

#[test]
fn half_the_rate_is_the_spectrum_of_a_display_of_half_the_rate() {
    let half = spectrum(Technique::HalfRate, 120.0, 20.0);
    let slow = spectrum(Technique::Full, 60.0, 20.0);
    for cpd in [0.0, 1.0, 4.0, 9.5] {
        assert!((half.amplitude(0, cpd) - slow.amplitude(0, cpd)).abs() < 1e-12);
        assert!((half.amplitude(1, cpd) - slow.amplitude(2, cpd)).abs() < 1e-12);
    }
}

#[test]
fn sharpness_has_the_published_order() {
    // Figure 5.6, third column: black frames and multiplexing as sharp as 120 Hz, smooth frames
    // between that and 60 Hz.
    let sharpness = |technique| spectrum(technique, 120.0, 20.0).half_amplitude_cpd(60.0).unwrap();
    let full = sharpness(Technique::Full);
    assert!((sharpness(Technique::BlackFrames) - full).abs() < 0.05);
    assert!((sharpness(Technique::Multiplexing(0.5)) - full).abs() < 0.05);
    let half = sharpness(Technique::HalfRate);
    assert!((half / full - 0.5).abs() < 0.01);
    let smooth = sharpness(Technique::SmoothFrames);
    assert!(smooth > half && smooth < full, "{half} {smooth} {full}");
}

#[test]
fn multiplexing_weakens_every_second_copy_and_the_others_do_not() {
    // Below figure 5.6: temporal aliases of black and smooth frames are comparable to 60 Hz, those
    // of multiplexing are much less visible.
    let window = window();
    let copies = |technique| spectrum(technique, 120.0, 20.0).visible_copies(&window);
    let trm = copies(Technique::Multiplexing(0.5));
    assert!(copies(Technique::Full) < 1e-9, "120 Hz is outside the window");
    for technique in [Technique::HalfRate, Technique::BlackFrames, Technique::SmoothFrames] {
        assert!(copies(technique) > 2.0 * trm, "{technique:?}: {} {trm}", copies(technique));
    }
    let at = |technique, m| spectrum(technique, 120.0, 20.0).amplitude(m, 3.0);
    let trm = |m| at(Technique::Multiplexing(0.5), m);
    assert!(trm(1) < 0.3 * at(Technique::HalfRate, 1));
    assert!((trm(2) - at(Technique::Full, 2)).abs() < 1e-12, "the second copy is as at 120 Hz");
}

#[test]
fn low_persistence_keeps_the_line_sharp_and_its_copies_strong() {
    // Figure 2.7, bottom row: the duty cycle widens the spectrum and leaves copies in place.
    let lit =
        |persistence| LineSpectrum::new(Technique::Full, 60.0, PPD, 20.0, persistence).unwrap();
    let (hold, strobe) = (lit(1.0), lit(0.25));
    let sharpness = |spectrum: &LineSpectrum| spectrum.half_amplitude_cpd(60.0).unwrap();
    assert!((sharpness(&strobe) / sharpness(&hold) - 4.0).abs() < 0.02);
    assert!((strobe.amplitude(0, 0.0) - 0.25).abs() < 1e-12, "Talbot and Plateau");
    assert!(strobe.amplitude(2, 0.0) > 0.2 && hold.amplitude(2, 0.0) < 1e-12, "it flickers");
}

#[test]
fn the_window_is_a_diamond_that_grows_with_light() {
    let window = window();
    assert!(window.contains(0.0, window.cpd * 0.99) && !window.contains(1.0, window.cpd * 0.99));
    assert!((window.relative(0.0, 0.0) - 1.0).abs() < 1e-12);
    assert!(window.relative(window.hz, 0.0).abs() < 1e-12);
    let bright = Window::new(&PyramidOfVisibility::ROBSON, 1000.0).unwrap();
    assert!(bright.hz > window.hz && bright.cpd > window.cpd);
    assert!(Window::new(&PyramidOfVisibility::ROBSON, 1e-9).is_err());
}

#[test]
fn numbers_out_of_range_are_refused() {
    let ask = |refresh, ppd, velocity, persistence| {
        LineSpectrum::new(Technique::Full, refresh, ppd, velocity, persistence)
    };
    assert!(ask(0.0, 56.0, 10.0, 1.0).is_err() && ask(60.0, 0.0, 10.0, 1.0).is_err());
    assert!(ask(60.0, 56.0, -1.0, 1.0).is_err() && ask(60.0, 56.0, 10.0, 1.1).is_err());
}
