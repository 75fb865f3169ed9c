//! The timeline: when keys arrived, what the display showed at each refresh, and which content
//! time that was.
//!
//! Three parts share one time axis: a lane of arrivals, a lane of presents by kind, and a plot of
//! content time against present time. In the plot a stream without judder is a straight line
//! through evenly spaced dots; arrivals of keys are squares on or above it.

mod axis;

use tiny_skia::Pixmap;

use self::axis::Axis;
use super::PictureError;
use crate::draw::palette::{
    DROPPED, GRID, INK, KEY, MUTED, PANEL, REAL, REPEATED, Rgb, SYNTHESISED,
};
use crate::draw::{Anchor, Canvas, TextStyle, text_width};

/// What a refresh of the display showed.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum PresentKind {
    /// A key frame as it is.
    Real,
    /// An in-between frame.
    Synthesised,
    /// The picture before, again.
    Repeated,
    /// Nothing new: the picture that was planned was not ready.
    Dropped,
}

impl PresentKind {
    const ALL: [Self; 4] = [Self::Real, Self::Synthesised, Self::Repeated, Self::Dropped];

    fn name(self) -> &'static str {
        match self {
            Self::Real => "real",
            Self::Synthesised => "synthesised",
            Self::Repeated => "repeated",
            Self::Dropped => "dropped",
        }
    }

    pub(super) fn color(self) -> Rgb {
        match self {
            Self::Real => REAL,
            Self::Synthesised => SYNTHESISED,
            Self::Repeated => REPEATED,
            Self::Dropped => DROPPED,
        }
    }
}

/// Something that happened. Times are milliseconds from a start that the caller chooses.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum TimelineEvent {
    /// A key frame arrived.
    Key {
        /// When.
        arrived_at_ms: f64,
        /// Simulation time that it shows.
        content_ms: f64,
    },
    /// A refresh of the display.
    Present {
        /// When.
        at_ms: f64,
        /// What it showed.
        kind: PresentKind,
        /// Content time of the picture on display from then on, if there is one.
        content_ms: Option<f64>,
    },
}

impl TimelineEvent {
    fn at_ms(&self) -> f64 {
        match *self {
            Self::Key { arrived_at_ms, .. } => arrived_at_ms,
            Self::Present { at_ms, .. } => at_ms,
        }
    }

    fn content_ms(&self) -> Option<f64> {
        match *self {
            Self::Key { content_ms, .. } => Some(content_ms),
            Self::Present { content_ms, .. } => content_ms,
        }
    }
}

pub(super) const WIDTH: u32 = 1600;
pub(super) const HEIGHT: u32 = 760;
/// Left and right edge of lanes and plot, px.
pub(super) const SIDES: [f32; 2] = [150.0, 1570.0];
pub(super) const KEYS_LANE: [f32; 2] = [92.0, 134.0];
pub(super) const PRESENTS_LANE: [f32; 2] = [144.0, 194.0];
pub(super) const PLOT: [f32; 2] = [220.0, 690.0];

const LABEL: TextStyle = TextStyle { size: 16.0, color: INK, anchor: Anchor::Start };
const TICK: TextStyle = TextStyle { size: 14.0, color: MUTED, anchor: Anchor::Middle };

/// Draws the timeline. Events may come in any order; those with a time that is not finite are
/// left out.
///
/// # Errors
/// If no event is left.
pub fn timeline(title: &str, events: &[TimelineEvent]) -> Result<Pixmap, PictureError> {
    let is_finite = |event: &&TimelineEvent| {
        event.at_ms().is_finite() && event.content_ms().is_none_or(f64::is_finite)
    };
    let mut events: Vec<TimelineEvent> = events.iter().filter(is_finite).copied().collect();
    events.sort_by(|a, b| a.at_ms().total_cmp(&b.at_ms()));
    let time = Axis::over(events.iter().map(TimelineEvent::at_ms), SIDES)
        .ok_or(PictureError::Empty { expected: "event with finite times" })?;
    // Screen y grows down, content time grows up.
    let content =
        Axis::over(events.iter().filter_map(TimelineEvent::content_ms), [PLOT[1], PLOT[0]]);
    let mut canvas = Canvas::new(WIDTH, HEIGHT).expect("a fixed size that fits memory");
    canvas.text(title, [24.0, 38.0], TextStyle { size: 24.0, ..LABEL });
    draw_legend(&mut canvas);
    draw_panels(&mut canvas, &time, content.as_ref());
    draw_lanes(&mut canvas, &events, &time);
    if let Some(content) = content {
        draw_plot(&mut canvas, &events, &time, &content);
    }
    Ok(canvas.into_pixmap())
}

fn draw_legend(canvas: &mut Canvas) {
    let mut x = SIDES[0];
    let keys = std::iter::once(("key arrives", KEY));
    for (name, color) in keys.chain(PresentKind::ALL.map(|kind| (kind.name(), kind.color()))) {
        canvas.fill_box([x, 58.0], [14.0, 14.0], color);
        canvas.text(name, [x + 22.0, 71.0], LABEL);
        x += 22.0 + text_width(name, LABEL.size) + 28.0;
    }
}

fn draw_panels(canvas: &mut Canvas, time: &Axis, content: Option<&Axis>) {
    let width = SIDES[1] - SIDES[0];
    for [top, bottom] in [KEYS_LANE, PRESENTS_LANE, PLOT] {
        canvas.fill_box([SIDES[0], top], [width, bottom - top], PANEL);
    }
    let right = TextStyle { anchor: Anchor::End, ..LABEL };
    let middle = |[top, bottom]: [f32; 2]| f32::midpoint(top, bottom) + 5.0;
    canvas.text("keys arrive", [SIDES[0] - 14.0, middle(KEYS_LANE)], right);
    canvas.text("display shows", [SIDES[0] - 14.0, middle(PRESENTS_LANE)], right);
    canvas.text("content time", [SIDES[0] - 14.0, PLOT[0] + 14.0], right);
    for (value, text) in time.ticks() {
        let x = time.at(value);
        canvas.fill_box([x, PLOT[0]], [1.0, PLOT[1] - PLOT[0]], GRID);
        canvas.fill_box([x, PLOT[1]], [1.0, 6.0], MUTED);
        canvas.text(&text, [x, PLOT[1] + 23.0], TICK);
    }
    canvas.text("time, ms", [SIDES[1], PLOT[1] + 48.0], TextStyle { anchor: Anchor::End, ..LABEL });
    let tick = TextStyle { anchor: Anchor::End, ..TICK };
    // The topmost labels would collide with the name of the axis.
    for (value, text) in content.into_iter().flat_map(Axis::ticks) {
        let y = content.map_or(0.0, |axis| axis.at(value));
        canvas.fill_box([SIDES[0], y], [width, 1.0], GRID);
        if y > PLOT[0] + 34.0 {
            canvas.text(&format!("{text} ms"), [SIDES[0] - 14.0, y + 5.0], tick);
        }
    }
}

/// Width of a refresh in the lane: between a hairline and what is legible, by how many there are.
fn bar_width(events: &[TimelineEvent]) -> f32 {
    let presents = events.iter().filter(|event| matches!(event, TimelineEvent::Present { .. }));
    ((SIDES[1] - SIDES[0]) / presents.count().max(1) as f32 * 0.7).clamp(1.0, 12.0)
}

fn draw_lanes(canvas: &mut Canvas, events: &[TimelineEvent], time: &Axis) {
    let bar = bar_width(events);
    for event in events {
        let x = time.at(event.at_ms());
        match *event {
            TimelineEvent::Key { .. } => {
                let [top, bottom] = [KEYS_LANE[0] + 6.0, KEYS_LANE[1] - 6.0];
                canvas.fill_box([x - 1.0, top], [2.0, bottom - top], KEY);
                canvas.fill_polygon(
                    &[[x - 5.0, bottom - 8.0], [x + 5.0, bottom - 8.0], [x, bottom]],
                    KEY,
                );
            }
            TimelineEvent::Present { kind, .. } => {
                let [top, bottom] = [PRESENTS_LANE[0] + 6.0, PRESENTS_LANE[1] - 6.0];
                canvas.fill_box([x - bar / 2.0, top], [bar, bottom - top], kind.color());
            }
        }
    }
}

fn draw_plot(canvas: &mut Canvas, events: &[TimelineEvent], time: &Axis, content: &Axis) {
    let shown = events.iter().filter_map(|event| match *event {
        TimelineEvent::Present { at_ms, kind, content_ms: Some(content_ms) } => {
            Some(([time.at(at_ms), content.at(content_ms)], kind))
        }
        _ => None,
    });
    let shown: Vec<([f32; 2], PresentKind)> = shown.collect();
    let line: Vec<[f32; 2]> = shown.iter().map(|&(point, _)| point).collect();
    canvas.line(&line, 1.5, MUTED);
    for event in events {
        if let TimelineEvent::Key { arrived_at_ms, content_ms } = *event {
            let [x, y] = [time.at(arrived_at_ms), content.at(content_ms)];
            canvas.fill_box([x - 3.5, y - 3.5], [7.0, 7.0], KEY);
        }
    }
    let radius = (bar_width(events) / 2.0).clamp(2.0, 4.5);
    for (point, kind) in shown {
        canvas.fill_disc(point, radius, kind.color());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn present(at_ms: f64, kind: PresentKind) -> TimelineEvent {
        TimelineEvent::Present { at_ms, kind, content_ms: None }
    }

    #[test]
    fn every_present_is_one_bar_of_its_colour_inside_its_lane() {
        let events: Vec<_> = (0..)
            .zip(PresentKind::ALL)
            .map(|(at, kind)| present(f64::from(at) * 10.0, kind))
            .collect();
        let picture = timeline("", &events).unwrap();
        let row = f32::midpoint(PRESENTS_LANE[0], PRESENTS_LANE[1]) as u32;
        for kind in PresentKind::ALL {
            let is_kind = |x: u32, y: u32| {
                let pixel = picture.pixel(x, y).unwrap();
                [pixel.red(), pixel.green(), pixel.blue()] == kind.color()
            };
            let columns: Vec<u32> = (0..WIDTH).filter(|&x| is_kind(x, row)).collect();
            let (first, last) = (columns[0], columns[columns.len() - 1]);
            assert_eq!(
                last - first + 1,
                u32::try_from(columns.len()).unwrap(),
                "one bar of {kind:?}"
            );
            assert!(first as f32 >= SIDES[0] && (last as f32) < SIDES[1], "{kind:?}");
            let below = PRESENTS_LANE[1] as u32..HEIGHT;
            assert!(below.into_iter().all(|y| !is_kind(first + 2, y)), "{kind:?} below its lane");
        }
    }

    #[test]
    fn the_order_of_events_does_not_matter_and_times_that_are_not_finite_are_left_out() {
        let mut events = vec![present(1.0, PresentKind::Real), present(9.0, PresentKind::Repeated)];
        let expected = timeline("", &events).unwrap();
        events.reverse();
        events.push(present(f64::NAN, PresentKind::Dropped));
        assert!(timeline("", &events).unwrap() == expected);
        let nothing = timeline("", &events[2..]).unwrap_err();
        assert_eq!(
            nothing.to_string(),
            "expected at least one event with finite times, found none"
        );
    }
}
