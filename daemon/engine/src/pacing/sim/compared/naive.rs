//! A timer at the announced rate: no feedback, no phase.

use super::super::policy::Planner;
use crate::pacing::Plan;
use crate::time::{MonoSpan, MonoTime};

/// A timer that ticks every refresh interval, on no grid but its own. It counts on a frame being
/// shown one interval after its tick.
#[derive(Clone, Debug)]
pub(in super::super) struct NaiveTimer {
    interval: MonoSpan,
    next_wake: Option<MonoTime>,
    newest: Option<MonoTime>,
    frames_of_newest: i64,
}

impl NaiveTimer {
    pub(in super::super) fn new(interval: MonoSpan) -> Self {
        Self { interval, next_wake: None, newest: None, frames_of_newest: 0 }
    }
}

impl Planner for NaiveTimer {
    fn on_key(&mut self, content_time: MonoTime, _arrived_at: MonoTime) {
        self.newest = Some(content_time);
        self.frames_of_newest = 0;
    }

    fn plan(&mut self, now: MonoTime) -> Plan {
        let wake_at = (*self.next_wake.get_or_insert(now)).max(now);
        let present_at = wake_at + self.interval;
        let ahead = self.interval.scale(self.frames_of_newest, 1);
        Plan {
            wake_at,
            wake_by: wake_at,
            submit_from: wake_at,
            submit_by: present_at,
            present_at,
            content_time: self.newest.map(|newest| newest + ahead),
        }
    }

    fn start(&mut self, plan: &Plan) {
        self.next_wake = Some(plan.present_at);
        self.frames_of_newest += 1;
    }
}
