//! What most frame generators do, to compare with: a timer at the announced rate, no feedback, and
//! content time that starts at each key anew.

use crate::pacing::Plan;
use crate::time::{MonoSpan, MonoTime};

/// A timer that ticks every refresh interval, on no grid but its own.
#[derive(Clone, Debug)]
pub(super) struct NaiveTimer {
    interval: MonoSpan,
    next_wake: Option<MonoTime>,
    newest: Option<MonoTime>,
    frames_of_newest: i64,
}

impl NaiveTimer {
    pub(super) fn new(interval: MonoSpan) -> Self {
        Self { interval, next_wake: None, newest: None, frames_of_newest: 0 }
    }

    pub(super) fn on_key(&mut self, content_time: MonoTime) {
        self.newest = Some(content_time);
        self.frames_of_newest = 0;
    }

    pub(super) fn plan(&mut self, now: MonoTime) -> Plan {
        let wake_at = (*self.next_wake.get_or_insert(now)).max(now);
        let present_at = wake_at + self.interval;
        let ahead = self.interval.scale(self.frames_of_newest, 1);
        Plan {
            wake_at,
            submit_by: present_at,
            present_at,
            content_time: self.newest.map(|newest| newest + ahead),
        }
    }

    pub(super) fn start(&mut self, plan: &Plan) {
        self.next_wake = Some(plan.present_at);
        self.frames_of_newest += 1;
    }
}
