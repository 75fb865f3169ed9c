//! The event loop: keys arrive, feedback arrives, the display refreshes, work ends, the pacer
//! wakes.

use std::collections::BTreeMap;

use super::display::{DisplayScript, SimDisplay, Slot};
use super::keys::{KeyScript, KeySource};
use super::measure::{Measure, ShownFrame, SimPicture, SimReport};
use super::policy::{Planner, Policy};
use super::rng::SplitMix64;
use crate::pacing::Plan;
use crate::time::{MonoSpan, MonoTime};

/// When a simulation starts, from the clock's epoch: late enough for jitter to reach below it.
const START: MonoSpan = MonoSpan::from_ms(1_000);
/// The share of the phase error by which an application that follows it moves its next frame.
const FOLLOW_DIVISOR: i64 = 16;

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
    let mut run = Run::new(scenario, policy, start);
    run.live_until(start + scenario.duration);
    run.measure.report(run.planner.status())
}

/// Runs `policy` through `scenario`; returns what was shown, in order.
#[must_use]
pub fn simulate_pictures(scenario: &Scenario, policy: Policy) -> Vec<SimPicture> {
    let start = MonoTime::ZERO + START;
    let mut run = Run::new(scenario, policy, start);
    run.live_until(start + scenario.duration);
    run.measure.pictures()
}

/// What happens next. In this order where several happen at one instant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Event {
    Refresh,
    Feedback,
    Key,
    HandOver,
    Wake,
}

struct Run {
    now: MonoTime,
    planner: Box<dyn Planner>,
    keys: KeySource,
    display: SimDisplay,
    chance: SplitMix64,
    work: WorkScript,
    /// Index and content time of the newest key that has arrived.
    newest: Option<(usize, MonoTime)>,
    in_work: Option<InWork>,
    /// The frames that the display will show, by the number of the slot.
    pending: BTreeMap<i64, (Slot, ShownFrame)>,
    /// Feedback under way, by arrival: planned and presented.
    feedback: BTreeMap<(MonoTime, i64), (MonoTime, MonoTime)>,
    measure: Measure,
}

/// A frame being made.
#[derive(Clone, Copy, Debug)]
struct InWork {
    ready_at: MonoTime,
    frame: ShownFrame,
    plan: Plan,
}

impl Run {
    fn new(scenario: &Scenario, policy: Policy, start: MonoTime) -> Self {
        let mut seeds = SplitMix64::new(scenario.seed);
        let display = SimDisplay::new(scenario.display, seeds.next_bits(), start);
        Self {
            now: start,
            planner: policy.planner(scenario.display.refresh_interval),
            keys: KeySource::new(scenario.keys, seeds.next_bits(), start),
            chance: SplitMix64::new(seeds.next_bits()),
            work: scenario.work,
            newest: None,
            in_work: None,
            pending: BTreeMap::new(),
            feedback: BTreeMap::new(),
            measure: Measure::new(display.interval(), display.kind()),
            display,
        }
    }

    fn live_until(&mut self, end: MonoTime) {
        loop {
            let plan = self.planner.plan(self.now);
            let (at, event) = self.next_event(&plan);
            if at > end {
                return;
            }
            self.now = at;
            match event {
                Event::Refresh => self.refresh(),
                Event::Feedback => self.hear_feedback(),
                Event::Key => self.take_key(),
                Event::HandOver => self.hand_over(),
                Event::Wake => self.begin(plan),
            }
        }
    }

    fn next_event(&mut self, plan: &Plan) -> (MonoTime, Event) {
        let refresh = self.pending.first_key_value().map(|(_, (slot, _))| slot.at);
        let feedback = self.feedback.first_key_value().map(|(&(at, _), _)| at);
        let key = Some(self.keys.peek().arrived_at);
        let done = self.in_work.map(|work| work.ready_at.max(work.plan.submit_from));
        // One frame is made at a time: no wake while another is in work.
        let wake = done.is_none().then_some(plan.wake_at);
        [
            (refresh, Event::Refresh),
            (feedback, Event::Feedback),
            (key, Event::Key),
            (done, Event::HandOver),
            (wake, Event::Wake),
        ]
        .into_iter()
        .filter_map(|(at, event)| Some((at?.max(self.now), event)))
        .min()
        .expect("either work is under way or a wake is planned")
    }

    fn refresh(&mut self) {
        let Some((_, (slot, frame))) = self.pending.pop_first() else { return };
        self.display.show(slot);
        self.measure.on_shown(slot.index, slot.at, frame);
        if let Some(feedback) = self.display.feedback(slot) {
            let told = (frame.planned, feedback.presented_at);
            self.feedback.insert((feedback.arrives_at, slot.index), told);
        }
    }

    fn hear_feedback(&mut self) {
        let Some((_, (planned, presented_at))) = self.feedback.pop_first() else { return };
        self.planner.on_presented(planned, presented_at, self.now);
    }

    fn take_key(&mut self) {
        let key = self.keys.take_next();
        let index = self.measure.on_key(key.arrived_at);
        self.newest = Some((index, key.content_time));
        self.planner.on_key(key.content_time, key.arrived_at);
        if self.keys.follows() {
            let error = self.planner.status().and_then(|status| status.phase_error);
            self.keys.shift(error.unwrap_or_default().scale(1, FOLLOW_DIVISOR));
        }
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
        self.in_work = Some(InWork { ready_at: self.now + work, frame, plan });
    }

    fn hand_over(&mut self) {
        let Some(InWork { ready_at, frame, plan }) = self.in_work.take() else { return };
        self.planner.on_work(ready_at - plan.wake_at);
        if self.planner.drops_what_is_late() && self.now > plan.submit_by {
            self.planner.on_dropped();
            self.measure.on_dropped();
            return;
        }
        self.planner.on_handed_over(&plan, self.now);
        let slot = self.display.slot(self.now);
        if let Some((_, old)) = self.pending.insert(slot.index, (slot, frame)) {
            self.measure.on_discarded();
            if self.display.tells_of_discard(slot) {
                self.planner.on_discarded(old.planned);
            }
        }
        self.measure.on_queue(self.pending.len());
    }
}
