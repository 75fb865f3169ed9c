//! The thread of a stream: waits for keys and for the pacer's wakes, and carries things to and fro.
//!
//! A key is taken in when it comes, and once more the newest one just before the picture that is
//! owed. That picture is put off by one refresh at most, so that keys that come faster than they
//! can be worked off do not keep the display from changing; the mailbox keeps the newest meanwhile.
//! Nothing here waits for anybody: sinks, recorder, subscribers and main loop are all behind queues
//! or slots that can be full.

use std::io;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use calloop::channel::Sender;
use foreframe_engine::engine::MotionState;
use foreframe_engine::pacing::Plan;
use foreframe_engine::{Method, MonoSpan, MonoTime};
use foreframe_protocol::slots::Holds;
use foreframe_protocol::{
    CreateStream, ErrorCode, ErrorMessage, OutputFrame, OutputKind, Pacing, PlaneKind, Presented,
    Statistics, Submit,
};
use tracing::{debug, error, info, trace, warn};

use super::command::StreamCommand;
use super::core::{CoreConfig, DroppedFrame, FrameKind, FrameOutcome, PresentedFrame, StreamCore};
use super::display::WindowDisplay;
use super::hints::Hints;
use super::intake::Intake;
use super::mailbox::{Mailbox, Submission, Taken, UiSubmission};
use super::observed::{KeyInstants, Observed, PictureInstants, alternation};
use super::owed::OwedPicture;
use super::{FromStream, StreamEvent, real_time};
use crate::clock::{self, Alarm, Woken};
use crate::control::StreamStatus;
use crate::gpu::Gpus;
use crate::hud::HudView;
use crate::ingest;
use crate::recorder::StreamRecorder;
use crate::sink::window::{WindowConfig, WindowOpener};
use crate::sink::worker::SinkWorker;

/// Refreshes in a row with nothing new to show, after which the thread waits for the next key
/// alone. Easing ends well before.
const REPEATS_BEFORE_IDLE: u32 = 120;
/// Time between two reports of counts.
const STATISTICS_INTERVAL: MonoSpan = MonoSpan::from_ms(250);

/// Everything a stream's thread owns from the start.
#[derive(Debug)]
pub struct StreamParts {
    /// Number of the stream in this process.
    pub ordinal: u64,
    /// What the client declared.
    pub create: CreateStream,
    /// How engine and display work.
    pub core: CoreConfig,
    /// The GPU adapter that makes the pictures, by its index; without it the CPU does.
    pub gpu: Option<(Arc<Gpus>, usize)>,
    /// Where keys come from.
    pub mailbox: Arc<Mailbox>,
    /// Where events go.
    pub events: Sender<FromStream>,
    /// A sink that keeps frames, if there is one.
    pub sink: Option<SinkWorker>,
    /// The window to show pictures in, if there is to be one.
    pub window: Option<(WindowOpener, WindowConfig)>,
    /// What to draw into the pictures of the window.
    pub hud: HudView,
    /// Takes keys, if the daemon records.
    pub recorder: Option<StreamRecorder>,
}

/// Starts the thread.
///
/// # Errors
/// If the process has no descriptor or thread left.
pub fn start(parts: StreamParts) -> io::Result<JoinHandle<()>> {
    let alarm = Alarm::new()?;
    let name = format!("foreframe-{}", parts.ordinal);
    thread::Builder::new().name(name).spawn(move || {
        // Declared first, so dropped last: when this is told, everything else is gone.
        let _last_words = LastWords { ordinal: parts.ordinal, events: parts.events.clone() };
        StreamThread::new(parts).run(&alarm);
    })
}

/// Tells the main loop that the thread has ended, however it ended.
struct LastWords {
    ordinal: u64,
    events: Sender<FromStream>,
}

impl Drop for LastWords {
    fn drop(&mut self) {
        let event = StreamEvent::Ended { has_panicked: thread::panicking() };
        // Without a main loop nobody needs to know.
        drop(self.events.send(FromStream { ordinal: self.ordinal, event }));
    }
}

struct StreamThread {
    parts: StreamParts,
    core: StreamCore,
    window: Option<WindowDisplay>,
    intake: Intake,
    /// The newest key, until the first picture made from it is shown.
    unshown: Option<Unshown>,
    owed: OwedPicture,
    refused: u64,
    /// Keys that were taken in and superseded before any picture of them was handed over.
    unseen: u64,
    /// What is wrong with the client's motion. None until enough keys have moved to tell.
    suspicion: Option<String>,
    repeats_in_a_row: u32,
    /// Whether it was said that the CPU took over from the GPU.
    told_of_fall: bool,
    /// Whether it was said that motion is estimated.
    told_of_estimate: bool,
    /// What taking in the newest key took.
    key_work: MonoSpan,
    synthesis: Mean,
    observed: Observed,
    /// Where the model knows how large a pixel is.
    hints: Option<Hints>,
    statistics_due_at: MonoTime,
}

struct Unshown {
    key_index: u64,
    instants: KeyInstants,
}

/// Mean of what was added.
#[derive(Default)]
struct Mean {
    sum_ns: u64,
    count: u64,
}

impl StreamThread {
    fn new(parts: StreamParts) -> Self {
        let format = ingest::stream_format(&parts.create.format);
        // Before real-time priority is asked for: the engine's workers must not inherit it.
        let mut core = StreamCore::new(format, &parts.core);
        let gpu = parts.gpu.as_ref().and_then(|(gpus, index)| {
            let opened = gpus.open(*index);
            opened.inspect_err(|error| warn!(%error, "the CPU makes the pictures")).ok()
        });
        if let Some(gpu) = &gpu {
            core.use_gpu(gpu);
        }
        let size = [parts.create.format.width, parts.create.format.height];
        let hints = Hints::new(size, parts.core.engine.pixels_per_degree);
        info!(stream = parts.ordinal, backend = core.backend().name, "stream starts");
        let window = parts.window.as_ref().and_then(|(opener, config)| {
            let mailbox = Arc::clone(&parts.mailbox);
            let wake = move || mailbox.waker.wake();
            WindowDisplay::open(opener, config, gpu.as_ref(), parts.hud, &mut core, wake)
        });
        Self {
            parts,
            core,
            window,
            intake: Intake::default(),
            unshown: None,
            owed: OwedPicture::default(),
            refused: 0,
            unseen: 0,
            suspicion: None,
            repeats_in_a_row: 0,
            told_of_fall: false,
            told_of_estimate: false,
            key_work: MonoSpan::ZERO,
            synthesis: Mean::default(),
            observed: Observed::default(),
            hints,
            statistics_due_at: clock::now(),
        }
    }

    fn run(mut self, alarm: &Alarm) {
        if let Some(recorder) = &mut self.parts.recorder {
            recorder.announce(&self.parts.create);
        }
        real_time::ask();
        let mailbox = Arc::clone(&self.parts.mailbox);
        loop {
            self.follow_commands();
            match mailbox.take() {
                Taken::Closed => break,
                Taken::Key(submission) => {
                    self.make_picture_first();
                    self.take_key(&submission);
                }
                Taken::Nothing => {}
            }
            if mailbox.has_ui() {
                self.repeats_in_a_row = 0;
                self.core.on_news();
            }
            self.hear_window();
            let plan = self.core.plan(clock::now());
            let is_settled =
                self.repeats_in_a_row >= REPEATS_BEFORE_IDLE && !self.core.is_to_show_again();
            let is_idle = plan.content_time.is_none() || is_settled;
            let wake_at = if is_idle { MonoTime::FAR_FUTURE } else { plan.wake_at };
            if self.owed.is_owed() && !is_idle {
                // The newest key of those that come until then is what the picture shows.
                let hears_until = self.owed.hears_until(&plan, self.key_work);
                if let Some(until) = hears_until.filter(|&until| clock::now() < until) {
                    clock::sleep_until(until);
                } else {
                    clock::sleep_until(wake_at);
                    self.make_frame(&plan);
                }
                continue;
            }
            match alarm.wait(&mailbox.waker, wake_at) {
                Ok(Woken::ByWaker) => {}
                Ok(Woken::AtDeadline) => self.make_frame(&plan),
                Err(error) => {
                    error!(%error, "a stream cannot wait and ends");
                    break;
                }
            }
        }
        self.core.finish(clock::now());
        self.send_statistics();
    }

    fn follow_commands(&mut self) {
        for command in self.parts.mailbox.take_commands() {
            match command {
                StreamCommand::Method(method) => {
                    let gpu = self.parts.gpu.as_ref();
                    let gpu = gpu.and_then(|(gpus, index)| gpus.open(*index).ok());
                    self.core.set_method(method, gpu.as_ref());
                }
                StreamCommand::Record(recorder) => {
                    self.parts.recorder = recorder;
                    if let Some(recorder) = &mut self.parts.recorder {
                        recorder.announce(&self.parts.create);
                    }
                }
                StreamCommand::Interval(interval) => {
                    self.core.use_timer(interval, self.parts.core.display_origin);
                }
                StreamCommand::Hud(view) => match &mut self.window {
                    Some(window) => window.set_hud(view),
                    None => debug!(%view, "no window to show a HUD in"),
                },
            }
        }
    }

    /// Makes the next picture from the keys so far, if taking in the one that waits would cost its
    /// refresh: that refresh could not show the new key anyway.
    fn make_picture_first(&mut self) {
        let now = clock::now();
        let plan = self.core.plan(now);
        let budget = plan.present_at - plan.wake_by;
        let is_at_stake = now + self.key_work + budget > plan.present_at;
        let is_idle = plan.content_time.is_none() || self.repeats_in_a_row >= REPEATS_BEFORE_IDLE;
        if is_at_stake && !is_idle {
            self.make_frame(&plan);
        }
    }

    fn take_key(&mut self, submission: &Submission) {
        let started_at = clock::now();
        let recorder = self.parts.recorder.as_mut();
        let format = &self.parts.create.format;
        let taken = self.intake.key(format, submission, recorder, &mut self.core);
        if let Some(slot) = self.parts.mailbox.release(Holds::Key) {
            self.send(StreamEvent::SlotCopied(slot));
        }
        let report = match taken {
            Ok(report) => report,
            Err(error) => return self.refuse(error),
        };
        let Submission { submit, arrived_at, .. } = submission;
        trace!(key = submit.key_index, work = %report.work, "key taken in");
        self.watch_motion(report.motion);
        self.key_work = clock::now() - started_at;
        self.repeats_in_a_row = 0;
        self.owed.on_key();
        let superseded = self.unshown.replace(Unshown {
            key_index: submit.key_index,
            instants: KeyInstants {
                arrived_at: *arrived_at,
                latched_at: started_at,
                taken_in_at: started_at + self.key_work,
            },
        });
        self.unseen += u64::from(superseded.is_some());
        self.send_pacing(submit.key_index);
        self.send_hint(submit);
        self.look_at_motion();
    }

    /// Tells the client, once, what looks wrong with its motion.
    fn look_at_motion(&mut self) {
        if self.suspicion.is_some() {
            return;
        }
        self.suspicion = self.core.suspicion();
        let Some(found) = self.suspicion.clone().filter(|found| !found.is_empty()) else { return };
        warn!(stream = self.parts.ordinal, found, "the client's motion is not what it says");
        self.send(StreamEvent::Noticed(ErrorMessage {
            code: ErrorCode::Content,
            is_fatal: false,
            stream: None,
            field: "motion".to_owned(),
            expected: "motion as the stream declares it".to_owned(),
            found,
        }));
    }

    /// Shows a UI plane from the next picture on, if it is the newest.
    fn take_ui(&mut self, submission: &UiSubmission) {
        let recorder = self.parts.recorder.as_mut();
        let format = &self.parts.create.format;
        let taken = self.intake.ui(format, submission, recorder, &mut self.core);
        if let Some(slot) = self.parts.mailbox.release(Holds::Ui) {
            self.send(StreamEvent::SlotCopied(slot));
        }
        if let Err(message) = taken {
            debug!(expected = message.expected, found = message.found, "UI plane refused");
            self.send(StreamEvent::KeyRefused(message));
        }
    }

    fn refuse(&mut self, message: ErrorMessage) {
        debug!(expected = message.expected, found = message.found, "key refused");
        self.refused += 1;
        self.send(StreamEvent::KeyRefused(message));
    }

    fn make_frame(&mut self, plan: &Plan) {
        let begun_at = clock::now();
        self.owed.on_picture();
        if let Some(submission) = self.parts.mailbox.take_ui() {
            self.take_ui(&submission);
        }
        if let Some((pose, arrived_at)) = self.parts.mailbox.take_late_camera() {
            if let Some(recorder) = &mut self.parts.recorder {
                recorder.offer_late_camera(&pose, arrived_at);
            }
            self.core.late_camera(MonoTime::from_ns(pose.content_time_ns), pose.view);
        }
        self.core.keep_pictures(self.window_alone_takes_pictures());
        let outcome = self.core.make(plan, clock::now);
        self.watch_backend();
        let Some(outcome) = outcome else { return };
        let ready_at = clock::now();
        if outcome != FrameOutcome::Repeated {
            self.observed.picture(ready_at, plan.present_at);
        }
        match outcome {
            FrameOutcome::Repeated => self.repeats_in_a_row += 1,
            FrameOutcome::Dropped(DroppedFrame { kind, work }) => {
                debug!(present_at = ?plan.present_at, "frame not ready");
                self.add_work(kind, work);
            }
            FrameOutcome::Presented(frame) => {
                trace!(?frame, "frame presented");
                self.repeats_in_a_row = 0;
                let is_here = self.core.kept().is_none();
                if let Some(window) = &mut self.window {
                    window.show(plan, &frame, &mut self.core);
                }
                let handed_over_at = match self.window {
                    Some(_) => clock::now(),
                    None => ready_at,
                };
                if is_here {
                    self.deliver(&frame);
                }
                let presented_at = frame.presented_at;
                let picture = PictureInstants { begun_at, ready_at, handed_over_at, presented_at };
                self.on_presented(&frame, &picture);
            }
        }
        if self.statistics_due_at <= plan.present_at {
            self.statistics_due_at = plan.present_at + STATISTICS_INTERVAL;
            self.send_statistics();
            self.send_report();
        }
    }

    /// Takes in what the window has told, and what it told of keys that were shown.
    fn hear_window(&mut self) {
        let Some(window) = &mut self.window else { return };
        let is_open = window.hear(&mut self.core);
        for presented in window.take_shown() {
            self.send(StreamEvent::Presented(presented));
        }
        if !is_open {
            self.window = None;
        }
    }

    fn add_work(&mut self, kind: FrameKind, work: MonoSpan) {
        if kind == FrameKind::Synthesised {
            self.synthesis.add(work);
            self.observed.synthesised(work);
        }
    }

    /// Says once why the CPU has taken over.
    fn watch_backend(&mut self) {
        if let Some(why) = self.core.backend().fell_back.as_ref().filter(|_| !self.told_of_fall) {
            warn!(stream = self.parts.ordinal, why, "the CPU makes the pictures from now on");
            self.told_of_fall = true;
        }
    }

    /// Says once that keys come without motion.
    fn watch_motion(&mut self, motion: MotionState) {
        let is_told = motion == MotionState::Estimated && self.core.method() != Method::Flow;
        if is_told && !self.told_of_estimate {
            let stream = self.parts.ordinal;
            warn!(stream, "a key without usable motion: it is estimated from the pictures");
            self.told_of_estimate = true;
        }
    }

    /// Whether nobody needs the next picture in memory.
    fn window_alone_takes_pictures(&self) -> bool {
        self.window.as_ref().is_some_and(WindowDisplay::takes_kept_pictures)
            && self.parts.sink.is_none()
            && self.parts.mailbox.outlets().is_empty()
    }

    /// Gives the picture to who else gets it.
    fn deliver(&mut self, frame: &PresentedFrame) {
        let phase_q12 = frame.phase.q12().unsigned_abs();
        for outlet in self.parts.mailbox.outlets().iter() {
            let Some((slot, skipped)) = outlet.write(self.core.frame()) else { continue };
            let message = OutputFrame {
                stream: outlet.stream,
                pool: outlet.pool,
                slot,
                kind: match frame.kind {
                    FrameKind::Real => OutputKind::Real,
                    FrameKind::Synthesised => OutputKind::Synthesised,
                },
                phase_q12,
                sequence: frame.index,
                key_index: frame.key_index,
                content_time_ns: frame.content_time.as_ns(),
                present_at_ns: frame.present_at.as_ns(),
                skipped,
            };
            self.send(StreamEvent::Output(outlet.session, message));
        }
        if let Some(sink) = &mut self.parts.sink {
            sink.repeat(frame.repeats_before);
            sink.offer(frame.index, self.core.frame());
        }
    }

    fn on_presented(&mut self, frame: &PresentedFrame, picture: &PictureInstants) {
        self.add_work(frame.kind, frame.work);
        let phase_q12 = frame.phase.q12().unsigned_abs();
        if let Some(key) = self.unshown.take_if(|key| key.key_index == frame.key_index) {
            self.observed.key_shown(&key.instants, picture);
            let presented = Presented {
                stream: 0,
                phase_q12,
                key_index: key.key_index,
                content_time_ns: frame.content_time.as_ns(),
                received_at_ns: key.instants.arrived_at.as_ns(),
                present_at_ns: frame.present_at.as_ns(),
                presented_at_ns: frame.presented_at.as_ns(),
            };
            match &mut self.window {
                Some(window) => window.await_word_of(presented),
                None => self.send(StreamEvent::Presented(presented)),
            }
        }
    }

    fn send_pacing(&self, key_index: u64) {
        let status = self.core.pacing();
        let (Some(slack), Some(phase_error)) = (status.slack, status.phase_error) else { return };
        self.send(StreamEvent::Pacing(Pacing {
            stream: 0,
            key_index,
            refresh_interval_ns: status.refresh_interval.as_ns().unsigned_abs(),
            slack_ns: slack.as_ns(),
            phase_error_ns: phase_error.as_ns(),
        }));
    }

    /// Tells what would look best, if that has changed.
    fn send_hint(&mut self, submit: &Submit) {
        let (core, valid) = (&self.core, submit.planes.get(PlaneKind::Color).map(|it| it.valid));
        let pixels = valid.map_or(0, |it| u64::from(it.width) * u64::from(it.height));
        let content_time = MonoTime::from_ns(submit.content_time_ns);
        let speed = || core.inspect().and_then(|seen| seen.speed());
        let refresh_interval = core.pacing().refresh_interval;
        let hints = self.hints.as_mut();
        let hint = hints.and_then(|it| it.on_key(content_time, refresh_interval, pixels, speed));
        if let Some(hint) = hint {
            self.send(StreamEvent::Hint(hint));
        }
    }

    fn send_statistics(&self) {
        let keys = self.parts.mailbox.counts();
        let frames = self.core.counts();
        self.send(StreamEvent::Statistics(Statistics {
            stream: 0,
            keys_received: keys.received,
            keys_superseded: keys.superseded + self.unseen,
            keys_refused: keys.refused + self.refused,
            presented: frames.real + frames.synthesised + frames.repeated,
            real: frames.real,
            synthesised: frames.synthesised,
            repeated: frames.repeated,
            dropped: frames.dropped,
            synthesis_mean_ns: self.synthesis.mean_ns(),
        }));
    }

    fn send_report(&mut self) {
        let keys = self.parts.mailbox.counts();
        let frames = self.core.counts();
        let (rates_hz, on_target_percent) = self.observed.rates(clock::now(), frames);
        let backend = self.core.backend();
        let sink = self.parts.sink.as_ref().map_or(0, SinkWorker::left_out);
        let fell = backend.fell_back.iter().map(|why| format!("the CPU took over: {why}"));
        let sink = (sink > 0).then(|| format!("the sink was too slow for {sink} frames"));
        let models = self.core.inspect().map(|it| it.rung_percent()).unwrap_or_default();
        let suspicion = self.suspicion.clone().filter(|found| !found.is_empty());
        let alternates = alternation(self.parts.create.format.valid_rect_use, rates_hz.keys);
        let mut report = StreamStatus {
            width: self.parts.create.format.width,
            height: self.parts.create.format.height,
            paced_by: "timer".to_owned(),
            method: self.core.method().name().to_owned(),
            backend: backend.name.clone(),
            rates_hz,
            on_target_percent,
            latency_ms: self.observed.stages(),
            ready_before_refresh: self.observed.headroom(),
            keys: [keys.received, keys.superseded + self.unseen, keys.refused + self.refused],
            frames: [frames.real, frames.synthesised, frames.repeated, frames.dropped],
            models_percent: models
                .into_iter()
                .map(|(name, share)| (name.to_owned(), share))
                .collect(),
            warnings: fell.chain(sink).chain(suspicion).chain(alternates).collect(),
            ..StreamStatus::default()
        };
        if let Some(window) = &mut self.window {
            window.report(&mut report);
        }
        self.send(StreamEvent::Report(Box::new(report)));
    }

    fn send(&self, event: StreamEvent) {
        let ordinal = self.parts.ordinal;
        if self.parts.events.send(FromStream { ordinal, event }).is_err() {
            trace!("the main loop has ended");
        }
    }
}

impl Drop for StreamThread {
    fn drop(&mut self) {
        let left_out = self.parts.sink.as_ref().map_or(0, SinkWorker::left_out);
        if left_out > 0 {
            warn!(left_out, "the sink was too slow for some frames");
        }
    }
}

impl Mean {
    fn add(&mut self, span: MonoSpan) {
        self.sum_ns += span.as_ns().max(0).unsigned_abs();
        self.count += 1;
    }

    fn mean_ns(&self) -> u64 {
        self.sum_ns.checked_div(self.count).unwrap_or(0)
    }
}
