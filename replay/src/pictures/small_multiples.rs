//! Small multiples: panels beside each other, each with axes of its own, under one legend.

use super::PictureError;
use crate::draw::palette::{GRID, HUES, INK, MUTED, PANEL, Rgb};
use crate::draw::{Anchor, Drawing, LinearAxis, LogAxis, TextStyle, text_width};

/// Around everything, and between panels beside what their labels need, px.
const MARGIN: f32 = 24.0;
/// Room of a panel for its labels: left, top, right, bottom of the plot, px.
const ROOM: [f32; 4] = [44.0, 34.0, 14.0, 44.0];
/// From one legend entry to the next below, px.
const LEGEND_ROW: f32 = 22.0;
/// Most ticks of the axis that goes up, less one.
const TICKS: u32 = 5;

const TITLE: TextStyle = TextStyle { size: 20.0, color: INK, anchor: Anchor::Start };
const LABEL: TextStyle = TextStyle { size: 14.0, color: INK, anchor: Anchor::Start };
const TICK: TextStyle = TextStyle { size: 11.5, color: MUTED, anchor: Anchor::Middle };

/// How a series looks, the same in every panel and in the legend.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Look {
    /// Colour of its line and of its marks.
    pub color: Rgb,
    /// Dashes of its line, px.
    pub dash: Option<f32>,
    /// Width of its line, px.
    pub width: f32,
    /// Its marks.
    pub mark: Mark,
}

/// The shape of a mark.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Mark {
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// A disc with an empty middle.
    Ring,
}

/// What goes across.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Across {
    /// Names, evenly spaced; the place of a point is the number of a name.
    Named(Vec<String>),
    /// Positive numbers, logarithmic.
    Log,
    /// Numbers.
    Linear,
}

/// Points joined by a line.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    /// How it looks.
    pub look: Look,
    /// Its points. Those that are not finite are left out.
    pub points: Vec<[f64; 2]>,
    /// Whether each point has a mark.
    pub is_marked: bool,
}

/// A point of its own.
#[derive(Clone, PartialEq, Debug)]
pub struct Point {
    /// How it looks.
    pub look: Look,
    /// Where it is.
    pub at: [f64; 2],
    /// What is written beside it.
    pub label: Option<String>,
    /// Whether a ring in ink is drawn around it.
    pub is_ringed: bool,
}

/// One panel.
#[derive(Clone, PartialEq, Debug)]
pub struct Panel {
    /// Above the plot.
    pub title: String,
    /// Below it.
    pub across: String,
    /// The axis that goes across.
    pub axis: Across,
    /// Under the points.
    pub lines: Vec<Line>,
    /// Over the lines.
    pub points: Vec<Point>,
}

/// A whole picture.
#[derive(Clone, PartialEq, Debug)]
pub struct Sheet {
    /// Above everything.
    pub title: String,
    /// Below the title, one line each.
    pub notes: Vec<String>,
    /// What a series is called and how it looks.
    pub legend: Vec<(String, Look)>,
    /// The panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
    /// Width and height of a panel with its labels, px.
    pub panel_px: [f32; 2],
}

impl Look {
    /// How methods look: `hold` in muted dashes, `auto` thick in ink, all others in hues, which
    /// come again in dashes and rings where there are more methods than hues.
    #[must_use]
    pub fn of_methods(methods: &[&str]) -> Vec<Self> {
        let mut others = 0;
        let look = |method: &&str| match *method {
            "hold" => Self { color: MUTED, dash: Some(5.0), width: 2.0, mark: Mark::Disc },
            "auto" => Self { color: INK, dash: None, width: 3.0, mark: Mark::Disc },
            _ => {
                let (round, hue) = (others / HUES.len(), others % HUES.len());
                others += 1;
                let (dash, mark) =
                    if round == 0 { (None, Mark::Disc) } else { (Some(8.0), Mark::Ring) };
                Self { color: HUES[hue], dash, width: 1.8, mark }
            }
        };
        methods.iter().map(look).collect()
    }

    fn draw_mark(&self, drawing: &mut Drawing, at: [f32; 2], radius: f32) {
        match self.mark {
            Mark::Disc => drawing.disc(at, radius, self.color),
            Mark::Square => {
                let corner = at.map(|side| side - radius);
                drawing.fill_box(corner, [2.0 * radius; 2], self.color);
            }
            Mark::Ring => {
                drawing.disc(at, radius, self.color);
                drawing.disc(at, 0.5 * radius, PANEL);
            }
        }
    }
}

/// Draws a sheet.
///
/// # Errors
/// If no panel has a point with finite numbers.
pub fn small_multiples(sheet: &Sheet) -> Result<Drawing, PictureError> {
    let panels: Vec<_> =
        sheet.panels.iter().filter_map(|panel| Some((panel, axes(panel)?))).collect();
    if panels.is_empty() {
        return Err(PictureError::Empty { expected: "point with finite numbers" });
    }
    let columns = sheet.columns.clamp(1, panels.len());
    let width = 2.0 * MARGIN + sheet.panel_px[0] * columns as f32;
    let legend = legend_places(sheet, width);
    let legend_rows = legend.last().map_or(0.0, |[_, row]| row + LEGEND_ROW);
    let notes = MARGIN + 28.0;
    let legend_top = notes + 20.0 * sheet.notes.len() as f32;
    let top = legend_top + legend_rows + 8.0;
    let rows = panels.len().div_ceil(columns);
    let height = top + sheet.panel_px[1] * rows as f32 + 8.0;
    let mut drawing = Drawing::new([width as u32, height as u32]);
    drawing.text(&sheet.title, [MARGIN, MARGIN + 10.0], TITLE);
    for (row, note) in sheet.notes.iter().enumerate() {
        let style = TextStyle { color: MUTED, ..LABEL };
        drawing.text(note, [MARGIN, notes + 20.0 * row as f32 + 4.0], style);
    }
    for ((name, look), [x, y]) in sheet.legend.iter().zip(&legend) {
        let y = legend_top + y + 8.0;
        drawing.line(&[[*x, y], [x + 26.0, y]], look.width, look.color, look.dash);
        look.draw_mark(&mut drawing, [x + 13.0, y], 3.5);
        drawing.text(name, [x + 33.0, y + 5.0], LABEL);
    }
    for (index, (panel, axes)) in panels.into_iter().enumerate() {
        let [column, row] = [index % columns, index / columns].map(|place| place as f32);
        let corner = [MARGIN + sheet.panel_px[0] * column, top + sheet.panel_px[1] * row];
        draw_panel(&mut drawing, panel, &axes.placed(corner, sheet.panel_px), corner);
    }
    Ok(drawing)
}

/// Left and top of each entry of the legend, from the top of the first.
fn legend_places(sheet: &Sheet, width: f32) -> Vec<[f32; 2]> {
    let (mut x, mut y) = (MARGIN, 0.0);
    let place = |(name, _): &(String, Look)| {
        // The reader's font may be wider than the one that is measured.
        let entry = 33.0 + 1.12 * text_width(name, LABEL.size) + 20.0;
        if x + entry > width - MARGIN && x > MARGIN {
            (x, y) = (MARGIN, y + LEGEND_ROW);
        }
        let at = [x, y];
        x += entry;
        at
    };
    sheet.legend.iter().map(place).collect()
}

/// All finite points of a panel.
fn points(panel: &Panel) -> impl Iterator<Item = [f64; 2]> + '_ {
    let lines = panel.lines.iter().flat_map(|line| line.points.iter().copied());
    let all = lines.chain(panel.points.iter().map(|point| point.at));
    let is_log = panel.axis == Across::Log;
    all.filter(move |[x, y]| x.is_finite() && y.is_finite() && (!is_log || *x > 0.0))
}

/// The values that the axes of a panel have to hold. None without any.
fn axes(panel: &Panel) -> Option<Axes<'_>> {
    points(panel).next().map(|_| Axes { panel })
}

struct Axes<'a> {
    panel: &'a Panel,
}

/// Axes with their pixels.
struct Placed {
    across: AcrossAxis,
    up: LinearAxis,
    left: f32,
    top: f32,
    right: f32,
    bottom: f32,
}

enum AcrossAxis {
    Linear(LinearAxis),
    Log(LogAxis),
}

impl Axes<'_> {
    fn placed(&self, [x, y]: [f32; 2], [width, height]: [f32; 2]) -> Placed {
        let [left, top, right, bottom] =
            [x + ROOM[0], y + ROOM[1], x + width - ROOM[2], y + height - ROOM[3]];
        let panel = self.panel;
        let across = || points(panel).map(|point| point[0]);
        let any = "a panel without points has no axes";
        let across = match &panel.axis {
            Across::Named(names) => {
                let range = [-0.4, names.len() as f64 - 0.6];
                AcrossAxis::Linear(LinearAxis::new(range, [left, right]))
            }
            Across::Linear => {
                AcrossAxis::Linear(LinearAxis::over(across(), [left, right]).expect(any))
            }
            Across::Log => AcrossAxis::Log(LogAxis::over(across(), [left, right]).expect(any)),
        };
        // Whole marks fit in.
        let up = || points(panel).map(|point| point[1]);
        let (low, high) = (up().fold(f64::MAX, f64::min), up().fold(f64::MIN, f64::max));
        let room = if high > low { 0.04 * (high - low) } else { 0.0 };
        let up = LinearAxis::over([low - room, high + room].into_iter(), [bottom, top]);
        let up = up.expect(any);
        Placed { across, up, left, top, right, bottom }
    }
}

impl Placed {
    fn at(&self, [x, y]: [f64; 2]) -> Option<[f32; 2]> {
        let column = match &self.across {
            AcrossAxis::Linear(axis) => axis.at(x),
            AcrossAxis::Log(axis) => axis.at(x),
        };
        let row = self.up.at(y);
        (column.is_finite() && row.is_finite()).then_some([column, row])
    }
}

fn draw_panel(drawing: &mut Drawing, panel: &Panel, placed: &Placed, [x, y]: [f32; 2]) {
    let &Placed { left, top, right, bottom, .. } = placed;
    drawing.text(&panel.title, [x, y + ROOM[1] - 12.0], TextStyle { size: 15.0, ..LABEL });
    drawing.fill_box([left, top], [right - left, bottom - top], PANEL);
    for (value, label) in placed.up.ticks(TICKS) {
        let row = placed.up.at(value);
        drawing.fill_box([left, row], [right - left, 1.0], GRID);
        let style = TextStyle { anchor: Anchor::End, ..TICK };
        drawing.text(&label, [left - 6.0, row + 4.0], style);
    }
    draw_ticks_across(drawing, panel, placed);
    let style = TextStyle { anchor: Anchor::Middle, size: 12.5, ..TICK };
    drawing.text(&panel.across, [f32::midpoint(left, right), bottom + 33.0], style);
    for line in &panel.lines {
        let points: Vec<_> = line.points.iter().filter_map(|point| placed.at(*point)).collect();
        drawing.line(&points, line.look.width, line.look.color, line.look.dash);
        for point in points.iter().filter(|_| line.is_marked) {
            line.look.draw_mark(drawing, *point, 2.6);
        }
    }
    let mut labels = Labels { taken: Vec::new(), bounds: [left, top, right, bottom] };
    for point in &panel.points {
        if let Some(at) = placed.at(point.at) {
            labels.taken.push([at[0] - 5.0, at[1] - 5.0, at[0] + 5.0, at[1] + 5.0]);
        }
    }
    // What is ringed has the first choice of a place for its label, and lies over the others.
    let (ringed, others): (Vec<_>, Vec<_>) = panel.points.iter().partition(|point| point.is_ringed);
    for point in others.iter().chain(&ringed) {
        let Some(at) = placed.at(point.at) else { continue };
        if point.is_ringed {
            drawing.disc(at, 9.0, INK);
            drawing.disc(at, 7.0, PANEL);
        }
        point.look.draw_mark(drawing, at, 5.0);
    }
    for point in ringed.iter().chain(&others) {
        let Some(at) = placed.at(point.at) else { continue };
        if let Some(label) = &point.label
            && let Some(place) = labels.place(label, at)
        {
            drawing.text(label, place, TextStyle { size: 12.5, ..LABEL });
        }
    }
}

fn draw_ticks_across(drawing: &mut Drawing, panel: &Panel, placed: &Placed) {
    let ticks: Vec<(f64, String)> = match (&panel.axis, &placed.across) {
        (Across::Named(names), _) => {
            names.iter().enumerate().map(|(place, name)| (place as f64, name.clone())).collect()
        }
        (_, AcrossAxis::Linear(axis)) => axis.ticks(2 * TICKS).collect(),
        (_, AcrossAxis::Log(axis)) => axis.ticks().collect(),
    };
    let mut free_from = f32::MIN;
    for (value, label) in ticks {
        let Some([column, _]) = placed.at([value, 0.0]) else { continue };
        drawing.fill_box([column - 0.5, placed.bottom], [1.0, 4.0], MUTED);
        let half = text_width(&label, TICK.size) / 2.0;
        if column - half > free_from {
            drawing.text(&label, [column, placed.bottom + 16.0], TICK);
            free_from = column + half + 4.0;
        }
    }
}

/// Labels of points, none over another or over a point.
struct Labels {
    /// Left, top, right, bottom of what is there already.
    taken: Vec<[f32; 4]>,
    bounds: [f32; 4],
}

impl Labels {
    /// Where the baseline of a label of the point `at` begins. None where there is no room.
    fn place(&mut self, label: &str, [x, y]: [f32; 2]) -> Option<[f32; 2]> {
        let width = 1.12 * text_width(label, 12.5);
        let places = [
            [x + 9.0, y + 4.0],
            [x - 9.0 - width, y + 4.0],
            [x - width / 2.0, y - 10.0],
            [x - width / 2.0, y + 19.0],
            [x + 7.0, y - 8.0],
            [x + 7.0, y + 17.0],
            [x - 7.0 - width, y - 8.0],
            [x - 7.0 - width, y + 17.0],
        ];
        let bounds = self.bounds;
        let of = |[left, baseline]: [f32; 2]| [left, baseline - 10.0, left + width, baseline + 3.0];
        let is_free = |place: &[f32; 2]| {
            let here = of(*place);
            let is_inside = here[0] >= bounds[0]
                && here[1] >= bounds[1]
                && here[2] <= bounds[2]
                && here[3] <= bounds[3];
            let is_apart = |other: &[f32; 4]| {
                here[2] <= other[0]
                    || other[2] <= here[0]
                    || here[3] <= other[1]
                    || other[3] <= here[1]
            };
            is_inside && self.taken.iter().all(is_apart)
        };
        let found = places.into_iter().find(is_free)?;
        self.taken.push(of(found));
        Some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look() -> Look {
        Look::of_methods(&["linear"])[0]
    }

    fn sheet(panels: Vec<Panel>) -> Sheet {
        Sheet {
            title: "t".to_owned(),
            notes: vec!["n".to_owned()],
            legend: vec![("linear".to_owned(), look())],
            panels,
            columns: 2,
            panel_px: [300.0, 200.0],
        }
    }

    fn panel(points: Vec<[f64; 2]>) -> Panel {
        Panel {
            title: "p".to_owned(),
            across: "a".to_owned(),
            axis: Across::Log,
            lines: vec![Line { look: look(), points, is_marked: true }],
            points: Vec::new(),
        }
    }

    #[test]
    fn panels_without_a_finite_point_are_left_out_and_none_at_all_is_an_error() {
        let empty = || panel(vec![[f64::NAN, 1.0], [-1.0, 2.0]]);
        assert!(small_multiples(&sheet(vec![empty()])).is_err());
        let with = |panels| small_multiples(&sheet(panels)).unwrap().to_svg();
        let full = panel(vec![[1.0, 2.0], [3.0, 4.0]]);
        assert_eq!(with(vec![empty(), full.clone()]), with(vec![full]));
    }

    #[test]
    fn methods_beyond_the_hues_look_different_from_all_before() {
        let names = ["hold", "a", "b", "c", "d", "e", "f", "g", "h", "i", "auto"];
        let looks = Look::of_methods(&names);
        for (index, look) in looks.iter().enumerate() {
            assert_eq!(looks.iter().position(|other| other == look), Some(index), "{index}");
        }
        assert_eq!((looks[0].color, looks[10].color), (MUTED, INK));
    }

    #[test]
    fn labels_lie_in_the_plot_and_not_on_each_other() {
        let mut labels = Labels { taken: Vec::new(), bounds: [0.0, 0.0, 200.0, 100.0] };
        let places: Vec<_> = (0..12)
            .filter_map(|i| labels.place("linear", [100.0, 50.0 + f64::from(i) as f32]))
            .collect();
        assert!((3..12).contains(&places.len()), "{places:?}");
        for (index, here) in labels.taken.iter().enumerate() {
            for other in &labels.taken[..index] {
                let is_apart = here[2] <= other[0]
                    || other[2] <= here[0]
                    || here[3] <= other[1]
                    || other[3] <= here[1];
                assert!(is_apart, "{here:?} {other:?}");
            }
        }
    }
}
