//! `foreframe perception displays`: the built-in profiles.

use std::fmt::Write as _;

use foreframe_perception::display::{DisplayProfile, Technology};
use serde::Serialize;

use super::round;
use crate::output::Output;

#[derive(Serialize, Debug)]
struct Listing {
    displays: Vec<Line>,
}

#[derive(Serialize, Debug)]
struct Line {
    name: String,
    title: String,
    source: String,
    technology: &'static str,
    width: u32,
    height: u32,
    refresh_hz: f64,
    persistence: f64,
    peak_luminance: f64,
    /// Luminance of white by the model.
    model_peak_luminance: f64,
    /// Rates at which the memory of its crystals is known.
    lcd_model_hz: Vec<f64>,
}

pub(super) fn run(output: &Output) -> anyhow::Result<()> {
    let line = |profile: DisplayProfile| Line {
        name: profile.name().to_owned(),
        title: profile.title().to_owned(),
        source: profile.source().to_owned(),
        technology: match profile.technology() {
            Technology::Lcd => "lcd",
            Technology::Oled => "oled",
        },
        width: profile.size_px()[0],
        height: profile.size_px()[1],
        refresh_hz: profile.refresh_hz(),
        persistence: profile.persistence(),
        peak_luminance: profile.peak_luminance(),
        model_peak_luminance: round(profile.model().luminance([1.0; 3])),
        lcd_model_hz: profile.high_refresh().iter().map(|high| high.refresh_hz).collect(),
    };
    let listing = Listing { displays: DisplayProfile::builtins().map(line).collect() };
    let mut text = String::new();
    for line in &listing.displays {
        let Line { name, title, technology, width, height, refresh_hz, peak_luminance, .. } = line;
        let _infallible = writeln!(
            text,
            "{name:24} {title}: {technology}, {width}x{height}, {refresh_hz} Hz, {peak_luminance} cd/m2",
        );
    }
    output.result(&listing, &text)
}
