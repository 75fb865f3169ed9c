//! The numbers of a stream as a small picture: rates, latency by stage, headroom, warnings.

use tiny_skia::Pixmap;

use super::HudView;
use crate::control::StreamStatus;
use crate::draw::palette::{DROPPED, GRID, REAL, REPEATED, Rgb, SYNTHESISED};
use crate::draw::{Anchor, Canvas, TextStyle};

const SIZE: [u32; 2] = [396, 182];
const BACK: Rgb = [22, 24, 28];
const TEXT: Rgb = [236, 236, 230];
const FAINT: Rgb = [150, 154, 162];

/// Draws `report`; `latency_ms` is the median latency of each report so far, newest last.
pub(super) fn draw(report: &StreamStatus, latency_ms: &[f64], view: HudView) -> Option<Pixmap> {
    let mut canvas = Canvas::new(SIZE[0], SIZE[1])?;
    canvas.fill_box([0.0; 2], SIZE.map(|length| length as f32), BACK);
    let StreamStatus { width, height, method, backend, .. } = report;
    write(&mut canvas, &format!("{width}x{height}  {method}  {backend}"), [12.0, 20.0], TEXT);
    let named = TextStyle { size: 13.0, color: FAINT, anchor: Anchor::End };
    canvas.text(view.name(), [SIZE[0] as f32 - 12.0, 20.0], named);
    rates(&mut canvas, report);
    latency(&mut canvas, report);
    headroom(&mut canvas, report);
    history(&mut canvas, latency_ms);
    if let Some(warning) = report.warnings.first() {
        write(&mut canvas, warning, [12.0, 175.0], REPEATED);
    }
    Some(canvas.into_pixmap())
}

fn write(canvas: &mut Canvas, text: &str, at: [f32; 2], color: Rgb) {
    canvas.text(text, at, TextStyle { size: 13.0, color, anchor: Anchor::Start });
}

fn rates(canvas: &mut Canvas, report: &StreamStatus) {
    let rates = &report.rates_hz;
    let columns = [
        ("keys", rates.keys, TEXT),
        ("real", rates.real, REAL),
        ("made", rates.synthesised, SYNTHESISED),
        ("repeated", rates.repeated, REPEATED),
        ("dropped", rates.dropped, DROPPED),
        ("on target", report.on_target_percent, TEXT),
    ];
    for (column, (name, value, color)) in (0_u8..).zip(columns) {
        let x = 12.0 + 64.0 * f32::from(column);
        canvas.fill_box([x, 28.0], [56.0, 3.0], color);
        let unit = if name == "on target" { " %" } else { "" };
        write(canvas, &format!("{value:.1}{unit}"), [x, 47.0], TEXT);
        write(canvas, name, [x, 62.0], FAINT);
    }
}

/// The stages of a key's latency as one bar, to scale.
fn latency(canvas: &mut Canvas, report: &StreamStatus) {
    let latency = &report.latency_ms;
    let stages = [
        ("waited", latency.waited, FAINT),
        ("taken in", latency.taken_in, REAL),
        ("made", latency.made, SYNTHESISED),
        ("until shown", latency.until_shown, GRID),
    ];
    let sum: f64 = stages.iter().map(|(_, spread, _)| spread.p50.max(0.0)).sum();
    let mut x = 12.0;
    for (_, spread, color) in stages {
        let share = if sum > 0.0 { spread.p50.max(0.0) / sum } else { 0.0 };
        let width = 372.0 * share as f32;
        canvas.fill_box([x, 74.0], [width, 10.0], color);
        x += width;
    }
    let text = format!(
        "key {:.1} ms ({:.1}): waited {:.1}, taken in {:.1}, made {:.1}, until shown {:.1}",
        latency.whole.p50,
        latency.whole.p95,
        latency.waited.p50,
        latency.taken_in.p50,
        latency.made.p50,
        latency.until_shown.p50
    );
    write(canvas, &text, [12.0, 99.0], TEXT);
}

/// How many of the last pictures were ready how early.
fn headroom(canvas: &mut Canvas, report: &StreamStatus) {
    let most = report.ready_before_refresh.iter().copied().max().unwrap_or(0).max(1);
    for (class, count) in (0_u8..).zip(report.ready_before_refresh) {
        let x = 12.0 + 26.0 * f32::from(class);
        let height = 34.0 * (f64::from(count) / f64::from(most)) as f32;
        let color = if class == 0 { DROPPED } else { SYNTHESISED };
        canvas.fill_box([x, 142.0 - height], [20.0, height], color);
        canvas.fill_box([x, 142.0], [20.0, 1.0], FAINT);
    }
    write(canvas, "ready early", [12.0, 157.0], FAINT);
}

/// The median latency over time.
fn history(canvas: &mut Canvas, latency_ms: &[f64]) {
    let most = latency_ms.iter().copied().fold(1.0, f64::max);
    let points: Vec<[f32; 2]> = (0_u16..)
        .zip(latency_ms)
        .map(|(index, ms)| [184.0 + 1.66 * f32::from(index), 142.0 - 34.0 * (ms / most) as f32])
        .collect();
    canvas.fill_box([184.0, 142.0], [200.0, 1.0], FAINT);
    canvas.line(&points, 1.5, SYNTHESISED);
    write(canvas, &format!("latency of keys, up to {most:.0} ms"), [184.0, 157.0], FAINT);
}
