//! The report as one self-contained page: chart, tables, error over time, tile classes as columns
//! after Falchetto et al. 2007 (figures 4.2 and 4.3), and a viewer to flip between truth, what was
//! predicted, the error, and the models by which the key went on.

use foreframe_engine::Plane;
use serde::Serialize;

use super::chart::chart;
use super::flips::{FlipFrame, RUNGS, scale_of};
use super::picture::Srgb8;
use super::report::{CaptureScore, MethodScore, Report};
use crate::draw::Drawing;
use crate::draw::palette::{Rgb, heat, rung_color};
use crate::html::{Page, png_url};
use crate::pictures::{
    Across, Column, ColumnSheet, Line, Look, Panel, PictureError, Sheet, columns, small_multiples,
};

/// Pictures on a page, truths and predictions together: a few megabytes. Maps are small.
const MOST_PICTURES: usize = 96;
/// Frames of one capture to flip through, at least and at most.
const FRAMES: [usize; 2] = [2, 6];
/// Errors in the viewer are shown this many times as large.
const ERROR_GAIN: u32 = 4;
/// Highest PSNR that is drawn over time, dB.
const HIGHEST_DB: f64 = 60.0;

/// Colours of the tile classes, worst first: dark red over yellow to blue.
const CLASS_COLORS: [Rgb; 6] =
    [[120, 20, 40], [213, 94, 0], [240, 190, 80], [190, 220, 220], [86, 180, 233], [0, 114, 178]];

/// How many frames of each capture to keep for a page with so many captures and rows of methods.
#[must_use]
pub fn frames_to_keep(captures: usize, methods: usize) -> usize {
    (MOST_PICTURES / (captures * (methods + 1)).max(1)).clamp(FRAMES[0], FRAMES[1])
}

/// Data of the viewer.
#[derive(Serialize)]
struct Flips {
    captures: Vec<FlipCapture>,
    heat: Vec<[u8; 4]>,
    gain: u32,
    rungs: Vec<Model>,
}

/// A model of how surfaces go on, and its colour in the map; none where they are held.
#[derive(Serialize)]
struct Model {
    name: &'static str,
    color: Option<Rgb>,
}

#[derive(Serialize)]
struct FlipCapture {
    name: String,
    methods: Vec<String>,
    frames: Vec<Flip>,
}

#[derive(Serialize)]
struct Flip {
    frame: usize,
    truth: String,
    shown: Vec<String>,
    rungs: Vec<String>,
}

/// Writes the page of a report.
///
/// # Errors
/// If a picture cannot be encoded.
pub fn page(report: &Report) -> anyhow::Result<String> {
    let mut page = Page::new("Foreframe: score");
    page.text(&format!(
        "Every frame between the keys was predicted and compared with the truth. {} threads, {}. \
         PSNR in dB, flicker in 8-bit levels, times in ms of the engine; * is given the next key too.",
        report.threads, report.backend
    ));
    add(&mut page, chart(report));
    if report.captures.len() > 1 {
        page.heading(&format!("Mean of {} captures", report.captures.len()));
        let rows: Vec<_> = report
            .mean
            .iter()
            .map(|mean| {
                let name = name_of(mean.name, mean.interpolates, &mean.backend, report);
                let values = [
                    (mean.psnr_rgb_db, 2),
                    (mean.psnr_y_db, 2),
                    (mean.ssim, 4),
                    (mean.flip, 4),
                    (mean.worst_tile_psnr_db, 2),
                    (mean.error_flicker, 3),
                    (mean.ms_per_frame, 2),
                    (mean.ms_per_key, 2),
                ];
                row(name, &values)
            })
            .collect();
        page.table(&HEAD, &rows);
    }
    let kept: usize = report.captures.iter().map(|capture| capture.flips.len()).sum();
    if kept > 0 {
        page.heading("Flip through");
        let all: u64 = report.captures.iter().map(frames_of).sum();
        let scales: Vec<_> = report.captures.iter().map(scale_note).collect();
        page.text(&format!(
            "{kept} of {all} predicted frames are here, evenly spread; the others are left out to \
             keep the page small. {}. Errors are the largest of the three channels, times {ERROR_GAIN}. \
             The rung map lies over the truth in grey: by which model each part of the newest key \
             goes on, in its place in the key.",
            scales.join("; ")
        ));
        page.markup(include_str!("viewer.html"));
    }
    for capture in &report.captures {
        let CaptureScore { name, width, height, ratio, keys, left_out, .. } = capture;
        page.heading(name);
        page.text(&format!(
            "{width}x{height}, 1 of {ratio} frames is a key, {keys} keys, {left_out} frames left out after cuts."
        ));
        let rows: Vec<_> = capture
            .methods
            .iter()
            .map(|method| {
                let name = name_of(method.name, method.interpolates, &method.backend, report);
                let values = [
                    (method.psnr_rgb_db, 2),
                    (method.psnr_y_db, 2),
                    (method.ssim, 4),
                    (method.flip, 4),
                    (method.worst_tile_psnr_db, 2),
                    (method.error_flicker, 3),
                    (method.ms_per_frame, 2),
                    (method.ms_per_key, 2),
                ];
                row(name, &values)
            })
            .collect();
        page.table(&HEAD, &rows);
        add(&mut page, over_time(capture));
        add(&mut page, tile_classes(capture));
    }
    if kept > 0 {
        page.data("flips", &flips(report)?)?;
        page.script(include_str!("viewer.js"));
    }
    Ok(page.finish())
}

const HEAD: [&str; 9] =
    ["method", "RGB", "Y", "SSIM", "FLIP", "worst tile", "flicker", "ms/frame", "ms/key"];

/// A drawing, or why there is none.
fn add(page: &mut Page, drawing: Result<Drawing, PictureError>) {
    match drawing {
        Ok(drawing) => page.drawing(&drawing),
        Err(why) => page.text(&format!("No chart: {why}.")),
    }
}

fn row(name: String, values: &[(Option<f64>, usize)]) -> Vec<String> {
    let number = |(value, digits): &(Option<f64>, usize)| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
    };
    std::iter::once(name).chain(values.iter().map(number)).collect()
}

fn name_of(name: &str, interpolates: bool, backend: &str, report: &Report) -> String {
    let mark = if interpolates { "*" } else { "" };
    let on = if backend == report.backend { String::new() } else { format!(" on {backend}") };
    format!("{name}{mark}{on}")
}

fn frames_of(capture: &CaptureScore) -> u64 {
    capture.methods.first().map_or(0, |method| method.frames)
}

fn scale_note(capture: &CaptureScore) -> String {
    match scale_of(capture.width) {
        1 => format!("{} in full size", capture.name),
        scale => format!("{} at 1/{scale} of its size", capture.name),
    }
}

/// PSNR and FLIP of every frame.
fn over_time(capture: &CaptureScore) -> Result<Drawing, PictureError> {
    // Every backend makes the same frames.
    let mut methods: Vec<&MethodScore> = Vec::new();
    for method in &capture.methods {
        if methods.iter().all(|other| other.name != method.name) {
            methods.push(method);
        }
    }
    let names: Vec<_> = methods.iter().map(|method| method.name).collect();
    let looks = Look::of_methods(&names);
    let panel = |title: &str, value: fn(&super::report::FramePoint) -> f64| Panel {
        title: title.to_owned(),
        across: "frame".to_owned(),
        axis: Across::Linear,
        lines: methods
            .iter()
            .zip(&looks)
            .map(|(method, look)| {
                let point = |point: &_| {
                    let &super::report::FramePoint { frame, .. } = point;
                    [frame as f64, value(point)]
                };
                let points = method.by_frame.iter().map(point).collect();
                Line { look: *look, points, is_marked: false }
            })
            .collect(),
        points: Vec::new(),
    };
    small_multiples(&Sheet {
        title: format!("{}: error over time", capture.name),
        notes: Vec::new(),
        legend: names.iter().map(|name| (*name).to_owned()).zip(looks.iter().copied()).collect(),
        panels: vec![
            panel("PSNR in dB, higher is better", |point| point.psnr_rgb_db.min(HIGHEST_DB)),
            panel("FLIP, lower is better", |point| point.flip),
        ],
        columns: 2,
        panel_px: [600.0, 240.0],
    })
}

/// A column per method of how many tiles are how good.
fn tile_classes(capture: &CaptureScore) -> Result<Drawing, PictureError> {
    let mut sheet = ColumnSheet {
        title: format!("{}: 4x4 tiles by PSNR_Y, after Falchetto et al. 2007", capture.name),
        classes: [
            "very bad, to 20 dB",
            "bad, 25",
            "quite good, 30",
            "good, 35",
            "very good, 40",
            "excellent",
        ]
        .into_iter()
        .zip(CLASS_COLORS)
        .collect(),
        columns: Vec::new(),
    };
    for method in &capture.methods {
        let Some(tiles) = method.tile_classes_percent else { continue };
        let is_new = sheet.columns.iter().all(|column| column.name != method.name);
        if is_new {
            let percent = vec![
                tiles.verybad,
                tiles.bad,
                tiles.quitegood,
                tiles.good,
                tiles.verygood,
                tiles.excellent,
            ];
            sheet.columns.push(Column { name: method.name.to_owned(), percent });
        }
    }
    columns(&sheet)
}

fn flips(report: &Report) -> anyhow::Result<Flips> {
    let capture = |capture: &CaptureScore| {
        let name = |method: &MethodScore| {
            name_of(method.name, method.interpolates, &method.backend, report)
        };
        let flip = |flip: &FlipFrame| {
            let shown = flip.shown.iter().map(|shown| url(&difference(shown, &flip.truth)));
            let rungs = flip.rungs.iter().map(|map| url(&as_grey(map)));
            Ok(Flip {
                frame: flip.frame,
                truth: url(&flip.truth)?,
                shown: shown.collect::<anyhow::Result<_>>()?,
                rungs: rungs.collect::<anyhow::Result<_>>()?,
            })
        };
        Ok(FlipCapture {
            name: capture.name.clone(),
            methods: capture.methods.iter().map(name).collect(),
            frames: capture.flips.iter().map(flip).collect::<anyhow::Result<_>>()?,
        })
    };
    let with_frames = report.captures.iter().filter(|capture| !capture.flips.is_empty());
    let heat = (0..=255).map(|error| {
        let [red, green, blue] = heat(error);
        [red, green, blue, 255]
    });
    Ok(Flips {
        captures: with_frames.map(capture).collect::<anyhow::Result<_>>()?,
        heat: heat.collect(),
        gain: ERROR_GAIN,
        rungs: RUNGS.map(|rung| Model { name: rung.name(), color: rung_color(rung) }).into(),
    })
}

/// Shown minus truth plus 128, modulo 256, by channel.
fn difference(shown: &Srgb8, truth: &Srgb8) -> Srgb8 {
    let pixel = |(shown, truth): (&[u8; 3], &[u8; 3])| {
        std::array::from_fn(|c| shown[c].wrapping_sub(truth[c]).wrapping_add(128))
    };
    let pixels = shown.data().iter().zip(truth.data()).map(pixel).collect();
    Srgb8::from_vec(truth.width(), truth.height(), pixels)
}

/// A map as a picture whose every channel is its number.
fn as_grey(map: &Plane<u8>) -> Srgb8 {
    let pixels = map.data().iter().map(|&number| [number; 3]).collect();
    Srgb8::from_vec(map.width(), map.height(), pixels)
}

fn url(picture: &Srgb8) -> anyhow::Result<String> {
    png_url(picture.width(), picture.height(), picture.data().as_flattened())
}

#[cfg(test)]
mod tests;
