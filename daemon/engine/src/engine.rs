//! Runs the steps in order: a key frame in, in-between frames out.
//!
//! One [`Engine`] serves one stream. It keeps the two newest keys and reuses its buffers.

use std::num::NonZeroUsize;

use crate::color::ColorPlane;
use crate::decode::{DecodeError, decode_key};
use crate::format::StreamFormat;
use crate::key::{KeyFrame, KeyInput};
use crate::method::Method;
use crate::phase::Phase;
use crate::time::{MonoSpan, MonoTime};

/// What an engine does and with how much of the machine.
#[derive(Clone, Copy, Debug)]
pub struct EngineConfig {
    /// How in-between frames are made.
    pub method: Method,
    /// Threads that share the work. The result does not depend on it.
    pub threads: NonZeroUsize,
    /// Pixels per degree of visual angle. Turns on the damping of motion that no eye can follow;
    /// None leaves motion as it is.
    pub pixels_per_degree: Option<f32>,
    /// Reads the clock that the times in reports come from. A constant in deterministic replay.
    pub timer: fn() -> MonoTime,
}

/// What taking in a key frame led to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KeyReport {
    /// Time from the first to the last step of decode and trajectory.
    pub work: MonoSpan,
    /// Whether in-between frames after this key can move.
    pub motion: MotionState,
}

/// Why in-between frames after a key move, or do not.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MotionState {
    /// The key has a usable motion field.
    Usable,
    /// The key, or the stream, has no motion plane.
    Missing,
    /// The key is a cut: its motion points into another scene.
    Cut,
}

/// What making one in-between frame led to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FrameReport {
    /// Sequence number of the newest key that it was made from.
    pub key_index: u64,
    /// Position after that key.
    pub phase: Phase,
    /// Time from the first to the last step.
    pub work: MonoSpan,
}

/// Extrapolates the frames of one stream.
#[derive(Debug)]
pub struct Engine {
    format: StreamFormat,
    config: EngineConfig,
    newest: Option<KeyFrame>,
    previous: Option<KeyFrame>,
}

impl Engine {
    /// An engine for one stream.
    #[must_use]
    pub fn new(format: StreamFormat, config: EngineConfig) -> Self {
        Self { format, config, newest: None, previous: None }
    }

    /// What the stream declared.
    #[must_use]
    pub fn format(&self) -> &StreamFormat {
        &self.format
    }

    /// The newest key, in the engine's convention.
    #[must_use]
    pub fn newest_key(&self) -> Option<&KeyFrame> {
        self.newest.as_ref()
    }

    /// Changes the method from the next frame on.
    pub fn set_method(&mut self, method: Method) {
        self.config.method = method;
    }

    /// Takes in a key frame. The one before it becomes the previous key, unless this is a cut.
    ///
    /// # Errors
    /// If the planes contradict the stream's format or hold what cannot be converted. The keys
    /// already taken in stay as they were.
    pub fn push_key(&mut self, input: &KeyInput<'_>) -> Result<KeyReport, DecodeError> {
        let started_at = (self.config.timer)();
        let key = decode_key(&self.format, input)?;
        let motion = match (key.is_cut, key.motion_from) {
            (true, _) => MotionState::Cut,
            (false, Some(_)) => MotionState::Usable,
            (false, None) => MotionState::Missing,
        };
        self.previous = if key.is_cut { None } else { self.newest.take() };
        self.newest = Some(key);
        Ok(KeyReport { work: (self.config.timer)() - started_at, motion })
    }

    /// Makes the picture that shows `content_time` into `out`, which takes on the size and format
    /// of the stream. Returns None, with `out` untouched, as long as no key has been taken in.
    pub fn synthesise(
        &mut self,
        content_time: MonoTime,
        out: &mut ColorPlane,
    ) -> Option<FrameReport> {
        let started_at = (self.config.timer)();
        let key = self.newest.as_ref()?;
        let phase = match key.motion_span() {
            Some(span) => Phase::at(content_time, key.content_time, span),
            None => Phase::ZERO,
        };
        out.clone_from(&key.color);
        Some(FrameReport { key_index: key.index, phase, work: (self.config.timer)() - started_at })
    }
}
