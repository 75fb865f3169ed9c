//! Evidence: each key is the truth for what every rung predicted of it.
//!
//! When a key arrives, one cell of every 4x4 of its field, a *sample*, is followed back along its own
//! motion to the key before, where the cell of its surface (depth agrees) is asked where each rung
//! had said that it would be by now:
//!
//! ```text
//! (1) e(r)  = |d_r(p) - D|                 p the phase of the new key after the old one, D its motion
//! (2) s(r)  = e^2 / (e^2 + c^2)            the part of a picture's contrast that such an error costs
//! (3) m(r) <- m(r) + (s(r) - m(r)) / n     n = 1, 2, .. 4: the mean over a few keys, on the surface
//! (4) S(r)  = mean of m over those of 5x5 samples that lie on the surface
//! ```
//!
//! The camera's order belongs to the whole image, and is chosen for it from
//! those samples that move with the world ([`CameraOrder`]). Of the rungs the cheapest is taken
//! whose S is within a tolerance of the best. The rung in use stays until it is worse by more, and the
//! rung that the whole image would take, by the mean of m over it, is preferred the more, the fewer
//! samples there are to judge a surface by.
//!
//! Geometry alone: nothing is warped for it, and nothing photometric makes it doubt. Floats,
//! deterministic as in [`crate::trajectory`]; each sample for itself and sums row by row in order, so
//! that the number of threads changes nothing.

mod choose;
mod measure;
#[cfg(test)]
mod tests;

use rayon::ThreadPool;

pub use measure::Predictions;

use crate::key::KeyFrame;
use crate::plane::Plane;
use crate::trajectory::camera_path::CameraOrder;
use crate::trajectory::grid::Grid;
use crate::trajectory::rung::Rung;
use crate::trajectory::surface::is_same_surface;

/// Cells from one sample to the next, per axis.
pub const STRIDE: u32 = 4;
/// The rungs that are measured, cheapest first.
pub const RUNGS: [Rung; 8] = [
    Rung::Hold,
    Rung::Global,
    Rung::Linear,
    Rung::Affine,
    Rung::Quadratic,
    Rung::World(CameraOrder::Constant),
    Rung::World(CameraOrder::Damped),
    Rung::World(CameraOrder::Accelerated),
];
/// A number per rung.
pub type PerRung = [f32; RUNGS.len()];

/// The place of a rung in [`RUNGS`].
#[must_use]
pub fn index_of(rung: Rung) -> usize {
    RUNGS.iter().position(|other| *other == rung).expect("every rung is measured")
}

/// What is known of the surface at one sample of the newest key.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Sample {
    /// Its depth key, 0 without depth.
    pub depth: u32,
    /// m of (3).
    pub mean: PerRung,
    /// n of (3), 0 where nothing has been measured.
    pub keys: u8,
    /// Whether it moves with the world.
    pub is_still: bool,
    /// The rung in use.
    pub rung: Rung,
}

/// The evidence of one stream, on the samples of its newest key.
#[derive(Clone, Debug)]
pub struct Evidence {
    samples: Plane<Sample>,
    /// Those of the key before, while new ones are made.
    older: Plane<Sample>,
    order: CameraOrder,
    /// Error (2) of each order over the still world, averaged over keys.
    order_errors: Option<[f32; CameraOrder::ALL.len()]>,
    /// The rung of the image as a whole.
    image_rung: Rung,
}

impl Default for Evidence {
    /// Nothing is known: of the rungs that need no history, the richest.
    fn default() -> Self {
        Self {
            samples: Plane::default(),
            older: Plane::default(),
            order: CameraOrder::default(),
            order_errors: None,
            image_rung: Rung::Affine,
        }
    }
}

impl Evidence {
    /// Takes in what `key` shows of the `predictions` of the key before it; None where there were
    /// none. `is_still` says which cells of `key` move with the world.
    pub fn update(
        &mut self,
        pool: &ThreadPool,
        key: &KeyFrame,
        grid: &Grid,
        predictions: Option<&Predictions<'_>>,
        is_still: impl Fn(u32, u32) -> bool + Sync,
    ) {
        std::mem::swap(&mut self.samples, &mut self.older);
        measure::measure(pool, key, grid, predictions, &self.older, is_still, &mut self.samples);
        if predictions.is_some() {
            self.choose_order();
        }
        self.image_rung = choose::choose(pool, self.order, self.image_rung, &mut self.samples);
    }

    /// Forgets everything: the scene is another.
    pub fn cut(&mut self) {
        *self = Self::default();
    }

    /// How the camera goes on best.
    #[must_use]
    pub fn order(&self) -> CameraOrder {
        self.order
    }

    /// The samples of the newest key.
    #[must_use]
    pub fn samples(&self) -> &Plane<Sample> {
        &self.samples
    }

    /// The rung of a cell of depth key `depth` of the newest key: that of the sample of its surface
    /// which is nearest to it among its own and those around, else the image's.
    #[must_use]
    #[inline(always)]
    pub fn rung_at(&self, x: u32, y: u32, depth: u32) -> Rung {
        let (column, row) = (x / STRIDE, y / STRIDE);
        let own = self.samples.at(column, row);
        if is_same_surface(own.depth, depth) {
            return own.rung;
        }
        let last = [self.samples.width() - 1, self.samples.height() - 1];
        let rows = row.saturating_sub(1)..=(row + 1).min(last[1]);
        let mut around = rows.flat_map(|row| {
            let columns = column.saturating_sub(1)..=(column + 1).min(last[0]);
            columns.map(move |column| self.samples.at(column, row))
        });
        let found = around.find(|sample| is_same_surface(sample.depth, depth));
        found.map_or(self.image_rung, |sample| sample.rung)
    }

    /// Chooses the camera's order from the still samples that have just been measured.
    fn choose_order(&mut self) {
        const WORLD: usize = RUNGS.len() - CameraOrder::ALL.len();
        let (mut sum, mut count) = ([0.0; CameraOrder::ALL.len()], 0.0);
        for sample in self.samples.data().iter().filter(|s| s.is_still && s.keys > 0) {
            for (sum, mean) in sum.iter_mut().zip(&sample.mean[WORLD..]) {
                *sum += mean;
            }
            count += 1.0;
        }
        if count == 0.0 {
            return;
        }
        let now = sum.map(|sum| sum / count);
        let errors = match self.order_errors {
            Some(before) => std::array::from_fn(|i| 0.5 * (before[i] + now[i])),
            None => now,
        };
        self.order_errors = Some(errors);
        let error = |order: CameraOrder| errors[order as usize];
        for order in CameraOrder::ALL {
            if error(order) < error(self.order) * (1.0 - ORDER_HYSTERESIS) - ORDER_TOLERANCE {
                self.order = order;
            }
        }
    }
}

/// Part of its error by which another order has to be better than the one in use.
const ORDER_HYSTERESIS: f32 = 0.1;
/// And the least difference of (2) that counts: that of a twentieth of a pixel.
const ORDER_TOLERANCE: f32 = 0.000_6;
