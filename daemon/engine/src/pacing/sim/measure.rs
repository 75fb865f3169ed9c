//! What was seen on the simulated display, in numbers.
//!
//! *Missed* is a started picture that was not shown at its planned refresh (within half a refresh
//! interval), whoever planned it. *Present error* is how far from its planned instant a picture was
//! shown, either way. Content judder is the standard deviation, over all refreshes between the
//! first and the last picture, of the advance of content time from one refresh to the next, in
//! refresh intervals: a refresh that repeats a picture counts with an advance of zero. A variable
//! display has no refreshes to count; there it is the deviation of that advance from the time that
//! passed between two pictures, in shortest intervals.

use crate::pacing::{PacerStatus, RefreshKind};
use crate::time::{MonoSpan, MonoTime};

/// One picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct ShownFrame {
    pub(super) planned: MonoTime,
    pub(super) content_time: MonoTime,
    /// Number of the key that it was made from.
    pub(super) key: usize,
    pub(super) is_real: bool,
}

/// A picture on the display.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SimPicture {
    /// When it was meant to be shown.
    pub present_at: MonoTime,
    /// When it was.
    pub presented_at: MonoTime,
    /// What it showed.
    pub content_time: MonoTime,
}

/// What a run came to. Shares are fractions of 1, spans are of the simulated clock.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SimReport {
    /// Keys that arrived.
    pub keys: u64,
    /// Keys of which a picture was shown before the next one arrived.
    pub keys_shown: u64,
    /// Pictures shown.
    pub presents: u64,
    /// Pictures that are a key as it is.
    pub real: u64,
    /// Pictures made in between.
    pub synthesised: u64,
    /// Refreshes that showed the picture before once more, or one of the same content time.
    pub repeated: u64,
    /// Pictures not shown at their planned refresh.
    pub missed: u64,
    /// Pictures that were not ready in time. Part of `missed`.
    pub dropped: u64,
    /// Share of started pictures that were shown at their planned refresh.
    pub on_target: f64,
    /// Distance from the planned to the real instant of a shown picture: median.
    pub present_error_p50: MonoSpan,
    /// The same, 99th percentile.
    pub present_error_p99: MonoSpan,
    /// Most pictures that waited at the display at a time.
    pub longest_queue: usize,
    /// From the 5th to the 95th percentile of the time between pictures.
    pub interval_5_95: MonoSpan,
    /// Standard deviation of the content-time step over the refresh interval.
    pub content_judder: f64,
    /// The same without the first second.
    pub steady_judder: f64,
    /// Largest advance of content time from one refresh to the next.
    pub largest_step: MonoSpan,
    /// Times that content time ran backwards from one picture to the next.
    pub backward_steps: u64,
    /// From the arrival of a key to the first refresh with a picture of it: median.
    pub latency_p50: MonoSpan,
    /// The same, 99th percentile.
    pub latency_p99: MonoSpan,
    /// Time from what a picture shows to when it is shown: median.
    pub content_age_p50: MonoSpan,
    /// What the pacer knew in the end. None for a timer.
    pub status: Option<PacerStatus>,
}

/// Collects.
#[derive(Debug)]
pub(super) struct Measure {
    interval: MonoSpan,
    kind: RefreshKind,
    longest_queue: usize,
    arrivals: Vec<MonoTime>,
    shown: Vec<(i64, MonoTime, ShownFrame)>,
    started: u64,
    dropped: u64,
    discarded: u64,
}

impl Measure {
    pub(super) fn new(interval: MonoSpan, kind: RefreshKind) -> Self {
        Self {
            interval,
            kind,
            longest_queue: 0,
            arrivals: vec![],
            shown: vec![],
            started: 0,
            dropped: 0,
            discarded: 0,
        }
    }

    /// Number of the key that has arrived.
    pub(super) fn on_key(&mut self, arrived_at: MonoTime) -> usize {
        self.arrivals.push(arrived_at);
        self.arrivals.len() - 1
    }

    pub(super) fn on_started(&mut self) {
        self.started += 1;
    }

    pub(super) fn on_dropped(&mut self) {
        self.dropped += 1;
    }

    pub(super) fn on_discarded(&mut self) {
        self.discarded += 1;
    }

    pub(super) fn on_queue(&mut self, pictures: usize) {
        self.longest_queue = self.longest_queue.max(pictures);
    }

    pub(super) fn on_shown(&mut self, refresh: i64, shown_at: MonoTime, frame: ShownFrame) {
        self.shown.push((refresh, shown_at, frame));
    }

    pub(super) fn pictures(&self) -> Vec<SimPicture> {
        let picture = |&(_, presented_at, frame): &(i64, MonoTime, ShownFrame)| SimPicture {
            present_at: frame.planned,
            presented_at,
            content_time: frame.content_time,
        };
        self.shown.iter().map(picture).collect()
    }

    pub(super) fn report(&self, status: Option<PacerStatus>) -> SimReport {
        let half = self.interval.scale(1, 2);
        let off_target = |&&(_, at, frame): &&(i64, MonoTime, ShownFrame)| {
            (at - frame.planned).max(frame.planned - at) > half
        };
        let late = count(self.shown.iter().filter(off_target));
        let real = count(self.shown.iter().filter(|(.., frame)| frame.is_real));
        let presents = count(&self.shown);
        let missed = late + self.dropped + self.discarded;
        let steps = self.content_steps();
        let steady = self.steps_after(MonoSpan::from_ms(1_000));
        let intervals = self.shown.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
        let intervals = Sorted::new(intervals);
        let error = |&(_, at, frame): &(i64, MonoTime, ShownFrame)| {
            (at - frame.planned).max(frame.planned - at)
        };
        let errors = Sorted::new(self.shown.iter().map(error).collect());
        let latencies = Sorted::new(self.key_latencies());
        let ages = self.shown.iter().map(|(_, at, frame)| *at - frame.content_time).collect();
        SimReport {
            keys: count(&self.arrivals),
            keys_shown: count(&latencies.0),
            presents,
            real,
            synthesised: presents - real,
            repeated: count(steps.iter().filter(|step| step.content == MonoSpan::ZERO)),
            missed,
            dropped: self.dropped,
            on_target: ratio(presents - late, presents + self.dropped + self.discarded),
            present_error_p50: errors.at(50),
            present_error_p99: errors.at(99),
            longest_queue: self.longest_queue,
            interval_5_95: intervals.at(95) - intervals.at(5),
            content_judder: self.judder(&steps),
            steady_judder: self.judder(&steady),
            largest_step: steps.iter().map(|step| step.content).max().unwrap_or_default(),
            backward_steps: count(steps.iter().filter(|step| step.content < MonoSpan::ZERO)),
            latency_p50: latencies.at(50),
            latency_p99: latencies.at(99),
            content_age_p50: Sorted::new(ages).at(50),
            status,
        }
    }

    fn content_steps(&self) -> Vec<Step> {
        self.steps_after(MonoSpan::ZERO)
    }

    /// Advance of content time per refresh, from pictures shown `skip` after the first on.
    fn steps_after(&self, skip: MonoSpan) -> Vec<Step> {
        let Some(&(_, first, _)) = self.shown.first() else { return vec![] };
        let mut steps = vec![];
        for pair in self.shown.windows(2) {
            let ((old_refresh, old_at, old), (refresh, at, new)) = (pair[0], pair[1]);
            if old_at - first >= skip {
                let content = new.content_time - old.content_time;
                match self.kind {
                    RefreshKind::Fixed => {
                        let passed = self.interval;
                        let repeated = Step { content: MonoSpan::ZERO, passed };
                        steps.extend((old_refresh + 1..refresh).map(|_| repeated));
                        steps.push(Step { content, passed });
                    }
                    RefreshKind::Variable => steps.push(Step { content, passed: at - old_at }),
                }
            }
        }
        steps
    }

    #[expect(clippy::cast_precision_loss, reason = "a count of refreshes has less than 53 bits")]
    fn judder(&self, steps: &[Step]) -> f64 {
        let interval = self.interval.as_secs_f64();
        let advance = |step: &Step| (step.content - step.passed).as_secs_f64() / interval;
        let advances: Vec<f64> = steps.iter().map(advance).collect();
        let n = (advances.len() as f64).max(1.0);
        let mean = advances.iter().sum::<f64>() / n;
        (advances.iter().map(|advance| (advance - mean).powi(2)).sum::<f64>() / n).sqrt()
    }

    /// Of each key that was shown before its successor: arrival to first picture.
    fn key_latencies(&self) -> Vec<MonoSpan> {
        let mut latencies = vec![];
        let mut last = None;
        for &(_, at, frame) in &self.shown {
            if last < Some(frame.key) {
                last = Some(frame.key);
                latencies.push(at - self.arrivals[frame.key]);
            }
        }
        latencies
    }
}

/// From one refresh to the next.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Advance of content time.
    content: MonoSpan,
    /// Time that passed.
    passed: MonoSpan,
}

/// Spans in order.
struct Sorted(Vec<MonoSpan>);

impl Sorted {
    fn new(mut spans: Vec<MonoSpan>) -> Self {
        spans.sort_unstable();
        Self(spans)
    }

    /// The smallest that `percent` of all do not exceed; zero of none.
    fn at(&self, percent: usize) -> MonoSpan {
        let rank = (self.0.len() * percent).div_ceil(100).saturating_sub(1);
        self.0.get(rank).copied().unwrap_or_default()
    }
}

fn count<T>(items: impl IntoIterator<Item = T>) -> u64 {
    items.into_iter().fold(0, |count, _| count + 1)
}

#[expect(clippy::cast_precision_loss, reason = "a report needs no more than 53 bits")]
fn ratio(part: u64, whole: u64) -> f64 {
    part as f64 / (whole as f64).max(1.0)
}
