//! The scoring protocol: keys in order to one engine per method, frames out, compared with truth.
//!
//! A method that extrapolates has been given nothing later than the newest key when it makes its
//! frames. One that interpolates is given the next key first, unless a cut lies before that key:
//! then it has no more to go by than the others. With [`ScoreOptions::late_camera`], and not
//! without, methods that know cameras are told the pose at the time of each frame. Work times are
//! the engine's own reports, and while an engine works nothing else runs here; comparing is done
//! afterwards, in parallel.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::Arc;

use anyhow::{Context as _, ensure};
use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::decode::decode_field;
use foreframe_engine::{
    ColorPlane, Engine, EngineConfig, FinishConfig, FinishMode, Method, MonoTime, Plane,
    StreamFormat,
};
use foreframed::sink::srgb::SrgbConverter;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::flips::{FlipFrame, rung_map};
use super::picture::{Srgb8, to_srgb8};
use super::report::{CaptureScore, MotionCounts};
use super::retina::{Eye, closeness, gaze_of, reach};
use super::tally::{FrameScore, MethodTally, Truth};
use crate::recording::keys::KeyReader;
use crate::recording::plan::{MotionSource, Plan};
use crate::recording::{Frame, Recording, Wanted};

/// What to score and how.
#[derive(Clone, Debug)]
pub struct ScoreOptions {
    /// The methods, in the order of the report.
    pub methods: Vec<Method>,
    /// Frames from key to key.
    pub ratio: NonZeroUsize,
    /// What makes the frames, one after the other: None is the CPU.
    pub backends: Vec<Option<Arc<Gpu>>>,
    /// Threads of the engine.
    pub threads: NonZeroUsize,
    /// The clock of the engine's work reports.
    pub timer: fn() -> MonoTime,
    /// How many frames to keep for a flip viewer, spread over the recording.
    pub kept_frames: usize,
    /// Whether detail moves from in-between frames to their keys, which are then made too.
    pub finish: FinishConfig,
    /// Compares what the eye sees, too.
    pub retina: bool,
    /// Tells methods that know cameras where the recording's is at the time of each frame.
    pub late_camera: bool,
}

/// Scores one recording. `on_key` is called after each key.
///
/// # Errors
/// If a frame cannot be read or the engine refuses it.
pub fn score_recording(
    name: &str,
    recording: &mut dyn Recording,
    options: &ScoreOptions,
    mut on_key: impl FnMut(),
) -> anyhow::Result<CaptureScore> {
    let plan = Plan::new(recording.heads(), options.ratio);
    ensure!(!plan.keys.is_empty(), "expected at least one whole frame, found no frames");
    // A larger ratio leaves one key as well, and would have lists of that many phases.
    let asked = options.ratio;
    let most = NonZeroUsize::MIN.saturating_add(recording.heads().len());
    let options = &ScoreOptions { ratio: asked.min(most), ..options.clone() };
    let reader = KeyReader::new(recording.format(), &plan)?;
    let format = *reader.format();
    let converter = SrgbConverter::new(&format);
    let mut truths = TruthReader::new(*recording.format(), options);
    let mut runs: Vec<_> = options
        .methods
        .iter()
        .flat_map(|method| options.backends.iter().map(|backend| (*method, backend.as_ref())))
        .map(|(method, backend)| MethodRun::new(method, backend, format, options))
        .collect();
    let kept = kept_frames(&plan, options.kept_frames);
    let mut retina = Retina::new(options)?;
    let mut flips = Vec::new();

    let mut key = reader.read(recording, &plan, 0)?;
    for index in 0..plan.keys.len() {
        let next = match index + 1 < plan.keys.len() {
            true => Some(reader.read(recording, &plan, index + 1)?),
            false => None,
        };
        let predicted = plan.predicted(index);
        let times: Vec<_> =
            predicted.clone().map(|frame| recording.heads()[frame].content_time).collect();
        let poses = late_poses(recording, predicted.clone(), options.late_camera)?;
        for run in &mut runs {
            run.make(&key, next.as_ref(), &times, &poses)
                .with_context(|| format!("key frame {}", plan.keys[index].frame))?;
        }
        let truths_of_key: Vec<_> = predicted
            .clone()
            .map(|frame| truths.read(recording, frame))
            .collect::<anyhow::Result<Vec<_>>>()?
            .into_par_iter()
            .map(Truth::new)
            .collect();
        let is_whole = plan.left_out(index) == 0;
        let size = (format.width, format.height);
        runs.par_iter_mut().for_each(|run| {
            let frames: Vec<_> = run
                .outputs
                .par_iter()
                .zip(&truths_of_key)
                .map(|(output, truth)| FrameScore::of(&to_srgb8(output, &converter), truth))
                .collect();
            run.tally.add_frames(predicted.start, &frames, size, is_whole);
        });
        if let Some(retina) = &mut retina {
            let moment = Moment { plan: &plan, index, key: &key, truths: &truths_of_key };
            retina.look(&moment, &format, &converter, &mut runs)?;
        }
        let truths = truths_of_key;
        for (place, frame) in predicted.enumerate().filter(|(_, frame)| kept.contains(frame)) {
            let size = [format.width, format.height];
            let shown = runs.iter().map(|run| {
                let seen = run.engine.inspect().expect("it has been given this key");
                (to_srgb8(&run.outputs[place], &converter), rung_map(&seen, size))
            });
            flips.push(FlipFrame::new(frame, truths[place].picture(), shown));
        }
        on_key();
        match next {
            Some(next) => key = next,
            None => break,
        }
    }
    Ok(CaptureScore {
        name: name.to_owned(),
        width: format.width,
        height: format.height,
        ratio: asked.get(),
        keys: plan.keys.len(),
        left_out: (0..plan.keys.len()).map(|key| plan.left_out(key)).sum(),
        key_motion: count_motion(&plan),
        methods: runs
            .iter()
            .map(|run| run.tally.finish(run.engine.backend().name.clone()))
            .collect(),
        flips,
    })
}

/// World to view at each of `frames` where it is to be told and the recording has it.
fn late_poses(
    recording: &mut dyn Recording,
    frames: Range<usize>,
    is_told: bool,
) -> anyhow::Result<Vec<Option<[f32; 16]>>> {
    let mut pose = |frame| -> anyhow::Result<_> {
        if !is_told {
            return Ok(None);
        }
        let read = recording.read(frame, Wanted::Color);
        let read = read.with_context(|| format!("the camera of frame {frame}"))?;
        Ok(read.camera.map(|camera| camera.view))
    };
    frames.map(&mut pose).collect()
}

fn count_motion(plan: &Plan) -> MotionCounts {
    let mut counts = MotionCounts::default();
    for key in &plan.keys {
        match key.motion {
            MotionSource::Own { .. } => counts.own += 1,
            MotionSource::Composed { .. } => counts.composed += 1,
            MotionSource::None => counts.missing += 1,
        }
    }
    counts
}

/// Predicted frames to keep, `count` of them or all, evenly spread.
fn kept_frames(plan: &Plan, count: usize) -> Vec<usize> {
    let all: Vec<_> = (0..plan.keys.len()).flat_map(|key| plan.predicted(key)).collect();
    let count = count.min(all.len());
    (0..count).map(|place| all[(2 * place + 1) * all.len() / (2 * count)]).collect()
}

fn engine_of(
    method: Method,
    gpu: Option<&Arc<Gpu>>,
    format: StreamFormat,
    options: &ScoreOptions,
) -> Engine {
    // Not damped: damping is for eyes, and the metrics have none.
    let config = EngineConfig {
        timer: options.timer,
        finish: options.finish,
        ..EngineConfig::new(method, options.threads)
    };
    let mut engine = Engine::new(format, config);
    if let Some(gpu) = gpu {
        engine.use_gpu(gpu);
    }
    engine
}

/// One method on its way through a recording.
struct MethodRun {
    method: Method,
    engine: Engine,
    newest: Option<u64>,
    outputs: Vec<ColorPlane>,
    /// The picture of the key itself, where pictures are finished or looked at.
    key_shown: Option<ColorPlane>,
    /// The last frames before the newest key, for the eye.
    before: Vec<Srgb8>,
    tally: MethodTally,
}

impl MethodRun {
    fn new(
        method: Method,
        gpu: Option<&Arc<Gpu>>,
        format: StreamFormat,
        options: &ScoreOptions,
    ) -> Self {
        Self {
            method,
            engine: engine_of(method, gpu, format, options),
            newest: None,
            outputs: Vec::new(),
            key_shown: (options.retina || options.finish.mode != FinishMode::Off)
                .then(ColorPlane::default),
            before: Vec::new(),
            tally: MethodTally::new(method, options.ratio.get()),
        }
    }

    /// Makes the frames that show `times`, between `key` and `next`, into `outputs`.
    fn make(
        &mut self,
        key: &Frame,
        next: Option<&Frame>,
        times: &[MonoTime],
        poses: &[Option<[f32; 16]>],
    ) -> anyhow::Result<()> {
        self.push(key)?;
        if let Some(next) = next.filter(|next| self.method.interpolates() && !next.is_cut) {
            self.push(next)?;
        }
        self.outputs.resize_with(times.len(), || ColorPlane::Rgba8(Plane::default()));
        if let Some(shown) = &mut self.key_shown {
            // The first picture of a key is the key.
            self.engine.synthesise(key.content_time, shown).context("the engine has no key")?;
        }
        for ((time, pose), output) in times.iter().zip(poses).zip(&mut self.outputs) {
            if let Some(view) = pose.filter(|_| self.method.knows_cameras()) {
                self.engine.late_camera(*time, view);
                self.tally.add_late_camera();
            }
            let report = self.engine.synthesise(*time, output).context("the engine has no key")?;
            self.tally.add_frame(output, report.work);
        }
        Ok(())
    }

    /// Gives the engine a key, unless it has been given it already.
    fn push(&mut self, key: &Frame) -> anyhow::Result<()> {
        if self.newest != Some(key.index) {
            let report = self.engine.push_key(&key.as_input())?;
            self.tally.add_key_work(report.work);
            self.newest = Some(key.index);
        }
        Ok(())
    }
}

/// What the eye sees, from key to key.
struct Retina {
    ratio: usize,
    finish: FinishConfig,
    pool: ThreadPool,
    /// The last true frames before the newest key.
    before: Vec<Srgb8>,
}

/// One key and the frames after it.
struct Moment<'a> {
    plan: &'a Plan,
    index: usize,
    key: &'a Frame,
    truths: &'a [Truth],
}

/// Keys before the first one that is looked at: until then finishing does not know how many frames
/// come between two.
const UNSETTLED_KEYS: usize = 2;

impl Retina {
    fn new(options: &ScoreOptions) -> anyhow::Result<Option<Self>> {
        if !options.retina {
            return Ok(None);
        }
        let pool = ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.context("starting a thread to decode motion with")?;
        let ratio = options.ratio.get();
        Ok(Some(Self { ratio, finish: options.finish, pool, before: Vec::new() }))
    }

    /// Looks at the frames around a key, where they are all there, and keeps those before the next.
    fn look(
        &mut self,
        moment: &Moment<'_>,
        format: &StreamFormat,
        converter: &SrgbConverter,
        runs: &mut [MethodRun],
    ) -> anyhow::Result<()> {
        let Moment { plan, index, key, truths } = *moment;
        let reach = reach(self.ratio);
        let is_there = self.before.len() == reach && truths.len() >= reach;
        if is_there && index >= UNSETTLED_KEYS && !key.is_cut {
            let field = decode_field(&self.pool, format, &key.as_input())?;
            let displacement = field.map(|field| field.displacement).unwrap_or_default();
            let size = [format.width, format.height];
            let gaze = gaze_of(&displacement, self.ratio as f32, size);
            let eye = Eye::new(gaze, self.ratio, &self.finish);
            let picture = to_srgb8(&decoded(key, format)?, converter);
            let after: Vec<_> = truths[..reach].iter().map(Truth::picture).collect();
            let truly = eye.sees(&around(&self.before, &picture, &after))?;
            let keys = closeness(&eye.sees_held(&picture)?, &truly);
            for run in &mut *runs {
                let shown = run.key_shown.as_ref().map(|shown| to_srgb8(shown, converter));
                let after: Vec<_> =
                    run.outputs[..reach].iter().map(|output| to_srgb8(output, converter)).collect();
                let after: Vec<_> = after.iter().collect();
                let shown = shown.as_ref().unwrap_or(&picture);
                let seen = eye.sees(&around(&run.before, shown, &after))?;
                run.tally.retina.add(closeness(&seen, &truly), keys);
            }
        }
        let is_whole = plan.left_out(index) == 0 && truths.len() >= reach;
        let last = |count: usize| if is_whole { count - reach..count } else { 0..0 };
        self.before =
            truths[last(truths.len())].iter().map(|truth| truth.picture().clone()).collect();
        for run in runs {
            let outputs = &run.outputs[last(run.outputs.len())];
            run.before = outputs.iter().map(|output| to_srgb8(output, converter)).collect();
        }
        Ok(())
    }
}

/// A key between the frames before it and those after it.
fn around<'a>(before: &'a [Srgb8], key: &'a Srgb8, after: &[&'a Srgb8]) -> Vec<&'a Srgb8> {
    before.iter().chain([key]).chain(after.iter().copied()).collect()
}

/// The picture of a key, through the engine's own decoder.
fn decoded(key: &Frame, format: &StreamFormat) -> anyhow::Result<ColorPlane> {
    let config = EngineConfig::new(Method::Hold, NonZeroUsize::MIN);
    let mut engine = Engine::new(*format, config);
    engine.push_key(&key.as_input())?;
    let mut picture = ColorPlane::default();
    engine.synthesise(key.content_time, &mut picture).context("the engine has no key")?;
    Ok(picture)
}

/// Reads ground truths through the engine's own decoder.
struct TruthReader {
    converter: SrgbConverter,
    engine: Engine,
    picture: ColorPlane,
}

impl TruthReader {
    fn new(format: StreamFormat, options: &ScoreOptions) -> Self {
        let options = ScoreOptions { finish: FinishConfig::default(), ..options.clone() };
        let gpu = options.backends.first().and_then(Option::as_ref);
        let engine = engine_of(Method::Hold, gpu, format, &options);
        let converter = SrgbConverter::new(&format);
        let picture = ColorPlane::Rgba8(Plane::default());
        Self { converter, engine, picture }
    }

    fn read(&mut self, recording: &mut dyn Recording, frame: usize) -> anyhow::Result<Srgb8> {
        let context = || format!("ground truth, frame {frame}");
        let truth = recording.read(frame, Wanted::Color).with_context(context)?;
        self.engine.push_key(&truth.as_input()).with_context(context)?;
        self.engine
            .synthesise(truth.content_time, &mut self.picture)
            .context("the engine has no key")?;
        Ok(to_srgb8(&self.picture, &self.converter))
    }
}

#[cfg(test)]
mod tests;
