//! Speed against accuracy: the time of an in-between frame across, its error up, a point per
//! method and backend, for the mean and for each capture.
//!
//! The front joins the methods of which none is both faster and better. Methods that interpolate
//! stand beside it: they need the next key, and no time that the engine takes tells of that wait.

use super::metrics::MAX_PSNR_DB;
use super::report::{MeanScore, MethodScore, Report};
use crate::draw::Drawing;
use crate::draw::palette::{GRID, MUTED};
use crate::pictures::{
    Across, Line, Look, Mark, Panel, PictureError, Point, Sheet, small_multiples,
};

const PANEL_PX: [f32; 2] = [440.0, 320.0];

/// What one point stands for.
struct Dot<'a> {
    name: &'a str,
    backend: &'a str,
    interpolates: bool,
    ms: f64,
    value: f64,
}

/// Draws the chart.
///
/// # Errors
/// If no method predicted anything in a time that could be measured.
pub fn chart(report: &Report) -> Result<Drawing, PictureError> {
    let methods = distinct(report.mean.iter().map(|mean| mean.name));
    let backends = distinct(report.mean.iter().map(|mean| mean.backend.as_str()));
    let looks = Look::of_methods(&methods);
    let look = |dot: &Dot<'_>| {
        let hue = methods.iter().position(|method| *method == dot.name).unwrap_or(0);
        let is_first = backends.first().is_none_or(|first| *first == dot.backend);
        let mark = if is_first { looks[hue].mark } else { Mark::Square };
        Look { mark, ..looks[hue] }
    };
    let panel = |title: String, up: &str, dots: Vec<Dot<'_>>, is_better: fn(f64, f64) -> bool| {
        let label = |dot: &Dot<'_>| {
            let mark = if dot.interpolates { "*" } else { "" };
            format!("{}{mark}", dot.name)
        };
        let point = |dot: &Dot<'_>| Point {
            look: look(dot),
            at: [dot.ms, dot.value],
            label: Some(label(dot)),
            is_ringed: dot.name == "auto",
        };
        let front = Look { color: GRID, dash: None, width: 5.0, mark: Mark::Disc };
        Panel {
            title: format!("{title}: {up}"),
            across: "ms per in-between frame".to_owned(),
            axis: Across::Log,
            lines: vec![Line { look: front, points: front_of(&dots, is_better), is_marked: false }],
            points: dots.iter().map(point).collect(),
        }
    };
    let higher: fn(f64, f64) -> bool = |a, b| a > b;
    let lower: fn(f64, f64) -> bool = |a, b| a < b;
    let mean = |value: fn(&MeanScore) -> Option<f64>| dots(&report.mean, value);
    let count = report.captures.len();
    let of = if count == 1 { "the capture".to_owned() } else { format!("mean of {count}") };
    let mut panels = vec![
        panel(of.clone(), "PSNR in dB, higher is better", mean(|m| m.psnr_rgb_db), higher),
        panel(of, "FLIP, lower is better", mean(|m| m.flip), lower),
    ];
    // One capture alone is its own mean.
    for capture in report.captures.iter().filter(|_| count > 1) {
        let title = format!("{} {}x{}", capture.name, capture.width, capture.height);
        let dots = dots(&capture.methods, |method: &MethodScore| method.psnr_rgb_db);
        panels.push(panel(title, "PSNR in dB", dots, higher));
    }
    let mut legend: Vec<_> =
        methods.iter().map(|name| (*name).to_owned()).zip(looks.iter().copied()).collect();
    if backends.len() > 1 {
        for (index, backend) in backends.iter().enumerate() {
            let mark = if index == 0 { Mark::Disc } else { Mark::Square };
            legend.push((
                format!("on {backend}"),
                Look { color: MUTED, dash: None, width: 0.0, mark },
            ));
        }
    }
    small_multiples(&Sheet {
        title: "Speed against accuracy".to_owned(),
        notes: vec![format!(
            "{} threads, {}; the line joins what nothing is both faster and better than; * is given the next key too",
            report.threads, report.backend
        )],
        legend,
        panels,
        columns: 2,
        panel_px: PANEL_PX,
    })
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut distinct = Vec::new();
    for name in names {
        if !distinct.contains(&name) {
            distinct.push(name);
        }
    }
    distinct
}

/// A row of a report that can be a point.
trait Scored {
    fn dot(&self, value: f64) -> Option<Dot<'_>>;
}

impl Scored for MeanScore {
    fn dot(&self, value: f64) -> Option<Dot<'_>> {
        let Self { name, backend, interpolates, ms_per_frame, .. } = self;
        Some(Dot { name, backend, interpolates: *interpolates, ms: (*ms_per_frame)?, value })
    }
}

impl Scored for MethodScore {
    fn dot(&self, value: f64) -> Option<Dot<'_>> {
        let Self { name, backend, interpolates, ms_per_frame, .. } = self;
        Some(Dot { name, backend, interpolates: *interpolates, ms: (*ms_per_frame)?, value })
    }
}

/// The points of rows that have a time and a value.
fn dots<S: Scored>(rows: &[S], value: impl Fn(&S) -> Option<f64>) -> Vec<Dot<'_>> {
    let dot = |row| Scored::dot(row, value(row)?.min(MAX_PSNR_DB));
    rows.iter().filter_map(dot).filter(|dot: &Dot<'_>| dot.ms > 0.0).collect()
}

/// Corners of the line below which nothing is both faster and better, from fast to slow.
fn front_of(dots: &[Dot<'_>], is_better: fn(f64, f64) -> bool) -> Vec<[f64; 2]> {
    let mut sorted: Vec<_> = dots.iter().filter(|dot| !dot.interpolates).collect();
    sorted.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let mut front: Vec<[f64; 2]> = Vec::new();
    for dot in sorted {
        match front.last() {
            Some(best) if !is_better(dot.value, best[1]) => {}
            Some(best) => {
                let corner = [dot.ms, best[1]];
                front.extend([corner, [dot.ms, dot.value]]);
            }
            None => front.push([dot.ms, dot.value]),
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::super::report::tests::{capture, score};
    use super::*;

    fn dot(name: &str, ms: f64, value: f64) -> Dot<'_> {
        Dot { name, backend: "cpu", interpolates: name == "blend", ms, value }
    }

    #[test]
    fn the_front_leaves_out_what_is_slower_and_no_better_and_what_interpolates() {
        let dots = [
            dot("c", 3.0, 25.0),
            dot("a", 1.0, 20.0),
            dot("b", 2.0, 19.0),
            dot("blend", 0.5, 99.0),
        ];
        assert_eq!(front_of(&dots, |a, b| a > b), [[1.0, 20.0], [3.0, 20.0], [3.0, 25.0]]);
        assert_eq!(front_of(&dots, |a, b| a < b), [[1.0, 20.0], [2.0, 20.0], [2.0, 19.0]]);
    }

    #[test]
    fn each_method_and_backend_is_a_point_of_the_mean_and_of_each_capture() {
        let report = |count: usize| {
            let mut one = capture(Some(30.0));
            one.methods.push(MethodScore { backend: "gpu:x".to_owned(), ..score(Some(30.0)) });
            one.methods.push(MethodScore { name: "auto", ..score(Some(33.0)) });
            Report::new(2, vec![one; count])
        };
        let svg = chart(&report(3)).unwrap().to_svg();
        assert_eq!(svg.matches("ms per in-between frame</text>").count(), 2 + 3);
        assert_eq!(svg.matches(">auto</text>").count(), 1 + 2 + 3, "legend and panels");
        assert!(svg.contains("on gpu:x"));
        let alone = chart(&report(1)).unwrap().to_svg();
        assert_eq!(alone.matches("ms per in-between frame</text>").count(), 2);
    }

    #[test]
    fn nothing_measured_is_no_chart() {
        let mut untimed = capture(Some(30.0));
        untimed.methods[0].ms_per_frame = None;
        assert!(chart(&Report::new(2, vec![untimed])).is_err());
    }
}
