//! In the style of the FSR 3 frame-interpolation swapchain: evenly spaced by the mean of the last
//! ten frame times, without a phase.
//!
//! A frame is handed over at (the one before) + mean / n - 0.1 deviation - 0.1 ms, where n is the
//! number of frames made of each key: 2 there, here what comes nearest to the refresh rate. Until
//! there are ten samples, and after a gap of more than 100 ms, nothing is paced. The key goes
//! first, for here it is extrapolated from. It aims at the instant of handing over, for it knows no
//! other.

use std::collections::VecDeque;

use super::super::policy::Planner;
use crate::pacing::Plan;
use crate::time::{MonoSpan, MonoTime};

/// Frame times that the mean is taken of.
const SAMPLES: usize = 10;
/// Frame times longer than this start anew.
const LONGEST: MonoSpan = MonoSpan::from_ms(100);
/// What is taken off each span for safety.
const SAFETY: MonoSpan = MonoSpan::from_us(100);

/// The pacer.
#[derive(Clone, Debug)]
pub(in super::super) struct Fsr3Style {
    refresh_interval: MonoSpan,
    intervals: VecDeque<MonoSpan>,
    newest: Option<(MonoTime, MonoTime)>,
    frames_of_newest: i64,
    last_target: Option<MonoTime>,
}

impl Fsr3Style {
    pub(in super::super) fn new(refresh_interval: MonoSpan) -> Self {
        Self {
            refresh_interval,
            intervals: VecDeque::new(),
            newest: None,
            frames_of_newest: 0,
            last_target: None,
        }
    }

    /// Mean and standard deviation of the frame times; zero until there are enough.
    #[expect(clippy::cast_precision_loss, reason = "ten spans below 100 ms")]
    fn frame_time(&self) -> (MonoSpan, MonoSpan) {
        if self.intervals.len() < SAMPLES {
            return (MonoSpan::ZERO, MonoSpan::ZERO);
        }
        let count = SAMPLES as f64;
        let seconds = || self.intervals.iter().map(|span| span.as_secs_f64());
        let mean = seconds().sum::<f64>() / count;
        let variance = seconds().map(|span| (span - mean).powi(2)).sum::<f64>() / count;
        (MonoSpan::from_secs_f64(mean), MonoSpan::from_secs_f64(variance.sqrt()))
    }

    /// Frames made of one key.
    fn frames_per_key(&self) -> i64 {
        let (mean, _) = self.frame_time();
        let refresh = self.refresh_interval.as_ns().max(1);
        ((mean.as_ns() + refresh / 2) / refresh).max(2)
    }
}

impl Planner for Fsr3Style {
    fn on_key(&mut self, content_time: MonoTime, arrived_at: MonoTime) {
        if let Some((_, before)) = self.newest {
            let interval = arrived_at - before;
            if interval > LONGEST {
                self.intervals.clear();
            } else {
                if self.intervals.len() == SAMPLES {
                    self.intervals.pop_front();
                }
                self.intervals.push_back(interval);
            }
        }
        self.newest = Some((content_time, arrived_at));
        self.frames_of_newest = 0;
    }

    fn plan(&mut self, now: MonoTime) -> Plan {
        let (mean, deviation) = self.frame_time();
        let frames = self.frames_per_key();
        let is_done = self.newest.is_none() || self.frames_of_newest >= frames;
        let span = mean.scale(1, frames) - deviation.scale(1, 10) - SAFETY;
        let after_last = self.last_target.map_or(now, |last| last + span.max(MonoSpan::ZERO));
        let target = after_last.max(now);
        // Without a key, and with all frames of one made, it waits for the next.
        let wake_at = if is_done { MonoTime::FAR_FUTURE } else { now };
        let target = target.max(wake_at);
        let ahead = mean.scale(self.frames_of_newest, frames);
        Plan {
            wake_at,
            wake_by: wake_at,
            submit_from: target,
            submit_by: target,
            present_at: target,
            content_time: self.newest.map(|(newest, _)| newest + ahead),
        }
    }

    fn start(&mut self, plan: &Plan) {
        self.last_target = Some(plan.present_at);
        self.frames_of_newest += 1;
    }
}
