//! One status as a terminal view: rates, latency by stage, headroom, warnings, for each stream.

use foreframed::control::{DaemonStatus, StreamStatus};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Bar, BarChart, BarGroup, Block, Paragraph, Row, Sparkline, Table};

use super::text;

/// Rows that one stream takes.
const STREAM_ROWS: u16 = 14;

/// What was seen of a stream over time, newest last.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    /// Median latency of a key, microseconds.
    pub(super) latency_us: Vec<u64>,
}

/// Draws `status`. `histories` belong to its streams, in their order.
pub(super) fn draw(frame: &mut Frame<'_>, status: &DaemonStatus, histories: &[History]) {
    let streams = status.streams.len().max(1);
    let rows = std::iter::once(Constraint::Length(1))
        .chain(std::iter::repeat_n(Constraint::Length(STREAM_ROWS), streams))
        .chain([Constraint::Min(0), Constraint::Length(1)]);
    let areas = Layout::vertical(rows).split(frame.area());
    let bold = Style::new().add_modifier(Modifier::BOLD);
    frame.render_widget(Line::styled(text::headline(status), bold), areas[0]);
    if status.streams.is_empty() {
        frame.render_widget(Paragraph::new("no application is connected"), areas[1]);
    }
    for (index, stream) in status.streams.iter().enumerate() {
        let history = histories.get(index).cloned().unwrap_or_default();
        draw_stream(frame, areas[1 + index], stream, &history);
    }
    let help = "q: quit    foreframe ctl: change method, recording, cap, HUD";
    frame.render_widget(
        Line::styled(help, Style::new().fg(Color::DarkGray)),
        areas[areas.len() - 1],
    );
}

fn draw_stream(frame: &mut Frame<'_>, area: Rect, stream: &StreamStatus, history: &History) {
    let block = Block::bordered().title(text::title(stream));
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let rows = [Constraint::Length(3), Constraint::Min(0), Constraint::Length(1)];
    let [rates, middle, last] = Layout::vertical(rows).areas(inner);
    frame.render_widget(Paragraph::new(rate_lines(stream)), rates);
    let columns = [Constraint::Length(38), Constraint::Length(34), Constraint::Min(0)];
    let [latency, headroom, over_time] = Layout::horizontal(columns).areas(middle);
    draw_latency(frame, latency, stream);
    draw_headroom(frame, headroom, stream);
    let title = Block::new().title("latency over time");
    frame.render_widget(Sparkline::default().block(title).data(&history.latency_us), over_time);
    let warning = match stream.warnings.first() {
        Some(warning) => Line::styled(format!("! {warning}"), Style::new().fg(Color::Yellow)),
        None => Line::default(),
    };
    frame.render_widget(warning, last);
}

fn rate_lines(stream: &StreamStatus) -> Vec<Line<'static>> {
    let rates = &stream.rates_hz;
    let good = stream.on_target_percent >= 99.0;
    let color = if good { Color::Green } else { Color::Yellow };
    let dropped = if rates.dropped > 0.0 { Color::Red } else { Color::Reset };
    let [received, superseded, refused] = stream.keys;
    vec![
        Line::from(vec![
            Span::raw(format!(
                "{:6.1} keys/s  {:6.1} real  {:6.1} synthesised  {:6.1} repeated  ",
                rates.keys, rates.real, rates.synthesised, rates.repeated
            )),
            Span::styled(format!("{:.1} dropped  ", rates.dropped), Style::new().fg(dropped)),
            Span::styled(
                format!("{:.1} % on target", stream.on_target_percent),
                Style::new().fg(color),
            ),
        ]),
        Line::raw(format!(
            "since the start: {received} keys, {superseded} superseded, {refused} refused; {} \
             frames dropped",
            stream.frames[3]
        )),
        Line::raw(format!("models: {}", text::models(stream))),
    ]
}

fn draw_latency(frame: &mut Frame<'_>, area: Rect, stream: &StreamStatus) {
    let rows = text::stages(stream).map(|(name, spread)| {
        Row::new([name.to_owned(), format!("{:8.2}", spread.p50), format!("{:8.2}", spread.p95)])
    });
    let widths = [Constraint::Length(16), Constraint::Length(9), Constraint::Length(9)];
    let header = Row::new(["latency, ms", "  median", "    95 %"])
        .style(Style::new().add_modifier(Modifier::BOLD));
    frame.render_widget(Table::new(rows, widths).header(header), area);
}

fn draw_headroom(frame: &mut Frame<'_>, area: Rect, stream: &StreamStatus) {
    let bars: Vec<Bar<'_>> = text::HEADROOM
        .iter()
        .zip(stream.ready_before_refresh)
        .map(|(name, count)| {
            let color = if *name == "late" { Color::Red } else { Color::Green };
            Bar::default().label(*name).value(u64::from(count)).style(Style::new().fg(color))
        })
        .collect();
    let chart = BarChart::default()
        .block(Block::new().title("ready before refresh, ms"))
        .bar_width(4)
        .bar_gap(1)
        .data(BarGroup::default().bars(&bars));
    frame.render_widget(chart, area);
}

#[cfg(test)]
mod tests {
    use foreframed::control::{Rates, Spread, Stages};
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;

    fn drawn(status: &DaemonStatus) -> String {
        let mut terminal = Terminal::new(TestBackend::new(110, 30)).unwrap();
        let histories = [History { latency_us: vec![1, 5, 9] }];
        terminal.draw(|frame| draw(frame, status, &histories)).unwrap();
        terminal.backend().to_string()
    }

    fn stream() -> StreamStatus {
        StreamStatus {
            number: 3,
            width: 1280,
            height: 720,
            paced_by: "timer".to_owned(),
            method: "linear".to_owned(),
            backend: "cpu".to_owned(),
            rates_hz: Rates {
                keys: 40.0,
                real: 40.0,
                synthesised: 79.5,
                repeated: 0.5,
                dropped: 0.0,
            },
            on_target_percent: 99.6,
            latency_ms: Stages { whole: Spread { p50: 11.25, p95: 17.5 }, ..Stages::default() },
            ready_before_refresh: [0, 3, 9, 88, 20, 8],
            keys: [400, 2, 1],
            frames: [398, 790, 5, 7],
            models_percent: vec![("linear".to_owned(), 87.5), ("hold".to_owned(), 12.5)],
            warnings: vec!["the CPU took over: device lost".to_owned()],
            ..StreamStatus::default()
        }
    }

    #[test]
    fn a_stream_shows_its_rates_latency_headroom_and_warning() {
        let status =
            DaemonStatus { refresh_hz: 120.0, streams: vec![stream()], ..Default::default() };
        let screen = drawn(&status);
        for expected in [
            "stream 3: 1280x720, linear on cpu, paced by timer",
            "79.5 synthesised",
            "99.6 % on target",
            "11.25",
            "17.50",
            "late",
            "88",
            "device lost",
            "models: linear 88 %, hold 12 %",
            "400 keys, 2 superseded, 1 refused; 7 frames dropped",
        ] {
            assert!(screen.contains(expected), "`{expected}` is not on\n{screen}");
        }
    }

    #[test]
    fn a_daemon_without_streams_says_so_and_a_small_terminal_is_no_error() {
        assert!(drawn(&DaemonStatus::default()).contains("no application is connected"));
        let mut terminal = Terminal::new(TestBackend::new(9, 3)).unwrap();
        let status = DaemonStatus { streams: vec![stream(); 9], ..Default::default() };
        terminal.draw(|frame| draw(frame, &status, &[])).unwrap();
    }
}
