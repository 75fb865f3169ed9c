//! In the style of gamescope's vblank manager: the next multiple of the nominal interval after the
//! last vblank, less a rolling maximum of the draw time and a fixed red zone.
//!
//! The rolling maximum jumps up at once when a draw exceeds it by more than half of the red zone,
//! and otherwise comes down by 2 % a frame. The phase is that of the last vblank alone.

use super::super::policy::Planner;
use super::{KeyContent, next_multiple};
use crate::pacing::Plan;
use crate::time::{MonoSpan, MonoTime};

/// Time that is left between the end of a draw and the vblank.
const RED_ZONE: MonoSpan = MonoSpan::from_us(1_650);
/// The least draw time that is counted on while compositing.
const LEAST_DRAW: MonoSpan = MonoSpan::from_us(2_400);
/// What stays of the rolling maximum from frame to frame, in percent.
const KEPT_PERCENT: i64 = 98;

/// The pacer.
#[derive(Clone, Debug)]
pub(in super::super) struct GamescopeStyle {
    interval: MonoSpan,
    last_vblank: Option<MonoTime>,
    rolling_draw: MonoSpan,
    last_target: Option<MonoTime>,
    content: KeyContent,
}

impl GamescopeStyle {
    pub(in super::super) fn new(interval: MonoSpan) -> Self {
        Self {
            interval,
            last_vblank: None,
            rolling_draw: LEAST_DRAW,
            last_target: None,
            content: KeyContent::default(),
        }
    }
}

impl Planner for GamescopeStyle {
    fn on_key(&mut self, content_time: MonoTime, _arrived_at: MonoTime) {
        self.content.on_key(content_time);
    }

    fn plan(&mut self, now: MonoTime) -> Plan {
        let lead = self.rolling_draw.max(LEAST_DRAW) + RED_ZONE;
        let last_vblank = *self.last_vblank.get_or_insert(now);
        let half = self.interval.scale(1, 2);
        let free = self.last_target.map_or(now, |last| last + half);
        let present_at = next_multiple(last_vblank, self.interval, (now + lead).max(free));
        Plan {
            wake_at: present_at - lead,
            wake_by: present_at - lead,
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

    fn on_work(&mut self, work: MonoSpan) {
        self.rolling_draw = if work - RED_ZONE.scale(1, 2) > self.rolling_draw {
            work
        } else {
            self.rolling_draw.scale(KEPT_PERCENT, 100) + work.scale(100 - KEPT_PERCENT, 100)
        };
    }

    fn on_presented(&mut self, _planned: MonoTime, presented_at: MonoTime, _heard_at: MonoTime) {
        self.last_vblank = self.last_vblank.max(Some(presented_at));
    }
}
