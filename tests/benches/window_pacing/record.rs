//! What became of each frame, and the figures that follow from it.

use std::fs;
use std::path::Path;

use foreframe_engine::MonoSpan;

/// Frames of the first second are not counted: pacers learn.
const WARM_UP: MonoSpan = MonoSpan::from_ms(1_000);

/// One frame. Times in nanoseconds; 0 where nothing is known.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Frame {
    pub(crate) planned: u64,
    pub(crate) handed_over_at: u64,
    pub(crate) shown_at: u64,
    pub(crate) is_discarded: bool,
}

/// Every frame of a run, in order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record {
    pub(crate) frames: Vec<Frame>,
}

/// A line of the table.
#[derive(Clone, Debug)]
pub(crate) struct Row(String);

impl Row {
    pub(crate) const HEAD: &str = "who                    frames  shown  disc.  no word   on target   interval p5/p50/p95 ms   spread   present to shown p50/p95 ms";
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl Record {
    /// What the daemon's log tells of frames.
    pub(crate) fn of_log(log: &Path) -> Self {
        let text = fs::read_to_string(log).expect("the daemon writes its log");
        let mut record = Self::default();
        for line in text.lines() {
            let Some(planned) = number(line, " planned=") else { continue };
            let at = number(line, " at=").unwrap_or(0);
            if line.contains("handed over") {
                record.frames.push(Frame { planned, handed_over_at: at, ..Frame::default() });
                continue;
            }
            let known = record.frames.iter_mut().rev().find(|frame| frame.planned == planned);
            let Some(frame) = known else { continue };
            if line.contains("shown") {
                frame.shown_at = at;
            } else {
                frame.is_discarded = true;
            }
        }
        record
    }

    /// Its figures; on target is a frame that was shown within half a refresh of its plan.
    pub(crate) fn row(&self, name: &str, interval: MonoSpan) -> Row {
        let from = self.frames.first().map_or(0, |first| first.handed_over_at)
            + WARM_UP.as_ns().unsigned_abs();
        let frames: Vec<_> =
            self.frames.iter().filter(|frame| frame.handed_over_at >= from).collect();
        let shown: Vec<_> = frames.iter().filter(|frame| frame.shown_at > 0).collect();
        let discarded = frames.iter().filter(|frame| frame.is_discarded).count();
        let half = interval.as_ns().unsigned_abs() / 2;
        let hits = shown.iter().filter(|it| it.planned.abs_diff(it.shown_at) < half).count();
        let planned = shown.iter().filter(|it| it.planned > 0).count();
        let on_target = match planned {
            0 => "-".to_owned(),
            _ => format!("{:.1} %", 100.0 * hits as f64 / frames.len().max(1) as f64),
        };
        let mut steps: Vec<f64> =
            shown.windows(2).map(|pair| ms(pair[1].shown_at, pair[0].shown_at)).collect();
        let mut delays: Vec<f64> =
            shown.iter().map(|it| ms(it.shown_at, it.handed_over_at)).collect();
        steps.sort_by(f64::total_cmp);
        delays.sort_by(f64::total_cmp);
        Row(format!(
            "{name:<22} {:>6} {:>6} {discarded:>6} {:>8} {on_target:>11}   {:>5.2} / {:>5.2} / {:>5.2}     {:>5.2}   {:>5.2} / {:>5.2}",
            frames.len(),
            shown.len(),
            frames.len() - shown.len() - discarded,
            at(&steps, 5),
            at(&steps, 50),
            at(&steps, 95),
            at(&steps, 95) - at(&steps, 5),
            at(&delays, 50),
            at(&delays, 95),
        ))
    }
}

fn at(sorted: &[f64], percent: usize) -> f64 {
    sorted.get((sorted.len().max(1) - 1) * percent / 100).copied().unwrap_or(f64::NAN)
}

fn ms(later: u64, earlier: u64) -> f64 {
    (later as f64 - earlier as f64) / 1e6
}

fn number(line: &str, name: &str) -> Option<u64> {
    let (_, rest) = line.split_once(name)?;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}
