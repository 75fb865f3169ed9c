//! The state machine: joins grid, content clock, cadence and budget into plans.

use super::budget::{Budget, Shows, WorkEstimate};
use super::cadence::KeyCadence;
use super::content::{ContentClock, KeyTiming};
use super::refresh::RefreshTracker;
use crate::time::{MonoSpan, MonoTime};

/// A frame less than refresh interval / this ahead of its key is the key: what warping would move
/// is below what an eye can follow, and a picture that is not resampled is sharper.
const SAME_AS_KEY_DIVISOR: i64 = 32;
/// Weight of a new key in the slack told to the application, as a divisor.
const SLACK_SMOOTHING_DIVISOR: i64 = 8;
/// Slack that the application should aim at: late enough to be fresh, early enough to be safe.
const TARGET_SLACK: MonoSpan = MonoSpan::from_us(500);

/// What a pacer has to know before the first frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacerConfig {
    /// Announced display period; the tracked one starts from it and stays within 1/16 of it.
    pub refresh_interval: MonoSpan,
    /// An instant at which the display refreshes, where it is known beforehand (timer sinks,
    /// replay). Else the first plan sets the grid and the first feedback corrects it.
    pub known_refresh: Option<MonoTime>,
    /// Adds one key interval of delay, for methods that need the key after the content time.
    pub interpolates: bool,
    /// Where the work estimate comes from.
    pub work: WorkEstimate,
}

/// The next frame. `wake_at <= submit_by <= present_at`, and none lies before the `now` it was
/// planned at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Plan {
    /// When to start to make the picture.
    pub wake_at: MonoTime,
    /// When it has to be handed to the display at the latest, for displays that need it some time
    /// before. One that only counts its refreshes takes a picture until `present_at`.
    pub submit_by: MonoTime,
    /// When the display starts to show it.
    pub present_at: MonoTime,
    /// Which content time it shows, after easing; never before the newest key's unless the method
    /// interpolates. Equal to the newest key's where that key is to be shown as it is. None before
    /// the first key.
    pub content_time: Option<MonoTime>,
}

/// Events since the pacer was made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct PacerCounts {
    /// Frames shown at their planned refresh.
    pub on_target: u64,
    /// Frames not shown at their planned refresh: shown at another, never shown, or dropped.
    pub missed: u64,
    /// Frames that were not ready in time and were not handed over. Part of `missed`.
    pub dropped: u64,
    /// Steps of the application's clock, forwards or backwards.
    pub clock_steps: u64,
    /// Times that keys fell behind for good and the content clock followed.
    pub relocks: u64,
    /// Presentation timestamps that were off the grid and not followed.
    pub distrusted_timestamps: u64,
}

/// What is known about display and application, as durations: they hold across clock borders.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacerStatus {
    /// Tracked time from refresh to refresh.
    pub refresh_interval: MonoSpan,
    /// Usual content time from key to key. None before the second key.
    pub key_interval: Option<MonoSpan>,
    /// How much later keys could have arrived without being shown later, smoothed.
    /// 0 to one refresh interval. None before the first key.
    pub slack: Option<MonoSpan>,
    /// By how much the application should start its frames later (positive) or earlier to meet the
    /// refresh with little slack, within half a refresh interval. None before the first key.
    pub phase_error: Option<MonoSpan>,
    /// Present time minus content time of the newest started frame.
    pub delay: Option<MonoSpan>,
    /// Expected time from wake to an in-between frame being ready.
    pub work: MonoSpan,
    /// The same for a key that is shown as it is.
    pub key_work: MonoSpan,
    /// Time from there to the refresh.
    pub margin: MonoSpan,
    /// Events so far.
    pub counts: PacerCounts,
}

/// Plans frames for one stream on one display.
///
/// Call [`plan`](Self::plan) after every event and wait until `wake_at` or the next event,
/// whichever comes first. At `wake_at`, [`start`](Self::start) the plan, make the picture, tell
/// [`on_work`](Self::on_work), and hand it over, or drop it ([`on_dropped`](Self::on_dropped)) if
/// it comes too late for the display: after `submit_by`, or on a timer display after `present_at`.
/// Tell [`on_presented`](Self::on_presented) when feedback comes.
#[derive(Clone, Debug)]
pub struct Pacer {
    interpolates: bool,
    refresh: RefreshTracker,
    clock: ContentClock,
    cadence: KeyCadence,
    budget: Budget,
    newest: Option<MonoTime>,
    last_target: Option<MonoTime>,
    last_content: Option<MonoTime>,
    /// What the frame that was started last shows.
    in_work: Shows,
    slack: Option<MonoSpan>,
    counts: PacerCounts,
}

impl Pacer {
    /// A pacer that has seen nothing.
    #[must_use]
    pub fn new(config: PacerConfig) -> Self {
        Self {
            interpolates: config.interpolates,
            refresh: RefreshTracker::new(config.refresh_interval, config.known_refresh),
            clock: ContentClock::default(),
            cadence: KeyCadence::default(),
            budget: Budget::new(config.work),
            newest: None,
            last_target: None,
            last_content: None,
            in_work: Shows::InBetween,
            slack: None,
            counts: PacerCounts::default(),
        }
    }

    /// A key frame has arrived, whole. `is_cut`: nothing before it relates to it.
    pub fn on_key(&mut self, content_time: MonoTime, arrived_at: MonoTime, is_cut: bool) {
        self.refresh.anchor_at(arrived_at + self.budget());
        let first_refresh = self.first_reachable(arrived_at);
        self.learn_slack(first_refresh - self.budget() - arrived_at);
        match self.clock.on_key(content_time, first_refresh, self.lag_limit(), is_cut) {
            KeyTiming::Followed => self.cadence.on_key(content_time, first_refresh),
            KeyTiming::Stepped => {
                self.counts.clock_steps += 1;
                self.cadence.on_clock_step(content_time);
                self.last_content = None;
            }
            KeyTiming::Relocked => {
                self.counts.relocks += 1;
                self.cadence.on_clock_step(content_time);
            }
        }
        if is_cut {
            self.last_content = None;
        }
        self.newest = Some(content_time);
        self.debug_verify();
    }

    /// The next frame to make, as seen at `now`. Calling it again replaces the plan; only
    /// [`start`](Self::start) takes its refresh.
    pub fn plan(&mut self, now: MonoTime) -> Plan {
        self.refresh.anchor_at(now + self.budget());
        let (shows, present_at) = self.next_picture(now);
        let hand_over = self.budget.hand_over(self.refresh.interval());
        let submit_by = (present_at - hand_over).max(now);
        let wake_at = (present_at - self.budget_of(shows)).max(now);
        Plan { wake_at, submit_by, present_at, content_time: self.content_time_at(present_at) }
    }

    /// The refresh to make the next picture for: one that an in-between frame can make, or an
    /// earlier one that shows a key as it is, which takes less.
    fn next_picture(&self, now: MonoTime) -> (Shows, MonoTime) {
        let present_at = self.first_reachable(now);
        let of_key = self.first_reachable_with(now, self.budget_of(Shows::Key));
        if of_key <= present_at && self.shows_key(self.content_time_at(of_key)) {
            (Shows::Key, of_key)
        } else {
            (Shows::InBetween, present_at)
        }
    }

    fn shows_key(&self, content_time: Option<MonoTime>) -> bool {
        !self.interpolates && content_time.is_some() && content_time == self.newest
    }

    /// The picture of `plan` is being made: its refresh is taken.
    pub fn start(&mut self, plan: &Plan) {
        if self.last_target.is_some_and(|last| plan.present_at <= last) {
            return; // the same plan again: its refresh is taken already
        }
        self.last_target = Some(plan.present_at);
        let shows_key = self.shows_key(plan.content_time);
        self.in_work = if shows_key { Shows::Key } else { Shows::InBetween };
        let delay = match self.newest {
            // The line goes on from the key: if only the frame moved, the next one would move back.
            Some(newest) if shows_key => Some(plan.present_at - newest),
            _ => self.delay_at(plan.present_at),
        };
        if let Some(delay) = delay {
            self.clock.go_on_from(plan.present_at, delay);
        }
        self.last_content = plan.content_time;
        self.debug_verify();
    }

    /// Making the frame that was started last took `work`, from its planned wake to the picture
    /// being ready.
    pub fn on_work(&mut self, work: MonoSpan) {
        self.budget.on_work(self.in_work, work);
        self.debug_verify();
    }

    /// The picture of a started plan was not ready in time and is not handed over.
    pub fn on_dropped(&mut self) {
        self.counts.dropped += 1;
        self.on_miss();
    }

    /// A frame that was handed over will never be shown: a newer one replaced it.
    pub fn on_discarded(&mut self) {
        self.on_miss();
    }

    /// The display has shown the frame that was planned for `planned` at `presented_at`.
    pub fn on_presented(&mut self, planned: MonoTime, presented_at: MonoTime) {
        self.refresh.on_presented(presented_at);
        let half = self.refresh.interval().scale(1, 2);
        let late = presented_at - planned;
        if late > half || late < -half {
            self.on_miss();
        } else {
            self.counts.on_target += 1;
            self.budget.on_good();
        }
        self.debug_verify();
    }

    /// What is known about display and application.
    #[must_use]
    pub fn status(&self) -> PacerStatus {
        let interval = self.refresh.interval();
        let delay = |target| Some(target - self.last_content?);
        PacerStatus {
            refresh_interval: interval,
            key_interval: self.cadence.interval(),
            slack: self.slack,
            phase_error: self.slack.map(|slack| wrapped(slack - TARGET_SLACK, interval)),
            delay: self.last_target.and_then(delay),
            work: self.budget.work(Shows::InBetween, interval),
            key_work: self.budget.work(Shows::Key, interval),
            margin: self.margin(),
            counts: PacerCounts { distrusted_timestamps: self.refresh.outliers(), ..self.counts },
        }
    }

    fn on_miss(&mut self) {
        self.counts.missed += 1;
        self.budget.on_miss(self.refresh.interval());
        self.debug_verify();
    }

    fn margin(&self) -> MonoSpan {
        self.budget.margin(self.refresh.interval())
    }

    /// Time from wake to the refresh of an in-between frame.
    fn budget(&self) -> MonoSpan {
        self.budget_of(Shows::InBetween)
    }

    fn budget_of(&self, shows: Shows) -> MonoSpan {
        self.budget.work(shows, self.refresh.interval()) + self.margin()
    }

    /// The first refresh that an in-between frame started at `time` can make and that is not taken.
    fn first_reachable(&self, time: MonoTime) -> MonoTime {
        self.first_reachable_with(time, self.budget())
    }

    fn first_reachable_with(&self, time: MonoTime, budget: MonoSpan) -> MonoTime {
        let ready = time + budget;
        let half = self.refresh.interval().scale(1, 2);
        // Half an interval tells the next refresh from the taken one after the grid has moved.
        let free = self.last_target.map_or(MonoTime::ZERO, |taken| taken + half);
        self.refresh.at_or_after(ready.max(free))
    }

    /// Delay of content time at `present_at`, small enough for the newest key's phase not to be
    /// negative.
    fn delay_at(&self, present_at: MonoTime) -> Option<MonoSpan> {
        Some(self.clock.delay_at(present_at)?.min(present_at - self.newest?))
    }

    fn content_time_at(&self, present_at: MonoTime) -> Option<MonoTime> {
        let newest = self.newest?;
        let delay = self.delay_at(present_at)?;
        let line = present_at - delay;
        let content = if self.interpolates {
            (line - self.cadence.interval().unwrap_or_default()).min(newest)
        } else {
            let lead = self.cadence.easing(delay).eased(line - newest);
            let same = self.refresh.interval().scale(1, SAME_AS_KEY_DIVISOR);
            if lead < same { newest } else { newest + lead }
        };
        Some(self.last_content.map_or(content, |shown| content.max(shown)))
    }

    /// By how much keys may lag behind the best of them without being stuck there: half an interval
    /// of jitter, and the refresh that a key may just have missed.
    fn lag_limit(&self) -> MonoSpan {
        let interval = self.cadence.interval().unwrap_or(MonoSpan::MAX);
        interval.scale(1, 2) + self.refresh.interval()
    }

    fn learn_slack(&mut self, slack: MonoSpan) {
        let smoothed = |old: MonoSpan| old + (slack - old).scale(1, SLACK_SMOOTHING_DIVISOR);
        let interval = self.refresh.interval();
        self.slack = Some(self.slack.map_or(slack, smoothed).clamp(MonoSpan::ZERO, interval));
    }

    /// Checks every invariant that the fields state.
    ///
    /// # Panics
    /// If one does not hold, which is a bug in this module.
    pub fn verify_invariants(&self) {
        self.refresh.verify_invariants();
        self.clock.verify_invariants();
        self.budget.verify_invariants();
        assert!(
            self.margin() <= self.refresh.interval().scale(1, 2),
            "margin above half a refresh"
        );
        assert!(self.counts.dropped <= self.counts.missed, "a drop is a miss: {:?}", self.counts);
    }

    fn debug_verify(&self) {
        if cfg!(debug_assertions) {
            self.verify_invariants();
        }
    }
}

/// `span` moved by whole intervals into half an interval around zero.
fn wrapped(span: MonoSpan, interval: MonoSpan) -> MonoSpan {
    let half = interval.as_ns() / 2;
    MonoSpan::from_ns((span.as_ns() + half).rem_euclid(interval.as_ns().max(1)) - half)
}
