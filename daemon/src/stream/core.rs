//! One stream without its thread: engine, pacer and display, with time as an argument.
//!
//! [`StreamCore`] takes keys in, says when to wake, makes the picture, and counts what became of
//! it. [`super::thread`] waits and carries things to and fro; nothing here waits, sends or reads a
//! clock other than the one it is given.

mod outcome;

use std::collections::VecDeque;
use std::sync::Arc;

use foreframe_engine::backend::BackendStatus;
use foreframe_engine::backend::gpu::{Gpu, GpuPicture};
use foreframe_engine::inspect::Inspection;
use foreframe_engine::pacing::{
    Pacer, PacerConfig, PacerStatus, Plan, RefreshKind, TimerDisplay, WorkEstimate,
};
use foreframe_engine::{
    ColorPlane, DecodeError, Engine, EngineConfig, KeyInput, KeyReport, Method, MonoSpan, MonoTime,
    Phase, StreamFormat, UiInput,
};

use outcome::Counted;
pub use outcome::{DroppedFrame, FrameCounts, FrameKind, FrameOutcome, PresentedFrame, Told};

/// What a stream needs to know before its first key.
#[derive(Clone, Copy, Debug)]
pub struct CoreConfig {
    /// How the engine works.
    pub engine: EngineConfig,
    /// Period of the timer display.
    pub refresh_interval: MonoSpan,
    /// An instant of its grid.
    pub display_origin: MonoTime,
    /// In-between frames are left out until something has moved by so many pixels (Falchetto et al.
    /// 2007, adaptive ratio). 0 leaves none out.
    pub least_step_px: f32,
}

/// Where pictures are shown.
#[derive(Clone, Copy, Debug)]
enum Display {
    /// Nowhere: refreshes are instants on a grid, and each shows what is ready by then.
    Timer(TimerDisplay),
    /// On a display that tells when it showed them.
    Told,
}

/// How long before a refresh compositors are expected to need a picture, until they show otherwise:
/// with less, mutter without a GPU shows one frame in fifty late at 120 Hz (`window_pacing`).
const FIRST_DEADLINE: MonoSpan = MonoSpan::from_ms(4);
/// The same on fast displays, as a share of the refresh interval.
const FIRST_DEADLINE_PERCENT: i64 = 55;
/// A picture is made for one refresh in so many, however slowly things move: about the key interval
/// of the slowest application on the fastest display.
const LONGEST_STRIDE: u32 = 8;
/// Pictures under way at most; a display that answers nothing is not waited for.
const UNDER_WAY: usize = 64;

/// Engine, pacer and display of one stream.
#[derive(Debug)]
pub struct StreamCore {
    engine: Engine,
    pacer: Pacer,
    display: Display,
    /// Pictures that were handed to a display which may tell what became of them, oldest first. One
    /// that is a timer tells of those alone that it never showed.
    under_way: VecDeque<(MonoTime, Counted)>,
    frame: ColorPlane,
    /// Whether pictures may stay on the GPU that makes them.
    keeps: bool,
    /// The picture that was made last, if it did.
    kept: Option<GpuPicture>,
    counts: FrameCounts,
    least_step_px: f32,
    newest_key: Option<NewestKey>,
    ui: NewestUi,
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

/// The user interface over the pictures.
#[derive(Clone, Copy, Debug, Default)]
struct NewestUi {
    /// When it came in.
    arrived_at: MonoTime,
    /// User interfaces taken in with it.
    taken: u64,
}

fn new_pacer(method: Method, refresh_interval: MonoSpan, known_refresh: Option<MonoTime>) -> Pacer {
    Pacer::new(PacerConfig {
        refresh_interval,
        refresh: RefreshKind::Fixed,
        known_refresh,
        interpolates: method.interpolates(),
        work: WorkEstimate::learned(refresh_interval),
    })
}

/// The picture on the display.
#[derive(Clone, Copy, Debug)]
struct Shown {
    index: u64,
    presented_at: MonoTime,
    content_time: MonoTime,
    /// Keys taken in when it was made. 0 if the display does not have it.
    keys: u64,
    /// Whether the display has it otherwise than it is to be.
    is_misplaced: bool,
    /// User interfaces taken in when it was made.
    uis: u64,
}

impl StreamCore {
    /// A stream without keys.
    #[must_use]
    pub fn new(format: StreamFormat, config: &CoreConfig) -> Self {
        let CoreConfig { refresh_interval, display_origin, .. } = *config;
        let pacer = new_pacer(config.engine.method, refresh_interval, Some(display_origin));
        Self {
            engine: Engine::new(format, config.engine),
            pacer,
            display: Display::Timer(TimerDisplay::new(display_origin, refresh_interval)),
            under_way: VecDeque::new(),
            frame: ColorPlane::new(format.color, format.width, format.height),
            keeps: false,
            kept: None,
            counts: FrameCounts::default(),
            least_step_px: config.least_step_px,
            newest_key: None,
            ui: NewestUi::default(),
            shown: None,
            counted_until: None,
        }
    }

    /// Makes the pictures on `gpu`, in a stream that has had no key.
    pub fn use_gpu(&mut self, gpu: &Arc<Gpu>) {
        self.engine.use_gpu(gpu);
    }

    /// Shows the pictures on a display that tells when it showed them, in a stream that has had no
    /// key. `announced` is its refresh interval, if it names one.
    pub fn use_display(&mut self, announced: Option<MonoSpan>) {
        let refresh_interval = announced.unwrap_or(self.interval());
        let deadline = FIRST_DEADLINE.min(refresh_interval.scale(FIRST_DEADLINE_PERCENT, 100));
        self.pacer = new_pacer(self.method(), refresh_interval, None).with_deadline(deadline);
        self.display = Display::Told;
    }

    /// Shows the pictures on a timer of this interval from now on. What is known of another display
    /// is forgotten.
    pub fn use_timer(&mut self, refresh_interval: MonoSpan, origin: MonoTime) {
        self.pacer = new_pacer(self.method(), refresh_interval, Some(origin));
        self.display = Display::Timer(TimerDisplay::new(origin, refresh_interval));
    }

    /// The display is gone: back to a timer, on a grid from `now`, for who else gets pictures.
    pub fn leave_display(&mut self, now: MonoTime) {
        let refresh_interval = self.interval();
        self.display = Display::Timer(TimerDisplay::new(now, refresh_interval));
        self.pacer.on_mode(refresh_interval, RefreshKind::Fixed);
        self.pacer.on_visibility(true);
        self.pacer.on_presented(now, now, now);
        self.under_way.clear();
        self.counted_until = self.counted_until.map(|_| now);
    }

    /// What makes the pictures.
    #[must_use]
    pub fn backend(&self) -> &BackendStatus {
        self.engine.backend()
    }

    /// Makes in-between frames by another method from now on, on `gpu` where there is one.
    pub fn set_method(&mut self, method: Method, gpu: Option<&Arc<Gpu>>) {
        self.engine.set_method(method, gpu);
        self.pacer.set_interpolates(method.interpolates());
    }

    /// How in-between frames are made.
    #[must_use]
    pub fn method(&self) -> Method {
        self.engine.method()
    }

    /// What is wrong with the motion of the first keys, once they were all looked at. Empty where
    /// nothing is.
    #[must_use]
    pub fn suspicion(&self) -> Option<String> {
        let check = self.engine.motion_check();
        check.is_done().then(|| check.diagnosis().verdict.unwrap_or_default())
    }

    /// What the engine makes of the newest key; None before the first.
    #[must_use]
    pub fn inspect(&self) -> Option<Inspection<'_>> {
        self.engine.inspect()
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
            moves: match self.method() {
                Method::Hold => false,
                Method::Blend => true,
                _ => report.motion.moves(),
            },
            taken: self.counts.keys,
        });
        if self.least_step_px > 0.0 {
            self.pacer.set_stride(self.stride());
        }
        Ok(report)
    }

    /// Refreshes in which what moves fastest moves by the least step.
    #[expect(clippy::cast_possible_truncation, reason = "1 to the longest, and seconds")]
    #[expect(clippy::cast_sign_loss, reason = "speeds are positive")]
    fn stride(&self) -> u32 {
        let speed = self.engine.inspect().and_then(|inspection| inspection.highest_speed());
        let Some(speed) = speed else { return 1 };
        let needed = self.least_step_px / (speed * self.interval().as_secs_f64() as f32);
        // Casts saturate: of what stands still, the longest.
        (needed.ceil() as u32).clamp(1, LONGEST_STRIDE)
    }

    /// Shows a user interface over every picture from now on, unless one that came in later is
    /// shown already.
    ///
    /// # Errors
    /// If its numbers do not describe pixels that are there. The one before stays.
    pub fn set_ui(&mut self, input: &UiInput<'_>, arrived_at: MonoTime) -> Result<(), DecodeError> {
        if arrived_at >= self.ui.arrived_at {
            self.engine.set_ui(input)?;
            self.ui = NewestUi { arrived_at, taken: self.ui.taken + 1 };
        }
        Ok(())
    }

    /// The next picture shows more than that things have moved on: see [`Pacer::on_news`].
    pub fn on_news(&mut self) {
        self.pacer.on_news();
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
        let asked = (content_time, key.taken, self.ui.taken);
        let same = |shown: &Shown| (shown.content_time, shown.keys, shown.uis) == asked;
        let shown_already = self.shown.filter(same).filter(|_| !self.engine.alternates());
        if shown_already.is_some_and(|shown| !shown.is_misplaced) {
            if let Display::Timer(_) = self.display {
                self.pacer.on_presented(plan.present_at, plan.present_at, plan.present_at);
            }
            self.count_until(plan.present_at);
            return Some(FrameOutcome::Repeated);
        }
        let started_at = clock();
        let report = match self.keeps {
            true => {
                let (report, kept) = self.engine.synthesise_kept(content_time, &mut self.frame)?;
                self.kept = kept;
                report
            }
            false => {
                self.kept = None;
                self.engine.synthesise(content_time, &mut self.frame)?
            }
        };
        let ready_at = clock();
        // A head start that was not used took nobody's time.
        self.pacer.on_work(ready_at - plan.wake_by.min(started_at));
        let kind = self.kind(content_time, report.phase, &key);
        let counted = match shown_already {
            Some(_) => Counted::Repeated,
            None => Counted::New(kind),
        };
        let presented_at = match self.display {
            Display::Timer(timer) => timer.refresh_at_or_after(ready_at),
            // Late for the deadline as it is known is not late for sure.
            Display::Told => ready_at.max(plan.present_at),
        };
        self.count_until(plan.present_at - self.interval());
        self.counted_until = Some(plan.present_at);
        if presented_at > plan.present_at {
            self.pacer.on_dropped();
            self.engine.picture_dropped();
            self.counts.dropped += 1;
            return Some(FrameOutcome::Dropped(DroppedFrame { kind, work: report.work }));
        }
        // Ready early: the display still shows it at the refresh that it was planned for.
        let presented_at = plan.present_at;
        if let Display::Timer(_) = self.display {
            self.pacer.on_presented(plan.present_at, presented_at, presented_at);
        }
        if self.under_way.len() == UNDER_WAY {
            self.under_way.pop_front();
        }
        self.under_way.push_back((plan.present_at, counted));
        match counted {
            Counted::New(FrameKind::Real) => self.counts.real += 1,
            Counted::New(FrameKind::Synthesised) => self.counts.synthesised += 1,
            Counted::Repeated => self.counts.repeated += 1,
        }
        let (index, repeats_before) = self.shown.map_or((0, 0), |shown| {
            let refreshes = self.refreshes(presented_at - shown.presented_at);
            (shown.index + refreshes, refreshes - 1)
        });
        let (keys, uis) = (key.taken, self.ui.taken);
        let is_misplaced = false;
        self.shown = Some(Shown { index, presented_at, content_time, keys, is_misplaced, uis });
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

    /// The picture of `plan` was handed to the display at `now`, or was not taken.
    pub fn on_handed_over(&mut self, plan: &Plan, now: MonoTime, is_taken: bool) {
        match (self.display, is_taken) {
            (Display::Timer(_), true) => {}
            (Display::Told, true) => self.pacer.on_handed_over(plan, now),
            (_, false) => {
                self.pacer.on_dropped();
                self.engine.picture_dropped();
                self.count_discarded(plan.present_at);
            }
        }
    }

    /// The display, or who draws for it, has told.
    pub fn on_told(&mut self, told: Told) {
        match told {
            Told::Presented { planned, presented_at, heard_at } => {
                self.under_way.retain(|&(waiting, _)| waiting > planned);
                self.pacer.on_presented(planned, presented_at, heard_at);
            }
            Told::Discarded { planned } => {
                // Too late for finishing, which has shared out the light of pictures after it.
                self.count_discarded(planned);
                // A timer's pictures were on time when they were made, and no display was late.
                if let Display::Told = self.display {
                    self.pacer.on_discarded(planned);
                }
            }
            Told::Mode(refresh_interval) => {
                self.pacer.on_mode(refresh_interval, RefreshKind::Fixed);
                if let Display::Timer(timer) = &mut self.display {
                    let origin = self.counted_until.unwrap_or_default();
                    *timer = TimerDisplay::new(origin, refresh_interval);
                    self.pacer.on_presented(origin, origin, origin);
                }
            }
            Told::Visible(is_visible) => self.pacer.on_visibility(is_visible),
            Told::Moved => {
                self.shown = self.shown.map(|shown| Shown { is_misplaced: true, ..shown });
                self.pacer.on_news();
            }
        }
    }

    /// Whether the next picture goes to the display although nothing in it is new: the display
    /// does not have the one before, or not as it is to be.
    #[must_use]
    pub fn is_to_show_again(&self) -> bool {
        self.shown.is_some_and(|shown| shown.keys == 0 || shown.is_misplaced)
    }

    /// The picture for `planned` was counted as shown, and was not.
    fn count_discarded(&mut self, planned: MonoTime) {
        let position = self.under_way.iter().position(|&(waiting, _)| waiting == planned);
        let counted = position.and_then(|position| self.under_way.remove(position));
        let counted = counted.map(|(_, counted)| counted);
        // What was made for it is not on the display, and is worth another try.
        self.shown = self.shown.map(|shown| match (shown.presented_at == planned, counted) {
            (true, Some(Counted::Repeated)) => Shown { is_misplaced: true, ..shown },
            (true, _) => Shown { keys: 0, ..shown },
            (false, _) => shown,
        });
        match counted {
            Some(Counted::New(FrameKind::Real)) => self.counts.real -= 1,
            Some(Counted::New(FrameKind::Synthesised)) => self.counts.synthesised -= 1,
            // The display shows that picture all the same.
            Some(Counted::Repeated) | None => return,
        }
        self.counts.dropped += 1;
    }

    /// The stream ends at `now`: what the display has shown until then is counted.
    pub fn finish(&mut self, now: MonoTime) {
        let Display::Timer(timer) = self.display else { return };
        // The refresh at or after a time is the last one at or before it, or one too late.
        let next = timer.refresh_at_or_after(now);
        let last = if next > now { next - timer.interval() } else { next };
        self.count_until(last);
    }

    /// The picture that was made last: presented, or dropped. Whoever needs the presented one later
    /// takes it before the next is made, and may leave any other in its place.
    pub fn frame(&mut self) -> &mut ColorPlane {
        &mut self.frame
    }

    /// Whether pictures stay on the GPU that makes them, where one does, from now on.
    pub fn keep_pictures(&mut self, keeps: bool) {
        self.keeps = keeps;
    }

    /// The picture that was made last, if it stayed on its GPU: then [`frame`](Self::frame) is any
    /// other.
    pub fn kept(&mut self) -> &mut Option<GpuPicture> {
        &mut self.kept
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
        if last - counted > self.interval().scale(1, 2) {
            self.counts.repeated += self.refreshes(last - counted);
            self.counted_until = Some(last);
        }
    }

    /// Where the picture of `content_time` came from: the engine copies a key at phase 0, and
    /// `blend` one of its two keys except between them.
    fn kind(&self, content_time: MonoTime, phase: Phase, key: &NewestKey) -> FrameKind {
        let is_of_a_key = match self.method() {
            Method::Hold => true,
            Method::Blend => {
                content_time >= key.content_time
                    || key.previous_content_time.is_none_or(|older| content_time <= older)
            }
            _ => phase == Phase::ZERO,
        };
        if is_of_a_key { FrameKind::Real } else { FrameKind::Synthesised }
    }

    /// Time between two refreshes, as it is known.
    fn interval(&self) -> MonoSpan {
        match self.display {
            Display::Timer(timer) => timer.interval(),
            Display::Told => self.pacer.status().refresh_interval,
        }
    }

    /// How many refreshes a span covers, at least one.
    fn refreshes(&self, span: MonoSpan) -> u64 {
        let interval = self.interval().as_ns().max(1);
        let rounded = (span.as_ns() + interval / 2) / interval;
        rounded.max(1).unsigned_abs()
    }
}

#[cfg(test)]
mod tests;
