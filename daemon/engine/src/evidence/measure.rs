//! (1) to (3) of [`super`].
//!
//! Every sample is followed back and asked for the rung in use and those that cost nothing, `hold`
//! and `linear`. Where the rung in use has failed, and in a part of the samples that moves on from
//! key to key, the whole ladder is measured, in a second pass: what its rungs need of the older key
//! is worked out in between, and only there.

use rayon::ThreadPool;

use super::orders::OrderErrors;
use super::{Lead, PerRung, RUNGS, STRIDE, Sample, WORLD, index_of};
use crate::bands::for_each_row_of_two;
use crate::key::KeyFrame;
use crate::lanes::{LANES, both};
use crate::plane::Plane;
use crate::trajectory::camera_path::CameraOrder;
use crate::trajectory::flow::FailedField;
use crate::trajectory::lattice::Lattice;
use crate::trajectory::models::Models;
use crate::trajectory::quadratic::Quadratic;
use crate::trajectory::rung::Rung;
use crate::trajectory::surface::{nearest_cell, was_same_surface};
use crate::trajectory::world::MoverOrder;

/// c of (2), pixels at the next key: an in-between frame in the middle has half of the error or
/// less, and a picture loses most of its contrast where it is a pixel off.
const CONTRAST_PX: f32 = 2.0;
/// Keys that (3) averages over.
const KEYS: u8 = 4;
/// 1 / n of (3).
const SHARES: [f32; KEYS as usize + 1] = [1.0, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0];
/// A rung with a larger (2) than this has failed: a fifth of a pixel.
pub(super) const FAILED: f32 = 0.01;

/// (2) up to which flow has met the next key's: that of a pixel. Chance does not, from key to key.
const FORESEEN: f32 = 0.2;

const HOLD: usize = 0;
const LINEAR: usize = 2;

/// What the rungs said of the key before.
#[derive(Debug)]
pub struct Predictions<'a> {
    /// That key.
    pub key: &'a KeyFrame,
    /// What its rungs need; more of it is worked out where it is missing.
    pub models: &'a mut Models,
    /// How it read the key before it.
    pub older: Option<&'a Quadratic<'a>>,
    /// Phase of the new key after it.
    pub phase: f32,
}

/// Where a sample was in the key before.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Trace {
    /// The cell of its surface.
    cell: [u16; 2],
    is_known: bool,
    /// Whether the whole ladder is to be measured.
    needs_all: bool,
    /// Where the rung in use had said that it would be by now.
    foreseen: [f32; 2],
}

/// How far every rung was off, pixels.
type OffPerRung = [[f32; 2]; RUNGS.len()];

/// What a key shows of the orders that belong to the whole image.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Orders {
    /// Of the camera, by what moves with the world.
    pub(super) camera: OrderErrors<{ CameraOrder::ALL.len() }>,
    /// Of movers, by what moves on its own.
    pub(super) movers: OrderErrors<{ MoverOrder::ALL.len() }>,
}

/// What a key shows at a sample.
struct Seen {
    /// How far it came.
    d: [f32; 2],
    depth: u32,
    /// Whether flow says so, and not the motion of the surface.
    is_flow: bool,
}

/// What the rung in use said of a sample.
pub(super) struct ByUsed {
    pub(super) used: Rung,
    /// Where it had said that the sample would be by now.
    pub(super) foreseen: [f32; 2],
    pub(super) has_failed: bool,
    /// (2) of hold, of linear and of the rung in use.
    pub(super) errors: [f32; 3],
}

/// What is measured beside the new key itself.
pub(super) struct Measuring<'a> {
    pub(super) lattice: &'a Lattice,
    /// Where its motion does not explain the key, and what does.
    pub(super) failed: &'a FailedField,
    /// The samples of the key that the predictions were made for.
    pub(super) before: &'a Plane<Sample>,
    /// The rung of what has no history.
    pub(super) image_rung: Rung,
    /// Which samples are measured by the whole ladder: every so many runs of eight, and which of
    /// them.
    pub(super) turn: [u32; 2],
    /// Whether nothing but the camera's order is asked for.
    pub(super) orders_alone: bool,
}

impl Measuring<'_> {
    /// Makes the samples of the new key where nothing was predicted of it.
    pub(super) fn begin(&self, pool: &ThreadPool, samples: &mut Plane<Sample>) {
        let [columns, rows] = self.lattice.points();
        samples.resize(columns, rows);
        crate::bands::for_each_row(pool, samples, |row, samples| {
            for (column, sample) in (0..).zip(samples) {
                let (_, depth) = self.lattice.at(column, row);
                *sample = Sample { depth, ..Sample::default() };
            }
        });
    }

    /// Makes the samples of the new key and returns what those measured by the whole ladder show of
    /// the orders. Rungs are left as they were on the surface.
    pub(super) fn measure(
        &self,
        pool: &ThreadPool,
        predictions: &mut Predictions<'_>,
        is_still: impl Fn(u32, u32) -> bool + Sync,
        traces: &mut Plane<Trace>,
        samples: &mut Plane<Sample>,
    ) -> Orders {
        let [columns, rows] = self.lattice.points();
        samples.resize(columns, rows);
        traces.resize(columns, rows);
        let known = &*predictions;
        for_each_row_of_two(
            pool,
            samples,
            traces,
            #[inline(always)]
            |row, samples, traces| {
                let runs = samples.chunks_mut(LANES).zip(traces.chunks_mut(LANES));
                for (first, (samples, traces)) in (0..).step_by(LANES).zip(runs) {
                    self.follow_run(known, [first, row], samples, traces);
                }
            },
        );
        fit_affine(pool, predictions, traces);
        let known = &*predictions;
        let mut orders = Plane::new(1, rows);
        for_each_row_of_two(pool, samples, &mut orders, |row, samples, orders: &mut [Orders]| {
            let traces = traces.row(row);
            for (column, (sample, trace)) in (0..).zip(samples.iter_mut().zip(traces)) {
                if !trace.needs_all {
                    continue;
                }
                let Seen { d, is_flow, .. } = self.seen(known, column, row);
                let off = all_off(known, trace.cell, d);
                let moves_with_world = !is_flow && is_still(column, row);
                // What the camera's poses explain is no jump of a surface, and no wrong vector; and
                // what flow does says nothing of the surface's own motion.
                if !moves_with_world && !is_flow {
                    sample.share = share(d, trace.foreseen, &off);
                }
                let now = errors(&off, sample.share);
                let history = self.history(trace.cell, sample.depth);
                self.take_in(sample, history, &now, |_| true);
                if moves_with_world {
                    orders[0].camera.add(errors_of_camera(known, trace.cell, d));
                } else if !is_flow {
                    orders[0].movers.add(std::array::from_fn(|order| now[WORLD + order]));
                }
            }
        });
        let mut total = Orders::default();
        for orders in orders.data() {
            total.camera.merge(&orders.camera);
            total.movers.merge(&orders.movers);
        }
        total
    }

    /// How what is seen at a sample has moved: by flow, where flow had said so a key before.
    #[inline(always)]
    fn seen(&self, predictions: &Predictions<'_>, column: u32, row: u32) -> Seen {
        let (d, depth) = self.lattice.at(column, row);
        let at = self.lattice.place(column, row);
        let flow = self.failed.at(at).filter(|flow| {
            let before = predictions.models.failed().at([at[0] - flow[0], at[1] - flow[1]]);
            let foreseen = before.map(|[dx, dy]| [dx * predictions.phase, dy * predictions.phase]);
            foreseen.is_some_and(|foreseen| error(foreseen, *flow) < FORESEEN)
        });
        Seen { d: flow.unwrap_or(d), depth, is_flow: flow.is_some() }
    }

    /// Follows one sample back, and measures what costs little.
    #[inline(always)]
    pub(super) fn follow(
        &self,
        predictions: &Predictions<'_>,
        column: u32,
        row: u32,
    ) -> (Sample, Trace) {
        let Seen { d, depth, .. } = self.seen(predictions, column, row);
        let sample = Sample { depth, ..Sample::default() };
        let mut trace = Trace::default();
        let at = self.lattice.place(column, row);
        let has_depth = !predictions.key.depth.data().is_empty();
        let was = [at[0] - d[0], at[1] - d[1]];
        let Some([x, y]) = cell_at(predictions, was, has_depth.then_some(depth)) else {
            return (sample, trace);
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "grids have at most 8192 cells per axis"
        )]
        let cell = [x as u16, y as u16];
        (trace.cell, trace.is_known) = (cell, true);
        if self.orders_alone {
            trace.needs_all = self.is_turn_of([column, row]);
            return (sample, trace);
        }
        let history = self.history(cell, depth);
        let used = history.map_or(self.image_rung, |history| history.lead.rung);
        let straight = straight(predictions, x, y);
        let foreseen = match used {
            Rung::Hold => Some([0.0; 2]),
            Rung::Linear => Some(straight),
            _ => predicted(predictions, used, cell),
        };
        let of_linear = error(straight, d);
        let of_used = foreseen.map_or(of_linear, |foreseen| error(foreseen, d));
        let by_used = ByUsed {
            used,
            foreseen: foreseen.unwrap_or(straight),
            has_failed: foreseen.is_none() || of_used > FAILED,
            errors: [error([0.0; 2], d), of_linear, of_used],
        };
        self.take_in_used([column, row], cell, depth, history, &by_used)
    }

    /// Whether it is the turn of a sample to be measured by the whole ladder.
    #[inline(always)]
    fn is_turn_of(&self, [column, row]: [u32; 2]) -> bool {
        (column / LANES as u32 + TURN_STEP * row) % self.turn[0] == self.turn[1]
    }

    /// Makes the sample at `at`, which was at `cell`, from what costs little.
    #[inline(always)]
    pub(super) fn take_in_used(
        &self,
        at: [u32; 2],
        cell: [u16; 2],
        depth: u32,
        history: Option<&Sample>,
        by_used: &ByUsed,
    ) -> (Sample, Trace) {
        let ByUsed { used, foreseen, has_failed, errors: [of_hold, of_linear, of_used] } = *by_used;
        let mut sample = Sample { depth, ..Sample::default() };
        let needs_all = has_failed || self.is_turn_of(at);
        let trace = Trace { cell, is_known: true, needs_all, foreseen };
        if needs_all {
            return (sample, trace);
        }
        // What is richer has nothing left to explain.
        let used_index = index_of(used);
        let mut now = [of_used; RUNGS.len()];
        (now[HOLD], now[LINEAR]) = (of_hold, of_linear);
        let is_measured = |index| index == HOLD || index == LINEAR || index >= used_index;
        self.take_in(&mut sample, history, &now, is_measured);
        (sample, trace)
    }

    /// What was known of the surface of depth key `depth` at a cell of the key before.
    #[inline(always)]
    pub(super) fn history(&self, [x, y]: [u16; 2], depth: u32) -> Option<&Sample> {
        let (column, row) = (u32::from(x) / STRIDE, u32::from(y) / STRIDE);
        if column >= self.before.width() || row >= self.before.height() {
            return None;
        }
        let history = &self.before.row(row)[column as usize];
        (history.keys > 0 && was_same_surface(history.depth, depth)).then_some(history)
    }

    /// (3).
    #[inline(always)]
    fn take_in(
        &self,
        sample: &mut Sample,
        history: Option<&Sample>,
        now: &PerRung,
        is_measured: impl Fn(usize) -> bool,
    ) {
        let Some(history) = history else {
            // What nobody has measured is no better than nothing.
            for (index, (mean, now)) in sample.mean.iter_mut().zip(now).enumerate() {
                *mean = if is_measured(index) { *now } else { 1.0 };
            }
            (sample.keys, sample.lead) = (1, Lead::by(self.image_rung));
            return;
        };
        sample.lead = history.lead;
        sample.keys = (history.keys + 1).min(KEYS);
        let share = SHARES[usize::from(sample.keys)];
        let mut aims = history.mean;
        for (index, (aim, now)) in aims.iter_mut().zip(now).enumerate() {
            *aim = if is_measured(index) { *now } else { *aim };
        }
        for ((mean, before), aim) in sample.mean.iter_mut().zip(&history.mean).zip(aims) {
            *mean = before + (aim - before) * share;
        }
    }
}

/// The part of the motion `d` that was foreseen along each axis, in sixteenths, where what every
/// rung is `off` makes it news.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "0 to 16")]
#[expect(clippy::cast_sign_loss, reason = "0 to 16")]
fn share(d: [f32; 2], foreseen: [f32; 2], off: &OffPerRung) -> [u8; 2] {
    let least = |off: &[[f32; 2]], square: fn(&[f32; 2]) -> f32| {
        off.iter().map(square).fold(f32::INFINITY, f32::min)
    };
    // Written so that NaN fails it.
    let is_news = |off: f32, part: f32, d: f32| off > NEWS_PX * NEWS_PX && off >= part * part * d;
    let all = is_news(least(off, |[x, y]| x * x + y * y), NEWS, d[0] * d[0] + d[1] * d[1]);
    let moving = &off[HOLD + 1..];
    let along = [least(moving, |[x, _]| x * x), least(moving, |[_, y]| y * y)];
    both(|axis| {
        let part = if all { NEWS } else { NEWS_ALONE };
        if !is_news(along[axis], part, d[axis] * d[axis]) {
            return Lead::WHOLE;
        }
        // What has stopped goes no further, from whichever side it came.
        if d[axis].abs() <= NEWS_PX {
            return 0;
        }
        ((foreseen[axis] / d[axis]).clamp(0.0, 1.0) * f32::from(Lead::WHOLE) + 0.5) as u8
    })
}

/// Part of a motion from which on its error makes it news: nobody foresaw more of it than somebody
/// did.
const NEWS: f32 = 0.5;
/// The same along one axis where the whole is none: it would rather have been held.
const NEWS_ALONE: f32 = 1.0;
/// And the least error, pixels: half of [`CONTRAST_PX`].
const NEWS_PX: f32 = 1.0;

/// Runs further on that those measured by the whole ladder lie in the next row: not below each
/// other.
const TURN_STEP: u32 = 5;

/// The cell of the surface of depth key `depth` (any, if None) that is nearest to a place, if one
/// of the four around it is.
#[inline(always)]
fn cell_at(predictions: &Predictions<'_>, was: [f32; 2], depth: Option<u32>) -> Option<[u32; 2]> {
    let (key, grid) = (predictions.key, predictions.models.grid());
    nearest_cell(key, grid, was, depth).map(|(x, y)| [x, y])
}

/// Fits the affine maps of the older key that the whole ladder is measured by.
fn fit_affine(pool: &ThreadPool, predictions: &mut Predictions<'_>, traces: &Plane<Trace>) {
    let [columns, rows] = predictions.models.lattice().points();
    let runs = columns.div_ceil(LANES as u32);
    let mut wanted = vec![false; (runs * rows) as usize];
    for trace in traces.data().iter().filter(|trace| trace.needs_all) {
        let [x, y] = trace.cell.map(u32::from);
        wanted[(y / STRIDE * runs + x / STRIDE / LANES as u32) as usize] = true;
    }
    predictions.models.fit_affine(pool, |run, row| wanted[(row * runs + run) as usize]);
}

/// Where `rung` had said that the surface at a cell would be by now; None without an answer.
#[inline(always)]
fn predicted(predictions: &Predictions<'_>, rung: Rung, [x, y]: [u16; 2]) -> Option<[f32; 2]> {
    let Predictions { key, models, older, phase } = predictions;
    let curve = models.curve_of_sample(rung, key, *older, u32::from(x), u32::from(y));
    curve.map(|curve| curve.at(*phase))
}

/// Where every rung had said that the surface at a cell would be by now, from where it is, pixels.
/// A rung without an answer is the motion field; one that was not prepared is no good.
#[inline(always)]
fn all_off(predictions: &Predictions<'_>, cell: [u16; 2], d: [f32; 2]) -> OffPerRung {
    let [x, y] = cell.map(u32::from);
    let straight = straight(predictions, x, y);
    RUNGS.map(|rung| {
        if !predictions.models.has(rung) {
            return [f32::INFINITY; 2];
        }
        let predicted = predicted(predictions, rung, cell).unwrap_or(straight);
        both(|axis| predicted[axis] - d[axis])
    })
}

/// (1) and (2) of the camera's orders, where a cell moves with the world.
#[inline(always)]
fn errors_of_camera(
    predictions: &Predictions<'_>,
    [x, y]: [u16; 2],
    d: [f32; 2],
) -> [f32; CameraOrder::ALL.len()] {
    let Predictions { key, models, older, phase } = predictions;
    let [x, y] = [x, y].map(u32::from);
    let straight = straight(predictions, x, y);
    CameraOrder::ALL.map(|order| {
        let curve = models.curve_by(order, key, *older, x, y);
        error(curve.map_or(straight, |curve| curve.at(*phase)), d)
    })
}

/// (1) and (2) of every rung. Those that follow the motion of a surface are judged along one axis,
/// where of the other not all of it goes on.
#[inline(always)]
fn errors(off: &OffPerRung, share: [u8; 2]) -> PerRung {
    let goes = share.map(|share| share == Lead::WHOLE);
    let is_one = goes[0] != goes[1];
    std::array::from_fn(|rung| {
        let skips = |axis: usize| is_one && !goes[axis] && rung >= LINEAR;
        contrast(both(|axis| if skips(axis) { 0.0 } else { off[rung][axis] }))
    })
}

/// Where the motion of a cell had said that it would be by now.
#[inline(always)]
fn straight(predictions: &Predictions<'_>, x: u32, y: u32) -> [f32; 2] {
    let [dx, dy] = predictions.key.displacement.at(x, y);
    [dx * predictions.phase, dy * predictions.phase]
}

/// (1) and (2).
#[inline(always)]
pub(super) fn error(predicted: [f32; 2], d: [f32; 2]) -> f32 {
    contrast(both(|axis| predicted[axis] - d[axis]))
}

/// (2).
#[inline(always)]
fn contrast([dx, dy]: [f32; 2]) -> f32 {
    let square = dx * dx + dy * dy;
    if square.is_finite() { square / (square + CONTRAST_PX * CONTRAST_PX) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_foreseen_is_the_same_in_a_mirror() {
        let straight = |d: [f32; 2], foreseen: [f32; 2]| {
            let hold = [-d[0], -d[1]];
            let rest = both(|axis| foreseen[axis] - d[axis]);
            std::array::from_fn(|rung| if rung == HOLD { hold } else { rest })
        };
        for d in [[12.0, 0.0], [12.0, 0.5], [12.0, 3.0], [0.0, 0.0], [1.0, -4.0]] {
            for foreseen in [[12.0, 5.0], [12.0, -5.0], [3.0, 5.0], [0.0, 9.0]] {
                let once = share(d, foreseen, &straight(d, foreseen));
                for mirror in [[-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
                    // Zero is zero in a mirror, too, and has no sign.
                    let mirrored = |v: [f32; 2]| both(|axis| v[axis] * mirror[axis] + 0.0);
                    let [d, foreseen] = [d, foreseen].map(mirrored);
                    let again = share(d, foreseen, &straight(d, foreseen));
                    assert_eq!(again, once, "{d:?} foreseen {foreseen:?}");
                }
            }
        }
        let stopped = [[12.0, 0.0], [12.0, -5.0]];
        assert_eq!(share(stopped[0], stopped[1], &straight(stopped[0], stopped[1])), [16, 0]);
    }
}
