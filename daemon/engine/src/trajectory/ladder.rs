//! One stream's ladder: prepares the rungs for each key and fills in its trajectories.
//!
//! [`Models`] holds what the rungs need of one key, small things that are worked out once; a rung's
//! answer for a cell is then a function of it, the key's planes and the key before. [`Ladder`] takes
//! the answers of the rung that the method names for every cell, lets each cell take those of the
//! surface that its colour belongs to (dilation), and leaves them in the key as fixed point.
//!
//! Where a rung has no answer, the motion field itself goes on: [`Rung::Linear`].

use foreframe_perception::tracking::tracked_share;
use rayon::ThreadPool;

use super::affine::AffineField;
use super::camera_path::{CameraOrder, CameraPath, Pose};
use super::curve::Curve;
use super::dilate_motion::dilate_cells;
use super::global::Homography;
use super::grid::Grid;
use super::quadratic::Quadratic;
use super::rung::Rung;
use super::world::World;
use crate::bands::for_each_row_of_two;
use crate::evidence::{Evidence, Predictions};
use crate::key::{Acceleration, Camera, KeyFrame, Velocity};
use crate::method::Method;
use crate::plane::Plane;
use crate::time::MonoTime;

/// What the rungs need of one key beside its planes.
#[derive(Clone, Debug, Default)]
pub struct Models {
    grid: Grid,
    global: Option<Homography>,
    affine: AffineField,
    /// By [`CameraOrder`].
    worlds: [Option<World>; CameraOrder::ALL.len()],
    /// With the camera on its way to a late pose, which takes the place of every order.
    late: Option<World>,
}

impl Models {
    /// The grid of the key's field.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The model of a camera order.
    #[must_use]
    pub fn world(&self, order: CameraOrder) -> Option<&World> {
        self.worlds[order as usize].as_ref()
    }

    /// Whether a late pose says where the surface of a cell goes on to: it moves with the world.
    #[inline(always)]
    fn is_led_by_late_camera(&self, key: &KeyFrame, x: u32, y: u32) -> bool {
        self.late.as_ref().is_some_and(|late| late.is_still(key, &self.grid, x, y))
    }

    /// Where `rung` takes the surface of a cell; None where it cannot tell. `older` reads the key
    /// before.
    #[must_use]
    #[inline(always)]
    pub fn curve(
        &self,
        rung: Rung,
        key: &KeyFrame,
        older: Option<&Quadratic<'_>>,
        x: u32,
        y: u32,
    ) -> Option<Curve> {
        let grid = &self.grid;
        let curve = match rung {
            Rung::Hold => Some(Curve::default()),
            Rung::Linear => Some(Curve::straight(key.displacement.at(x, y))),
            Rung::Global => self.global.map(|global| global.curve(grid.centre(x, y))),
            Rung::Affine => self.affine.curve(key, grid, x, y),
            Rung::Quadratic => older.and_then(|older| older.curve(key, grid, x, y)),
            Rung::World(order) => {
                let world = self.late.as_ref().or(self.worlds[order as usize].as_ref());
                world.map(|world| world.curve(key, older, grid, x, y))
            }
        };
        curve.filter(Curve::is_known)
    }
}

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
            | Method::Linear => {
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
            velocity: Plane::default(),
            acceleration: Plane::default(),
        })
    }

    /// What the keys so far have shown.
    #[must_use]
    pub fn evidence(&self) -> &Evidence {
        &self.evidence
    }

    /// Gives `key` its trajectories. It was decoded with its displacement; `older` is the key before
    /// it, unless this one is a cut, and `before` the one before that.
    pub fn take_key(
        &mut self,
        pool: &ThreadPool,
        key: &mut KeyFrame,
        older: Option<&KeyFrame>,
        before: Option<&KeyFrame>,
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
        let models = self.prepare(pool, key);
        if !matches!(self.choice, Choice::Always(_)) {
            let followed = older.filter(|older| key.motion_from == Some(older.content_time));
            self.weigh(pool, key, &models, followed, before);
        }
        self.spare = std::mem::replace(&mut self.models, models);
        self.models.late = self.late_world(key);
        self.fill(pool, key, older);
    }

    /// The client has moved the camera on to `view` at `time`, after its newest key. The newest pose
    /// wins. Takes effect with [`Ladder::catch_up`].
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
    pub fn catch_up(
        &mut self,
        pool: &ThreadPool,
        key: &mut KeyFrame,
        older: Option<&KeyFrame>,
    ) -> bool {
        let is_new = std::mem::take(&mut self.is_late_new) && !key.displacement.data().is_empty();
        let late = if is_new { self.late_world(key) } else { None };
        if late.is_none() {
            return false;
        }
        self.models.late = late;
        self.fill(pool, key, older);
        true
    }

    /// The camera's way from `key` to the late pose.
    fn late_world(&self, key: &KeyFrame) -> Option<World> {
        let is_newest = |pose: &&Pose| pose.time == key.content_time;
        self.path.newest().filter(is_newest)?;
        let span = key.motion_span().filter(|_| !key.depth.data().is_empty())?;
        let older = self.camera_at(key, key.motion_from?)?;
        World::new(key, &older, &self.path.towards(&self.late?)?, span)
    }

    /// Takes in what `key` shows of the predictions of `older`, which its motion points back to.
    fn weigh(
        &mut self,
        pool: &ThreadPool,
        key: &KeyFrame,
        models: &Models,
        older: Option<&KeyFrame>,
        before: Option<&KeyFrame>,
    ) {
        let older = older.filter(|older| !older.displacement.data().is_empty());
        let quadratic = older.zip(before).and_then(|(older, before)| Quadratic::new(older, before));
        let predictions = older.and_then(|older| {
            let after = (key.content_time - older.content_time).as_secs_f64();
            let phase = (after / older.motion_span()?.as_secs_f64()) as f32;
            Some(Predictions { key: older, models: &self.models, older: quadratic.as_ref(), phase })
        });
        let world = models.worlds[0].as_ref();
        let is_still =
            |x: u32, y: u32| world.is_some_and(|world| world.is_still(key, &models.grid, x, y));
        self.evidence.update(pool, key, &models.grid, predictions.as_ref(), is_still);
    }

    /// Works out what the rungs need of `key`.
    fn prepare(&mut self, pool: &ThreadPool, key: &KeyFrame) -> Models {
        // Their buffers go round: those of the key before last are taken over.
        let mut models = std::mem::take(&mut self.spare);
        models.grid = Grid::of(key);
        let uses = |rung| match self.choice {
            Choice::Always(always) => always == rung,
            Choice::World => false,
            Choice::Evidence => true,
        };
        if uses(Rung::Global) {
            models.global = Homography::fit(key, &models.grid);
        }
        if uses(Rung::Affine) {
            models.affine.update(pool, key, &models.grid);
        }
        if !matches!(self.choice, Choice::Always(_)) {
            models.worlds = self.worlds(key);
        }
        models
    }

    /// The camera's ways on from `key`, where depth, cameras and times tell them.
    fn worlds(&self, key: &KeyFrame) -> [Option<World>; CameraOrder::ALL.len()] {
        CameraOrder::ALL.map(|order| {
            let is_newest = |pose: &&Pose| pose.time == key.content_time;
            self.path.newest().filter(is_newest)?;
            let span = key.motion_span().filter(|_| !key.depth.data().is_empty())?;
            let older = self.camera_at(key, key.motion_from?)?;
            World::new(key, &older, &self.path.onward(order)?, span)
        })
    }

    /// The camera at the time that the motion of `key` points back to.
    fn camera_at(&self, key: &KeyFrame, time: MonoTime) -> Option<Camera> {
        self.path.at(time).map(|pose| pose.camera).or(key.motion_from_camera)
    }

    /// Fills in velocity and acceleration of `key`.
    fn fill(&mut self, pool: &ThreadPool, key: &mut KeyFrame, older: Option<&KeyFrame>) {
        let quadratic = older.and_then(|older| Quadratic::new(key, older));
        let [width, height] = self.models.grid.cells;
        self.velocity.resize(width, height);
        self.acceleration.resize(width, height);
        let px_per_span = self.px_per_span(key);
        let (models, evidence, held) = (&self.models, &self.evidence, &*key);
        let has_depth = !key.depth.data().is_empty();
        let (choice, order) = (self.choice, self.evidence.order());
        for_each_row_of_two(
            pool,
            &mut self.velocity,
            &mut self.acceleration,
            #[inline(always)]
            |y, velocities, accelerations| {
                let cells = (0..).zip(velocities.iter_mut().zip(accelerations));
                for (x, (velocity, acceleration)) in cells {
                    let rung = match choice {
                        Choice::Always(rung) => rung,
                        Choice::World => Rung::World(order),
                        Choice::Evidence if models.is_led_by_late_camera(held, x, y) => {
                            Rung::World(order)
                        }
                        Choice::Evidence => {
                            let depth = if has_depth { held.depth.at(x, y) } else { 0 };
                            evidence.rung_at(x, y, depth)
                        }
                    };
                    let curve = models
                        .curve(rung, held, quadratic.as_ref(), x, y)
                        .unwrap_or_else(|| Curve::straight(held.displacement.at(x, y)));
                    (*velocity, *acceleration) = damped(curve, px_per_span).quantise();
                }
            },
        );
        dilate_cells(pool, &key.depth, &self.velocity, &mut key.velocity);
        if self.acceleration.data().iter().all(|a| *a == Acceleration::default()) {
            key.acceleration.resize(0, 0);
        } else {
            dilate_cells(pool, &key.depth, &self.acceleration, &mut key.acceleration);
        }
    }

    /// Pixels per motion span of a speed of one degree per second, where motion is damped.
    #[expect(clippy::cast_possible_truncation, reason = "seconds need no more than an f32")]
    fn px_per_span(&self, key: &KeyFrame) -> Option<f32> {
        let seconds = key.motion_span()?.as_secs_f64() as f32;
        self.pixels_per_degree.map(|pixels_per_degree| pixels_per_degree * seconds)
    }
}

/// The part of a curve that an eye can follow: (3) and (4) of [`super::dilate_motion`], of its chord.
#[inline(always)]
fn damped(curve: Curve, px_per_span: Option<f32>) -> Curve {
    let Some(px_per_span) = px_per_span else { return curve };
    let [x, y] = curve.one;
    let share = tracked_share(libm::sqrtf(x * x + y * y) / px_per_span);
    Curve { half: curve.half.map(|d| d * share), one: curve.one.map(|d| d * share) }
}
