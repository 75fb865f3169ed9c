//! The numbers in `docs/perception.md` are what the models give.
//!
//! Each test computes the rows of one table and looks for them in the document, word for word.
//! Where a model changes, the message has the rows that the document must have.

use foreframe_perception::banding::{BandWidth, Gradient};
use foreframe_perception::detection::any;
use foreframe_perception::display::geometry::{Viewing, diagonal, distance_for_ppd};
use foreframe_perception::display::transfer::{pq_to_luminance, srgb_to_linear};
use foreframe_perception::display::{DisplayProfile, LcdModel};
use foreframe_perception::flicker::FlickerModel;
use foreframe_perception::motion_quality::schedule::{ScheduleDisplay, schedule};
use foreframe_perception::motion_quality::{Motion, Shown, judder, quality_difference};
use foreframe_perception::multiplex::Technique;
use foreframe_perception::multiplex::table::{Conditions, row};
use foreframe_perception::sensitivity::PyramidOfVisibility;
use foreframe_perception::window::{LineSpectrum, Window};

const DOCUMENT: &str = include_str!("../../../docs/perception.md");

/// Rows that the document lacks.
fn missing(document: &str, rows: &[String]) -> Vec<String> {
    rows.iter().filter(|row| !document.lines().any(|line| line == *row)).cloned().collect()
}

fn holds(rows: &[String]) {
    let missing = missing(DOCUMENT, rows);
    assert!(missing.is_empty(), "docs/perception.md must have\n{}", missing.join("\n"));
}

#[test]
fn a_row_with_another_number_would_be_found() {
    let rows = display_rows();
    holds(&rows);
    let changed = DOCUMENT.replacen("157.6", "157.7", 1);
    assert_eq!(missing(&changed, &rows).len(), 1);
}

fn display_rows() -> Vec<String> {
    let line = |profile: DisplayProfile| {
        let white = profile.model().luminance([1.0; 3]);
        let black = profile.model().black_xyz()[1];
        format!(
            "| `{}` | {} | {white:.1} | {:+.1} % | {}:1 | {:.0}:1 |",
            profile.name(),
            profile.peak_luminance(),
            (white / profile.peak_luminance() - 1.0) * 100.0,
            profile.dynamic_range(),
            profile.peak_luminance() / black,
        )
    };
    DisplayProfile::builtins().map(line).collect()
}

#[test]
fn inverses_are_as_good_as_the_document_says() {
    let mut worst = 0.0_f64;
    let mut pairs = 0;
    for profile in DisplayProfile::builtins() {
        for level in 0..=255_u8 {
            for channel in 0..3 {
                let mut codes = [0.5; 3];
                codes[channel] = f64::from(level) / 255.0;
                let back = profile.model().codes(profile.model().xyz(codes));
                worst = worst.max((back[channel] - codes[channel]).abs() * 255.0);
            }
        }
        for high in profile.high_refresh() {
            pairs += lcd_round_trips(&high.lcd);
        }
    }
    assert!(worst < 1e-3, "{worst} levels");
    assert_eq!(pairs, 3 * 3 * 86 * 86);
    holds(&["| inverse of every profile, level and channel | 0.5 level | below 0.001 level |"
        .to_owned()]);
}

fn lcd_round_trips(lcd: &LcdModel) -> u32 {
    let levels = || (0..=255_u8).step_by(3).map(|level| f64::from(level) / 255.0);
    let mut count = 0;
    for channel in 0..3 {
        for older in levels() {
            for newer in levels() {
                let found = lcd.newer(channel, lcd.merged(channel, newer, older), older);
                assert!((found.code - newer).abs() < 1e-9);
                count += 1;
            }
        }
    }
    count
}

#[test]
fn angles_are_as_in_the_document() {
    let asus = |distance| Viewing::new([2560, 1440], 27.0, distance).unwrap();
    holds(&[
        format!(
            "| 27 inch, 2560 columns, 75 cm | 56 ppd | {:.1} in the middle |",
            asus(75.0).ppd_at_centre()
        ),
        format!("| the same at 65 cm | 52 ppd | {:.1} over a row |", asus(65.0).ppd_over_width()),
        format!("| the same at 80 cm | 41 deg | {:.1} deg |", asus(80.0).width_deg()),
        format!("| the same at 108 cm | 30 deg | {:.1} deg |", asus(108.0).width_deg()),
        format!(
            "| 15.6 inch, 1920x1080, 120 ppd | 123 cm | {:.1} cm |",
            distance_for_ppd(diagonal([1920, 1080]), 15.6, 120.0)
        ),
        format!(
            "| 15.6 inch, 3840x2160, 120 ppd | 60 cm | {:.1} cm |",
            distance_for_ppd(diagonal([3840, 2160]), 15.6, 120.0)
        ),
    ]);
}

fn shown(refresh_hz: f64) -> Shown {
    Shown { refresh_hz, ppd: 2560.0 / 30.0, persistence: 1.0 }
}

#[test]
fn motion_quality_is_as_in_the_document() {
    let mut rows = Vec::new();
    for (name, motion) in
        [("predictable", Motion::Predictable), ("unpredictable", Motion::Unpredictable)]
    {
        for velocity in [15.0, 30.0, 45.0] {
            let at = |to| quality_difference(shown(to), shown(50.0), velocity, motion);
            let all =
                [60.0, 72.0, 85.0, 100.0, 120.0, 165.0].map(|to| format!("{:.2}", at(to).total()));
            let last = at(165.0);
            rows.push(format!(
                "| {velocity} deg/s, {name} | {} | {:.2} | {:.2} |",
                all.join(" | "),
                last.parallel,
                last.judder
            ));
        }
    }
    for rate in [50.0, 60.0, 72.0, 83.0] {
        let seen =
            |motion| judder::energy(rate, 30.0, motion) - judder::energy(2.0 * rate, 30.0, motion);
        let told = if rate < 70.0 { "told apart" } else { "not told apart" };
        rows.push(format!(
            "| {rate} Hz against {} Hz | {told} | {:.2} | {:.2} |",
            2.0 * rate,
            seen(Motion::Predictable),
            seen(Motion::Unpredictable)
        ));
    }
    holds(&rows);
}

#[test]
fn schedules_are_as_in_the_document() {
    let display = ScheduleDisplay {
        size_px: [2560, 1440],
        width_deg: 30.0,
        max_refresh_hz: 165.0,
        persistence: 1.0,
    };
    let mut rows = Vec::new();
    for (name, motion) in
        [("predictable", Motion::Predictable), ("unpredictable", Motion::Unpredictable)]
    {
        for budget in [28.0, 55.0, 221.0, 443.0] {
            let at = [1.0, 3.0, 5.0, 10.0, 20.0, 40.0, 60.0].map(|velocity| {
                let at = schedule(&display, budget * 1e6, velocity, motion).unwrap();
                format!("{:.0} Hz, {:.0} %", at.refresh_hz, at.scale * 100.0)
            });
            rows.push(format!("| {budget} MP/s, {name} | {} |", at.join(" | ")));
        }
    }
    holds(&rows);
}

#[test]
fn flicker_is_as_in_the_document() {
    let at =
        |rate, luminance| FlickerModel::new(rate, 52.0).unwrap().of_contrast(1.0, 1.625, luminance);
    let mut rows = vec![
        format!("| full contrast, 120 Hz, mean 78 cd/m2 | 0.25 | {:.3} |", at(120.0, 78.0)),
        format!("| full contrast, 120 Hz, mean 156 cd/m2 | 0.65 | {:.3} |", at(120.0, 156.0)),
    ];
    for rate in [60.0, 72.0, 90.0, 120.0, 144.0, 165.0] {
        rows.push(format!(
            "| full contrast, {rate} Hz, mean 156 cd/m2 | | {:.3} |",
            at(rate, 156.0)
        ));
    }
    rows.remove(5); // 120 Hz is there with its published value
    holds(&rows);
    assert!((any([0.25, 0.25]) - 0.4375).abs() < 1e-12);
}

#[test]
fn banding_is_as_in_the_document() {
    let grey = |luminance: f64| [0.9505, 1.0, 1.089].map(|value: f64| value * luminance);
    let ramp = |from: f64, to: f64| Gradient::new([from; 3], [to; 3]).unwrap();
    let bits = |gradient: Gradient, xyz: &dyn Fn([f64; 3]) -> [f64; 3]| {
        gradient.least_bits(BandWidth::Worst, 60.0, xyz).unwrap().unwrap()
    };
    let pq = |codes: [f64; 3]| grey(pq_to_luminance(codes[1]));
    let srgb = |codes: [f64; 3]| grey(100.0 * srgb_to_linear(codes[1]));
    holds(&[
        format!(
            "| PQ, codes 0.15 to 0.75 | more than 10, 12 do | {} |",
            bits(ramp(0.15, 0.75), &pq)
        ),
        format!("| sRGB, white 100 cd/m2, codes 0.5 to 1 | | {} |", bits(ramp(0.5, 1.0), &srgb)),
        format!("| sRGB, white 100 cd/m2, codes 0.2 to 0.5 | | {} |", bits(ramp(0.2, 0.5), &srgb)),
    ]);
}

#[test]
fn table_5_1_is_as_in_the_document() {
    let published = [
        ("full rate", ""),
        ("re-projection", "100 %, reduced, none, 50 % at most"),
        ("half frame rate", "100 %, strong, none, 50 %"),
        ("interlace", "50 %, reduced, moderate, 50 %"),
        ("BFI", "50 %, reduced, severe, 50 %"),
        ("NCSFI", "100 %, reduced, mild, 50 %"),
        ("TRM, 1/2", "100 %, reduced, mild, 37-49 %"),
    ];
    let window = Window::new(&PyramidOfVisibility::ROBSON, 100.0).unwrap();
    let rows: Vec<_> = Technique::ALL
        .into_iter()
        .zip(published)
        .map(|(technique, (name, published))| {
            let row = row(technique, &Conditions::DEFAULT).unwrap();
            let spectrum = LineSpectrum::new(technique, 120.0, 56.0, 20.0, 1.0).unwrap();
            format!(
                "| {name} | {published} | {:.0} % | {:.1} | {:.3} | {:.4} | {:.1} % |",
                row.peak_luminance * 100.0,
                row.blur_px,
                row.flicker,
                spectrum.visible_copies(&window),
                row.pixels_saved * 100.0
            )
        })
        .collect();
    holds(&rows);
}
