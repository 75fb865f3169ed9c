//! What `foreframe score` prints: one JSON object with fixed names, or a table.

use std::fmt::Write as _;

use serde::Serialize;

use super::flips::FlipFrame;
use super::metrics::TileClasses;
use super::retina::RetinaScore;

/// The whole result.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// What the engine ran on.
    pub backend: String,
    /// Threads of the engine.
    pub threads: usize,
    /// One entry per capture, in the order given.
    pub captures: Vec<CaptureScore>,
    /// Plain mean over the captures, one entry per method.
    pub mean: Vec<MeanScore>,
}

/// One capture.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct CaptureScore {
    /// Name of what was recorded.
    pub name: String,
    /// Columns of the colour plane.
    pub width: u32,
    /// Rows of the colour plane.
    pub height: u32,
    /// Frames from key to key.
    pub ratio: usize,
    /// How many keys.
    pub keys: usize,
    /// Frames from a cut to the next key, which are not predicted.
    pub left_out: usize,
    /// Where the motion of the keys came from.
    pub key_motion: MotionCounts,
    /// One entry per method and backend.
    pub methods: Vec<MethodScore>,
    /// Pictures for a flip viewer, where they were asked for.
    #[serde(skip)]
    pub flips: Vec<FlipFrame>,
}

/// How many keys have motion from where.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct MotionCounts {
    /// From the capture's own field of that step.
    pub own: usize,
    /// From the fields of the frames between.
    pub composed: usize,
    /// None.
    pub missing: usize,
}

/// One method on one capture. Means over all predicted frames; None where there were none.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MethodScore {
    /// Name of the method.
    pub name: &'static str,
    /// What the engine ran on in the end, as it says.
    pub backend: String,
    /// Whether it was given the key after the frame.
    pub interpolates: bool,
    /// Whether it was told where the camera is at the time of each frame, after the key.
    pub late_camera: bool,
    /// Predicted frames.
    pub frames: u64,
    /// The digest of all of them, 32 hexadecimal digits: the same on every machine.
    pub digest: String,
    /// See [`super::metrics::psnr_rgb_db`].
    pub psnr_rgb_db: Option<f64>,
    /// See [`super::metrics::psnr_y_db`].
    pub psnr_y_db: Option<f64>,
    /// The same, by place after the key.
    pub psnr_y_by_phase_db: Vec<Option<f64>>,
    /// See [`super::metrics::ssim`].
    pub ssim: Option<f64>,
    /// See [`super::metrics::flip`].
    pub flip: Option<f64>,
    /// The worst tile of all frames.
    pub worst_tile_psnr_db: Option<f64>,
    /// The tiles of all frames by class.
    pub tile_classes_percent: Option<TileClasses>,
    /// See [`super::metrics::error_flicker`].
    pub error_flicker: Option<f64>,
    /// Work of the engine per in-between frame.
    pub ms_per_frame: Option<f64>,
    /// Work of the engine per key frame.
    pub ms_per_key: Option<f64>,
    /// How close the frames come to the true ones on the retina, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retina: Option<RetinaScore>,
    /// Every predicted frame, in order.
    #[serde(skip)]
    pub by_frame: Vec<FramePoint>,
}

/// How good one predicted frame is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FramePoint {
    /// Its number in the recording.
    pub frame: usize,
    /// See [`super::metrics::psnr_rgb_db`].
    pub psnr_rgb_db: f64,
    /// See [`super::metrics::flip`].
    pub flip: f64,
}

/// One method, over all captures on which it predicted anything.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MeanScore {
    /// Name of the method.
    pub name: &'static str,
    /// What the engine ran on, on the first capture.
    pub backend: String,
    /// Whether it was given the key after the frame.
    pub interpolates: bool,
    /// Mean of the captures' means.
    pub psnr_rgb_db: Option<f64>,
    /// Mean of the captures' means.
    pub psnr_y_db: Option<f64>,
    /// Mean of the captures' means.
    pub ssim: Option<f64>,
    /// Mean of the captures' means.
    pub flip: Option<f64>,
    /// The worst tile of all captures.
    pub worst_tile_psnr_db: Option<f64>,
    /// Mean of the captures' means.
    pub error_flicker: Option<f64>,
    /// Mean of the captures' means.
    pub ms_per_frame: Option<f64>,
    /// Mean of the captures' means.
    pub ms_per_key: Option<f64>,
}

impl Report {
    /// Adds the means to the captures' scores. Every capture has the same methods.
    #[must_use]
    pub fn new(threads: usize, captures: Vec<CaptureScore>) -> Self {
        // One that gave up its GPU on the way says so here.
        let mut backends: Vec<&str> = Vec::new();
        for method in captures.iter().flat_map(|capture| &capture.methods) {
            if !backends.contains(&method.backend.as_str()) {
                backends.push(&method.backend);
            }
        }
        let backend = backends.join(", ");
        let methods = captures.first().map_or(0, |capture| capture.methods.len());
        let mean = (0..methods)
            .map(|method| mean_score(captures.iter().map(|capture| &capture.methods[method])))
            .collect();
        Self { backend, threads, captures, mean }
    }

    /// One table per capture, and one of the means where there are several captures.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for capture in &self.captures {
            let CaptureScore { name, width, height, ratio, keys, left_out, key_motion, .. } =
                capture;
            push_line(
                &mut text,
                &format!(
                    "{name}: {width}x{height}, 1 of {ratio} frames is a key, {keys} keys (motion: \
                     {} own, {} composed, {} missing), {left_out} frames left out after cuts",
                    key_motion.own, key_motion.composed, key_motion.missing
                ),
            );
            push_line(&mut text, HEADER);
            for method in &capture.methods {
                push_line(&mut text, &(method_row(method) + &on(&self.backend, &method.backend)));
            }
            if capture.methods.iter().any(|method| method.retina.is_some()) {
                push_line(&mut text, RETINA_HEADER);
                for method in &capture.methods {
                    push_line(&mut text, &retina_row(method));
                }
            }
            push_line(&mut text, "");
        }
        if self.captures.len() > 1 {
            push_line(&mut text, &format!("mean of {} captures", self.captures.len()));
            push_line(&mut text, HEADER);
            for mean in &self.mean {
                push_line(&mut text, &(mean_row(mean) + &on(&self.backend, &mean.backend)));
            }
            push_line(&mut text, "");
        }
        push_line(
            &mut text,
            "PSNR and the worst tile in dB, flicker in 8-bit levels, times in ms of the engine; \
             * is given the next key too",
        );
        text
    }
}

const HEADER: &str = "  method   frames    RGB      Y   SSIM   FLIP  worst  flicker  ms/frame  \
                      ms/key  Y by phase";

const RETINA_HEADER: &str = "  on the retina  windows     RGB    SSIM  keys held: RGB    SSIM";

fn retina_row(score: &MethodScore) -> String {
    let windows = score.retina.map_or(0, |retina| retina.windows);
    let value = |pick: fn(&RetinaScore) -> f64| score.retina.as_ref().map(pick);
    format!(
        "  {:<13} {windows:>8} {} {} {} {}",
        score.name,
        number(value(|retina| retina.psnr_rgb_db), 7, 2),
        number(value(|retina| retina.ssim), 7, 4),
        number(value(|retina| retina.keys_psnr_rgb_db), 15, 2),
        number(value(|retina| retina.keys_ssim), 7, 4),
    )
}

/// What a row ran on, where not all ran on the same.
fn on(all: &str, backend: &str) -> String {
    if all == backend { String::new() } else { format!("  {backend}") }
}

fn push_line(text: &mut String, line: &str) {
    text.push_str(line);
    text.push('\n');
}

fn method_row(score: &MethodScore) -> String {
    let mark = match (score.interpolates, score.late_camera) {
        (true, _) => "*",
        (false, true) => "+",
        (false, false) => "",
    };
    let mut row = columns(
        &format!("{}{mark}", score.name),
        &score.frames.to_string(),
        [
            score.psnr_rgb_db,
            score.psnr_y_db,
            score.ssim,
            score.flip,
            score.worst_tile_psnr_db,
            score.error_flicker,
            score.ms_per_frame,
            score.ms_per_key,
        ],
    );
    for phase in &score.psnr_y_by_phase_db {
        let _infallible = write!(row, " {}", number(*phase, 5, 2));
    }
    row
}

fn mean_row(score: &MeanScore) -> String {
    columns(
        score.name,
        "",
        [
            score.psnr_rgb_db,
            score.psnr_y_db,
            score.ssim,
            score.flip,
            score.worst_tile_psnr_db,
            score.error_flicker,
            score.ms_per_frame,
            score.ms_per_key,
        ],
    )
}

fn columns(name: &str, frames: &str, values: [Option<f64>; 8]) -> String {
    let widths = [(6, 2), (6, 2), (6, 4), (6, 4), (6, 2), (8, 3), (9, 2), (7, 2)];
    let mut row = format!("  {name:<8} {frames:>6}");
    for (value, (width, digits)) in values.into_iter().zip(widths) {
        let _infallible = write!(row, " {}", number(value, width, digits));
    }
    row.push(' ');
    row
}

fn number(value: Option<f64>, width: usize, digits: usize) -> String {
    value.map_or_else(|| format!("{:>width$}", "-"), |v| format!("{v:width$.digits$}"))
}

fn mean_score<'a>(scores: impl Iterator<Item = &'a MethodScore> + Clone) -> MeanScore {
    let values = |field: fn(&MethodScore) -> Option<f64>| scores.clone().filter_map(field);
    let mean = |field| {
        let count = values(field).count();
        (count > 0).then(|| values(field).sum::<f64>() / count as f64)
    };
    MeanScore {
        name: scores.clone().next().map_or("", |score| score.name),
        backend: scores.clone().next().map_or_else(String::new, |score| score.backend.clone()),
        interpolates: scores.clone().next().is_some_and(|score| score.interpolates),
        psnr_rgb_db: mean(|score| score.psnr_rgb_db),
        psnr_y_db: mean(|score| score.psnr_y_db),
        ssim: mean(|score| score.ssim),
        flip: mean(|score| score.flip),
        worst_tile_psnr_db: values(|score| score.worst_tile_psnr_db).reduce(f64::min),
        error_flicker: mean(|score| score.error_flicker),
        ms_per_frame: mean(|score| score.ms_per_frame),
        ms_per_key: mean(|score| score.ms_per_key),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) fn score(psnr: Option<f64>) -> MethodScore {
        MethodScore {
            name: "linear",
            backend: "cpu".to_owned(),
            interpolates: false,
            late_camera: false,
            digest: String::new(),
            frames: 36,
            psnr_rgb_db: psnr,
            psnr_y_db: psnr,
            psnr_y_by_phase_db: vec![psnr, None],
            ssim: Some(0.95),
            flip: Some(0.04),
            worst_tile_psnr_db: psnr,
            tile_classes_percent: Some(TileClasses::default()),
            error_flicker: Some(0.8),
            ms_per_frame: Some(3.1),
            ms_per_key: Some(2.4),
            retina: None,
            by_frame: Vec::new(),
        }
    }

    pub(in super::super) fn capture(psnr: Option<f64>) -> CaptureScore {
        CaptureScore {
            name: "atrium".into(),
            width: 640,
            height: 360,
            ratio: 3,
            keys: 13,
            left_out: 2,
            key_motion: MotionCounts { own: 1, composed: 10, missing: 2 },
            methods: vec![score(psnr)],
            flips: Vec::new(),
        }
    }

    fn keys_of(value: &serde_json::Value) -> Vec<&str> {
        let mut keys: Vec<_> = value.as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        keys
    }

    #[test]
    fn the_backend_is_what_the_engines_say_each_named_once() {
        let on = |backend: &&str| MethodScore { backend: (*backend).to_owned(), ..score(None) };
        let report = |names: &[&str]| {
            let methods = names.iter().map(on).collect();
            Report::new(1, vec![CaptureScore { methods, ..capture(None) }])
        };
        assert_eq!(report(&["cpu", "cpu"]).backend, "cpu");
        let mixed = report(&["gpu:a", "cpu", "gpu:a"]);
        assert_eq!(mixed.backend, "gpu:a, cpu");
        assert!(mixed.to_text().contains("  gpu:a\n"), "{}", mixed.to_text());
    }

    #[test]
    fn the_fixed_json_names_are_there() {
        let report = Report::new(2, vec![capture(Some(33.0))]);
        let json = serde_json::to_value(&report).unwrap();
        let first = &json["captures"][0];
        for name in ["name", "width", "height", "ratio", "keys", "methods"] {
            assert!(keys_of(first).contains(&name), "{name}");
        }
        let mut expected = vec![
            "name",
            "backend",
            "digest",
            "interpolates",
            "late_camera",
            "frames",
            "psnr_rgb_db",
            "psnr_y_db",
            "psnr_y_by_phase_db",
            "ssim",
            "flip",
            "worst_tile_psnr_db",
            "tile_classes_percent",
            "error_flicker",
            "ms_per_frame",
            "ms_per_key",
        ];
        expected.sort_unstable();
        assert_eq!(keys_of(&first["methods"][0]), expected);
        assert_eq!(
            keys_of(&first["methods"][0]["tile_classes_percent"]),
            ["bad", "excellent", "good", "quitegood", "verybad", "verygood"]
        );
    }

    #[test]
    fn the_mean_is_over_captures_that_have_a_value_and_the_worst_tile_is_the_worst() {
        let captures = vec![capture(Some(30.0)), capture(Some(20.0)), capture(None)];
        let mean = &Report::new(2, captures).mean[0];
        assert_eq!(mean.psnr_y_db, Some(25.0));
        assert_eq!(mean.worst_tile_psnr_db, Some(20.0));
    }

    #[test]
    fn a_value_that_does_not_exist_is_null_and_a_dash() {
        let report = Report::new(2, vec![capture(None)]);
        let json = serde_json::to_value(&report).unwrap();
        assert!(json["captures"][0]["methods"][0]["psnr_rgb_db"].is_null());
        assert!(report.to_text().contains(" - "));
    }

    #[test]
    fn header_and_rows_of_the_table_end_in_the_same_columns() {
        let text = Report::new(2, vec![capture(Some(33.25)), capture(Some(1.5))]).to_text();
        let lines: Vec<_> = text.lines().collect();
        let header = lines.iter().position(|line| line.contains("method")).unwrap();
        for title in ["frames", "RGB", "SSIM", "flicker", "ms/key"] {
            let end = lines[header].find(title).unwrap() + title.len();
            let row = lines[header + 1].as_bytes();
            assert!(row[end - 1] != b' ' && row[end] == b' ', "{title}: {text}");
        }
        assert!(text.contains("mean of 2 captures"));
        let alone = Report::new(2, vec![capture(Some(1.0))]).to_text();
        assert!(!alone.contains("mean of"), "one capture has no mean row");
    }
}
