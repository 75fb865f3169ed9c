//! The chart: time against pixels, each method on each backend beside the plain copy.
//!
//! Two plots share a legend: an in-between frame on the left, a key on the right. Both axes are
//! logarithmic, so that what costs the same per pixel at every size is a straight line, and what
//! the caches do shows as a bend. [`Drawing`] makes it pixels or SVG.

use foreframe_engine::Method;

use super::report::{Case, Report};
use crate::draw::palette::{GRID, HUES, INK, MUTED, PANEL, Rgb};
use crate::draw::{Anchor, Drawing, LogAxis, TextStyle};

/// Side of the page, px.
const PAGE: [u32; 2] = [1800, 800];
/// Top and bottom of the plots, px.
const ROWS: [f32; 2] = [110.0, 690.0];
/// Left and right of each plot, px.
const PLOTS: [[f32; 2]; 2] = [[90.0, 640.0], [740.0, 1290.0]];
/// Left of the legend, px.
const LEGEND: f32 = 1330.0;

const LABEL: TextStyle = TextStyle { size: 18.0, color: INK, anchor: Anchor::Start };
const TICK: TextStyle = TextStyle { size: 15.0, color: MUTED, anchor: Anchor::Middle };
/// The plain copy, which all others are read against.
const COPY: Rgb = INK;
/// Dashes of the backends, px: none for the first.
const DASHES: [Option<f32>; 4] = [None, Some(8.0), Some(3.0), Some(14.0)];

/// One line of a plot.
#[derive(Clone, PartialEq, Debug)]
struct Series {
    name: String,
    color: Rgb,
    dash: Option<f32>,
    width: f32,
    /// Pixels of a picture and milliseconds of a frame and of a key, by pixels.
    points: Vec<(f64, [f64; 2])>,
}

/// Draws the chart. None without cases, or where no time could be measured.
#[must_use]
pub fn chart(report: &Report) -> Option<Drawing> {
    let series = all_series(&report.results);
    let mut sizes: Vec<(f64, String)> = Vec::new();
    for Case { width, height, .. } in &report.results {
        let size = (pixels(*width, *height), format!("{width}x{height}"));
        if !sizes.contains(&size) {
            sizes.push(size);
        }
    }
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut drawing = Drawing::new(PAGE);
    let head = format!("Time per picture, medians, {} threads", report.threads);
    drawing.text(&head, [PLOTS[0][0], 44.0], TextStyle { size: 26.0, ..LABEL });
    let x_values = || sizes.iter().map(|(pixels, _)| *pixels);
    let y_values = || series.iter().flat_map(|line| line.points.iter().flat_map(|point| point.1));
    for (plot, name) in ["an in-between frame", "a key"].into_iter().enumerate() {
        let x = LogAxis::over(x_values(), PLOTS[plot])?;
        let y = LogAxis::over(y_values(), [ROWS[1], ROWS[0]])?;
        drawing.text(name, [PLOTS[plot][0], ROWS[0] - 16.0], LABEL);
        draw_grid(&mut drawing, PLOTS[plot], &x, &y, &sizes);
        for line in &series {
            let at = |(pixels, ms): &(f64, [f64; 2])| [x.at(*pixels), y.at(ms[plot])];
            let points: Vec<_> = line.points.iter().map(at).collect();
            drawing.line(&points, line.width, line.color, line.dash);
            for point in points {
                drawing.disc(point, line.width + 1.0, line.color);
            }
        }
    }
    draw_legend(&mut drawing, &series);
    Some(drawing)
}

/// One line per scene, method and backend, and one for the plain copy. `hold`, whose time does not
/// depend on the scene, has one line per backend.
fn all_series(cases: &[Case]) -> Vec<Series> {
    let mut series: Vec<Series> = Vec::new();
    let mut backends: Vec<&str> = Vec::new();
    let mut whats: Vec<String> = Vec::new();
    for case in cases {
        let is_hold = case.method == Method::Hold.name();
        let what =
            if is_hold { "hold".to_owned() } else { format!("{} {}", case.scene, case.method) };
        let backend = position_or_push(&mut backends, &case.backend.as_str());
        let hue = position_or_push(&mut whats, &what);
        let line = Series {
            name: format!("{what}, {}", case.backend),
            color: HUES[hue % HUES.len()],
            dash: DASHES[backend % DASHES.len()],
            width: 2.0,
            points: Vec::new(),
        };
        add_point(&mut series, line, case, [case.ms_per_frame, case.ms_per_key]);
    }
    // The copy is timed in every case; the best of a size is what the memory allows.
    let copy = Series {
        name: "plain copy of the bytes".to_owned(),
        color: COPY,
        dash: None,
        width: 4.0,
        points: Vec::new(),
    };
    for case in cases {
        add_point(&mut series, copy.clone(), case, [case.copy_ms, case.key_copy_ms]);
    }
    for line in &mut series {
        line.points.retain(|(_, ms)| ms.iter().all(|ms| ms.is_finite() && *ms > 0.0));
        line.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    series.retain(|line| !line.points.is_empty());
    series
}

/// Adds a point to the line of this name, which begins with it if it is new. Of two times at one
/// size the shorter one counts.
fn add_point(series: &mut Vec<Series>, line: Series, case: &Case, ms: [f64; 2]) {
    let names: Vec<_> = series.iter().map(|line| line.name.clone()).collect();
    let at = names.iter().position(|name| *name == line.name).unwrap_or_else(|| {
        series.push(line);
        series.len() - 1
    });
    let pixels = pixels(case.width, case.height);
    let points = &mut series[at].points;
    match points.iter_mut().find(|point| point.0.total_cmp(&pixels).is_eq()) {
        Some((_, old)) => *old = [old[0].min(ms[0]), old[1].min(ms[1])],
        None => points.push((pixels, ms)),
    }
}

fn position_or_push<T: Clone + PartialEq>(all: &mut Vec<T>, one: &T) -> usize {
    all.iter().position(|other| other == one).unwrap_or_else(|| {
        all.push(one.clone());
        all.len() - 1
    })
}

fn pixels(width: u32, height: u32) -> f64 {
    f64::from(width) * f64::from(height)
}

fn draw_grid(
    drawing: &mut Drawing,
    [left, right]: [f32; 2],
    x: &LogAxis,
    y: &LogAxis,
    sizes: &[(f64, String)],
) {
    let [top, bottom] = ROWS;
    drawing.fill_box([left, top], [right - left, bottom - top], PANEL);
    for (value, label) in y.ticks() {
        let row = y.at(value);
        drawing.fill_box([left, row], [right - left, 1.0], GRID);
        let style = TextStyle { anchor: Anchor::End, ..TICK };
        drawing.text(&format!("{label} ms"), [left - 8.0, row + 5.0], style);
    }
    // Labels of neighbours stand on two rows, and none where it would touch the one before.
    let mut free_from = [f32::MIN; 2];
    for (index, (value, label)) in sizes.iter().enumerate() {
        let column = x.at(*value);
        drawing.fill_box([column, top], [1.0, bottom - top], GRID);
        drawing.fill_box([column, bottom], [1.0, 6.0], MUTED);
        let half = crate::draw::text_width(label, TICK.size) / 2.0;
        let row = index % 2;
        if column - half > free_from[row] {
            drawing.text(label, [column, bottom + 24.0 + 20.0 * row as f32], TICK);
            free_from[row] = column + half + 8.0;
        }
    }
    let style = TextStyle { anchor: Anchor::End, ..LABEL };
    drawing.text("pixels of colour", [right, bottom + 74.0], style);
}

fn draw_legend(drawing: &mut Drawing, series: &[Series]) {
    for (index, line) in series.iter().enumerate() {
        let y = ROWS[0] + 10.0 + 30.0 * index as f32;
        drawing.line(&[[LEGEND, y], [LEGEND + 44.0, y]], line.width, line.color, line.dash);
        drawing.text(&line.name, [LEGEND + 54.0, y + 5.0], TextStyle { size: 16.0, ..LABEL });
    }
}

#[cfg(test)]
mod tests {
    use foreframe_fixtures::Size;

    use super::super::report::tests::{case, report};
    use super::*;

    fn sizes() -> [Size; 3] {
        [Size::new(1280, 720), Size::new(256, 144), Size::new(3840, 2160)]
    }

    fn cases() -> Vec<Case> {
        let mut cases = Vec::new();
        for (scene, slower) in [("pan", 0), ("tower", 5)] {
            for (backend, slowest) in [("cpu", 0), ("gpu:x", 40)] {
                for (size, ms) in sizes().into_iter().zip([10, 3, 70]) {
                    cases.push(case(scene, Method::Hold, backend, size, 2));
                    let ms = ms + slower + slowest;
                    cases.push(case(scene, Method::Linear, backend, size, ms));
                }
            }
        }
        cases
    }

    #[test]
    fn each_scene_method_and_backend_is_one_line_and_so_is_the_copy() {
        let series = all_series(&cases());
        let mut names: Vec<_> = series.iter().map(|line| line.name.as_str()).collect();
        names.sort_unstable();
        let expected = [
            "hold, cpu",
            "hold, gpu:x",
            "pan linear, cpu",
            "pan linear, gpu:x",
            "plain copy of the bytes",
            "tower linear, cpu",
            "tower linear, gpu:x",
        ];
        assert_eq!(names, expected);
        for line in &series {
            let pixels: Vec<_> = line.points.iter().map(|point| point.0).collect();
            assert_eq!(pixels, [36_864.0, 921_600.0, 8_294_400.0], "{}", line.name);
        }
        let looks = |name: &str| {
            let line = series.iter().find(|line| line.name == name).unwrap();
            (line.color, line.dash)
        };
        let [cpu, gpu] = ["cpu", "gpu:x"].map(|backend| looks(&format!("pan linear, {backend}")));
        assert_eq!(cpu.0, gpu.0, "a colour is a scene and a method");
        assert_ne!(cpu.1, gpu.1, "a dash is a backend");
        assert_ne!(cpu.0, looks("tower linear, cpu").0);
    }

    #[test]
    fn the_svg_has_a_polyline_per_series_and_plot_that_runs_to_the_right() {
        let svg = chart(&report(cases())).unwrap().to_svg();
        let lines: Vec<&str> = svg.lines().filter(|line| line.contains("<polyline")).collect();
        let points = |line: &str| -> Vec<[f32; 2]> {
            let (_, rest) = line.split_once("points=\"").unwrap();
            let (points, _) = rest.split_once('"').unwrap();
            let number = |text: &str| text.parse::<f32>().unwrap();
            let point = |pair: &str| pair.split_once(',').map(|(x, y)| [number(x), number(y)]);
            points.split(' ').map(|pair| point(pair).unwrap()).collect()
        };
        let plotted: Vec<_> =
            lines.iter().map(|line| points(line)).filter(|p| p.len() == 3).collect();
        assert_eq!(plotted.len(), 2 * 7, "{svg}");
        for points in &plotted {
            assert!(points.is_sorted_by(|a, b| a[0] < b[0]), "{points:?}");
            let is_inside = |[left, right]: [f32; 2]| {
                points
                    .iter()
                    .all(|[x, y]| (left..=right).contains(x) && (ROWS[0]..=ROWS[1]).contains(y))
            };
            assert!(PLOTS.into_iter().any(is_inside), "{points:?}");
        }
        assert_eq!(lines.len() - plotted.len(), 7, "the samples of the legend");
    }

    #[test]
    fn nothing_measured_is_no_chart_and_a_time_that_is_no_number_is_no_point() {
        assert!(chart(&report(Vec::new())).is_none());
        let mut cases = cases();
        cases[1].ms_per_frame = f64::NAN;
        let series = all_series(&cases);
        let line = series.iter().find(|line| line.name == "pan linear, cpu").unwrap();
        assert_eq!(line.points.len(), 2);
        assert!(chart(&report(cases)).is_some());
    }
}
