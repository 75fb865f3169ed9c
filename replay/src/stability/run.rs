//! Renders the points of sweeps and lets every method make their frames.
//!
//! Points are independent of each other and run side by side; one engine of one thread serves one
//! method on one point, so that no result depends on how many there are.

use std::num::NonZeroUsize;

use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method, MonoTime, Plane};
use foreframe_fixtures::probes::{PICTURE, Probe};
use foreframed::sink::srgb::SrgbConverter;
use rayon::prelude::*;

use super::report::{MethodPoint, PointReport, SweepReport};
use super::shoot::{KeyRecipe, KeyShot, content_time, stream_format, truth};
use super::spoil::spoil;
use super::sweeps::{Case, Frames, Sweep};
use crate::recording::Frame;
use crate::score::metrics::{ErrorPicture, TileTally, error_flicker, psnr_rgb_db};
use crate::score::picture::{Srgb8, to_srgb8};

/// A method has recovered where its frames are no more than this below what it reaches in a calm
/// sequence, dB: about what one can see in a flip.
const RECOVERED_DB: f64 = 0.5;
/// Two times closer than this, in key intervals, are one.
const SAME_TIME: f64 = 1e-6;

/// Runs `methods` over one sweep. `on_point` is called after each point, in any order.
///
/// # Errors
/// If an engine refuses a key.
pub fn run_sweep(
    sweep: &Sweep,
    methods: &[Method],
    on_point: impl Fn() + Sync,
) -> anyhow::Result<SweepReport> {
    let points = (sweep.points)();
    let points = points.par_iter().map(|point| {
        let methods = run_case(&point.case, methods)?;
        on_point();
        let has_event = point.case.calm.is_some();
        Ok(PointReport { label: point.label.clone(), has_event, methods })
    });
    Ok(SweepReport::new(sweep, points.collect::<anyhow::Result<_>>()?))
}

/// Keys as the engine gets them, and the frames to make.
struct Sequence {
    keys: Vec<Frame>,
    outputs: Vec<Output>,
}

/// One frame to make.
struct Output {
    content_time: MonoTime,
    /// The key interval that it lies in, or the key that it follows.
    interval: usize,
    /// Number of the newest key that has arrived, among those that do.
    newest: usize,
    truth: Srgb8,
}

/// What a method made of a sequence.
struct Made {
    /// Mean PSNR of the frames of each key interval; None where there are none.
    by_interval: Vec<Option<f64>>,
    psnr_rgb_db: f64,
    error_flicker: f64,
    worst_tile_psnr_db: f64,
}

fn run_case(case: &Case, methods: &[Method]) -> anyhow::Result<Vec<MethodPoint>> {
    let probe = (case.probe)();
    let shots = shoot(&probe, &case.keys);
    let sequence = sequence_of(case, &probe, &shots);
    let calm = case.calm.as_ref().map(|calm| {
        let other = calm.probe.as_ref().map(|build| build());
        let shots = match &other {
            Some(probe) => shoot(probe, &calm.keys),
            None => reshoot(&probe, &shots, &case.keys, &calm.keys),
        };
        let keys = frames_of(shots.iter().enumerate());
        let outputs = outputs_of(case, other.as_ref().unwrap_or(&probe), &shots, &[]);
        Sequence { keys, outputs }
    });
    let run = |&method: &Method| {
        if method.interpolates() && matches!(case.frames, Frames::After(_)) {
            return Ok(None);
        }
        let made = make(method, &sequence, case)?;
        let calm = calm.as_ref().map(|calm| make(method, calm, case)).transpose()?;
        let keys_to_recover =
            calm.and_then(|calm| keys_to_recover(&made.by_interval, &calm.by_interval, case));
        Ok(Some(MethodPoint {
            name: method.name(),
            interpolates: method.interpolates(),
            psnr_rgb_db: made.psnr_rgb_db,
            error_flicker: made.error_flicker,
            worst_tile_psnr_db: made.worst_tile_psnr_db,
            keys_to_recover,
        }))
    };
    methods.iter().filter_map(|method| run(method).transpose()).collect()
}

fn shoot(probe: &Probe, keys: &[KeyRecipe]) -> Vec<KeyShot> {
    keys.iter().map(|key| key.shoot(probe)).collect()
}

/// Renders `keys` of a probe of which `shots` are known, of the recipes `known`.
fn reshoot(
    probe: &Probe,
    shots: &[KeyShot],
    known: &[KeyRecipe],
    keys: &[KeyRecipe],
) -> Vec<KeyShot> {
    let of = |key: &KeyRecipe| match known.iter().position(|known| known == key) {
        Some(at) => shots[at].clone(),
        None => key.shoot(probe),
    };
    keys.iter().map(of).collect()
}

fn sequence_of(case: &Case, probe: &Probe, shots: &[KeyShot]) -> Sequence {
    let mut spoilt = shots.to_vec();
    if let Some((kind, keys)) = &case.spoil {
        for key in keys.clone() {
            spoil(&mut spoilt[key], *kind, key as u64 + 1);
        }
    }
    let arrived = spoilt.iter().enumerate().filter(|(key, _)| !case.dropped.contains(key));
    let keys = frames_of(arrived);
    Sequence { keys, outputs: outputs_of(case, probe, shots, &case.dropped) }
}

fn frames_of<'a>(shots: impl Iterator<Item = (usize, &'a KeyShot)>) -> Vec<Frame> {
    shots.map(|(key, shot)| shot.to_frame(key as u64)).collect()
}

fn outputs_of(case: &Case, probe: &Probe, shots: &[KeyShot], dropped: &[usize]) -> Vec<Output> {
    let arrived: Vec<f64> =
        (0..shots.len()).filter(|key| !dropped.contains(key)).map(|key| shots[key].time).collect();
    let output = |time: f64, interval: usize, newest: usize| Output {
        content_time: content_time(time),
        interval,
        newest,
        truth: truth(probe, time),
    };
    match case.frames {
        Frames::After(after) => {
            (0..arrived.len() - 1).map(|key| output(arrived[key] + after, key, key)).collect()
        }
        Frames::Quarters => {
            let last = case.keys.len() - 1;
            let between = (0..4 * last).filter_map(|quarter| {
                let (time, interval) = (quarter as f64 / 4.0, quarter / 4);
                // Where a key was to be shown there is a frame to make only if it did not arrive.
                if quarter % 4 == 0 && !dropped.contains(&interval) {
                    return None;
                }
                let newest =
                    arrived.partition_point(|key| *key <= time + SAME_TIME).checked_sub(1)?;
                Some(output(time, interval, newest))
            });
            between.collect()
        }
    }
}

fn make(method: Method, sequence: &Sequence, case: &Case) -> anyhow::Result<Made> {
    let config = EngineConfig::new(method, NonZeroUsize::MIN);
    let mut engine = Engine::new(stream_format(), config);
    let converter = SrgbConverter::new(&stream_format());
    let key_error = ErrorPicture::of_key(PICTURE.width, PICTURE.height);
    let mut picture = ColorPlane::Rgba8(Plane::default());
    let (mut pushed, mut newest) = (0, None);
    let mut by_interval = vec![Mean::default(); case.keys.len()];
    let (mut psnr, mut flicker, mut tiles) =
        (Mean::default(), Mean::default(), TileTally::default());
    let mut before = key_error.clone();
    for output in &sequence.outputs {
        let next = sequence.keys.get(output.newest + 1);
        let sees_next = method.interpolates() && next.is_some_and(|next| !next.is_cut);
        let wanted = output.newest + 1 + usize::from(sees_next);
        for key in &sequence.keys[pushed..wanted.max(pushed)] {
            engine.push_key(&key.as_input())?;
        }
        pushed = pushed.max(wanted);
        engine.synthesise(output.content_time, &mut picture);
        let shown = to_srgb8(&picture, &converter);
        let frame_db = psnr_rgb_db(&shown, &output.truth);
        by_interval[output.interval].add(frame_db);
        let error = ErrorPicture::of(&shown, &output.truth);
        if case.measured.contains(&output.interval) {
            psnr.add(frame_db);
            tiles.merge(&TileTally::of(&shown, &output.truth));
            if newest != Some(output.newest) {
                // The key was shown as it is.
                flicker.add(error_flicker(&before, &key_error));
                before = key_error.clone();
            }
            flicker.add(error_flicker(&before, &error));
        }
        (before, newest) = (error, Some(output.newest));
    }
    Ok(Made {
        by_interval: by_interval.iter().map(Mean::value).collect(),
        psnr_rgb_db: psnr.value().unwrap_or(f64::NAN),
        error_flicker: flicker.value().unwrap_or(f64::NAN),
        worst_tile_psnr_db: tiles.worst_db().unwrap_or(f64::NAN),
    })
}

/// How many sound keys it takes until the frames after one are as good as in a calm sequence: the
/// most of all events, None where one is not recovered from before the next, or the end.
fn keys_to_recover(made: &[Option<f64>], calm: &[Option<f64>], case: &Case) -> Option<usize> {
    let mut most = 0;
    for (event, &first) in case.sound_again.iter().enumerate() {
        // The next event begins a key before its first sound one.
        let end = case.sound_again.get(event + 1).map_or(made.len(), |next| next - 1);
        let is_recovered = |key: &usize| match (made[*key], calm[*key]) {
            (Some(made), Some(calm)) => made >= calm - RECOVERED_DB,
            _ => false,
        };
        let recovered = (first..end).find(is_recovered)?;
        most = most.max(recovered - first + 1);
    }
    Some(most)
}

/// A mean that grows.
#[derive(Clone, Copy, Default, Debug)]
struct Mean {
    sum: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / f64::from(self.count))
    }
}

#[cfg(test)]
mod tests;
