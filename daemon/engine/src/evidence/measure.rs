//! (1) to (3) of [`super`].

use rayon::ThreadPool;

use super::{PerRung, RUNGS, STRIDE, Sample};
use crate::bands::for_each_row;
use crate::key::KeyFrame;
use crate::plane::Plane;
use crate::trajectory::grid::Grid;
use crate::trajectory::ladder::Models;
use crate::trajectory::quadratic::Quadratic;
use crate::trajectory::surface::{Around, is_same_surface};

/// c of (2), pixels at the next key: an in-between frame in the middle has half of the error or less,
/// and a picture loses most of its contrast where it is a pixel off.
const CONTRAST_PX: f32 = 2.0;
/// Keys that (3) averages over.
const KEYS: u8 = 4;

/// What the rungs said of the key before.
#[derive(Clone, Copy, Debug)]
pub struct Predictions<'a> {
    /// That key.
    pub key: &'a KeyFrame,
    /// What its rungs need.
    pub models: &'a Models,
    /// How it read the key before it.
    pub older: Option<&'a Quadratic<'a>>,
    /// Phase of the new key after it.
    pub phase: f32,
}

/// Makes the samples of `key` from `predictions` and the samples `before`, those of the key that the
/// predictions were made for. Rungs are left as they were on the surface.
pub(super) fn measure(
    pool: &ThreadPool,
    key: &KeyFrame,
    grid: &Grid,
    predictions: Option<&Predictions<'_>>,
    before: &Plane<Sample>,
    is_still: impl Fn(u32, u32) -> bool + Sync,
    samples: &mut Plane<Sample>,
) {
    let [columns, rows] = grid.cells.map(|cells| cells.div_ceil(STRIDE));
    samples.resize(columns, rows);
    for_each_row(pool, samples, |row, samples| {
        let y = (row * STRIDE + STRIDE / 2).min(grid.cells[1] - 1);
        for (column, sample) in (0..).zip(samples) {
            let x = (column * STRIDE + STRIDE / 2).min(grid.cells[0] - 1);
            let depth = if key.depth.data().is_empty() { 0 } else { key.depth.at(x, y) };
            *sample = Sample { depth, is_still: is_still(x, y), ..Sample::default() };
            if let Some(predictions) = predictions {
                measure_one(key, grid, predictions, before, [x, y], sample);
            }
        }
    });
}

/// The sample at one cell.
fn measure_one(
    key: &KeyFrame,
    grid: &Grid,
    predictions: &Predictions<'_>,
    before: &Plane<Sample>,
    [x, y]: [u32; 2],
    sample: &mut Sample,
) {
    let d = key.displacement.at(x, y);
    let at = grid.centre(x, y);
    let was = [at[0] - d[0], at[1] - d[1]];
    let depth = (!key.depth.data().is_empty()).then_some(sample.depth);
    let around = Around::new(predictions.models.grid(), was);
    let Some((x, y)) = around.and_then(|around| around.nearest(predictions.key, depth)) else {
        return;
    };
    let errors = errors(predictions, x, y, d);
    let (column, row) = (x / STRIDE, y / STRIDE);
    let is_held = column < before.width() && row < before.height();
    let history = if is_held { before.at(column, row) } else { Sample::default() };
    let is_its = history.keys > 0 && is_same_surface(history.depth, sample.depth);
    if !is_its {
        (sample.mean, sample.keys) = (errors, 1);
        return;
    }
    sample.rung = history.rung;
    sample.keys = (history.keys + 1).min(KEYS);
    let share = 1.0 / f32::from(sample.keys);
    for (mean, (before, now)) in sample.mean.iter_mut().zip(history.mean.iter().zip(errors)) {
        *mean = before + (now - before) * share;
    }
}

/// (1) and (2). A rung without an answer is the motion field.
fn errors(predictions: &Predictions<'_>, x: u32, y: u32, d: [f32; 2]) -> PerRung {
    let Predictions { key, models, older, phase } = *predictions;
    let straight = key.displacement.at(x, y).map(|d| d * phase);
    RUNGS.map(|rung| {
        let curve = models.curve(rung, key, older, x, y);
        let predicted = curve.map_or(straight, |curve| curve.at(phase));
        let (dx, dy) = (predicted[0] - d[0], predicted[1] - d[1]);
        let square = dx * dx + dy * dy;
        if square.is_finite() { square / (square + CONTRAST_PX * CONTRAST_PX) } else { 1.0 }
    })
}
