//! In the style of Monado's compositor pacer: nominal period, and a time for composing that is
//! stepped up and down until frames are ready a millisecond before they are shown.
//!
//! A frame shown more than 0.5 ms after its time raises the composing time by 4 % of the period, up
//! to 30 %; else it is moved by 2 % towards a margin of 1 ms. It starts at 10 %.

use std::collections::BTreeMap;

use super::super::policy::Planner;
use super::{KeyContent, next_multiple};
use crate::pacing::Plan;
use crate::time::{MonoSpan, MonoTime};

/// Composing time in percent of the period: first, and at most.
const FIRST_PERCENT: i64 = 10;
const MOST_PERCENT: i64 = 30;
/// Its steps.
const MISS_PERCENT: i64 = 4;
const STEP_PERCENT: i64 = 2;
/// From the frame being ready to it being shown, as it should be.
const MARGIN: MonoSpan = MonoSpan::from_ms(1);
/// Shown later than planned by more than this is missed.
const LATE: MonoSpan = MonoSpan::from_us(500);

/// The pacer.
#[derive(Clone, Debug)]
pub(in super::super) struct MonadoStyle {
    interval: MonoSpan,
    last_present: Option<MonoTime>,
    composing: MonoSpan,
    last_target: Option<MonoTime>,
    /// Margins of the frames that are under way, by their planned present.
    margins: BTreeMap<MonoTime, MonoSpan>,
    content: KeyContent,
}

impl MonadoStyle {
    pub(in super::super) fn new(interval: MonoSpan) -> Self {
        Self {
            interval,
            last_present: None,
            composing: interval.scale(FIRST_PERCENT, 100),
            last_target: None,
            margins: BTreeMap::new(),
            content: KeyContent::default(),
        }
    }
}

impl Planner for MonadoStyle {
    fn on_key(&mut self, content_time: MonoTime, _arrived_at: MonoTime) {
        self.content.on_key(content_time);
    }

    fn plan(&mut self, now: MonoTime) -> Plan {
        let last_present = *self.last_present.get_or_insert(now);
        let half = self.interval.scale(1, 2);
        let free = self.last_target.map_or(now, |last| last + half);
        let present_at =
            next_multiple(last_present, self.interval, (now + self.composing).max(free));
        Plan {
            wake_at: present_at - self.composing,
            wake_by: present_at - self.composing,
            submit_from: now,
            submit_by: present_at,
            present_at,
            content_time: self.content.at(present_at),
        }
    }

    fn start(&mut self, plan: &Plan) {
        self.last_target = Some(plan.present_at);
        self.content.on_start(plan.present_at);
    }

    fn on_handed_over(&mut self, plan: &Plan, handed_over_at: MonoTime) {
        self.margins.insert(plan.present_at, plan.present_at - handed_over_at);
    }

    fn on_presented(&mut self, planned: MonoTime, presented_at: MonoTime, _heard_at: MonoTime) {
        self.last_present = self.last_present.max(Some(presented_at));
        let margin = self.margins.remove(&planned).unwrap_or(MARGIN);
        self.margins.retain(|&waiting, _| waiting > planned);
        let percent = |percent| self.interval.scale(percent, 100);
        let step = percent(STEP_PERCENT);
        if presented_at > planned + LATE {
            self.composing += percent(MISS_PERCENT);
        } else if margin > MARGIN + step {
            self.composing -= step;
        } else if margin < MARGIN - step {
            self.composing += step;
        }
        self.composing = self.composing.clamp(step, percent(MOST_PERCENT));
    }
}
