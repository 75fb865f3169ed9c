//! What the bench tells: a table, or JSON.

use foreframe_engine::{Method, MonoSpan};
use foreframe_fixtures::Size;
use serde::Serialize;

use super::Settings;
use super::keys::MovedBytes;
use super::measure::Times;

/// Everything that was timed.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// Threads of the engine and of the plain copy.
    pub threads: usize,
    /// Keys that were timed in each case.
    pub keys: usize,
    /// In-between frames after each key.
    pub frames_per_key: usize,
    /// Colour is this much larger per axis than depth and motion.
    pub field_ratio: f64,
    /// What the planes are made of.
    pub planes: &'static str,
    /// One entry per scene, size, backend and method.
    pub results: Vec<Case>,
}

/// One scene, size, backend and method. Times are in milliseconds, medians unless they say more.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Case {
    /// Name of the scene.
    pub scene: &'static str,
    /// Name of the method.
    pub method: &'static str,
    /// `cpu`, or `gpu:` and the name of the adapter.
    pub backend: String,
    /// Columns of colour.
    pub width: u32,
    /// Rows of colour.
    pub height: u32,
    /// Taking in a key.
    pub ms_per_key: f64,
    /// Making an in-between frame.
    pub ms_per_frame: f64,
    /// From a key to the second in-between frame after it. None where there are fewer.
    pub ms_key_and_two: Option<f64>,
    /// The plain copy for a frame.
    pub copy_ms: f64,
    /// A frame over the plain copy for it.
    pub ratio_to_copy: f64,
    /// The plain copy for a key.
    pub key_copy_ms: f64,
    /// A key over the plain copy for it.
    pub key_ratio_to_copy: f64,
    /// A frame over one of `hold`, of the same scene, size and backend.
    pub ratio_to_hold: f64,
    /// Keys and in-between frames per second that one stream could have.
    pub frames_per_second: f64,
    /// Bytes that a key reads and writes at least; half of them are copied plainly.
    pub key_bytes: usize,
    /// Bytes that a frame reads and writes at least; half of them are copied plainly.
    pub frame_bytes: usize,
    /// Taking in a key.
    pub key_percentiles: Percentiles,
    /// Making an in-between frame.
    pub frame_percentiles: Percentiles,
    /// A key and all of its in-between frames.
    pub total_percentiles: Percentiles,
    /// Why the CPU took over from the GPU, if it did.
    pub fell_back: Option<String>,
}

/// Of one series of times, in milliseconds, by nearest rank: the smallest time that this share of
/// them does not exceed.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Percentiles {
    /// Half of the times.
    pub p50: f64,
    /// 95 % of the times.
    pub p95: f64,
    /// 99 % of the times.
    pub p99: f64,
}

impl Percentiles {
    /// Not a number where there are no times.
    fn of(times: &[MonoSpan]) -> Self {
        let mut sorted = times.to_vec();
        sorted.sort_unstable();
        let at = |percent: usize| {
            let rank = (sorted.len() * percent).div_ceil(100).max(1);
            sorted.get(rank - 1).map_or(f64::NAN, |time| time.as_ms_f64())
        };
        Self { p50: at(50), p95: at(95), p99: at(99) }
    }
}

impl Case {
    pub(super) fn new(
        scene: &'static str,
        size: Size,
        method: Method,
        backend: &str,
        bytes: &MovedBytes,
        times: &Times,
    ) -> Self {
        let [key, frame, total] =
            [&times.key, &times.frame, &times.total].map(|times| Percentiles::of(times));
        let [key_copy, frame_copy] =
            [&times.key_copy, &times.frame_copy].map(|times| Percentiles::of(times).p50);
        let frames_per_key = times.frame.len() / times.key.len().max(1);
        let has_two = !times.key_and_two.is_empty();
        Self {
            scene,
            method: method.name(),
            backend: backend.to_owned(),
            width: size.width,
            height: size.height,
            ms_per_key: key.p50,
            ms_per_frame: frame.p50,
            ms_key_and_two: has_two.then(|| Percentiles::of(&times.key_and_two).p50),
            copy_ms: frame_copy,
            ratio_to_copy: frame.p50 / frame_copy,
            key_copy_ms: key_copy,
            key_ratio_to_copy: key.p50 / key_copy,
            ratio_to_hold: f64::NAN,
            frames_per_second: (frames_per_key + 1) as f64 * 1e3 / total.p50,
            key_bytes: bytes.key(),
            frame_bytes: bytes.frame(),
            key_percentiles: key,
            frame_percentiles: frame,
            total_percentiles: total,
            fell_back: times.fell_back.clone(),
        }
    }

    /// What two cases have to share to be compared.
    fn place(&self) -> (&str, &str, u32, u32) {
        (self.scene, &self.backend, self.width, self.height)
    }
}

impl Report {
    /// The report of `cases`, each of which has one of `hold` beside it.
    pub(super) fn new(settings: &Settings, mut cases: Vec<Case>) -> Self {
        let holds: Vec<_> =
            cases.iter().filter(|case| case.method == Method::Hold.name()).cloned().collect();
        for case in &mut cases {
            let hold = holds.iter().find(|hold| hold.place() == case.place());
            case.ratio_to_hold =
                hold.map_or(f64::NAN, |hold| case.ms_per_frame / hold.ms_per_frame);
        }
        Self {
            threads: settings.threads.get(),
            keys: settings.keys.get(),
            frames_per_key: settings.frames.get(),
            field_ratio: settings.field_ratio,
            planes: "rgba8 colour, f32 depth, rg16f motion; in the engine 4 bytes of colour a pixel, 4 of depth and 4 of velocity a cell",
            results: cases,
        }
    }

    /// The table for people.
    #[must_use]
    pub fn to_text(&self) -> String {
        let Self { threads, keys, frames_per_key, field_ratio, planes, results } = self;
        let mut lines = vec![
            format!(
                "{threads} threads, {keys} keys with {frames_per_key} in-betweens each; medians in ms, p99 of in-betweens, 10^6 bytes read and written"
            ),
            format!("planes: {planes}; fields at 1/{field_ratio} per axis"),
            format!(
                "{:14} {:>9} {:6} {:7} {:>7} {:>6} {:>7} {:>7} {:>7} {:>6} {:>6} {:>7} {:>7} {:>6}",
                "scene",
                "size",
                "method",
                "backend",
                "key",
                "x copy",
                "frame",
                "p99",
                "copy",
                "x copy",
                "x hold",
                "key MB",
                "MB",
                "fps"
            ),
        ];
        for case in results {
            lines.push(format!(
                "{:14} {:>9} {:6} {:7} {:7.2} {:6.1} {:7.2} {:7.2} {:7.2} {:6.1} {:6.1} {:7.1} {:7.1} {:6.0}",
                case.scene,
                format!("{}x{}", case.width, case.height),
                case.method,
                short(&case.backend),
                case.ms_per_key,
                case.key_ratio_to_copy,
                case.ms_per_frame,
                case.frame_percentiles.p99,
                case.copy_ms,
                case.ratio_to_copy,
                case.ratio_to_hold,
                case.key_bytes as f64 / 1e6,
                case.frame_bytes as f64 / 1e6,
                case.frames_per_second,
            ));
        }
        let lost = results.iter().filter_map(|case| Some((case, case.fell_back.as_ref()?)));
        lines.extend(lost.map(|(case, why)| {
            format!("{} {} ran on the CPU in the end: {why}", case.scene, case.backend)
        }));
        lines.join("\n")
    }
}

/// The first word of an adapter's name: what fits a column.
fn short(backend: &str) -> &str {
    backend.split(' ').next().unwrap_or(backend)
}

#[cfg(test)]
pub(super) mod tests {
    use std::num::NonZeroUsize;

    use super::super::Backend;
    use super::*;

    fn ms(times: impl IntoIterator<Item = i64>) -> Vec<MonoSpan> {
        times.into_iter().map(MonoSpan::from_ms).collect()
    }

    /// A case in which everything is exact: one key of 4 ms, frames of `frame_ms`, copies of 1 ms.
    pub(in super::super) fn case(
        scene: &'static str,
        method: Method,
        backend: &str,
        size: Size,
        frame_ms: i64,
    ) -> Case {
        let bytes = MovedBytes { planes: 600, color: 400, field: 200 };
        let times = Times {
            key: ms([4]),
            frame: ms([frame_ms, frame_ms]),
            key_and_two: ms([4 + 2 * frame_ms]),
            total: ms([4 + 2 * frame_ms]),
            key_copy: ms([2]),
            frame_copy: ms([1]),
            fell_back: None,
        };
        Case::new(scene, size, method, backend, &bytes, &times)
    }

    pub(in super::super) fn report(cases: Vec<Case>) -> Report {
        let settings = Settings {
            scenes: Vec::new(),
            sizes: Vec::new(),
            methods: Vec::new(),
            backends: vec![Backend { name: "cpu".to_owned(), gpu: None }],
            threads: NonZeroUsize::MIN,
            keys: NonZeroUsize::MIN,
            frames: NonZeroUsize::MIN,
            field_ratio: 2.0,
        };
        Report::new(&settings, cases)
    }

    fn is(found: f64, expected: f64) -> bool {
        (found - expected).abs() < 1e-9
    }

    #[test]
    fn percentiles_are_of_the_nearest_rank_whatever_the_order() {
        let of = |times: Vec<MonoSpan>| {
            let Percentiles { p50, p95, p99 } = Percentiles::of(&times);
            [p50, p95, p99].map(|ms| ms.round() as i64)
        };
        assert_eq!(of(ms((1..=100).rev())), [50, 95, 99]);
        assert_eq!(of(ms(1..=40)), [20, 38, 40]);
        assert_eq!(of(ms([3, 1, 2])), [2, 3, 3]);
        assert_eq!(of(ms([7])), [7, 7, 7]);
        assert!(Percentiles::of(&[]).p50.is_nan());
    }

    #[test]
    fn ratios_and_rates_follow_from_the_medians() {
        let size = Size::new(100, 1);
        let case = case("pan", Method::Linear, "cpu", size, 3);
        assert!(is(case.ratio_to_copy, 3.0) && is(case.key_ratio_to_copy, 2.0), "{case:?}");
        assert!(is(case.ms_key_and_two.unwrap(), 10.0), "{case:?}");
        assert!(is(case.frames_per_second, 300.0), "three pictures in 10 ms: {case:?}");
        assert_eq!((case.key_bytes, case.frame_bytes), (1200, 1000));
    }

    #[test]
    fn hold_is_that_of_the_same_scene_size_and_backend() {
        let (small, large) = (Size::new(10, 10), Size::new(20, 20));
        let report = report(vec![
            case("pan", Method::Hold, "cpu", small, 1),
            case("pan", Method::Hold, "gpu:x", small, 2),
            case("pan", Method::Hold, "cpu", large, 3),
            case("tower", Method::Hold, "cpu", small, 4),
            case("pan", Method::Linear, "cpu", small, 12),
            case("pan", Method::Linear, "gpu:x", small, 12),
            case("pan", Method::Linear, "cpu", large, 12),
            case("tower", Method::Linear, "cpu", small, 12),
        ]);
        let ratios: Vec<_> = report.results.iter().map(|case| case.ratio_to_hold).collect();
        for (found, expected) in ratios.iter().zip([1.0, 1.0, 1.0, 1.0, 12.0, 6.0, 4.0, 3.0]) {
            assert!(is(*found, expected), "{ratios:?}");
        }
    }

    #[test]
    fn the_table_has_a_line_per_case_and_says_what_fell_back() {
        let mut lost = case("pan", Method::Linear, "gpu:x y", Size::new(10, 10), 3);
        lost.fell_back = Some("the device was lost".to_owned());
        let text =
            report(vec![case("pan", Method::Hold, "cpu", Size::new(10, 10), 1), lost]).to_text();
        assert_eq!(text.lines().count(), 3 + 2 + 1, "{text}");
        assert!(
            text.ends_with("pan gpu:x y ran on the CPU in the end: the device was lost"),
            "{text}"
        );
    }

    #[test]
    fn json_has_the_names_that_others_rely_on() {
        let report = report(vec![case("pan", Method::Hold, "cpu", Size::new(10, 10), 1)]);
        let json = serde_json::to_value(&report).unwrap();
        assert!(json["threads"].is_u64());
        for name in [
            "scene",
            "method",
            "backend",
            "width",
            "height",
            "ms_per_key",
            "ms_per_frame",
            "ms_key_and_two",
            "copy_ms",
            "ratio_to_copy",
        ] {
            assert!(!json["results"][0][name].is_null(), "{name}");
        }
    }
}
