//! The event loop: keys arrive, feedback arrives, the display refreshes, work ends, the pacer wakes.

use std::collections::BTreeMap;
use std::iter::Peekable;

use super::display::{DisplayScript, SimDisplay};
use super::keys::{KeyScript, KeySource};
use super::measure::{Measure, ShownFrame, SimReport};
use super::policy::{Planner, Policy};
use super::rng::SplitMix64;
use crate::pacing::Plan;
use crate::time::{MonoSpan, MonoTime};

/// When a simulation starts, from the clock's epoch: late enough for jitter to reach below it.
const START: MonoSpan = MonoSpan::from_ms(1_000);

/// How long synthesis takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct WorkScript {
    /// Usual time per frame.
    pub typical: MonoSpan,
    /// Varies by up to this, +-.
    pub jitter: MonoSpan,
    /// Frames that take three times as long.
    pub spike_per_mille: u32,
}

/// Everything that a simulation depends on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Scenario {
    /// How long it runs.
    pub duration: MonoSpan,
    /// Where chance comes from.
    pub seed: u64,
    /// How keys come.
    pub keys: KeyScript,
    /// What the display does.
    pub display: DisplayScript,
    /// How long synthesis takes.
    pub work: WorkScript,
}

/// Runs `policy` through `scenario`.
#[must_use]
pub fn simulate(scenario: &Scenario, policy: Policy) -> SimReport {
    let start = MonoTime::ZERO + START;
    Run::new(scenario, policy, start).finish(start + scenario.duration)
}

/// What happens next. In this order where several happen at one instant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Event {
    Refresh,
    Feedback,
    Key,
    WorkDone,
    Wake,
}

struct Run {
    now: MonoTime,
    planner: Planner,
    keys: Peekable<KeySource>,
    display: SimDisplay,
    chance: SplitMix64,
    work: WorkScript,
    /// Index and content time of the newest key that has arrived.
    newest: Option<(usize, MonoTime)>,
    /// The frame being made, and when it is ready.
    in_work: Option<(MonoTime, ShownFrame, Plan)>,
    /// The frame that the display will show next, and at which refresh.
    pending: Option<(i64, ShownFrame)>,
    /// Feedback under way, by arrival: planned and presented.
    feedback: BTreeMap<(MonoTime, i64), (MonoTime, MonoTime)>,
    measure: Measure,
}

impl Run {
    fn new(scenario: &Scenario, policy: Policy, start: MonoTime) -> Self {
        let mut seeds = SplitMix64::new(scenario.seed);
        let display = SimDisplay::new(scenario.display, seeds.next_bits(), start);
        Self {
            now: start,
            planner: Planner::new(policy, scenario.display.refresh_interval),
            keys: KeySource::new(scenario.keys, seeds.next_bits(), start).peekable(),
            chance: SplitMix64::new(seeds.next_bits()),
            work: scenario.work,
            newest: None,
            in_work: None,
            pending: None,
            feedback: BTreeMap::new(),
            measure: Measure::new(display.interval()),
            display,
        }
    }

    fn finish(mut self, end: MonoTime) -> SimReport {
        loop {
            let plan = self.planner.plan(self.now);
            let (at, event) = self.next_event(&plan);
            if at > end {
                let status = self.planner.pacer().map(|pacer| pacer.status());
                return self.measure.report(status);
            }
            self.now = at;
            match event {
                Event::Refresh => self.refresh(),
                Event::Feedback => self.hear_feedback(),
                Event::Key => self.take_key(),
                Event::WorkDone => self.hand_over(),
                Event::Wake => self.begin(plan),
            }
        }
    }

    fn next_event(&mut self, plan: &Plan) -> (MonoTime, Event) {
        let refresh = self.pending.map(|(index, _)| self.display.refresh_at(index));
        let feedback = self.feedback.first_key_value().map(|(&(at, _), _)| at);
        let key = self.keys.peek().map(|key| key.arrived_at);
        let done = self.in_work.map(|(ready_at, ..)| ready_at);
        // One frame is made at a time: no wake while another is in work.
        let wake = done.is_none().then_some(plan.wake_at);
        [
            (refresh, Event::Refresh),
            (feedback, Event::Feedback),
            (key, Event::Key),
            (done, Event::WorkDone),
            (wake, Event::Wake),
        ]
        .into_iter()
        .filter_map(|(at, event)| Some((at?.max(self.now), event)))
        .min()
        .expect("either work is under way or a wake is planned")
    }

    fn refresh(&mut self) {
        let Some((index, frame)) = self.pending.take() else { return };
        let shown_at = self.display.refresh_at(index);
        self.measure.on_shown(index, shown_at, frame);
        if let Some(feedback) = self.display.feedback(index) {
            let told = (frame.planned, feedback.presented_at);
            self.feedback.insert((feedback.arrives_at, index), told);
        }
    }

    fn hear_feedback(&mut self) {
        let Some((_, (planned, presented_at))) = self.feedback.pop_first() else { return };
        if let Some(pacer) = self.planner.pacer() {
            pacer.on_presented(planned, presented_at);
        }
    }

    fn take_key(&mut self) {
        let Some(key) = self.keys.next() else { return };
        let index = self.measure.on_key(key.arrived_at);
        self.newest = Some((index, key.content_time));
        self.planner.on_key(key.content_time, key.arrived_at);
    }

    fn begin(&mut self, plan: Plan) {
        self.planner.start(&plan);
        let (Some(content_time), Some((key, key_time))) = (plan.content_time, self.newest) else {
            return; // nothing to show yet
        };
        let usual = (self.work.typical + self.chance.within(self.work.jitter)).max(MonoSpan::ZERO);
        let is_spike = self.chance.happens(self.work.spike_per_mille);
        let work = if is_spike { usual.scale(3, 1) } else { usual };
        let is_real = content_time == key_time;
        let frame = ShownFrame { planned: plan.present_at, content_time, key, is_real };
        self.measure.on_started();
        self.in_work = Some((self.now + work, frame, plan));
    }

    fn hand_over(&mut self) {
        let Some((_, frame, plan)) = self.in_work.take() else { return };
        if let Some(pacer) = self.planner.pacer() {
            pacer.on_work(self.now - plan.wake_at);
            if self.now > plan.submit_by {
                pacer.on_dropped();
                self.measure.on_dropped();
                return;
            }
        }
        let index = self.display.shows_at(self.now);
        if let Some((waiting, old)) = self.pending.replace((index, frame)) {
            if waiting == index {
                self.measure.on_discarded();
                if let Some(pacer) = self.planner.pacer() {
                    pacer.on_discarded();
                }
            } else {
                // Both are shown: the one that waits, first.
                self.pending = Some((waiting, old));
                self.refresh();
                self.pending = Some((index, frame));
            }
        }
    }
}
