//! Is the client's motion what the client says it is? Asked of the first keys that move, by luma.
//!
//! What a key shows at x, the key that its motion points back to has shown at x - D. Under every
//! [`Hypothesis`] of how the motion plane was meant, D is worked out anew from what was decoded,
//! and
//!
//! ```text
//! (1) e = sqrt(mean of (L(x) - L'(x - D))^2)         L, L' luma in 8-bit levels
//! ```
//!
//! is taken over the same samples for all: at most [`MOST_SAMPLES`] a key, those that move under
//! some hypothesis. If what was declared is right, no other way of reading comes near it. Sums are
//! integers. Nothing in the pictures depends on what is found; it is for the client's eyes.

mod hypothesis;

pub use hypothesis::Hypothesis;

use crate::color::{ColorPlane, Texel};
use crate::decode::StillWorld;
use crate::format::{CameraMotion, StreamFormat};
use crate::key::KeyFrame;
use crate::plane::{Plane, Rect};
use crate::time::{MonoSpan, MonoTime};
use crate::trajectory::grid::Grid;
use crate::warp::sample::sample;
use hypothesis::Known;

/// Samples of a key: a thousandth of (1) by chance, for a millisecond of work.
const MOST_SAMPLES: u32 = 4096;
/// Motion that counts, pixels.
const MOVED_PX: f32 = 0.25;
/// Another way of reading is believed where its error squared is below this part of that as
/// declared. In sound captures none comes below it: halving or doubling a motion of a few pixels
/// leaves more.
const CLEARLY: f64 = 0.7;
/// Motion does harm where its error squared is above that of standing still by this factor: grain
/// and flicker, which nothing explains, make the two alike.
const HARM: f64 = 1.1;
/// Keys that are looked at, for each one wanted, until enough of them have moved.
const PATIENCE: u32 = 16;
/// Fewest samples that a finding takes, of all keys.
const MIN_SAMPLES: u64 = 400;
/// Fewest samples for a key to count as one that moves.
const MIN_SAMPLES_OF_KEY: u64 = 25;
/// Content times that differ by no more are one.
const SAME_TIME: MonoSpan = MonoSpan::from_us(2);

/// What was found.
#[derive(Clone, PartialEq, Debug)]
pub struct Diagnosis {
    /// Keys that were looked at and moved.
    pub keys: u32,
    /// Samples that move.
    pub samples: u64,
    /// (1) of every way of reading that the stream has data for, 8-bit levels.
    pub errors: Vec<(Hypothesis, f64)>,
    /// What is wrong, with the numbers. None where nothing was found.
    pub verdict: Option<String>,
}

/// Looks at the first keys of a stream.
#[derive(Clone, Debug)]
pub struct MotionCheck {
    wanted: u32,
    looked: u32,
    /// Keys that move by some way of reading, and as declared.
    keys: u32,
    declared_keys: u32,
    samples: u64,
    hypotheses: Vec<Hypothesis>,
    squares: Vec<u64>,
    declared: Declared,
}

/// Over the samples that move as declared alone.
#[derive(Clone, Copy, Debug, Default)]
struct Declared {
    samples: u64,
    /// As declared, and standing still.
    squares: [u64; 2],
}

impl MotionCheck {
    /// Looks at the first `keys` keys that move.
    #[must_use]
    pub fn new(format: &StreamFormat, keys: u32) -> Self {
        let hypotheses = Hypothesis::of(format);
        let squares = vec![0; hypotheses.len()];
        Self {
            wanted: if format.motion.is_some() { keys } else { 0 },
            looked: 0,
            keys: 0,
            declared_keys: 0,
            samples: 0,
            hypotheses,
            squares,
            declared: Declared::default(),
        }
    }

    /// Whether it has seen all that it looks at: enough keys that move as declared, or enough of
    /// which another way of reading makes clearly more, or nothing of the kind for long.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.declared_keys >= self.wanted
            || self.looked >= self.wanted.saturating_mul(PATIENCE)
            || (self.keys >= self.wanted && self.reads_better(&self.errors()).is_some())
    }

    /// Looks at `key`, whose motion as decoded is `displacement`, and which follows `older`. Keys
    /// whose motion points back to another one, and cuts, tell nothing.
    pub(crate) fn look(
        &mut self,
        format: &StreamFormat,
        key: &KeyFrame,
        displacement: &Plane<[f32; 2]>,
        older: &KeyFrame,
    ) {
        let points_back = |from: MonoTime| {
            let apart = from - older.content_time;
            apart <= SAME_TIME && -apart <= SAME_TIME
        };
        let is_in = |key: &KeyFrame| key.valid.fits(key.color.width(), key.color.height());
        let is_whole = key.valid == older.valid && is_in(key) && is_in(older);
        if self.is_done() || !is_whole || !key.motion_from.is_some_and(points_back) {
            return;
        }
        let step = Step::new(format, key, displacement, older);
        let declared_before = self.declared.samples;
        let samples = match (key.compared(), older.compared()) {
            (ColorPlane::Rgba8(now), ColorPlane::Rgba8(then)) => self.sum(&step, [now, then]),
            (ColorPlane::Rgb10a2(now), ColorPlane::Rgb10a2(then)) => self.sum(&step, [now, then]),
            (ColorPlane::Rgba16f(now), ColorPlane::Rgba16f(then)) => self.sum(&step, [now, then]),
            _ => return,
        };
        self.looked += 1;
        self.samples += samples;
        let declared = self.declared.samples - declared_before;
        self.keys += u32::from(samples >= MIN_SAMPLES_OF_KEY);
        self.declared_keys += u32::from(declared >= MIN_SAMPLES_OF_KEY);
    }

    fn sum<T: Texel>(&mut self, step: &Step<'_>, [now, then]: [&Plane<T>; 2]) -> u64 {
        let [columns, rows] = step.grid.cells;
        let every = stride(columns, rows);
        let mut samples = 0;
        let mut motions = vec![[0.0; 2]; self.hypotheses.len()];
        for y in (every / 2..rows).step_by(every as usize) {
            for x in (every / 2..columns).step_by(every as usize) {
                let Some(known) = step.known(x, y) else { continue };
                for (motion, hypothesis) in motions.iter_mut().zip(&self.hypotheses) {
                    *motion = hypothesis.displacement(&known);
                }
                // Written so that NaN fails it.
                let moves = |[dx, dy]: &[f32; 2]| dx.abs().max(dy.abs()) >= MOVED_PX;
                // Jitter moves a picture that stands still.
                let read = self.hypotheses.iter().zip(&motions).filter(|(it, _)| !it.is_jitter());
                if !read.map(|(_, motion)| motion).any(moves) {
                    continue;
                }
                let moves_as_declared = moves(&motions[0]);
                // At a pixel: between pixels grain is weaker, and standing still would look better.
                let [at_x, at_y] = step.grid.centre(x, y).map(f32::round);
                let level = |plane: &Plane<T>, x: f32, y: f32| {
                    i64::from(sample(plane, step.valid, q8(x), q8(y)).luma8())
                };
                let shown = level(now, at_x, at_y);
                let mut own = [0; 2];
                for (index, (squares, [dx, dy])) in
                    self.squares.iter_mut().zip(&motions).enumerate()
                {
                    // What is unknown is taken to stand still.
                    let [dx, dy] = [dx, dy].map(|d| if d.is_finite() { *d } else { 0.0 });
                    let error = shown - level(then, at_x - dx, at_y - dy);
                    let square = error.unsigned_abs().pow(2);
                    *squares += square;
                    if let Some(own) = own.get_mut(index) {
                        *own = square;
                    }
                }
                if moves_as_declared {
                    self.declared.samples += 1;
                    self.declared.squares[0] += own[0];
                    self.declared.squares[1] += own[1];
                }
                samples += 1;
            }
        }
        samples
    }

    /// (1) of every way of reading.
    #[expect(clippy::cast_precision_loss, reason = "sums over a few thousand samples of 16 bits")]
    fn errors(&self) -> Vec<(Hypothesis, f64)> {
        let samples = self.samples.max(1) as f64;
        let error = |squares: &u64| (*squares as f64 / samples).sqrt();
        self.hypotheses.iter().copied().zip(self.squares.iter().map(error)).collect()
    }

    /// What was found so far.
    #[must_use]
    pub fn diagnosis(&self) -> Diagnosis {
        let errors = self.errors();
        let verdict = self.reads_better(&errors).or_else(|| self.does_harm());
        Diagnosis { keys: self.keys, samples: self.samples, errors, verdict }
    }

    /// Another way of reading makes clearly more of the pictures than the declared one does, and
    /// than standing still.
    fn reads_better(&self, errors: &[(Hypothesis, f64)]) -> Option<String> {
        let (declared, still) = (errors[0].1, errors[1].1);
        let (hypothesis, error) = errors[2..].iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let is_clear = error * error < CLEARLY * declared.min(still).powi(2);
        (is_clear && self.samples >= MIN_SAMPLES).then(|| {
            let says = hypothesis.says();
            format!(
                "motion looks {says}: read otherwise, the error falls from {declared:.1} to {error:.1} levels"
            )
        })
    }

    /// What the declared motion moves would be met better by standing still.
    #[expect(clippy::cast_precision_loss, reason = "sums over a few thousand samples of 16 bits")]
    fn does_harm(&self) -> Option<String> {
        let Declared { samples, squares } = self.declared;
        let [with, without] = squares.map(|sum| sum as f64 / samples.max(1) as f64);
        (samples >= MIN_SAMPLES && with > HARM * without).then(|| {
            let (with, without) = (with.sqrt(), without.sqrt());
            format!(
                "motion explains nothing: {with:.1} levels of error with it, {without:.1} without"
            )
        })
    }
}

/// Cells from one sample to the next, per axis.
fn stride(columns: u32, rows: u32) -> u32 {
    (1..)
        .find(|every| columns.div_ceil(*every) * rows.div_ceil(*every) <= MOST_SAMPLES)
        .unwrap_or(1)
}

/// Q8 pixels of a place that may lie anywhere.
#[expect(clippy::cast_possible_truncation, reason = "clamped to 2^15 pixels")]
fn q8(place: f32) -> i32 {
    (place.clamp(-32_768.0, 32_768.0) * 256.0).round() as i32
}

/// Two keys and what lies between them.
struct Step<'a> {
    grid: Grid,
    valid: Rect,
    displacement: &'a Plane<[f32; 2]>,
    depth: &'a Plane<u32>,
    camera: Option<StillWorld>,
    jitter: [f32; 2],
    adds_camera: bool,
}

impl<'a> Step<'a> {
    #[expect(clippy::cast_precision_loss, reason = "jitter of less than a cell in Q8")]
    fn new(
        format: &StreamFormat,
        key: &'a KeyFrame,
        displacement: &'a Plane<[f32; 2]>,
        older: &KeyFrame,
    ) -> Self {
        let cells = [displacement.width(), displacement.height()];
        let moved_on =
            |axis: usize| (key.field_offset[axis] - older.field_offset[axis]) as f32 / 256.0;
        Self {
            grid: Grid::with_cells(key, cells),
            valid: key.valid,
            displacement,
            depth: &key.depth,
            camera: StillWorld::between(older, key),
            jitter: [moved_on(0), moved_on(1)],
            adds_camera: format
                .motion
                .is_some_and(|motion| motion.camera_motion == CameraMotion::Missing),
        }
    }

    /// None where the plane holds no vector.
    #[expect(clippy::cast_precision_loss, reason = "sizes up to 8192 are exact")]
    fn known(&self, x: u32, y: u32) -> Option<Known> {
        let [mut dx, mut dy] = self.displacement.at(x, y);
        if !(dx.is_finite() && dy.is_finite()) {
            return None;
        }
        let has_depth = x < self.depth.width() && y < self.depth.height();
        let camera = match &self.camera {
            Some(world) if has_depth => {
                let [at_x, at_y] = self.grid.centre(x, y);
                world.displacement(self.valid, [at_x, at_y], self.depth.at(x, y))
            }
            _ => [f32::NAN; 2],
        };
        if self.adds_camera {
            (dx, dy) = (dx - camera[0], dy - camera[1]);
        }
        let size = [self.valid.width as f32, self.valid.height as f32];
        let (own, jitter) = ([dx, dy], self.jitter);
        Some(Known { own, camera, jitter, size, adds_camera: self.adds_camera })
    }
}

#[cfg(test)]
mod tests;
