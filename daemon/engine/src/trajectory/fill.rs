//! Fills in the trajectories of a key's cells, run by run.
//!
//! A run is some neighbouring cells of a row that take one rung, or cells that each look for
//! theirs. Runs of one rung are worked out several cells at a time.

use foreframe_perception::tracking::tracked_share;

use super::curve::{Curve, Curves};
use super::dilate_motion::quantise_row;
use super::lattice::STRIDE;
use super::models::Models;
use super::quadratic::Quadratic;
use super::rung::Rung;
use crate::evidence::Lead;
use crate::key::{Acceleration, KeyFrame, Velocity};

/// Cells of one step where the world is still.
const WORLD_CELLS: usize = 8;
/// Cells between the same lattice points.
const LATTICE_CELLS: usize = STRIDE as usize;

/// Motion that does not round to zero, pixels.
const LEAST_PX: f32 = 0.5 / Velocity::PER_PX as f32;

/// What the trajectories of one key are made from.
#[derive(Debug)]
pub(super) struct Filling<'a> {
    pub(super) models: &'a Models,
    pub(super) key: &'a KeyFrame,
    /// How it reads the key before.
    pub(super) older: Option<&'a Quadratic<'a>>,
    /// Pixels per motion span of a speed of one degree per second, where motion is damped.
    pub(super) px_per_span: Option<f32>,
}

/// Cells of a row, from column `x` on.
pub(super) struct Run<'a> {
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) velocity: &'a mut [Velocity],
    pub(super) acceleration: &'a mut [Acceleration],
}

impl<'a> Run<'a> {
    /// The first `cells` of these, which are taken from them.
    #[inline(always)]
    pub(super) fn take<'b>(&'b mut self, cells: usize) -> Run<'b> {
        let velocity = std::mem::take(&mut self.velocity);
        let acceleration = std::mem::take(&mut self.acceleration);
        let (velocity, rest) = velocity.split_at_mut(cells);
        self.velocity = rest;
        let (acceleration, rest) = acceleration.split_at_mut(cells);
        self.acceleration = rest;
        let x = self.x;
        self.x += cells as u32;
        Run { x, y: self.y, velocity, acceleration }
    }

    #[inline(always)]
    fn set<const N: usize>(&mut self, at: usize, curves: &Curves<N>) {
        let (velocities, accelerations) = curves.quantise();
        self.velocity[at..at + N].copy_from_slice(&velocities);
        self.acceleration[at..at + N].copy_from_slice(&accelerations);
    }
}

impl Filling<'_> {
    /// Takes every cell of `run` on by `rung`.
    #[inline(always)]
    pub(super) fn by(&self, rung: Rung, mut run: Run<'_>) {
        let row = self.key.displacement.row(run.y);
        let cells = run.velocity.len();
        let (is_damped, grid) = (self.px_per_span.is_some(), self.models.grid());
        let mut done = 0;
        match rung {
            Rung::Hold => {
                run.velocity.fill(Velocity::default());
                run.acceleration.fill(Acceleration::default());
                done = cells;
            }
            Rung::Linear => {
                quantise_row(&row[run.x as usize..][..cells], self.px_per_span, run.velocity);
                run.acceleration.fill(Acceleration::default());
                done = cells;
            }
            Rung::Affine if !is_damped => {
                let half = STRIDE / 2;
                let aside = ((run.x + half).next_multiple_of(STRIDE) - half - run.x) as usize;
                self.each(rung, &mut run, 0..aside.min(cells));
                done = aside.min(cells);
                while done + LATTICE_CELLS <= cells {
                    let x = run.x + done as u32;
                    let mut curves =
                        self.models.affine().curves::<LATTICE_CELLS>(self.key, grid, x, run.y);
                    curves.or_straight(&row[x as usize..]);
                    run.set(done, &curves);
                    done += LATTICE_CELLS;
                }
            }
            Rung::World(_) if !is_damped => {
                if let Some(world) = self.models.world() {
                    while done + WORLD_CELLS <= cells {
                        let x = run.x + done as u32;
                        match world.still_curves::<WORLD_CELLS>(self.key, grid, x, run.y) {
                            Some(curves) => run.set(done, &curves),
                            None => self.each(rung, &mut run, done..done + WORLD_CELLS),
                        }
                        done += WORLD_CELLS;
                    }
                }
            }
            _ => {}
        }
        self.each(rung, &mut run, done..cells);
    }

    /// Whether the key says that nothing moves in `run`.
    #[inline(always)]
    pub(super) fn is_still(&self, run: &Run<'_>) -> bool {
        let row = &self.key.displacement.row(run.y)[run.x as usize..][..run.velocity.len()];
        row.iter().all(|[dx, dy]| dx.abs().max(dy.abs()) < LEAST_PX)
    }

    /// Takes cells on one by one.
    #[inline(always)]
    fn each(&self, rung: Rung, run: &mut Run<'_>, cells: std::ops::Range<usize>) {
        for i in cells {
            (run.velocity[i], run.acceleration[i]) =
                self.one(Lead::by(rung), run.x + i as u32, run.y);
        }
    }

    /// Takes one cell on.
    #[inline(always)]
    pub(super) fn one(&self, lead: Lead, x: u32, y: u32) -> (Velocity, Acceleration) {
        let straight = Curve::straight(self.key.displacement.at(x, y));
        let curve = self.models.curve(lead.rung, self.key, self.older, x, y);
        let mut curve = curve.unwrap_or(straight);
        for axis in 0..2 {
            if let Some(part) = lead.part(axis) {
                curve.half[axis] = part * straight.half[axis];
                curve.one[axis] = part * straight.one[axis];
            }
        }
        damped(curve, self.px_per_span).quantise()
    }
}

/// The part of a curve that an eye can follow: (3) and (4) of [`super::dilate_motion`], of its
/// chord.
#[inline(always)]
fn damped(curve: Curve, px_per_span: Option<f32>) -> Curve {
    let Some(px_per_span) = px_per_span else { return curve };
    let [x, y] = curve.one;
    let share = tracked_share(libm::sqrtf(x * x + y * y) / px_per_span);
    Curve { half: curve.half.map(|d| d * share), one: curve.one.map(|d| d * share) }
}
