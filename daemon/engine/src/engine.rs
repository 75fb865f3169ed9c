//! Runs the steps in order: a key frame in, in-between frames out.
//!
//! One [`Engine`] serves one stream. It keeps the newest keys and reuses its buffers: once every
//! buffer has its size, neither a key nor a frame allocates pixels, but the few keys after a cut and
//! after a key without depth or motion, which lets go of all that was remembered.

use std::num::NonZeroUsize;
use std::sync::Arc;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::backend::fallback::{Backend, Made};
use crate::backend::gpu::{Gpu, GpuPicture};
use crate::backend::{BackendStatus, FrameInput, Passes};
use crate::color::ColorPlane;
use crate::decode::{DecodeError, DecodeScratch, decode_key};
use crate::diagnosis::MotionCheck;
use crate::evidence::Evidence;
use crate::field::FieldMap;
use crate::finish::{Finish, FinishConfig};
use crate::format::{DepthMeaning, StreamFormat};
use crate::key::{KeyFrame, KeyInput};
use crate::light::Light;
use crate::light::relight::relight;
use crate::method::Method;
use crate::multiplex::Multiplex;
use crate::phase::Phase;
use crate::simd::Simd;
use crate::time::{MonoSpan, MonoTime};
use crate::trajectory::flow::Flow;
use crate::trajectory::ladder::{Ladder, Past};
use crate::ui::{UiInput, UiLayer, composite};
use crate::warp::linear::{MOST_KEYS, kept_keys};

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
    /// Whether detail moves from in-between frames to their keys. On its own it is off.
    pub finish: FinishConfig,
    /// How many keys that move are looked at, from the first on, for what is wrong with their
    /// motion.
    pub keys_to_check: u32,
    /// Which ways through the kernels are taken. The result does not depend on it.
    pub simd: Simd,
    /// Runs on each worker thread when it starts, for a priority that the engine knows nothing of.
    pub worker_started: fn(),
    /// Reads the clock that the times in reports come from. A constant in deterministic replay.
    pub timer: fn() -> MonoTime,
}

impl EngineConfig {
    /// Makes frames by `method` on `threads`: undamped, not finished, unchecked, by the widest
    /// registers, without asking for priority, and with a timer that stands still.
    #[must_use]
    pub fn new(method: Method, threads: NonZeroUsize) -> Self {
        Self {
            method,
            threads,
            pixels_per_degree: None,
            finish: FinishConfig::default(),
            keys_to_check: 0,
            simd: Simd::Widest,
            worker_started: || (),
            timer: || MonoTime::ZERO,
        }
    }
}

/// What taking in a key frame led to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KeyReport {
    /// Time from the first to the last step of decode and trajectory.
    pub work: MonoSpan,
    /// Whether in-between frames after this key can move.
    pub motion: MotionState,
    /// What the projection says that depth means, where it contradicts what the stream declares.
    /// The projection was followed.
    pub depth_contradiction: Option<DepthMeaning>,
}

/// Why in-between frames after a key move, or do not.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MotionState {
    /// The key has a usable motion field.
    Usable,
    /// It has none, or the method takes no notice of it: motion was estimated from this picture and
    /// the one before.
    Estimated,
    /// The key, or the stream, has no motion plane, and there is no picture before it to estimate
    /// motion from, or nothing in common with it.
    Missing,
    /// The key is a cut: its motion points into another scene.
    Cut,
    /// Vectors lack the camera's motion, the key has no depth or not both cameras, and there is
    /// nothing to estimate it from either.
    LacksCamera,
}

impl MotionState {
    /// Whether frames after the key can move.
    #[must_use]
    pub const fn moves(self) -> bool {
        matches!(self, Self::Usable | Self::Estimated)
    }
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
    pool: Arc<ThreadPool>,
    newest: Option<KeyFrame>,
    previous: Option<KeyFrame>,
    /// The keys before that, from the newest on, which holes may show.
    remembered: Vec<KeyFrame>,
    /// Key frames that are no longer needed, whose buffers the next ones take over.
    spares: Vec<KeyFrame>,
    scratch: Scratch,
    /// Of methods whose trajectories are more than the motion field.
    ladder: Option<Ladder>,
    backend: Backend,
    /// Of `auto`.
    light: Option<Light>,
    /// Of streams whose pictures are finished.
    finish: Option<Finish>,
    /// Of streams that send reduced keys in between.
    multiplex: Option<Multiplex>,
    ui: UiLayer,
    check: MotionCheck,
}

/// Buffers of the steps, kept from frame to frame.
#[derive(Debug, Default)]
struct Scratch {
    decode: DecodeScratch,
    map: FieldMap,
    flow: Flow,
}

impl Engine {
    /// An engine for one stream. It starts its threads now, fewer where the system gives fewer.
    ///
    /// Pictures of a stream that multiplexes are not finished, whatever `config` says: its keys
    /// move their detail about already.
    #[must_use]
    pub fn new(format: StreamFormat, config: EngineConfig) -> Self {
        let multiplex = Multiplex::new(&format, &config.finish);
        let finishes = multiplex.is_none();
        let finish = Finish::new(&format, &config.finish, config.pixels_per_degree);
        Self {
            format,
            config,
            pool: Arc::new(start_pool(config.threads, config.simd, config.worker_started)),
            newest: None,
            previous: None,
            remembered: Vec::new(),
            spares: Vec::new(),
            scratch: Scratch::default(),
            ladder: Ladder::new(config.method, config.pixels_per_degree),
            backend: Backend::default(),
            light: light_of(config.method, &format),
            finish: finish.filter(|_| finishes),
            multiplex,
            ui: UiLayer::default(),
            check: MotionCheck::new(&format, config.keys_to_check),
        }
    }

    /// Makes pictures on `gpu` instead of the CPU, as long as it works. To be called before the
    /// first key. [`Engine::backend`] says how it went.
    pub fn use_gpu(&mut self, gpu: &Arc<Gpu>) {
        let passes = Passes { relights: self.light.is_some(), finishes: self.finish.is_some() };
        self.backend.use_gpu(gpu, self.format.color, self.config.method.warp(), passes);
    }

    /// Makes in-between frames by `method` from now on, on `gpu` where there is one and none has
    /// failed in this stream. Until the next key surfaces go on as they did; methods that look back
    /// further learn anew.
    pub fn set_method(&mut self, method: Method, gpu: Option<&Arc<Gpu>>) {
        if method == self.config.method {
            return;
        }
        self.config.method = method;
        self.ladder = Ladder::new(method, self.config.pixels_per_degree);
        self.light = light_of(method, &self.format);
        let has_failed = self.backend.status().fell_back.is_some();
        self.backend.restart();
        if let Some(gpu) = gpu.filter(|_| !has_failed) {
            self.use_gpu(gpu);
        }
        let (pool, map) = (Arc::clone(&self.pool), &self.scratch.map);
        let backend = &mut self.backend;
        pool.install(|| {
            for key in self.remembered.iter().rev().chain(&self.previous).chain(&self.newest) {
                backend.take_key(&pool, method.warp(), key, map);
            }
        });
    }

    /// What makes the pictures, and why it is not what was asked for.
    #[must_use]
    pub fn backend(&self) -> &BackendStatus {
        self.backend.status()
    }

    /// How in-between frames are made.
    #[must_use]
    pub fn method(&self) -> Method {
        self.config.method
    }

    /// The newest key, where the cells of its field lie, and what the last keys have shown.
    pub(crate) fn newest_seen(&self) -> Option<(&KeyFrame, &FieldMap, Option<&Evidence>)> {
        let evidence = self.ladder.as_ref().map(Ladder::evidence);
        self.newest.as_ref().map(|key| (key, &self.scratch.map, evidence))
    }

    /// What was found of the client's motion so far.
    #[must_use]
    pub fn motion_check(&self) -> &MotionCheck {
        &self.check
    }

    /// What the stream declared.
    #[must_use]
    pub fn format(&self) -> &StreamFormat {
        &self.format
    }

    /// Takes in a key frame. The one before it becomes the previous key, unless this is a cut.
    ///
    /// # Errors
    /// If its content time is not later than the newest key's, or the planes contradict the
    /// stream's format or hold what cannot be converted. The keys already taken in stay as they
    /// were.
    pub fn push_key(&mut self, input: &KeyInput<'_>) -> Result<KeyReport, DecodeError> {
        // The pool is entered once: steps within it do not wake threads again.
        let pool = Arc::clone(&self.pool);
        pool.install(|| self.take_key(input))
    }

    fn take_key(&mut self, input: &KeyInput<'_>) -> Result<KeyReport, DecodeError> {
        let started_at = (self.config.timer)();
        if let Some(newest) = self.newest.as_ref().map(|key| key.content_time)
            && input.content_time <= newest
        {
            return Err(DecodeError::TimeBackwards { newest, found: input.content_time });
        }
        let is_by_flow = self.config.method == Method::Flow;
        let seen = KeyInput {
            mask: input.mask.filter(|_| self.config.method.follows_motion()),
            motion: input.motion.filter(|_| !is_by_flow),
            motion_from: input.motion_from.filter(|_| !is_by_flow),
            ..*input
        };
        let mut key = self.spares.pop().unwrap_or_default();
        let noticed = decode_key(
            &self.pool,
            &self.format,
            &seen,
            self.config.pixels_per_degree,
            &mut self.scratch.decode,
            &mut key,
        );
        let noticed = match noticed {
            Ok(noticed) => noticed,
            Err(error) => {
                self.spares.push(key);
                return Err(error);
            }
        };
        if let Some(multiplex) = &mut self.multiplex {
            let from = self.scratch.decode.reduced_color();
            let reduced = noticed.reduced.map(|part| (from, part));
            multiplex.take_key(&self.pool, reduced, self.newest.as_ref(), &mut key);
        }
        if let Some(older) = self.newest.as_ref().filter(|_| key.motion_from.is_some()) {
            let displacement = self.scratch.decode.displacement();
            self.check.look(&self.format, &key, displacement, older);
        }
        let has_none = key.motion_from.is_none() && !key.is_cut;
        let is_estimated = has_none && self.estimate_motion(&mut key);
        if !is_estimated {
            self.follow_picture(&mut key);
        }
        let motion = match key.motion_from {
            _ if key.is_cut => MotionState::Cut,
            Some(_) if is_estimated => MotionState::Estimated,
            Some(_) => MotionState::Usable,
            None if noticed.lacks_camera_motion => MotionState::LacksCamera,
            None => MotionState::Missing,
        };
        if let Some(ladder) = &mut self.ladder {
            if key.motion_from.is_some() {
                self.scratch.decode.hand_displacement(&mut key);
            }
            // Keys from before a change of method lack what the ladder keeps of a key.
            let is_known =
                |key: &&KeyFrame| key.motion_from.is_none() || !key.displacement.data().is_empty();
            let past = past_keys([&self.newest, &self.previous], &self.remembered);
            let past = past.map(|older| older.filter(|_| !key.is_cut).filter(is_known));
            let flow = Some(&mut self.scratch.flow).filter(|_| !is_estimated);
            ladder.take_key(&self.pool, flow, &mut key, past);
            key.is_found_cut = ladder.evidence().is_cut();
        }
        if !key.velocity.data().is_empty() {
            let cells = [key.velocity.width(), key.velocity.height()];
            self.scratch.map.update(key.valid, cells, key.field_offset);
        }
        self.backend.take_key(&self.pool, self.config.method.warp(), &key, &self.scratch.map);
        self.follow_light(&key);
        if let Some(finish) = &mut self.finish {
            let evidence = self.ladder.as_ref().map(Ladder::evidence);
            let older = self.newest.as_ref();
            finish.take_key(&self.pool, &key, older, &self.scratch.map, evidence);
        }
        let newest = self.newest.replace(key);
        let dropped = std::mem::replace(&mut self.previous, newest);
        let dropped = dropped.and_then(|dropped| self.remember(dropped));
        self.spares.extend(dropped);
        if input.is_cut {
            self.spares.extend(self.previous.take());
            self.spares.append(&mut self.remembered);
        }
        Ok(KeyReport {
            work: (self.config.timer)() - started_at,
            motion,
            depth_contradiction: noticed.depth_contradiction,
        })
    }

    /// Keeps `key`, the one before the previous key, where holes may show it. Returns a key that is
    /// no longer needed.
    fn remember(&mut self, key: KeyFrame) -> Option<KeyFrame> {
        if self.config.method.warp() != Method::Linear {
            self.remembered.clear();
            self.spares.clear();
            return Some(key);
        }
        let cells = key.velocity.data().len();
        // Of a key without depth or motion no hole shows anything, nor of what lies before it.
        if key.depth.data().is_empty() || cells == 0 {
            self.spares.append(&mut self.remembered);
            return Some(key);
        }
        self.remembered.insert(0, key);
        let most = kept_keys(cells).saturating_sub(1);
        let last = self.remembered.get(most).is_some().then(|| self.remembered.swap_remove(most));
        self.remembered.truncate(most);
        last
    }

    /// Estimates the motion of `key`, which has none, from its picture and the newest one's.
    /// Returns whether that was wanted and possible.
    fn estimate_motion(&mut self, key: &mut KeyFrame) -> bool {
        let wanted = self.newest.as_ref().filter(|_| self.config.method.follows_motion());
        let Some(older) = wanted else { return false };
        let Scratch { decode, flow, .. } = &mut self.scratch;
        let is_found = flow.find(&self.pool, key, older);
        if is_found {
            let pixels_per_degree = self.config.pixels_per_degree;
            decode.take_flow(&self.pool, flow, older.content_time, pixels_per_degree, key);
        }
        is_found
    }

    /// Takes in how the light of `key`, the one that is coming, has changed.
    fn follow_light(&mut self, key: &KeyFrame) {
        let Some((light, ladder)) = self.light.as_mut().zip(self.ladder.as_ref()) else { return };
        let is_cut = key.is_cut || key.is_found_cut;
        match self.newest.as_ref().filter(|_| !is_cut) {
            Some(older) => {
                let is_followed = |at| ladder.is_followed(at);
                light.take_key(&self.pool, key, older, &self.scratch.map, is_followed);
            }
            None => light.forget(),
        }
    }

    /// Lets the cells of `key` go by the motion of the picture whose mask says so.
    fn follow_picture(&mut self, key: &mut KeyFrame) {
        let has_both = key.motion_from.is_some() && !key.mask.data().is_empty();
        let Some(older) = self.newest.as_ref().filter(|_| has_both && !key.is_cut) else { return };
        let Scratch { decode, flow, .. } = &mut self.scratch;
        if decode.asks_for_picture(key) && flow.find(&self.pool, key, older) {
            let pixels_per_degree = self.config.pixels_per_degree;
            decode.take_picture(&self.pool, flow, older.content_time, pixels_per_degree, key);
        }
    }

    /// The client has moved the camera on to `view` (world to view, column-major) at
    /// `content_time`, after its newest key. Of several the newest content time wins. Frames made
    /// from now on by a method that knows cameras, `world` or `auto`, see what moves with the world
    /// from there; others take no notice.
    pub fn late_camera(&mut self, content_time: MonoTime, view: [f32; 16]) {
        let is_finite = view.iter().all(|element| element.is_finite());
        if let Some(ladder) = self.ladder.as_mut().filter(|_| is_finite) {
            ladder.late_camera(content_time, view);
        }
    }

    /// Shows this user interface over every picture from now on, in the place of the one before.
    /// It may come before the first key, and stays across cuts.
    ///
    /// # Errors
    /// If its numbers do not describe pixels that are there. What was shown before stays.
    pub fn set_ui(&mut self, input: &UiInput<'_>) -> Result<(), DecodeError> {
        self.ui.set(&self.pool, self.format.color, input)
    }

    /// Brings the newest key's trajectories up to the late camera.
    fn catch_up(&mut self) {
        let Some((ladder, key)) = self.ladder.as_mut().zip(self.newest.as_mut()) else { return };
        let past = past_keys([&self.previous], &self.remembered);
        if ladder.catch_up(&self.pool, key, past) {
            let method = self.config.method.warp();
            self.backend.take_field(&self.pool, method, key, &self.scratch.map);
            if let Some(finish) = &mut self.finish {
                finish.take_field(key, &self.scratch.map);
            }
        }
    }

    /// Makes the picture that shows `content_time` into `out`, which takes on the size and format
    /// of the stream. Returns None, with `out` untouched, as long as no key has been taken in.
    pub fn synthesise(
        &mut self,
        content_time: MonoTime,
        out: &mut ColorPlane,
    ) -> Option<FrameReport> {
        let pool = Arc::clone(&self.pool);
        let made = pool.install(|| self.make(content_time, out, false));
        made.map(|(report, _)| report)
    }

    /// The same for who reads the picture on the GPU that makes it: there it stays, and `out` is
    /// unspecified. Where it is not made on a GPU, or something comes over it, it is in `out`.
    pub fn synthesise_kept(
        &mut self,
        content_time: MonoTime,
        out: &mut ColorPlane,
    ) -> Option<(FrameReport, Option<GpuPicture>)> {
        let pool = Arc::clone(&self.pool);
        let keeps = self.ui.is_empty();
        pool.install(|| self.make(content_time, out, keeps))
    }

    /// Whether a picture of a content time that has just been shown would be another one now,
    /// because finishing gives each frame of a key its own part of the light.
    #[must_use]
    pub fn alternates(&self) -> bool {
        self.finish.as_ref().is_some_and(|finish| !finish.ledger.is_settled())
    }

    /// The last picture was not shown; the display showed the one before again. To be told where
    /// pictures are finished: the light of those that follow makes up for it.
    pub fn picture_dropped(&mut self) {
        if let Some(finish) = &mut self.finish {
            finish.ledger.dropped();
        }
    }

    fn make(
        &mut self,
        content_time: MonoTime,
        out: &mut ColorPlane,
        keeps: bool,
    ) -> Option<(FrameReport, Option<GpuPicture>)> {
        let started_at = (self.config.timer)();
        self.catch_up();
        let key = self.newest.as_ref()?;
        let phase = match key.motion_span() {
            // Back from the newest key.
            Some(span) if self.config.method == Method::Voxel => {
                Phase::at(key.content_time, content_time, span)
            }
            Some(span) => Phase::at(content_time, key.content_time, span),
            None => Phase::ZERO,
        };
        out.reset(key.color.format(), key.color.width(), key.color.height());
        let (newest_at, previous) = (key.content_time, self.previous.as_ref());
        let shown = match (self.config.method, previous) {
            (method, Some(older))
                if method.interpolates() && content_time <= older.content_time =>
            {
                Some(older)
            }
            (method, Some(_)) if method.interpolates() && content_time < newest_at => None,
            (Method::Hold | Method::Blend | Method::Voxel, _) => Some(key),
            _ if phase == Phase::ZERO => Some(key),
            _ => None,
        };
        let is_after = shown.is_none() && !self.config.method.interpolates();
        let moved = if is_after { phase } else { Phase::ZERO };
        let part = self.finish.as_mut().map(|finish| finish.next_part(moved));
        let gains = self.light.as_mut().and_then(|light| light.gains(&self.pool, moved));
        let Made { is_finished, kept } = if let Some(shown) = shown {
            out.copy_from(&shown.color);
            Made { is_finished: false, kept: None }
        } else {
            let method = self.config.method.warp();
            let map = &self.scratch.map;
            let finish = self.finish.as_mut().zip(part).and_then(|(it, part)| it.split(part));
            let mut past = [key; MOST_KEYS];
            let known = previous.into_iter().chain(&self.remembered);
            let known = past.iter_mut().zip(known).map(|(past, key)| *past = key).count();
            let past = &past[..known];
            let frame = FrameInput { method, phase, newest: key, past, map, gains, finish };
            self.backend.make(&self.pool, &frame, out, keeps)
        };
        if let Some(gains) = gains.filter(|_| !is_finished) {
            relight(&self.pool, gains, key.valid, out);
        }
        if let Some((finish, part)) = self.finish.as_mut().zip(part).filter(|_| !is_finished) {
            finish.apply(&self.pool, part, key.valid, out);
        }
        if kept.is_none() {
            composite(&self.pool, &self.ui, out);
        }
        // What lies before the newest key has no position after it.
        let phase = if self.config.method.interpolates() { Phase::ZERO } else { phase };
        let work = (self.config.timer)() - started_at;
        Some((FrameReport { key_index: key.index, phase, work }, kept))
    }
}

/// The keys before one: those `kept` for themselves, the newest first, and then the others.
fn past_keys<'a, const N: usize>(
    kept: [&'a Option<KeyFrame>; N],
    remembered: &'a [KeyFrame],
) -> Past<'a> {
    let mut keys = kept.into_iter().flatten().chain(remembered);
    std::array::from_fn(|_| keys.next())
}

/// What continues the light of a stream of `method`.
fn light_of(method: Method, format: &StreamFormat) -> Option<Light> {
    (method == Method::Auto).then(|| Light::new(format.color))
}

/// A pool of `threads`, or of as many as the system starts, which go through kernels as `simd`
/// says.
pub(crate) fn start_pool(threads: NonZeroUsize, simd: Simd, started: fn()) -> ThreadPool {
    (1..=threads.get())
        .rev()
        .find_map(|threads| {
            let name = |index| format!("foreframe-{index}");
            let pool = ThreadPoolBuilder::new().num_threads(threads).thread_name(name);
            let start = move |_| {
                simd.enter();
                started();
            };
            pool.start_handler(start).build().ok()
        })
        .expect("a system that runs this thread can start one more")
}

#[cfg(test)]
mod tests;
