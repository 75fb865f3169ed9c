//! One stream without its thread: engine, pacer and display, with time as an argument.
//!
//! [`StreamCore`] takes keys in, says when to wake, makes the picture, and counts what became of
//! it. [`super::thread`] waits and carries things to and fro; nothing here waits, sends or reads a
//! clock other than the one it is given.

use std::sync::Arc;

use foreframe_engine::backend::BackendStatus;
use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::engine::MotionState;
use foreframe_engine::pacing::{
    Pacer, PacerConfig, PacerStatus, Plan, RefreshKind, TimerDisplay, WorkEstimate,
};
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
    /// The picture was not ready for its refresh, which shows the one before again.
    Dropped(DroppedFrame),
}

/// A picture that was made in vain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DroppedFrame {
    /// Real, or made.
    pub kind: FrameKind,
    /// Time that the engine took.
    pub work: MonoSpan,
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
    /// Refreshes since the picture before, all of which showed that one again: repeated or dropped.
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

/// What became of the refreshes from the first planned picture on. Each is in exactly one of real,
/// synthesised, repeated and dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FrameCounts {
    /// Keys taken in.
    pub keys: u64,
    /// Refreshes that showed a key itself.
    pub real: u64,
    /// Refreshes that showed a made picture.
    pub synthesised: u64,
    /// Refreshes that showed the picture before again because there was nothing new to show, or
    /// nobody had time to plan them.
    pub repeated: u64,
    /// Refreshes that showed the picture before again because theirs was not ready in time.
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
    /// The last refresh that is counted.
    counted_until: Option<MonoTime>,
}

#[derive(Clone, Copy, Debug)]
struct NewestKey {
    index: u64,
    content_time: MonoTime,
    /// Of the key before. None at the first key and at a cut: the engine has none before it then.
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
            refresh: RefreshKind::Fixed,
            known_refresh: Some(config.display_origin),
            interpolates: config.engine.method.interpolates(),
            work: WorkEstimate::Measured { first: config.refresh_interval.scale(1, 4) },
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
            counted_until: None,
        }
    }

    /// Makes the pictures on `gpu`, in a stream that has had no key.
    pub fn use_gpu(&mut self, gpu: &Arc<Gpu>) {
        self.engine.use_gpu(gpu);
    }

    /// What makes the pictures.
    #[must_use]
    pub fn backend(&self) -> &BackendStatus {
        self.engine.backend()
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
            previous_content_time: self
                .newest_key
                .filter(|_| !input.is_cut)
                .map(|before| before.content_time),
            moves: match self.method {
                Method::Hold => false,
                Method::Blend => true,
                _ => report.motion == MotionState::Usable,
            },
            taken: self.counts.keys,
        });
        Ok(report)
    }

    /// The camera is at `view` by `content_time`: see [`Engine::late_camera`].
    pub fn late_camera(&mut self, content_time: MonoTime, view: [f32; 16]) {
        self.engine.late_camera(content_time, view);
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
            self.pacer.on_presented(plan.present_at, plan.present_at, plan.present_at);
            self.count_until(plan.present_at);
            return Some(FrameOutcome::Repeated);
        }
        let started_at = clock();
        let report = self.engine.synthesise(content_time, &mut self.frame)?;
        let ready_at = clock();
        self.pacer.on_work(ready_at - plan.wake_at.min(started_at));
        let kind = self.kind(content_time, report.phase, &key);
        let presented_at = self.display.refresh_at_or_after(ready_at);
        self.count_until(plan.present_at - self.display.interval());
        self.counted_until = Some(plan.present_at);
        if presented_at > plan.present_at {
            self.pacer.on_dropped();
            self.counts.dropped += 1;
            return Some(FrameOutcome::Dropped(DroppedFrame { kind, work: report.work }));
        }
        // Ready early: the display still shows it at the refresh that it was planned for.
        let presented_at = plan.present_at;
        self.pacer.on_presented(plan.present_at, presented_at, presented_at);
        match kind {
            FrameKind::Real => self.counts.real += 1,
            FrameKind::Synthesised => self.counts.synthesised += 1,
        }
        let (index, repeats_before) = self.shown.map_or((0, 0), |shown| {
            let refreshes = self.refreshes(presented_at - shown.presented_at);
            (shown.index + refreshes, refreshes - 1)
        });
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

    /// The stream ends at `now`: what the display has shown until then is counted.
    pub fn finish(&mut self, now: MonoTime) {
        // The refresh at or after a time is the last one at or before it, or one too late.
        let next = self.display.refresh_at_or_after(now);
        let last = if next > now { next - self.display.interval() } else { next };
        self.count_until(last);
    }

    /// The picture that was made last: presented, or dropped. Whoever needs the presented one later
    /// takes it before the next is made, and may leave any other in its place.
    pub fn frame(&mut self) -> &mut ColorPlane {
        &mut self.frame
    }

    /// What became of the refreshes so far, up to the last plan or [`finish`](Self::finish).
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

    /// Counts the refreshes after the last counted one, up to the one at `last`, as repeated.
    fn count_until(&mut self, last: MonoTime) {
        let Some(counted) = self.counted_until else { return };
        if last - counted > self.display.interval().scale(1, 2) {
            self.counts.repeated += self.refreshes(last - counted);
            self.counted_until = Some(last);
        }
    }

    /// Where the picture of `content_time` came from: the engine copies a key at phase 0, and
    /// `blend` one of its two keys except between them.
    fn kind(&self, content_time: MonoTime, phase: Phase, key: &NewestKey) -> FrameKind {
        let is_of_a_key = match self.method {
            Method::Hold => true,
            Method::Blend => {
                content_time >= key.content_time
                    || key.previous_content_time.is_none_or(|older| content_time <= older)
            }
            _ => phase == Phase::ZERO,
        };
        if is_of_a_key { FrameKind::Real } else { FrameKind::Synthesised }
    }

    /// How many refreshes a span covers, at least one.
    fn refreshes(&self, span: MonoSpan) -> u64 {
        let interval = self.display.interval().as_ns();
        let rounded = (span.as_ns() + interval / 2) / interval;
        rounded.max(1).unsigned_abs()
    }
}

#[cfg(test)]
mod tests;
