//! What the rungs need of one key beside its planes: small things that are worked out once.
//!
//! A rung's answer for a cell is then a function of it, the key's planes and the key before. Made
//! and kept by [`super::ladder`], read by it and by the evidence.

use rayon::ThreadPool;

use super::affine::AffineField;
use super::camera_path::CameraOrder;
use super::curve::Curve;
use super::flow::FailedField;
use super::global::Homography;
use super::grid::Grid;
use super::lattice::Lattice;
use super::quadratic::Quadratic;
use super::rung::Rung;
use super::world::{MoverOrder, World};
use crate::key::KeyFrame;

/// What the rungs need of one key beside its planes.
#[derive(Clone, Debug, Default)]
pub struct Models {
    pub(super) grid: Grid,
    pub(super) lattice: Lattice,
    /// Whether the lattice is not of this key: it was not needed, as nothing moves.
    pub(super) lacks_lattice: bool,
    pub(super) global: Option<Homography>,
    pub(super) affine: AffineField,
    /// By [`CameraOrder`].
    pub(super) worlds: [Option<World>; CameraOrder::ALL.len()],
    /// How the camera is taken to go on.
    pub(super) order: CameraOrder,
    /// Where the key's motion does not explain its picture, and what does.
    pub(super) failed: FailedField,
    /// With the camera on its way to a late pose, which takes the place of every order.
    pub(super) late: Option<World>,
}

impl Models {
    /// The grid of the key's field.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The key's field at the lattice's points.
    #[must_use]
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Where the key's motion does not explain its picture, and what does.
    #[must_use]
    pub fn failed(&self) -> &FailedField {
        &self.failed
    }

    /// The flow at a lattice point that the key's motion does not explain.
    #[must_use]
    pub fn flow_of(&self, column: u32, row: u32) -> Option<[f32; 2]> {
        self.failed.at(self.lattice.place(column, row))
    }

    /// The affine maps that have been fitted.
    #[must_use]
    pub fn affine(&self) -> &AffineField {
        &self.affine
    }

    /// Fits the runs of eight lattice points that are `wanted`, by number and row.
    pub fn fit_affine(&mut self, pool: &ThreadPool, wanted: impl Fn(u32, u32) -> bool + Sync) {
        self.affine.fit(pool, &self.lattice, &self.grid, wanted);
    }

    /// The world as the camera is taken to go on: to the late pose, where there is one.
    #[must_use]
    pub fn world(&self) -> Option<&World> {
        self.late.as_ref().or(self.worlds[self.order as usize].as_ref())
    }

    /// Whether a rung was prepared, so that it may have answers.
    #[must_use]
    #[inline(always)]
    pub fn has(&self, rung: Rung) -> bool {
        rung != Rung::Global || self.global.is_some()
    }

    /// [`Models::curve`] of a cell for the evidence: affine by one fit and not by the mean of four.
    #[must_use]
    #[inline(always)]
    pub fn curve_of_sample(
        &self,
        rung: Rung,
        key: &KeyFrame,
        older: Option<&Quadratic<'_>>,
        x: u32,
        y: u32,
    ) -> Option<Curve> {
        if rung != Rung::Affine {
            return self.curve(rung, key, older, x, y);
        }
        let depth = if key.depth.data().is_empty() { 0 } else { key.depth.at(x, y) };
        self.affine.curve_by_own(&self.grid, [x, y], depth, key.displacement.at(x, y))
    }

    /// Where the surface of a cell goes as the camera goes on by `order`; None where no camera
    /// tells.
    #[must_use]
    #[inline(always)]
    pub fn curve_by(
        &self,
        order: CameraOrder,
        key: &KeyFrame,
        older: Option<&Quadratic<'_>>,
        x: u32,
        y: u32,
    ) -> Option<Curve> {
        let world = self.worlds[order as usize].as_ref()?;
        let curve = world.curve(MoverOrder::Constant, key, older, &self.grid, [x, y]);
        Some(curve).filter(Curve::is_known)
    }

    /// Whether a late pose says where the surface of a cell goes on to: it moves with the world.
    #[inline(always)]
    pub(super) fn is_led_by_late_camera(&self, key: &KeyFrame, x: u32, y: u32) -> bool {
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
            Rung::World(movers) => {
                self.world().map(|world| world.curve(movers, key, older, grid, [x, y]))
            }
            Rung::Flow => self.failed.at(grid.centre(x, y)).map(Curve::straight),
        };
        curve.filter(Curve::is_known)
    }
}
