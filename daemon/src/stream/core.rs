//! One stream without its thread: engine, pacer and display, with time as an argument.
//!
//! [`StreamCore`] takes keys in, says when to wake, makes the picture, and counts what became of
//! it. [`super::thread`] waits and carries things to and fro; nothing here waits, sends or reads a
//! clock other than the one it is given.

use foreframe_engine::engine::MotionState;
use foreframe_engine::pacing::{Pacer, PacerConfig, PacerStatus, Plan, TimerDisplay, WorkEstimate};
use foreframe_engine::{
    ColorPlane, DecodeError, Engine, EngineConfig, KeyInput, KeyReport, Method, MonoSpan, MonoTime,
    Phase, StreamFormat,
};

/// What a stream needs to know before its first key.
#[derive(Clone, Copy, Debug)]
pub struct CoreConfig {
    /// How the engine works.
    pub engine: EngineConfig,
    /// Period of the timer display.
    pub refresh_interval: MonoSpan,
    /// An instant of its grid.
    pub display_origin: MonoTime,
}

/// What became of one plan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameOutcome {
    /// A new picture goes to the display; [`StreamCore::frame`] holds it.
    Presented(PresentedFrame),
    /// The display shows the picture before again: there is nothing new to show.
    Repeated,
    /// The picture was not ready for its refresh.
    Dropped,
}

/// A picture that goes to the display.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PresentedFrame {
    /// Number of the output frame, counted up by one per refresh from the first picture on; what
    /// was repeated or dropped leaves a gap.
    pub index: u64,
    /// The newest key that it was made from.
    pub key_index: u64,
    /// Content time of that key.
    pub key_content_time: MonoTime,
    /// Position after that key.
    pub phase: Phase,
    /// Real, or made.
    pub kind: FrameKind,
    /// Content time that it shows.
    pub content_time: MonoTime,
    /// Refresh that it was planned for.
    pub present_at: MonoTime,
    /// Refresh that it is shown at.
    pub presented_at: MonoTime,
    /// Refreshes since the picture before that showed that one again.
    pub repeats_before: u64,
    /// Time that the engine took.
    pub work: MonoSpan,
}

/// Where a picture comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameKind {
    /// The key itself.
    Real,
    /// Made by the engine.
    Synthesised,
}

/// Output frames since the stream began, each refresh in exactly one of real, synthesised and
/// repeated.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FrameCounts {
    /// Keys taken in.
    pub keys: u64,
    /// Refreshes that showed a key itself.
    pub real: u64,
    /// Refreshes that showed a made picture.
    pub synthesised: u64,
    /// Refreshes that showed the picture before again.
    pub repeated: u64,
    /// Pictures that were not ready in time.
    pub dropped: u64,
}

/// Engine, pacer and display of one stream.
#[derive(Debug)]
pub struct StreamCore {
    engine: Engine,
    method: Method,
    pacer: Pacer,
    display: TimerDisplay,
    frame: ColorPlane,
    counts: FrameCounts,
    newest_key: Option<NewestKey>,
    shown: Option<Shown>,
}

#[derive(Clone, Copy, Debug)]
struct NewestKey {
    index: u64,
    content_time: MonoTime,
    previous_content_time: Option<MonoTime>,
    /// Whether pictures made from it differ from it.
    moves: bool,
    /// Keys taken in with it.
    taken: u64,
}

/// The picture on the display.
#[derive(Clone, Copy, Debug)]
struct Shown {
    index: u64,
    presented_at: MonoTime,
    content_time: MonoTime,
    /// Keys taken in when it was made.
    keys: u64,
}

impl StreamCore {
    /// A stream without keys.
    #[must_use]
    pub fn new(format: StreamFormat, config: &CoreConfig) -> Self {
        let pacer = Pacer::new(PacerConfig {
            refresh_interval: config.refresh_interval,
            known_refresh: Some(config.display_origin),
            interpolates: config.engine.method.interpolates(),
            work: WorkEstimate::Measured,
        });
        Self {
            engine: Engine::new(format, config.engine),
            method: config.engine.method,
            pacer,
            display: TimerDisplay::new(config.display_origin, config.refresh_interval),
            frame: ColorPlane::new(format.color, format.width, format.height),
            counts: FrameCounts::default(),
            newest_key: None,
            shown: None,
        }
    }

    /// Takes in a key. `clock` says when that is done: from then on it can be shown.
    ///
    /// # Errors
    /// If it contradicts its stream. The keys before it stay.
    pub fn on_key(
        &mut self,
        input: &KeyInput<'_>,
        clock: impl Fn() -> MonoTime,
    ) -> Result<KeyReport, DecodeError> {
        let report = self.engine.push_key(input)?;
        self.pacer.on_key(input.content_time, clock(), input.is_cut);
        self.counts.keys += 1;
        self.newest_key = Some(NewestKey {
            index: input.index,
            content_time: input.content_time,
            previous_content_time: self.newest_key.map(|before| before.content_time),
            moves: match self.method {
                Method::Hold => false,
                Method::Blend => true,
                _ => report.motion == MotionState::Usable,
            },
            taken: self.counts.keys,
        });
        Ok(report)
    }

    /// When to wake for which picture, as seen at `now`.
    #[must_use]
    pub fn plan(&mut self, now: MonoTime) -> Plan {
        self.pacer.plan(now)
    }

    /// Makes the picture of `plan`, whose wake has come. None before the first key. `clock` says
    /// when the picture is ready.
    pub fn make(&mut self, plan: &Plan, clock: impl Fn() -> MonoTime) -> Option<FrameOutcome> {
        let key = self.newest_key?;
        let content_time = self.shown_content_time(plan.content_time?, &key);
        self.pacer.start(plan);
        let is_shown_already = self
            .shown
            .is_some_and(|shown| (shown.content_time, shown.keys) == (content_time, key.taken));
        if is_shown_already {
            self.pacer.on_presented(plan.present_at, plan.present_at);
            return Some(FrameOutcome::Repeated);
        }
        let started_at = clock();
        let report = self.engine.synthesise(content_time, &mut self.frame)?;
        let ready_at = clock();
        self.pacer.on_work(ready_at - plan.wake_at.min(started_at));
        let presented_at = self.display.refresh_at_or_after(ready_at);
        if presented_at > plan.present_at {
            self.pacer.on_dropped();
            self.counts.dropped += 1;
            return Some(FrameOutcome::Dropped);
        }
        // Ready early: the display still shows it at the refresh that it was planned for.
        let presented_at = plan.present_at;
        self.pacer.on_presented(plan.present_at, presented_at);
        let is_of_a_key =
            content_time == key.content_time || Some(content_time) == key.previous_content_time;
        let kind = if is_of_a_key {
            self.counts.real += 1;
            FrameKind::Real
        } else {
            self.counts.synthesised += 1;
            FrameKind::Synthesised
        };
        let (index, repeats_before) = self.shown.map_or((0, 0), |shown| {
            let refreshes = self.refreshes(presented_at - shown.presented_at);
            (shown.index + refreshes, refreshes - 1)
        });
        self.counts.repeated += repeats_before;
        self.shown = Some(Shown { index, presented_at, content_time, keys: key.taken });
        Some(FrameOutcome::Presented(PresentedFrame {
            index,
            key_index: key.index,
            key_content_time: key.content_time,
            phase: report.phase,
            kind,
            content_time,
            present_at: plan.present_at,
            presented_at,
            repeats_before,
            work: report.work,
        }))
    }

    /// The newest picture that was made.
    pub fn frame(&mut self) -> &mut ColorPlane {
        &mut self.frame
    }

    /// What became of the refreshes so far. Repeats are counted when they are over.
    #[must_use]
    pub fn counts(&self) -> FrameCounts {
        self.counts
    }

    /// What the pacer knows.
    #[must_use]
    pub fn pacing(&self) -> PacerStatus {
        self.pacer.status()
    }

    /// The content time that a picture planned for `planned` really shows: the key's where nothing
    /// in the key says how it moves.
    fn shown_content_time(&self, planned: MonoTime, key: &NewestKey) -> MonoTime {
        if key.moves { planned } else { key.content_time }
    }

    /// How many refreshes a span covers, at least one.
    fn refreshes(&self, span: MonoSpan) -> u64 {
        let interval = self.display.interval().as_ns();
        let rounded = (span.as_ns() + interval / 2) / interval;
        rounded.max(1).unsigned_abs()
    }
}
