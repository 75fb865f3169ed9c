//! Laws of the pacer under any sequence of events.
//!
//! A [`World`] holds a pacer, an application and a display; [`Op`]s happen to it; every plan and
//! every started frame is checked.

use proptest::prelude::*;

use crate::pacing::{FeedbackState, Pacer, PacerConfig, Plan, RefreshKind, WorkEstimate};
use crate::time::{MonoSpan, MonoTime};

/// What can happen.
#[derive(Clone, Debug)]
enum Op {
    /// Time passes, keys arrive evenly but for +-`jitter_us` of content time, frames are made.
    Run { ms: u16, jitter_us: i32 },
    /// Time passes without keys, frames are made.
    Stall { ms: u16 },
    /// So many keys arrive at once.
    Burst { keys: u8 },
    /// The application's clock is set.
    ClockStep { ms: i32 },
    /// A key that nothing before relates to.
    Cut,
    /// From now on the display shows frames one refresh late.
    MissVblank(bool),
    /// From now on feedback comes like this.
    Feedback(FeedbackMode),
    /// Making a frame takes so long from now on.
    Work { us: u16 },
    /// The display switches to another rate.
    Mode { hz: u16 },
    /// The window is covered, or seen again.
    Visible(bool),
    /// Pictures for so many refreshes are made from one to the next.
    Stride(u8),
    /// Whether the pacer is told of what is handed over.
    Watch(bool),
    /// Time passes and nobody plans, as in a process that was stopped.
    Sleep { ms: u16 },
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum FeedbackMode {
    Prompt,
    /// Only when three more frames have been started.
    Late,
    /// Each pair of frames the wrong way round.
    OutOfOrder,
    Absent,
    /// Off by a third of a refresh and more.
    Wild,
    /// Every frame is thrown away.
    Discarded,
}

fn op() -> impl Strategy<Value = Op> {
    let feedback = prop_oneof![
        Just(FeedbackMode::Prompt),
        Just(FeedbackMode::Late),
        Just(FeedbackMode::OutOfOrder),
        Just(FeedbackMode::Absent),
        Just(FeedbackMode::Wild),
        Just(FeedbackMode::Discarded),
    ];
    prop_oneof![
        4 => (1_u16..400, -9_000_i32..9_000).prop_map(|(ms, jitter_us)| Op::Run { ms, jitter_us }),
        1 => (1_u16..600).prop_map(|ms| Op::Stall { ms }),
        1 => (1_u8..6).prop_map(|keys| Op::Burst { keys }),
        1 => (-900_i32..900).prop_map(|ms| Op::ClockStep { ms }),
        1 => Just(Op::Cut),
        1 => any::<bool>().prop_map(Op::MissVblank),
        1 => feedback.prop_map(Op::Feedback),
        1 => (0_u16..12_000).prop_map(|us| Op::Work { us }),
        1 => (48_u16..240).prop_map(|hz| Op::Mode { hz }),
        1 => any::<bool>().prop_map(Op::Visible),
        1 => any::<bool>().prop_map(Op::Watch),
        1 => (1_u8..5).prop_map(Op::Stride),
        1 => (1_u16..300).prop_map(|ms| Op::Sleep { ms }),
    ]
}

struct World {
    pacer: Pacer,
    interpolates: bool,
    kind: RefreshKind,
    is_visible: bool,
    is_watched: bool,
    stride: u8,
    /// Whether something is to be seen that no picture was handed over of.
    has_news: bool,
    now: MonoTime,
    refresh: MonoSpan,
    key_interval: MonoSpan,
    next_key: MonoTime,
    /// Content time minus arrival of the application's keys.
    app_clock: MonoSpan,
    newest: Option<MonoTime>,
    /// Last started frame, until the application's clock is set back or a cut comes.
    started: Option<Plan>,
    last_target: MonoTime,
    last_presented: MonoTime,
    key_since_start: bool,
    is_late: bool,
    feedback: FeedbackMode,
    waiting: Vec<(MonoTime, MonoTime)>,
    work: MonoSpan,
}

impl World {
    fn new(refresh_hz: f64, key_hz: f64, interpolates: bool, kind: RefreshKind) -> Self {
        let refresh = MonoSpan::from_hz(refresh_hz);
        Self {
            pacer: Pacer::new(PacerConfig {
                refresh_interval: refresh,
                refresh: kind,
                known_refresh: None,
                interpolates,
                work: WorkEstimate::Measured { first: MonoSpan::from_ms(2) },
            }),
            interpolates,
            kind,
            is_visible: true,
            is_watched: false,
            stride: 1,
            has_news: false,
            now: MonoTime::from_ns(5_000_000_000),
            refresh,
            key_interval: MonoSpan::from_hz(key_hz),
            next_key: MonoTime::from_ns(5_000_000_000),
            app_clock: MonoSpan::from_ms(-20),
            newest: None,
            started: None,
            last_target: MonoTime::ZERO,
            last_presented: MonoTime::ZERO,
            key_since_start: false,
            is_late: false,
            feedback: FeedbackMode::Prompt,
            waiting: vec![],
            work: MonoSpan::from_ms(2),
        }
    }

    fn apply(&mut self, op: &Op) -> Result<(), TestCaseError> {
        match *op {
            Op::Run { ms, jitter_us } => self.run(ms, Some(jitter_us))?,
            Op::Stall { ms } => {
                self.run(ms, None)?;
                self.next_key = self.now;
            }
            Op::Burst { keys } => (0..keys).for_each(|_| self.key(MonoSpan::ZERO, false)),
            Op::ClockStep { ms } => self.app_clock += MonoSpan::from_ms(ms.into()),
            Op::Cut => self.key(MonoSpan::ZERO, true),
            Op::MissVblank(is_late) => self.is_late = is_late,
            Op::Feedback(mode) => self.feedback = mode,
            Op::Work { us } => self.work = MonoSpan::from_us(us.into()),
            Op::Mode { hz } => {
                self.refresh = MonoSpan::from_hz(hz.into());
                self.pacer.on_mode(self.refresh, self.kind);
            }
            Op::Visible(is_visible) => {
                self.is_visible = is_visible;
                self.pacer.on_visibility(is_visible);
            }
            Op::Watch(is_watched) => self.is_watched = is_watched,
            Op::Stride(refreshes) => {
                self.stride = refreshes;
                self.pacer.set_stride(refreshes.into());
            }
            Op::Sleep { ms } => {
                self.now += MonoSpan::from_ms(ms.into());
                self.next_key = self.now;
            }
        }
        self.checked_plan()?;
        self.pacer.verify_invariants();
        Ok(())
    }

    fn key(&mut self, jitter: MonoSpan, is_cut: bool) {
        let content_time = self.now + self.app_clock + jitter;
        if is_cut || self.newest.is_some_and(|newest| content_time < newest) {
            self.started = None;
        }
        self.pacer.on_key(content_time, self.now, is_cut);
        self.newest = Some(content_time);
        self.key_since_start = true;
        self.has_news = true;
    }

    /// Lives through `ms`; keys arrive if they have a jitter.
    fn run(&mut self, ms: u16, jitter_us: Option<i32>) -> Result<(), TestCaseError> {
        let end = self.now + MonoSpan::from_ms(ms.into());
        let mut sign = 1;
        loop {
            let plan = self.checked_plan()?;
            let key_at = jitter_us.map_or(MonoTime::FAR_FUTURE, |_| self.next_key.max(self.now));
            self.now = key_at.min(plan.wake_at).min(end);
            if self.now == end {
                return Ok(());
            }
            if let (true, Some(us)) = (self.now == key_at, jitter_us) {
                self.key(MonoSpan::from_us(i64::from(us) * sign), false);
                self.next_key = key_at + self.key_interval;
                sign = -sign;
            } else {
                self.start(&plan)?;
            }
        }
    }

    fn start(&mut self, plan: &Plan) -> Result<(), TestCaseError> {
        prop_assert!(plan.present_at > self.last_target, "targets strictly increase");
        if let Some((old, new)) =
            self.started.and_then(|old| old.content_time.zip(plan.content_time))
        {
            let passed = plan.present_at - self.last_target;
            prop_assert!(new >= old, "content time ran back by {:?}", old - new);
            if !self.key_since_start && !self.interpolates {
                let fastest = passed + passed.scale(1, 32) + MonoSpan::from_ns(2);
                prop_assert!(new - old <= fastest, "{:?} of content in {passed:?}", new - old);
            }
        }
        self.pacer.start(plan);
        self.last_target = plan.present_at;
        self.started = Some(*plan);
        self.key_since_start = false;
        self.has_news = false;
        let shows_key = plan.content_time == self.newest;
        let work = if shows_key { self.work.scale(1, 4) } else { self.work };
        if self.now + work > plan.submit_by {
            self.pacer.on_dropped();
            self.has_news = true;
        } else {
            if self.is_watched {
                self.pacer.on_handed_over(plan, self.now + work);
            }
            self.shown(plan.present_at);
        }
        self.pacer.on_work(work);
        Ok(())
    }

    fn shown(&mut self, planned: MonoTime) {
        let late = if self.is_late { self.refresh } else { MonoSpan::ZERO };
        let wild = if self.feedback == FeedbackMode::Wild {
            self.refresh.scale((planned.as_ns() % 100).cast_signed() + 36, 100)
        } else {
            MonoSpan::ZERO
        };
        self.waiting.push((planned, planned + late + wild));
        let held_back = match self.feedback {
            FeedbackMode::Prompt | FeedbackMode::Wild => 0,
            FeedbackMode::Late => 3,
            FeedbackMode::OutOfOrder => self.waiting.len() % 2,
            FeedbackMode::Absent => return self.waiting.clear(),
            FeedbackMode::Discarded => {
                self.waiting.clear();
                return self.pacer.on_discarded(planned);
            }
        };
        if self.feedback == FeedbackMode::OutOfOrder {
            self.waiting.reverse();
        }
        for (planned, presented_at) in
            self.waiting.drain(..self.waiting.len().max(held_back) - held_back)
        {
            self.last_presented = self.last_presented.max(presented_at);
            self.pacer.on_presented(planned, presented_at, self.now);
        }
    }

    /// The laws of a plan.
    fn checked_plan(&mut self) -> Result<Plan, TestCaseError> {
        let plan = self.pacer.plan(self.now);
        prop_assert_eq!(plan, self.pacer.plan(self.now), "planning changes nothing");
        prop_assert!(plan.wake_at >= self.now, "the wake lies in the past: {:?}", plan);
        prop_assert!(plan.wake_at <= plan.wake_by && plan.wake_by <= plan.submit_by);
        prop_assert!(plan.submit_by <= plan.present_at);
        prop_assert!(self.now <= plan.submit_from && plan.submit_from <= plan.submit_by);
        prop_assert!(plan.present_at > self.last_target, "a refresh was taken twice: {:?}", plan);
        let status = self.pacer.status();
        prop_assert!(self.is_visible || status.feedback == FeedbackState::Hidden);
        let lead = status.margin + status.display_offset;
        let ready = self.now + status.work + lead;
        let shows_key = !self.interpolates && plan.content_time == self.newest;
        let least = if shows_key { status.work.min(status.key_work) } else { status.work };
        let ready_at_best = self.now + least + lead;
        prop_assert!(plan.present_at >= ready_at_best, "not enough time: {:?}", plan);
        let half = status.refresh_interval.scale(1, 2);
        let mut taken_until = self.last_target + half;
        if self.kind == RefreshKind::Variable {
            taken_until = taken_until.max(self.last_presented);
        }
        let latest = ready.max(taken_until) + status.refresh_interval;
        // A display that answers nothing, or nobody sees, is given less; on a variable one there is
        // nothing to show at every instant, but a key goes out at once.
        let is_slowed = status.unanswered > 1 || status.feedback == FeedbackState::Hidden;
        let waits = self.kind == RefreshKind::Variable && !self.key_since_start;
        let passed_over = if self.has_news { 0 } else { i64::from(self.stride) - 1 };
        let latest = latest + status.refresh_interval.scale(passed_over, 1);
        if !is_slowed && !waits {
            prop_assert!(plan.present_at <= latest, "a refresh was passed over: {:?}", plan);
        }
        prop_assert_eq!(plan.content_time.is_some(), self.newest.is_some());
        if let Some((content, newest)) = plan.content_time.zip(self.newest) {
            if !self.interpolates {
                prop_assert!(content >= newest, "negative phase: {:?}", content - newest);
            }
            if self.started.is_none() {
                let interval = status.key_interval.unwrap_or(MonoSpan::from_ms(25));
                let longest = interval.scale(4, 1);
                prop_assert!(content - newest <= longest, "phase {:?}", content - newest);
            }
        }
        Ok(plan)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn whatever_happens_the_laws_of_plans_and_content_time_hold(
        refresh_hz in prop::sample::select(vec![48.0, 59.94, 60.0, 119.88, 120.0, 144.0, 240.0]),
        key_hz in 20.0_f64..70.0,
        interpolates in prop::bool::weighted(0.2),
        kind in prop::sample::select(vec![RefreshKind::Fixed, RefreshKind::Fixed, RefreshKind::Variable]),
        ops in prop::collection::vec(op(), 1..40),
    ) {
        let mut world = World::new(refresh_hz, key_hz, interpolates, kind);
        for op in &ops {
            world.apply(op)?;
        }
    }
}
