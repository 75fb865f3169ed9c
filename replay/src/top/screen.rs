//! Owns the terminal: draws, waits for a key or the next look, and leaves the terminal as it was.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::Context as _;
use foreframed::control::DaemonStatus;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyModifiers};

use super::view::{self, History};

/// Looks that a history remembers.
const REMEMBERED: usize = 240;

/// Shows what `look` sees every `interval` until `q` or Ctrl-C is pressed, or `look` fails.
///
/// # Errors
/// Those of `look`, and of the terminal.
pub fn show(
    interval: Duration,
    mut look: impl FnMut() -> anyhow::Result<DaemonStatus>,
) -> anyhow::Result<()> {
    let mut terminal = ratatui::try_init().context("taking over the terminal")?;
    let mut histories = BTreeMap::new();
    let shown = loop {
        let status = match look() {
            Ok(status) => status,
            Err(error) => break Err(error),
        };
        let seen = remember(&mut histories, &status);
        if let Err(error) = terminal.draw(|frame| view::draw(frame, &status, &seen)) {
            break Err(anyhow::Error::from(error).context("drawing"));
        }
        match wants_to_quit(interval) {
            Ok(true) => break Ok(()),
            Ok(false) => {}
            Err(error) => break Err(error.context("reading the keyboard")),
        }
    };
    ratatui::restore();
    shown
}

/// Adds what `status` says to the histories, forgets streams that have ended, and gives those of
/// its streams in their order.
fn remember(histories: &mut BTreeMap<u64, History>, status: &DaemonStatus) -> Vec<History> {
    histories.retain(|number, _| status.streams.iter().any(|stream| stream.number == *number));
    let seen = status.streams.iter().map(|stream| {
        let history = histories.entry(stream.number).or_default();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "for a plot")]
        history.latency_us.push((stream.latency_ms.whole.p50 * 1e3).max(0.0) as u64);
        let forgotten = history.latency_us.len().saturating_sub(REMEMBERED);
        history.latency_us.drain(..forgotten);
        history.clone()
    });
    seen.collect()
}

/// Waits for a key, or for as long as the next look takes.
fn wants_to_quit(interval: Duration) -> anyhow::Result<bool> {
    if !event::poll(interval)? {
        return Ok(false);
    }
    let Event::Key(KeyEvent { code, modifiers, .. }) = event::read()? else { return Ok(false) };
    let is_interrupt = code == KeyCode::Char('c') && modifiers.contains(KeyModifiers::CONTROL);
    Ok(is_interrupt || matches!(code, KeyCode::Char('q') | KeyCode::Esc))
}

#[cfg(test)]
mod tests {
    use foreframed::control::StreamStatus;

    use super::*;

    #[test]
    fn histories_follow_their_streams_and_end_with_them() {
        let mut histories = BTreeMap::new();
        let status = |numbers: &[u64]| {
            let stream = |&number| {
                let mut stream = StreamStatus { number, ..Default::default() };
                stream.latency_ms.whole.p50 = number as f64;
                stream
            };
            DaemonStatus { streams: numbers.iter().map(stream).collect(), ..Default::default() }
        };
        for _ in 0..REMEMBERED + 3 {
            remember(&mut histories, &status(&[1, 2]));
        }
        let seen = remember(&mut histories, &status(&[2, 7]));
        assert_eq!(seen[0].latency_us, vec![2000; REMEMBERED]);
        assert_eq!(seen[1].latency_us, [7000]);
        assert_eq!(histories.len(), 2);
    }
}
