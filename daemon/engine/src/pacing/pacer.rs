//! The state machine: joins grid, content clock, cadence and budget into plans.

use super::budget::{Budget, Shows};
use super::cadence::KeyCadence;
use super::content::{ContentClock, KeyOffer, KeyTiming};
use super::flight::Flight;
use super::refresh::RefreshTracker;
use super::types::{FeedbackState, PacerConfig, PacerCounts, PacerStatus, Plan, RefreshKind};
use super::variable::VariableRefresh;
use crate::time::{MonoSpan, MonoTime};

/// A frame less than refresh interval / this ahead of its key is the key: what warping would move
/// is below what an eye can follow, and a picture that is not resampled is sharper.
const SAME_AS_KEY_DIVISOR: i64 = 32;
/// The same on a variable display, where a key comes at any instant and would hardly ever be shown
/// as it is: a millisecond at 120 Hz.
const SAME_AS_KEY_DIVISOR_VARIABLE: i64 = 8;
/// Weight of a new key in the slack told to the application, as a divisor.
const SLACK_SMOOTHING_DIVISOR: i64 = 8;
/// Slack that the application should aim at: late enough to be fresh, early enough to be safe.
const TARGET_SLACK: MonoSpan = MonoSpan::from_us(500);
/// Deadline and margin together are at most this share of a refresh interval, in percent.
const EARLIEST_PERCENT: i64 = 85;
/// A frame shown earlier than planned by more than this share of the interval, in percent, has not
/// waited for a refresh.
const EARLY_PERCENT: i64 = 30;
/// So many of them in a row mean that the display follows us at a pace slower than its own.
const EARLY_TO_REPHASE: u32 = 4;
/// A picture that is ready sooner is handed over this share of an interval before it has to be.
const EARLY_DIVISOR: i64 = 8;
/// While no key is expected, pictures are begun this share of an interval before they have to be:
/// longer than an operating system usually keeps a thread waiting, 2 ms at 120 Hz.
const HEAD_START_DIVISOR: i64 = 4;
/// So many frames in a row that the display throws away mean that nobody sees them.
const DISCARDS_TO_HIDE: u32 = 16;
/// So many of them in a row are no fault of the pacing, and widen no margin.
const DISCARDS_TO_BLAME: u32 = 4;
/// From one frame to the next while nobody sees them: enough to notice that somebody does again.
const HIDDEN_INTERVAL: MonoSpan = MonoSpan::from_ms(250);

/// Plans frames for one stream on one display.
///
/// Call [`plan`](Self::plan) after every event and wait until `wake_at` or the next event,
/// whichever comes first. At `wake_at`, [`start`](Self::start) the plan, make the picture, tell
/// [`on_work`](Self::on_work), and hand it over, or drop it ([`on_dropped`](Self::on_dropped)) if
/// it comes too late for the display: after `submit_by`, or on a timer display after `present_at`.
/// Tell [`on_presented`](Self::on_presented) when feedback comes. A display that may fail to answer
/// is watched from the frames that [`on_handed_over`](Self::on_handed_over) tells of.
#[derive(Clone, Debug)]
pub struct Pacer {
    interpolates: bool,
    refresh: RefreshTracker,
    /// In place of `refresh` where the display has no grid.
    variable: Option<VariableRefresh>,
    flight: Flight,
    clock: ContentClock,
    cadence: KeyCadence,
    budget: Budget,
    newest: Option<MonoTime>,
    last_target: Option<MonoTime>,
    /// When the frame for `last_target` was shown, once that is known.
    last_shown: Option<MonoTime>,
    last_content: Option<MonoTime>,
    /// Whether the window is shown, as far as its owner knows.
    is_visible: bool,
    discards_in_a_row: u32,
    early_in_a_row: u32,
    /// What the frame that was started last shows.
    in_work: Shows,
    /// Refreshes from one picture of a key to the next.
    stride: u32,
    /// Whether no picture was started since the newest key, or other news.
    has_news: bool,
    slack: Option<MonoSpan>,
    counts: PacerCounts,
}

impl Pacer {
    /// Whether pictures come from between the two newest keys from now on.
    pub fn set_interpolates(&mut self, interpolates: bool) {
        self.interpolates = interpolates;
    }

    /// Makes a picture for every `refreshes`-th refresh from now on, at least 1, but one that has
    /// news, as the first of a key may, as soon as ever.
    pub fn set_stride(&mut self, refreshes: u32) {
        self.stride = refreshes.max(1);
    }

    /// The next picture shows more than that things have moved on.
    pub fn on_news(&mut self) {
        self.has_news = true;
    }

    /// A pacer that has seen nothing.
    #[must_use]
    pub fn new(config: PacerConfig) -> Self {
        Self {
            interpolates: config.interpolates,
            refresh: RefreshTracker::new(config.refresh_interval, config.known_refresh),
            variable: variable(config.refresh, config.refresh_interval),
            flight: Flight::default(),
            clock: ContentClock::default(),
            cadence: KeyCadence::default(),
            budget: Budget::new(config.work),
            newest: None,
            last_target: None,
            last_shown: None,
            last_content: None,
            is_visible: true,
            discards_in_a_row: 0,
            early_in_a_row: 0,
            in_work: Shows::InBetween,
            stride: 1,
            has_news: false,
            slack: None,
            counts: PacerCounts::default(),
        }
    }

    /// The same, on a display that is expected to need frames `before_refresh`, until it shows
    /// otherwise. Without this a frame is expected to be shown if it comes just before.
    #[must_use]
    pub fn with_deadline(self, before_refresh: MonoSpan) -> Self {
        Self { flight: Flight::with_deadline(before_refresh), ..self }
    }

    /// A key frame has arrived, whole. `is_cut`: nothing before it relates to it.
    pub fn on_key(&mut self, content_time: MonoTime, arrived_at: MonoTime, is_cut: bool) {
        self.refresh.anchor_at(arrived_at + self.budget());
        if let Some(variable) = &mut self.variable {
            variable.on_key(arrived_at);
        }
        let budget = self.budget.work_at_best(self.interval()) + self.margin() + self.offset();
        let ready_at = arrived_at + budget;
        let first_refresh = self.first_reachable_with(arrived_at, budget);
        self.learn_slack(first_refresh - ready_at);
        let offer = KeyOffer { content_time, ready_at, first_refresh, is_cut };
        let refresh = &self.refresh;
        // Where content times are uneven, every key meets the grid in another place anyway.
        let can_foresee = self.variable.is_none() && self.cadence.is_even(self.interval());
        let reachable = |ready_at| can_foresee.then(|| refresh.at_or_after(ready_at));
        match self.clock.on_key(&offer, self.lag_limit(), reachable) {
            KeyTiming::Followed => {
                self.cadence.on_key(content_time, arrived_at, first_refresh);
            }
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
        self.has_news = true;
        self.debug_verify();
    }

    /// The next frame to make, as seen at `now`. Calling it again replaces the plan; only
    /// [`start`](Self::start) takes its refresh.
    pub fn plan(&mut self, now: MonoTime) -> Plan {
        let interval = self.interval();
        let held = self.flight.hold_until(now, interval);
        self.refresh.anchor_at(now + self.budget());
        let hidden = self.last_target.filter(|_| self.is_hidden());
        let from = now.max(held.unwrap_or(now)).max(hidden.map_or(now, |t| t + HIDDEN_INTERVAL));
        let (shows, present_at) = self.next_picture(from);
        let hand_over = self.budget.hand_over(interval);
        let deadline = present_at - self.offset();
        let submit_by = (deadline - hand_over).max(now);
        let wake_by = (present_at - self.budget_of(shows)).max(now);
        let wake_at = (wake_by - self.head_start(wake_by, shows)).max(now);
        let submit_from = match (&self.variable, shows) {
            // A display without a beam shows what comes early early.
            (None, _) if self.knows_phase() => submit_by - interval.scale(1, EARLY_DIVISOR),
            (Some(_), Shows::Key) => now,
            (None, _) | (Some(_), Shows::InBetween) => submit_by,
        };
        let submit_from = submit_from.min(submit_by).max(now);
        let content_time = self.content_time_at(present_at);
        Plan { wake_at, wake_by, submit_from, submit_by, present_at, content_time }
    }

    /// How much sooner a picture is begun than it has to be by `wake_by`. A key that comes between
    /// the two would be shown a refresh later for it, so only while none is expected.
    fn head_start(&self, wake_by: MonoTime, shows: Shows) -> MonoSpan {
        let is_quiet = self.cadence.quiet_until().is_some_and(|until| wake_by < until);
        if is_quiet && shows == Shows::InBetween && self.variable.is_none() {
            self.interval().scale(1, HEAD_START_DIVISOR)
        } else {
            MonoSpan::ZERO
        }
    }

    /// The refresh to make the next picture for: one that an in-between frame can make, or an
    /// earlier one that shows a key as it is, which takes less.
    fn next_picture(&self, from: MonoTime) -> (Shows, MonoTime) {
        let mut present_at = self.first_reachable(from);
        if let Some(last) = self.last_target.filter(|_| !self.has_news && self.variable.is_none()) {
            let passed_over = self.interval().scale(i64::from(self.stride) - 1, 1);
            let half = self.interval().scale(1, 2);
            present_at = present_at.max(self.refresh.at_or_after(last + half + passed_over));
        }
        let of_key = self.first_reachable_with(from, self.budget_of(Shows::Key));
        if of_key <= present_at && self.shows_key(self.content_time_at(of_key)) {
            return (Shows::Key, of_key);
        }
        if let (Some(variable), Some(last)) = (&self.variable, self.last_target) {
            let armed = variable.next_in_between(last, self.cadence.interval());
            present_at = present_at.max(armed.unwrap_or(present_at));
        }
        (Shows::InBetween, present_at)
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
        self.last_shown = None;
        self.has_news = false;
        if let Some(variable) = &mut self.variable {
            variable.on_start(plan.present_at);
        }
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

    /// Making the frame that was started last took `work`, from its start, or from the plan's
    /// `wake_by` if it started after that, to the picture being ready.
    pub fn on_work(&mut self, work: MonoSpan) {
        self.budget.on_work(self.in_work, work);
        self.debug_verify();
    }

    /// The picture of a started plan was not ready in time and is not handed over.
    pub fn on_dropped(&mut self) {
        self.counts.dropped += 1;
        self.has_news = true; // nobody has seen it
        self.on_miss();
    }

    /// The picture of a started plan was handed to the display at `handed_over_at`, and an answer
    /// is expected. Displays that need no watching, such as timers, are not told of here.
    pub fn on_handed_over(&mut self, plan: &Plan, handed_over_at: MonoTime) {
        let lead = plan.present_at - handed_over_at;
        self.flight.hand_over(plan.present_at, lead, handed_over_at <= plan.submit_by);
        self.debug_verify();
    }

    /// The frame that was planned for `planned` and handed over will never be shown: a newer one
    /// replaced it, or nobody sees the window.
    pub fn on_discarded(&mut self, planned: MonoTime) {
        self.has_news = true; // nobody has seen it
        let is_blamed = self.variable.is_none() && self.discards_in_a_row < DISCARDS_TO_BLAME;
        self.flight.on_discarded(planned, self.interval(), is_blamed);
        self.discards_in_a_row = self.discards_in_a_row.saturating_add(1);
        if self.discards_in_a_row > DISCARDS_TO_BLAME {
            self.counts.missed += 1;
        } else {
            self.on_miss();
        }
    }

    /// The display has shown the frame that was planned for `planned` at `presented_at`; this was
    /// heard at `heard_at`.
    pub fn on_presented(&mut self, planned: MonoTime, presented_at: MonoTime, heard_at: MonoTime) {
        if let Some(variable) = &mut self.variable {
            variable.on_presented(presented_at);
        } else {
            let was_corrected = self.refresh.is_corrected();
            self.refresh.on_presented(presented_at, self.discards_in_a_row);
            if self.refresh.is_corrected() != was_corrected {
                self.flight.on_mode();
            }
        }
        self.discards_in_a_row = 0;
        if self.last_target == Some(planned) {
            self.last_shown = Some(presented_at);
        }
        let interval = self.interval();
        let half = interval.scale(1, 2);
        let late = presented_at - planned;
        let is_early = late < -interval.scale(EARLY_PERCENT, 100);
        self.early_in_a_row = if is_early { self.early_in_a_row + 1 } else { 0 };
        if self.early_in_a_row >= EARLY_TO_REPHASE && self.variable.is_none() {
            self.early_in_a_row = 0;
            self.refresh.restart_at(presented_at);
        }
        let late_for_grid = if self.variable.is_none() { late } else { MonoSpan::ZERO };
        self.flight.on_shown(planned, late_for_grid, heard_at, interval);
        if late > half {
            self.on_miss();
        } else if late < -half {
            // Shown early: a wider margin would make it earlier still.
            self.counts.missed += 1;
        } else {
            self.counts.on_target += 1;
            self.budget.on_good();
        }
        self.debug_verify();
    }

    /// The display has changed its mode: another refresh interval, another kind, or another
    /// display. What was learned of the application stays.
    pub fn on_mode(&mut self, refresh_interval: MonoSpan, refresh: RefreshKind) {
        self.refresh.on_mode(refresh_interval);
        self.variable = variable(refresh, refresh_interval);
        self.flight.on_mode();
        self.discards_in_a_row = 0;
        self.debug_verify();
    }

    /// Whether anybody can see what is shown. While nobody can, a frame is planned now and then.
    pub fn on_visibility(&mut self, is_visible: bool) {
        self.is_visible = is_visible;
        self.discards_in_a_row = 0;
    }

    /// What is known about display and application.
    #[must_use]
    pub fn status(&self) -> PacerStatus {
        let interval = self.interval();
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
            display_offset: self.offset(),
            is_rate_corrected: self.refresh.is_corrected(),
            keeps_up: self.keeps_up(),
            unanswered: self.flight.unanswered(),
            feedback: self.feedback(),
            counts: PacerCounts { distrusted_timestamps: self.refresh.outliers(), ..self.counts },
        }
    }

    fn feedback(&self) -> FeedbackState {
        if self.is_hidden() {
            FeedbackState::Hidden
        } else if self.flight.is_silent() {
            FeedbackState::Absent
        } else if self.counts.on_target + self.counts.missed > 0 {
            FeedbackState::Presented
        } else {
            FeedbackState::Awaited
        }
    }

    fn is_hidden(&self) -> bool {
        !self.is_visible || self.discards_in_a_row >= DISCARDS_TO_HIDE
    }

    /// Keys come as fast as the display refreshes, one for each: there is nothing to put in
    /// between.
    fn keeps_up(&self) -> bool {
        self.variable.is_none() && self.cadence.keeps_up_with(self.interval())
    }

    /// Time between two refreshes; on a variable display the shortest.
    fn interval(&self) -> MonoSpan {
        self.variable.as_ref().map_or_else(|| self.refresh.interval(), VariableRefresh::shortest)
    }

    /// Whether it is known when the display refreshes.
    fn knows_phase(&self) -> bool {
        self.variable.is_some() || (self.refresh.is_measured() && !self.flight.is_silent())
    }

    /// From the display's deadline for a frame to the refresh that shows it. Where the phase is
    /// unknown a frame handed over is shown within one interval, so half of one is the best guess,
    /// and off by no more than that.
    fn offset(&self) -> MonoSpan {
        if !self.knows_phase() {
            self.interval().scale(1, 2)
        } else {
            self.interval().scale(self.flight.offset(), 1) + self.flight.deadline()
        }
    }

    fn on_miss(&mut self) {
        self.counts.missed += 1;
        self.budget.on_miss(self.interval());
        self.debug_verify();
    }

    /// Leaves a frame that is ready on time no room to be taken for the refresh before.
    fn margin(&self) -> MonoSpan {
        let interval = self.interval();
        let most = interval.scale(EARLIEST_PERCENT, 100) - self.flight.deadline();
        self.budget.margin(interval).min(most)
    }

    /// Time from wake to the refresh of an in-between frame.
    fn budget(&self) -> MonoSpan {
        self.budget_of(Shows::InBetween)
    }

    fn budget_of(&self, shows: Shows) -> MonoSpan {
        self.budget.work(shows, self.interval()) + self.margin() + self.offset()
    }

    /// The first refresh that an in-between frame started at `time` can make and that is not taken.
    fn first_reachable(&self, time: MonoTime) -> MonoTime {
        self.first_reachable_with(time, self.budget())
    }

    fn first_reachable_with(&self, time: MonoTime, budget: MonoSpan) -> MonoTime {
        let ready = time + budget;
        if let Some(variable) = &self.variable {
            return ready.max(variable.free_from(self.last_target));
        }
        let half = self.refresh.interval().scale(1, 2);
        // Half an interval tells the next refresh from the taken one after the grid has moved.
        let free = self.last_target.map_or(MonoTime::ZERO, |planned| match self.last_shown {
            // Shown early, it has not taken the refresh that it was planned for.
            Some(shown) if shown < planned => (shown + half).max(planned + half.scale(1, 4)),
            _ => planned + half,
        });
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
            let is_same = self.keeps_up() || lead < self.same_as_key();
            if is_same { newest } else { newest + lead }
        };
        Some(self.last_content.map_or(content, |shown| content.max(shown)))
    }

    fn same_as_key(&self) -> MonoSpan {
        let divisor = match self.variable {
            None => SAME_AS_KEY_DIVISOR,
            Some(_) => SAME_AS_KEY_DIVISOR_VARIABLE,
        };
        self.interval().scale(1, divisor)
    }

    /// By how much keys may lag behind the best of them without being stuck there: half an interval
    /// of jitter, and the refresh that a key may just have missed.
    fn lag_limit(&self) -> MonoSpan {
        let interval = self.cadence.interval().unwrap_or(MonoSpan::MAX);
        interval.scale(1, 2) + self.interval()
    }

    fn learn_slack(&mut self, slack: MonoSpan) {
        let interval = self.interval();
        // On a circle: slack just above zero and just below one interval are neighbours.
        let smoothed =
            |old: MonoSpan| old + wrapped(slack - old, interval).scale(1, SLACK_SMOOTHING_DIVISOR);
        let slack = self.slack.map_or(slack, smoothed);
        let around = slack.as_ns().rem_euclid(interval.as_ns().max(1));
        self.slack = Some(MonoSpan::from_ns(around));
    }

    /// Checks every invariant that the fields state.
    ///
    /// # Panics
    /// If one does not hold, which is a bug in this module.
    pub fn verify_invariants(&self) {
        self.refresh.verify_invariants();
        self.clock.verify_invariants();
        self.budget.verify_invariants();
        self.flight.verify_invariants();
        assert!(self.margin() <= self.interval().scale(1, 2), "margin above half a refresh");
        assert!(self.counts.dropped <= self.counts.missed, "a drop is a miss: {:?}", self.counts);
    }

    fn debug_verify(&self) {
        if cfg!(debug_assertions) {
            self.verify_invariants();
        }
    }
}

fn variable(refresh: RefreshKind, shortest: MonoSpan) -> Option<VariableRefresh> {
    (refresh == RefreshKind::Variable).then(|| VariableRefresh::new(shortest))
}

/// `span` moved by whole intervals into half an interval around zero.
fn wrapped(span: MonoSpan, interval: MonoSpan) -> MonoSpan {
    let half = interval.as_ns() / 2;
    MonoSpan::from_ns((span.as_ns() + half).rem_euclid(interval.as_ns().max(1)) - half)
}
