//! Charts: lines over two linear axes, and maps of a value over two of them.
//!
//! A chart is a [`Drawing`], so that the same shapes become PNG or SVG.

use super::PictureError;
use crate::draw::palette::{GRID, HUES, INK, MUTED, PANEL, Rgb};
use crate::draw::{Anchor, Drawing, LinearAxis, TextStyle, text_width};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 600;
/// Left and right, top and bottom edge of the plot, px.
const ACROSS: [f32; 2] = [84.0, 760.0];
const DOWN: [f32; 2] = [64.0, 530.0];
const LABEL: TextStyle = TextStyle { size: 15.0, color: INK, anchor: Anchor::Start };
const TICK: TextStyle = TextStyle { size: 13.0, color: MUTED, anchor: Anchor::Middle };
/// Most ticks of an axis, less one.
const TICKS: u32 = 10;

/// What a chart says in words.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ChartLabels<'a> {
    /// Above the plot.
    pub title: &'a str,
    /// Below it: what goes across, with its unit.
    pub across: &'a str,
    /// At its left: what goes up, with its unit.
    pub up: &'a str,
}

/// One line of a chart.
#[derive(Clone, PartialEq, Debug)]
pub struct Series {
    /// What it stands for.
    pub name: String,
    /// Its points. Those that are not finite are left out.
    pub points: Vec<[f64; 2]>,
}

/// Draws `series` as lines.
///
/// # Errors
/// If there is no point with finite numbers.
pub fn line_chart(labels: ChartLabels<'_>, series: &[Series]) -> Result<Drawing, PictureError> {
    let is_finite = |point: &&[f64; 2]| point.iter().all(|number| number.is_finite());
    let points = || series.iter().flat_map(|series| &series.points).filter(is_finite);
    let empty = PictureError::Empty { expected: "point with finite numbers" };
    let across = LinearAxis::over(points().map(|point| point[0]), ACROSS).ok_or(empty.clone())?;
    let up = LinearAxis::over(points().map(|point| point[1]), [DOWN[1], DOWN[0]]).ok_or(empty)?;
    let mut drawing = Drawing::new([WIDTH, HEIGHT]);
    draw_frame(&mut drawing, labels, &across, &up, true);
    for (index, series) in series.iter().enumerate() {
        let color = HUES[index % HUES.len()];
        let dash = (index >= HUES.len()).then_some(6.0);
        let points: Vec<_> = series
            .points
            .iter()
            .filter(is_finite)
            .map(|point| [across.at(point[0]), up.at(point[1])])
            .collect();
        drawing.line(&points, 2.0, color, dash);
        let y = DOWN[0] + 16.0 + 22.0 * index as f32;
        drawing.line(&[[776.0, y - 5.0], [800.0, y - 5.0]], 2.0, color, dash);
        drawing.text(&series.name, [808.0, y], LABEL);
    }
    Ok(drawing)
}

/// A value of 0 to 1 over two axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MapAxes {
    /// Values at the left and right edge.
    pub across: [f64; 2],
    /// Values at the bottom and top edge.
    pub up: [f64; 2],
    /// Cells across and up.
    pub cells: [u16; 2],
}

/// Draws `value(across, up)` at the middle of each cell, black for 0 and bright for 1, with
/// `outline` over it, both in the units of the axes.
#[must_use]
pub fn map_chart(
    labels: ChartLabels<'_>,
    axes: &MapAxes,
    value: impl Fn(f64, f64) -> f64,
    outline: &[[f64; 2]],
) -> Drawing {
    let across = LinearAxis::new(axes.across, ACROSS);
    let up = LinearAxis::new(axes.up, [DOWN[1], DOWN[0]]);
    let mut drawing = Drawing::new([WIDTH, HEIGHT]);
    draw_frame(&mut drawing, labels, &across, &up, false);
    let middle = |[from, to]: [f64; 2], index: u16, count: u16| {
        from + (to - from) * (f64::from(index) + 0.5) / f64::from(count)
    };
    let size = [
        (ACROSS[1] - ACROSS[0]) / f32::from(axes.cells[0]),
        (DOWN[1] - DOWN[0]) / f32::from(axes.cells[1]),
    ];
    drawing.fill_box([ACROSS[0], DOWN[0]], [ACROSS[1] - ACROSS[0], DOWN[1] - DOWN[0]], glow(0.0));
    for row in 0..axes.cells[1] {
        for column in 0..axes.cells[0] {
            let x = middle(axes.across, column, axes.cells[0]);
            let y = middle(axes.up, row, axes.cells[1]);
            let color = glow(value(x, y));
            if color == glow(0.0) {
                continue;
            }
            let at =
                [ACROSS[0] + size[0] * f32::from(column), DOWN[1] - size[1] * f32::from(row + 1)];
            // A little more than the cell, so that no seam of the page is left between two.
            drawing.fill_box(at, [size[0] + 0.5, size[1] + 0.5], color);
        }
    }
    let outline: Vec<_> =
        outline.iter().map(|point| [across.at(point[0]), up.at(point[1])]).collect();
    drawing.line(&outline, 2.0, [86, 180, 233], None);
    for step in 0..=10_u8 {
        let share = f64::from(step) / 10.0;
        let y = DOWN[1] - (DOWN[1] - DOWN[0] - 20.0) * share as f32 - 20.0;
        drawing.fill_box([790.0, y], [24.0, 20.0], glow(share));
        if step % 5 == 0 {
            drawing.text(&format!("{share:.1}"), [822.0, y + 15.0], LABEL);
        }
    }
    drawing
}

fn draw_frame(
    drawing: &mut Drawing,
    labels: ChartLabels<'_>,
    across: &LinearAxis,
    up: &LinearAxis,
    has_grid: bool,
) {
    let size = [ACROSS[1] - ACROSS[0], DOWN[1] - DOWN[0]];
    drawing.fill_box([ACROSS[0], DOWN[0]], size, PANEL);
    drawing.text(labels.title, [24.0, 34.0], TextStyle { size: 20.0, ..LABEL });
    drawing.text(labels.up, [ACROSS[0] - 60.0, DOWN[0] - 10.0], LABEL);
    let middle = f32::midpoint(ACROSS[0], ACROSS[1]) - text_width(labels.across, LABEL.size) / 2.0;
    drawing.text(labels.across, [middle, DOWN[1] + 52.0], LABEL);
    for (value, text) in across.ticks(TICKS) {
        let x = across.at(value);
        if has_grid {
            drawing.fill_box([x - 0.5, DOWN[0]], [1.0, size[1]], GRID);
        }
        drawing.fill_box([x - 0.5, DOWN[1]], [1.0, 6.0], MUTED);
        drawing.text(&text, [x, DOWN[1] + 22.0], TICK);
    }
    for (value, text) in up.ticks(TICKS) {
        let y = up.at(value);
        if has_grid {
            drawing.fill_box([ACROSS[0], y - 0.5], [size[0], 1.0], GRID);
        }
        drawing.fill_box([ACROSS[0] - 6.0, y - 0.5], [6.0, 1.0], MUTED);
        let style = TextStyle { anchor: Anchor::End, ..TICK };
        drawing.text(&text, [ACROSS[0] - 12.0, y + 4.5], style);
    }
}

/// Black, violet, orange, pale yellow: lightness rises all the way. Values are clamped to 0 to 1.
fn glow(value: f64) -> Rgb {
    const STOPS: [[f64; 3]; 4] =
        [[12.0, 10.0, 24.0], [112.0, 30.0, 110.0], [232.0, 96.0, 46.0], [252.0, 240.0, 190.0]];
    let place = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) * 3.0 };
    let step = (place as usize).min(2);
    let way = place - step as f64;
    std::array::from_fn(|channel| {
        let (from, to) = (STOPS[step][channel], STOPS[step + 1][channel]);
        (from + (to - from) * way).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABELS: ChartLabels<'_> = ChartLabels { title: "t", across: "x", up: "y" };

    #[test]
    fn a_rising_line_goes_up_and_stays_in_the_plot() {
        let points = vec![[0.0, 1.0], [f64::NAN, 2.0], [10.0, 5.0], [20.0, 9.0]];
        let series = [Series { name: "a".to_owned(), points }];
        let picture = line_chart(LABELS, &series).unwrap().to_pixmap().unwrap();
        let [left, right] = ACROSS.map(|edge| edge as u32);
        let line = |x: u32| {
            (0..HEIGHT).find(|&y| {
                let pixel = picture.pixel(x, y).unwrap();
                [pixel.red(), pixel.green(), pixel.blue()] == HUES[0]
            })
        };
        let rows: Vec<u32> = (left..right).filter_map(line).collect();
        assert!(rows.len() > 600, "it goes across: {}", rows.len());
        assert!(rows.is_sorted_by(|a, b| a >= b), "up is up");
        assert!(rows.iter().all(|&y| (DOWN[0]..DOWN[1]).contains(&(y as f32))));
        let nothing = [Series { name: String::new(), points: vec![[f64::NAN, 1.0]] }];
        assert!(line_chart(LABELS, &nothing).is_err());
    }

    #[test]
    fn a_map_is_dark_where_the_value_is_low_and_bright_where_it_is_high() {
        let axes = MapAxes { across: [0.0, 1.0], up: [0.0, 1.0], cells: [4, 3] };
        let drawing = map_chart(LABELS, &axes, |x, y| x * y, &[[0.0, 0.0], [1.0, 1.0]]);
        let pixmap = drawing.to_pixmap().unwrap();
        let at = |x: f32, y: f32| pixmap.pixel(x as u32, y as u32).unwrap().green();
        let (low, high) =
            (at(ACROSS[0] + 40.0, DOWN[1] - 9.0), at(ACROSS[1] - 40.0, DOWN[0] + 9.0));
        assert!(low < 40 && high > 80, "{low} {high}");
        assert_eq!(glow(f64::NAN), glow(0.0));
    }
}
