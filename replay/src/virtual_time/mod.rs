//! A daemon's stream without a daemon: keys of a recording in, output frames out, on virtual time.
//!
//! The very [`StreamCore`] that the daemon runs is driven here by a clock that is set, not read:
//! it jumps from event to event, making a frame takes a constant time, and the display refreshes
//! exactly on its grid. So one recording gives one sequence of plans and, for any number of
//! threads, one sequence of pictures, whose [`digest`] proves it.

pub mod digest;
pub mod keys;

use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::{
    ColorPlane, EngineConfig, FinishConfig, Method, MonoSpan, MonoTime, Phase, StreamFormat,
    UiInput,
};
use foreframed::stream::core::{CoreConfig, FrameKind, FrameOutcome, PresentedFrame, StreamCore};
use foreframed::stream::owed::OwedPicture;
use std::num::NonZeroUsize;
use std::sync::Arc;

use crate::recording::{Frame, OwnedPlane};

/// Time that making a frame takes, unless a quarter of the refresh interval is less.
const MAX_WORK: MonoSpan = MonoSpan::from_ms(1);

/// How to replay.
#[derive(Clone, Debug)]
pub struct ReplayConfig {
    /// How in-between frames are made.
    pub method: Method,
    /// Makes the pictures; without it the CPU does. The pictures do not depend on it.
    pub gpu: Option<Arc<Gpu>>,
    /// Threads of the engine. The pictures do not depend on it.
    pub threads: NonZeroUsize,
    /// Period of the display.
    pub refresh_interval: MonoSpan,
    /// A refresh of the display, not after the first arrival; None has one at the first arrival.
    pub display_origin: Option<MonoTime>,
    /// Angular size of a pixel, which turns on damping of motion that no eye can follow.
    pub pixels_per_degree: Option<f32>,
    /// Poses that arrive after their keys, in the order of their arrival.
    pub late_cameras: Vec<TimedPose>,
    /// Whether detail moves from in-between frames to their keys.
    pub finish: FinishConfig,
    /// In-between frames are left out until something has moved by so many pixels.
    pub least_step_px: f32,
}

/// Where an output frame comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum OutputKind {
    /// A key, as it is.
    Real,
    /// Made by the engine.
    Synthesised,
    /// The frame before, again.
    Repeated,
}

/// One refresh of the display.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OutputFrame {
    /// Number of the refresh, from 0 at the first picture.
    pub index: u64,
    /// When it is shown.
    pub present_at: MonoTime,
    /// Content time that it shows.
    pub content_time: MonoTime,
    /// Number of the newest key that it was made from.
    pub key: u64,
    /// Position after that key.
    pub phase: Phase,
    /// Where it comes from.
    pub kind: OutputKind,
}

/// What did not become an output frame.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Losses {
    /// Pictures that were not ready for their refresh.
    pub dropped: u64,
    /// Keys that a newer one replaced before a picture of them was made.
    pub superseded: u64,
    /// Why each refused key was refused, in order.
    pub refused: Vec<String>,
    /// Why the CPU took over from the GPU, if it did.
    pub fell_back: Option<String>,
}

/// A key and when it arrives.
#[derive(Clone, Debug)]
pub struct TimedKey {
    /// On the virtual clock; not before the key before.
    pub arrives_at: MonoTime,
    /// The key.
    pub frame: Frame,
}

/// A pose of the camera and when it arrives.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TimedPose {
    /// On the virtual clock.
    pub arrives_at: MonoTime,
    /// Content time of the pose.
    pub content_time: MonoTime,
    /// World to view, column-major.
    pub view: [f32; 16],
}

/// A user interface that comes between keys, and when it arrives.
#[derive(Clone, Debug)]
pub struct TimedUi {
    /// On the virtual clock; not before the one before.
    pub arrives_at: MonoTime,
    /// Column and row of the output that its first pixel lies on.
    pub place: [i32; 2],
    /// Its pixels, in the format of the stream.
    pub plane: OwnedPlane,
}

/// Replays `keys`, with the user interfaces `uis` between them, and hands each output frame to
/// `show`. Ends one key interval after the last key, and not before everything was shown.
///
/// # Errors
/// Those of `keys`, of `uis` and of `show`.
pub fn replay(
    format: StreamFormat,
    config: &ReplayConfig,
    keys: impl IntoIterator<Item = anyhow::Result<TimedKey>>,
    uis: impl IntoIterator<Item = anyhow::Result<TimedUi>>,
    mut show: impl FnMut(&OutputFrame, &ColorPlane) -> anyhow::Result<()>,
) -> anyhow::Result<Losses> {
    let mut losses = Losses::default();
    let mut keys = keys.into_iter();
    let Some(first) = keys.next().transpose()? else { return Ok(losses) };
    let mut clock = first.arrives_at;
    let mut stream = VirtualStream::new(format, config, clock);
    let mut next = Some(first);
    let mut last_arrivals = [clock; 2];
    let mut poses = &config.late_cameras[..];
    let mut uis = uis.into_iter();
    let mut next_ui = uis.next().transpose()?;
    let mut last_ui = MonoTime::ZERO;
    loop {
        if next_ui.as_ref().is_some_and(|ui| ui.arrives_at <= clock) {
            stream.core.on_news();
        }
        let plan = stream.core.plan(clock);
        let hears_until = stream.owed.hears_until(&plan, MonoSpan::ZERO);
        let is_taken = |key: &mut TimedKey| match hears_until {
            _ if plan.content_time.is_none() => true,
            Some(until) => clock < until && key.arrives_at <= until,
            None => !stream.owed.is_owed() && key.arrives_at <= plan.wake_at,
        };
        if let Some(mut key) = next.take_if(is_taken) {
            // What comes while a picture is owed waits until that has to hear of it.
            clock = clock.max(hears_until.unwrap_or(key.arrives_at));
            next = keys.next().transpose()?;
            // Newest wins, as in the daemon: what came meanwhile replaces what waited.
            while let Some(newer) = next.take_if(|newer| newer.arrives_at <= clock) {
                losses.superseded += 1;
                key = newer;
                next = keys.next().transpose()?;
            }
            last_arrivals = [last_arrivals[1], key.arrives_at];
            match stream.core.on_key(&key.frame.as_input(), || clock) {
                Ok(_) => {
                    losses.superseded += u64::from(stream.owed.on_key());
                    if let Some(ui) = key.frame.ui_input() {
                        stream.core.set_ui(&ui, key.arrives_at)?;
                    }
                }
                Err(error) => losses.refused.push(format!("key {}: {error}", key.frame.index)),
            }
            continue;
        }
        let interval = (last_arrivals[1] - last_arrivals[0]).max(config.refresh_interval);
        let has_shown_all = next.is_none() && next_ui.is_none() && !stream.owed.is_owed();
        let end = (last_arrivals[1] + interval).max(last_ui + config.refresh_interval);
        let is_over = has_shown_all && plan.present_at > end;
        if plan.content_time.is_none() || (is_over && stream.shown.is_some()) {
            losses.fell_back = stream.core.backend().fell_back.clone();
            return Ok(losses);
        }
        // Its arrival wakes the stream, which may plan an earlier picture for it.
        if let Some(ui) = &next_ui
            && ui.arrives_at > clock
            && ui.arrives_at < plan.wake_at
        {
            clock = ui.arrives_at;
            continue;
        }
        while let Some(ui) = next_ui.take_if(|ui| ui.arrives_at <= plan.wake_at) {
            let input = UiInput { plane: ui.plane.as_input(), place: ui.place };
            stream.core.set_ui(&input, ui.arrives_at)?;
            last_ui = ui.arrives_at;
            next_ui = uis.next().transpose()?;
        }
        while let Some((pose, later)) =
            poses.split_first().filter(|(pose, _)| pose.arrives_at <= plan.wake_at)
        {
            stream.core.late_camera(pose.content_time, pose.view);
            poses = later;
        }
        clock = plan.wake_at + stream.work;
        stream.owed.on_picture();
        let outcome = stream.core.make(&plan, || clock);
        match outcome.and_then(|outcome| stream.on_outcome(outcome, plan.present_at)) {
            Some(frame) => show(&frame, &stream.picture)?,
            None => losses.dropped += 1,
        }
    }
}

/// The stream and what its display shows.
struct VirtualStream {
    core: StreamCore,
    work: MonoSpan,
    refresh_interval: MonoSpan,
    shown: Option<OutputFrame>,
    /// The picture on the display. What was made and dropped is not.
    picture: ColorPlane,
    /// Whether the newest key still has no picture.
    owed: OwedPicture,
}

impl VirtualStream {
    fn new(format: StreamFormat, config: &ReplayConfig, origin: MonoTime) -> Self {
        let refresh_interval = config.refresh_interval;
        let mut core = StreamCore::new(
            format,
            &CoreConfig {
                engine: EngineConfig {
                    pixels_per_degree: config.pixels_per_degree,
                    finish: config.finish,
                    ..EngineConfig::new(config.method, config.threads)
                },
                refresh_interval,
                display_origin: config.display_origin.unwrap_or(origin),
                least_step_px: config.least_step_px,
            },
        );
        if let Some(gpu) = &config.gpu {
            core.use_gpu(gpu);
        }
        let work = MAX_WORK.min(refresh_interval.scale(1, 4));
        let picture = ColorPlane::default();
        Self { core, work, refresh_interval, shown: None, picture, owed: OwedPicture::default() }
    }

    /// What the refresh at `present_at` shows after `outcome`; None if its picture was dropped.
    fn on_outcome(&mut self, outcome: FrameOutcome, present_at: MonoTime) -> Option<OutputFrame> {
        match outcome {
            FrameOutcome::Presented(frame) => {
                std::mem::swap(self.core.frame(), &mut self.picture);
                Some(self.present(&frame))
            }
            FrameOutcome::Repeated => self.repeat(present_at),
            FrameOutcome::Dropped(_) => None,
        }
    }

    fn present(&mut self, frame: &PresentedFrame) -> OutputFrame {
        let kind = match frame.kind {
            FrameKind::Real => OutputKind::Real,
            FrameKind::Synthesised => OutputKind::Synthesised,
        };
        *self.shown.insert(OutputFrame {
            index: frame.index,
            present_at: frame.presented_at,
            content_time: frame.content_time,
            key: frame.key_index,
            phase: frame.phase,
            kind,
        })
    }

    /// The picture on the display at a later refresh.
    fn repeat(&mut self, present_at: MonoTime) -> Option<OutputFrame> {
        let shown = self.shown.as_mut()?;
        let interval = self.refresh_interval.as_ns().max(1);
        let passed = ((present_at - shown.present_at).as_ns() + interval / 2) / interval;
        shown.index += passed.max(0).unsigned_abs();
        shown.present_at = present_at;
        shown.kind = OutputKind::Repeated;
        Some(*shown)
    }
}

#[cfg(test)]
mod tests;
