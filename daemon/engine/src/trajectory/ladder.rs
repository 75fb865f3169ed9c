//! One stream's ladder: prepares the rungs for each key and fills in its trajectories.
//!
//! [`Models`] holds what the rungs need of one key. [`Ladder`] takes the answers of the rung that
//! the method names for every cell, lets each cell take those of the surface that its colour
//! belongs to (dilation), and leaves them in the key as fixed point.
//!
//! Where a rung has no answer, the motion field itself goes on: [`Rung::Linear`].

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::ThreadPool;
use rayon::iter::ParallelIterator;
use rayon::slice::ParallelSlice;

use super::camera_path::{CameraOrder, CameraPath, Onward, Pose};
use super::dilate_motion::dilate_cells;
use super::fill::{Filling, Run};
use super::flow::Flow;
use super::global::Homography;
use super::grid::Grid;
use super::lattice::{Lattice, STRIDE, middle};
use super::models::Models;
use super::quadratic::Quadratic;
use super::rung::Rung;
use super::world::{MoverOrder, World};
use crate::bands::for_each_row_of_two;
use crate::evidence::{Evidence, Lead, Predictions};
use crate::key::{Acceleration, Camera, KeyFrame, Velocity};
use crate::lanes::LANES;
use crate::method::Method;
use crate::plane::Plane;
use crate::time::MonoTime;

/// Cells of which one look tells whether any of them moves.
const STILL_RUN: usize = 256;
/// Cells that are worth waking a thread for.
const STILL_PART: usize = 1 << 16;

/// The keys before one, the newest first, as many as it takes to say how that had gone on.
pub type Past<'a> = [Option<&'a KeyFrame>; 3];

/// Who says which rung a cell takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Choice {
    /// The method: this one everywhere.
    Always(Rung),
    /// `world` everywhere; evidence says in which order the camera goes on.
    World,
    /// Evidence.
    Evidence,
}

/// What one stream knows from key to key.
#[derive(Debug)]
pub struct Ladder {
    choice: Choice,
    /// Pixels per degree of visual angle, where motion that no eye can follow is damped.
    pixels_per_degree: Option<f32>,
    path: CameraPath,
    models: Models,
    spare: Models,
    evidence: Evidence,
    /// The newest pose that the client has sent ahead of its key.
    late: Option<Pose>,
    /// Whether the trajectories of the newest key do not know it yet.
    is_late_new: bool,
    /// Whether the motion of the newest key is zero everywhere.
    is_still: bool,
    velocity: Plane<Velocity>,
    acceleration: Plane<Acceleration>,
}

impl Ladder {
    /// For streams of `method`; None where it takes the motion field as it is.
    #[must_use]
    pub fn new(method: Method, pixels_per_degree: Option<f32>) -> Option<Self> {
        let choice = match method {
            Method::Global => Choice::Always(Rung::Global),
            Method::Affine => Choice::Always(Rung::Affine),
            Method::Quadratic => Choice::Always(Rung::Quadratic),
            Method::World => Choice::World,
            Method::Auto => Choice::Evidence,
            Method::Hold
            | Method::Blend
            | Method::Voxel
            | Method::Gather
            | Method::Grid
            | Method::Linear
            | Method::Flow => {
                return None;
            }
        };
        Some(Self {
            choice,
            pixels_per_degree,
            path: CameraPath::default(),
            models: Models::default(),
            spare: Models::default(),
            evidence: Evidence::default(),
            late: None,
            is_late_new: false,
            is_still: false,
            velocity: Plane::default(),
            acceleration: Plane::default(),
        })
    }

    /// What the keys so far have shown.
    #[must_use]
    pub fn evidence(&self) -> &Evidence {
        &self.evidence
    }

    /// Whether flow explains what the newest key shows at a pixel, and its motion does not.
    #[must_use]
    pub fn is_followed(&self, at: [f32; 2]) -> bool {
        self.models.failed.at(at).is_some()
    }

    /// Gives `key` its trajectories. It was decoded with its displacement; `past` are the keys
    /// before it: none where it is a cut. `flow` looks at the pictures where motion was not
    /// estimated from them already.
    pub fn take_key(
        &mut self,
        pool: &ThreadPool,
        flow: Option<&mut Flow>,
        key: &mut KeyFrame,
        past: Past<'_>,
    ) {
        if key.is_cut {
            self.path.cut();
            self.evidence.cut();
        }
        // The evidence is of what was predicted, not of what was told.
        self.models.late = None;
        self.late = self.late.filter(|late| late.time > key.content_time && !key.is_cut);
        self.is_late_new = false;
        if let Some(camera) = key.camera {
            self.path.push(Pose { time: key.content_time, camera });
        }
        if key.displacement.data().is_empty() {
            self.evidence.cut();
            return;
        }
        self.is_still = is_still(pool, key);
        let older = past[0];
        let mut models = self.prepare(key, older);
        let followed = older.filter(|older| key.motion_from == Some(older.content_time));
        let mut looked = flow.zip(followed).filter(|_| self.choice == Choice::Evidence);
        let may_rest = self.is_still && self.late.is_none();
        let rested = may_rest && self.evidence.is_at_rest();
        let stays = looked.as_mut().filter(|_| rested);
        let stays = stays.is_some_and(|(flow, older)| flow.shows_the_same(pool, key, older));
        models.lacks_lattice = stays && self.evidence.rest(Lattice::points_on(&models.grid));
        if !models.lacks_lattice {
            models.lattice.update(pool, key, &models.grid);
        }
        if !models.lacks_lattice && !matches!(self.choice, Choice::Always(_)) {
            let is_explained = looked.is_some_and(|(flow, older)| {
                flow.find_failed(pool, key, older, &mut models.failed)
            });
            let rests = may_rest && is_explained;
            if !rests || !self.evidence.rest(models.lattice.points()) {
                self.weigh(pool, key, &models, past);
            }
        }
        if self.evidence.is_cut() {
            // The next key knows two poses of this place, and no more.
            let newest = self.path.newest().copied();
            self.path.cut();
            newest.into_iter().for_each(|pose| self.path.push(pose));
        }
        models.order = self.evidence.order();
        self.fit_affine(pool, &mut models);
        self.spare = std::mem::replace(&mut self.models, models);
        self.models.late = self.late_world(key, older);
        self.fill(pool, key, past);
    }

    /// The client has moved the camera on to `view` at `time`, after its newest key. The newest
    /// pose wins. Takes effect with [`Ladder::catch_up`].
    pub fn late_camera(&mut self, time: MonoTime, view: [f32; 16]) {
        let Some(newest) = self.path.newest() else { return };
        let is_newer = self.late.is_none_or(|late| time > late.time) && time > newest.time;
        if is_newer && !matches!(self.choice, Choice::Always(_)) {
            self.late = Some(Pose { time, camera: Camera { view, ..newest.camera } });
            self.is_late_new = true;
        }
    }

    /// Brings the trajectories of `key`, the one that was taken last, up to the newest late pose.
    /// Returns whether they changed.
    pub fn catch_up(&mut self, pool: &ThreadPool, key: &mut KeyFrame, past: Past<'_>) -> bool {
        let is_new = std::mem::take(&mut self.is_late_new) && !key.displacement.data().is_empty();
        let older = past[0];
        let late = if is_new { self.late_world(key, older) } else { None };
        if late.is_none() {
            return false;
        }
        self.models.late = late;
        self.fill(pool, key, past);
        true
    }

    /// The camera's way from `key` to the late pose.
    fn late_world(&self, key: &KeyFrame, older: Option<&KeyFrame>) -> Option<World> {
        self.world(key, older, &self.path.towards(&self.late?)?)
    }

    /// The world of `key`, after `older`, as the camera goes `onward`, where depth, cameras and
    /// times tell it.
    fn world(&self, key: &KeyFrame, older: Option<&KeyFrame>, onward: &Onward) -> Option<World> {
        let is_newest = |pose: &&Pose| pose.time == key.content_time;
        self.path.newest().filter(is_newest)?;
        let span = key.motion_span().filter(|_| !key.depth.data().is_empty())?;
        let camera = self.camera_at(key, key.motion_from?)?;
        let oldest = older.and_then(|older| self.camera_at(older, older.motion_from?));
        World::new(key, &camera, oldest.as_ref(), onward, span)
    }

    /// Takes in what `key` shows of the predictions of the key that its motion points back to, if
    /// that is the newest of `past`.
    fn weigh(&mut self, pool: &ThreadPool, key: &KeyFrame, new: &Models, past: Past<'_>) {
        let [older, before, first] = past;
        let older = older.filter(|older| {
            key.motion_from == Some(older.content_time) && !older.displacement.data().is_empty()
        });
        let quadratic = older.and_then(|older| Quadratic::new(older, before?, first));
        let models = &mut self.models;
        if let Some(older) = older.filter(|_| models.lacks_lattice) {
            models.lattice.update(pool, older, &models.grid);
            models.lacks_lattice = false;
        }
        let mut predictions = older.and_then(|older| {
            let after = (key.content_time - older.content_time).as_secs_f64();
            let phase = (after / older.motion_span()?.as_secs_f64()) as f32;
            Some(Predictions { key: older, models, older: quadratic.as_ref(), phase })
        });
        let world = new.worlds[0].as_ref();
        let is_still = |column: u32, row: u32| {
            let [x, y] = [(column, 0), (row, 1)].map(|(i, axis)| middle(i, new.grid.cells[axis]));
            world.is_some_and(|world| world.is_still(key, &new.grid, x, y))
        };
        let orders_alone = self.choice == Choice::World;
        self.evidence.update(pool, key, new, predictions.as_mut(), is_still, orders_alone);
    }

    /// Works out what the rungs need of `key`, but for the lattice and what is fitted to it.
    fn prepare(&mut self, key: &KeyFrame, older: Option<&KeyFrame>) -> Models {
        // Their buffers go round: those of the key before last are taken over.
        let mut models = std::mem::take(&mut self.spare);
        models.grid = Grid::of(key);
        models.affine.clear(Lattice::points_on(&models.grid));
        models.failed.clear();
        let uses_global = match self.choice {
            Choice::Always(rung) => rung == Rung::Global,
            Choice::World => false,
            Choice::Evidence => !self.is_still && self.evidence.asks_for_global(),
        };
        models.global = if uses_global { Homography::fit(key, &models.grid) } else { None };
        if !matches!(self.choice, Choice::Always(_)) {
            models.worlds =
                CameraOrder::ALL.map(|order| self.world(key, older, &self.path.onward(order)?));
        }
        models
    }

    /// Fits the affine maps that cells take.
    fn fit_affine(&self, pool: &ThreadPool, models: &mut Models) {
        match self.choice {
            Choice::Always(Rung::Affine) => models.fit_affine(pool, |_, _| true),
            Choice::Evidence if !self.evidence.takes(Rung::Affine) => {}
            Choice::Evidence => {
                let evidence = &self.evidence;
                let last = models.lattice.points().map(|points| points - 1);
                models.fit_affine(pool, |run, row| {
                    // Cells read the points around them.
                    let first = (run * LANES as u32).saturating_sub(1);
                    let columns = first..=((run + 1) * LANES as u32).min(last[0]);
                    let mut rows = row.saturating_sub(1)..=(row + 1).min(last[1]);
                    rows.any(|row| {
                        columns
                            .clone()
                            .any(|column| evidence.leads().at(column, row).rung == Rung::Affine)
                    })
                });
            }
            _ => {}
        }
    }

    /// The camera at the time that the motion of `key` points back to.
    fn camera_at(&self, key: &KeyFrame, time: MonoTime) -> Option<Camera> {
        self.path.at(time).map(|pose| pose.camera).or(key.motion_from_camera)
    }

    /// Fills in velocity and acceleration of `key`.
    fn fill(&mut self, pool: &ThreadPool, key: &mut KeyFrame, past: Past<'_>) {
        let one_for_all = match self.choice {
            Choice::Always(rung) => Some(rung),
            Choice::World => Some(Rung::World(self.evidence.mover_order())),
            Choice::Evidence if self.models.late.is_some() => None,
            Choice::Evidence => self.evidence.rung_of_all(),
        };
        let is_always = !matches!(self.choice, Choice::Evidence);
        let is_decoded = key.velocity.data().len() == key.displacement.data().len();
        // Held, or gone by a motion of zero: the same.
        let is_own = one_for_all == Some(Rung::Linear)
            || (one_for_all == Some(Rung::Hold) && is_decoded && self.is_still);
        if is_own && is_decoded {
            // The field as it was decoded.
            key.acceleration.resize(0, 0);
            return;
        }
        let quadratic = past[0].and_then(|older| Quadratic::new(key, older, past[1]));
        let [width, height] = self.models.grid.cells;
        self.velocity.resize(width, height);
        self.acceleration.resize(width, height);
        let px_per_span = self.px_per_span(key);
        let filling = Filling { models: &self.models, key, older: quadratic.as_ref(), px_per_span };
        let evidence = &self.evidence;
        let accelerates = AtomicBool::new(false);
        for_each_row_of_two(
            pool,
            &mut self.velocity,
            &mut self.acceleration,
            #[inline(always)]
            |y, velocity, acceleration| {
                let run = Run { x: 0, y, velocity, acceleration };
                match one_for_all {
                    Some(rung) if is_always || rung != Rung::Hold => filling.by(rung, run),
                    _ => fill_row(&filling, evidence, run),
                }
                if acceleration.iter().any(|a| *a != Acceleration::default()) {
                    accelerates.store(true, Ordering::Relaxed);
                }
            },
        );
        if is_decoded && key.came.data().is_empty() {
            std::mem::swap(&mut key.came, &mut key.velocity);
        }
        dilate_cells(pool, &key.depth, &self.velocity, &mut key.velocity);
        if accelerates.into_inner() {
            dilate_cells(pool, &key.depth, &self.acceleration, &mut key.acceleration);
        } else {
            key.acceleration.resize(0, 0);
        }
    }

    /// Pixels per motion span of a speed of one degree per second, where motion is damped.
    #[expect(clippy::cast_possible_truncation, reason = "seconds need no more than an f32")]
    fn px_per_span(&self, key: &KeyFrame) -> Option<f32> {
        let seconds = key.motion_span()?.as_secs_f64() as f32;
        self.pixels_per_degree.map(|pixels_per_degree| pixels_per_degree * seconds)
    }
}

/// Whether the motion of `key`, as it was decoded, is zero everywhere.
fn is_still(pool: &ThreadPool, key: &KeyFrame) -> bool {
    let is_decoded = key.velocity.data().len() == key.displacement.data().len();
    let moves = |run: &[Velocity]| run.iter().fold(0, |any, v| any | v.x | v.y) != 0;
    let moves = |part: &[Velocity]| part.chunks(STILL_RUN).any(moves);
    // Where something moves, most often the first cells say so.
    let (first, rest) = key.velocity.data().split_at(key.velocity.data().len().min(STILL_PART));
    is_decoded && !moves(first) && !pool.install(|| rest.par_chunks(STILL_PART).any(moves))
}

/// Fills in a row, sample by sample: runs of samples that share a rung, and cells of others, which
/// look for their own.
#[inline(always)]
fn fill_row(filling: &Filling<'_>, evidence: &Evidence, mut row: Run<'_>) {
    let (y, width) = (row.y, row.velocity.len() as u32);
    let columns = evidence.samples().width();
    let models = filling.models;
    let is_late = models.late.is_some();
    let rung_of = |column| {
        if is_late { None } else { evidence.shared_rung(column, y / STRIDE) }
    };
    let mut column = 0;
    while column < columns {
        let rung = rung_of(column);
        let first = column;
        column += 1;
        while column < columns && rung_of(column) == rung {
            column += 1;
        }
        let end = (column * STRIDE).min(width);
        let run = row.take((end - first * STRIDE) as usize);
        match rung {
            // What moves among samples that are held is too thin for one of its own.
            Some(Rung::Hold) if !filling.is_still(&run) => fill_mixed(filling, evidence, run),
            Some(rung) => filling.by(rung, run),
            None => fill_mixed(filling, evidence, run),
        }
    }
}

/// Fills in cells that each look for their rung.
fn fill_mixed(filling: &Filling<'_>, evidence: &Evidence, run: Run<'_>) {
    let Filling { models, key, .. } = filling;
    let has_depth = !key.depth.data().is_empty();
    let cells = (run.x..).zip(run.velocity.iter_mut().zip(run.acceleration));
    for (x, (velocity, acceleration)) in cells {
        let lead = if models.is_led_by_late_camera(key, x, run.y) {
            Lead::by(Rung::World(MoverOrder::Constant))
        } else {
            let depth = if has_depth { key.depth.at(x, run.y) } else { 0 };
            evidence.lead_at(x, run.y, depth)
        };
        (*velocity, *acceleration) = filling.one(lead, x, run.y);
    }
}
