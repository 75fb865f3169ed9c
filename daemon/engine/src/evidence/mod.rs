//! Evidence: each key is the truth for what every rung predicted of it.
//!
//! When a key arrives, one cell of every 4x4 of its field, a *sample*, is followed back along its
//! own motion to the key before, where the cell of its surface (depth agrees) is asked where each
//! rung had said that it would be by now:
//!
//! ```text
//! (1) e(r)  = |d_r(p) - D|                 p the phase of the new key after the old one, D its motion
//! (2) s(r)  = e^2 / (e^2 + c^2)            the part of a picture's contrast that such an error costs
//! (3) m(r) <- m(r) + (s(r) - m(r)) / n     n = 1, 2, .. 4: the mean over a few keys, on the surface
//! (4) S(r)  = mean of m over those of 5x5 samples that lie on the surface
//! ```
//!
//! The camera's order belongs to the whole image, and is chosen for it from those samples that move
//! with the world ([`CameraOrder`]). The order in which what moves besides goes on ([`MoverOrder`])
//! makes two rungs; where every surface goes by `world` it is chosen for the whole image, too, from
//! the samples that move on their own. Of the rungs the cheapest is taken whose S is within a
//! tolerance of the best. The rung in use stays until it is worse by more, and the rung that the
//! whole image would take, by the mean of m over it, is preferred the more, the fewer samples there
//! are to judge a surface by.
//!
//! Where the rungs have failed and most of a surface's motion is news, it may be a jump as well as
//! a beginning: only that part of it goes on which was foreseen, along each axis of the picture for
//! itself. The same holds of one axis alone along which holding would have been as good as every
//! other rung, or better: what shakes up and down as it drives by goes on across, and not up. The
//! rungs that follow the motion are then judged by (1) along the other axis. That limits overshoot
//! where something turns back, and a vector that is wrong for one key moves nothing. Wrong vectors
//! that stay are found by luma ([`trust`]).
//!
//! A shadow, a reflection and a texture that runs move otherwise than the surface that shows them.
//! Where luma says so of two keys in a row, and flow explains what their motion does not
//! ([`crate::trajectory::flow`]), D is that flow, in all of the above: a sample then stands for
//! what is seen there and not for the surface.
//!
//! What is not needed is not measured: `hold`, `linear` and the rung in use always, the others
//! where that has failed, and in a sixteenth of the samples in turn. A richer rung that is not
//! measured counts as good as the one in use, which has not failed; a cheaper one keeps its mean.
//!
//! Geometry alone: nothing is warped for it, and nothing photometric makes it doubt. Floats,
//! deterministic as in [`crate::trajectory`]; each sample for itself and sums row by row in order,
//! so that the number of threads changes nothing.

mod choose;
mod eight;
mod measure;
mod orders;
#[cfg(test)]
mod tests;
mod trust;

use rayon::ThreadPool;

pub use measure::Predictions;
use measure::{Measuring, Trace};
use orders::OrderChoice;
use trust::Trust;

use crate::key::KeyFrame;
use crate::plane::Plane;
use crate::trajectory::camera_path::CameraOrder;
pub use crate::trajectory::lattice::STRIDE;
use crate::trajectory::models::Models;
use crate::trajectory::rung::Rung;
use crate::trajectory::surface::is_same_surface;
use crate::trajectory::world::MoverOrder;

/// The rungs that are measured, cheapest first.
pub const RUNGS: [Rung; 8] = [
    Rung::Hold,
    Rung::Global,
    Rung::Linear,
    Rung::Affine,
    Rung::Quadratic,
    Rung::World(MoverOrder::Constant),
    Rung::World(MoverOrder::Accelerated),
    Rung::Flow,
];
/// The place of the first of the orders of movers.
const WORLD: usize = 5;
/// A number per rung.
pub type PerRung = [f32; RUNGS.len()];

/// The place of a rung in [`RUNGS`].
#[must_use]
#[inline(always)]
pub const fn index_of(rung: Rung) -> usize {
    match rung {
        Rung::Hold => 0,
        Rung::Global => 1,
        Rung::Linear => 2,
        Rung::Affine => 3,
        Rung::Quadratic => 4,
        Rung::World(order) => WORLD + order as usize,
        Rung::Flow => 7,
    }
}

/// Of [`Evidence::taken`].
const fn bit_of(rung: Rung) -> u16 {
    1 << index_of(rung)
}

/// The rung of a surface that nothing was measured of, where the image takes `image`. Rungs below
/// [`Rung::Linear`] ignore what the newest key says of its motion, and have to be proven.
fn unproven(image: Rung) -> Rung {
    if index_of(image) < index_of(Rung::Linear) { Rung::Linear } else { image }
}

/// What leads a surface on from the newest key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Lead {
    /// The rung in use.
    pub rung: Rung,
    /// By axis, where most of its motion is news, the part of it that was foreseen, in sixteenths;
    /// else [`Lead::WHOLE`].
    pub share: [u8; 2],
}

impl Lead {
    /// The share of motion along an axis that goes on as it is.
    pub const WHOLE: u8 = 16;

    /// By `rung`, whole.
    #[must_use]
    pub const fn by(rung: Rung) -> Self {
        Self { rung, share: [Self::WHOLE; 2] }
    }

    /// Whether the rung takes the surface on along both axes.
    #[must_use]
    #[inline(always)]
    pub fn is_whole(self) -> bool {
        self.share == [Self::WHOLE; 2]
    }

    /// The part of its motion along an axis that a surface goes on with, where that is not all of
    /// it.
    #[must_use]
    #[inline(always)]
    pub fn part(self, axis: usize) -> Option<f32> {
        let share = self.share[axis];
        (share < Self::WHOLE).then(|| f32::from(share) / f32::from(Self::WHOLE))
    }
}

impl Default for Lead {
    fn default() -> Self {
        Self::by(Rung::default())
    }
}

/// What is known of the surface at one sample of the newest key.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample {
    /// m of (3).
    pub mean: PerRung,
    /// Its depth key, 0 without depth.
    pub depth: u32,
    /// n of (3), 0 where nothing has been measured.
    pub keys: u8,
    /// What led it so far.
    lead: Lead,
    /// As [`Lead::share`], by this key alone.
    share: [u8; 2],
}

impl Sample {
    /// The rung that led it so far.
    #[inline(always)]
    fn rung(&self) -> Rung {
        self.lead.rung
    }
}

impl Default for Sample {
    /// Of nothing that is known.
    fn default() -> Self {
        let lead = Lead::default();
        Self { mean: PerRung::default(), depth: 0, keys: 0, lead, share: lead.share }
    }
}

/// Runs of eight samples of which one is measured by the whole ladder, key by key in turn.
const TURNS: u32 = 16;
/// The same where nothing but the camera's order is asked for.
const ORDER_TURNS: u32 = 4;
/// Keys of which one is fitted a homography where none is in use.
const GLOBAL_KEYS: u32 = 4;
/// What [`Evidence::shared_rung`] has where cells have to look for their own.
const MIXED: u8 = u8::MAX;

/// The evidence of one stream, on the samples of its newest key.
#[derive(Clone, Debug)]
pub struct Evidence {
    samples: Plane<Sample>,
    /// Those of the key before, while new ones are made.
    older: Plane<Sample>,
    traces: Plane<Trace>,
    leads: Plane<Lead>,
    /// Per sample the index of the rung that it takes whole, or [`MIXED`].
    whole: Plane<u8>,
    /// Per sample the index of the rung that it and all around it take, or [`MIXED`].
    shared: Plane<u8>,
    /// Which rungs some sample takes, by their indices.
    taken: u16,
    trust: Trust,
    /// Whether nothing moves in the newest key.
    is_at_rest: bool,
    /// Keys taken in.
    count: u32,
    /// By the still world.
    order: OrderChoice<{ CameraOrder::ALL.len() }>,
    /// By what moves on its own.
    mover_order: OrderChoice<{ MoverOrder::ALL.len() }>,
    /// The rung of the image as a whole.
    image_rung: Rung,
}

impl Default for Evidence {
    /// Nothing is known: of the rungs that need no history, the richest.
    fn default() -> Self {
        Self {
            samples: Plane::default(),
            older: Plane::default(),
            traces: Plane::default(),
            leads: Plane::default(),
            whole: Plane::default(),
            shared: Plane::default(),
            taken: 0,
            trust: Trust::default(),
            is_at_rest: false,
            count: 0,
            order: OrderChoice::default(),
            mover_order: OrderChoice::default(),
            image_rung: Rung::Affine,
        }
    }
}

impl Evidence {
    /// Takes in what `key`, whose `models` are new, shows of the `predictions` of the key before
    /// it; None where there were none. `is_still` says which samples move with the world.
    pub fn update(
        &mut self,
        pool: &ThreadPool,
        key: &KeyFrame,
        models: &Models,
        predictions: Option<&mut Predictions<'_>>,
        is_still: impl Fn(u32, u32) -> bool + Sync,
        orders_alone: bool,
    ) {
        let lattice = models.lattice();
        std::mem::swap(&mut self.samples, &mut self.older);
        self.count = self.count.wrapping_add(1);
        self.is_at_rest = false;
        let turns = if orders_alone { ORDER_TURNS } else { TURNS };
        let measuring = Measuring {
            lattice,
            failed: models.failed(),
            before: &self.older,
            image_rung: self.image_rung,
            turn: [turns, self.count % turns],
            orders_alone,
        };
        self.trust.clear();
        match predictions {
            Some(predictions) => {
                if !orders_alone {
                    let older = predictions.key;
                    self.trust.update(pool, key, lattice, older, self.count);
                }
                let (traces, samples) = (&mut self.traces, &mut self.samples);
                let sums = measuring.measure(pool, predictions, is_still, traces, samples);
                self.order.take_in(&sums.camera);
                self.mover_order.take_in(&sums.movers);
            }
            None => measuring.begin(pool, &mut self.samples),
        }
        if !orders_alone {
            self.choose_rungs(pool, models);
        }
    }

    /// Gives every sample its rung.
    fn choose_rungs(&mut self, pool: &ThreadPool, models: &Models) {
        let Self { samples, leads, whole, shared, taken, trust, image_rung, .. } = self;
        *image_rung = choose::choose(pool, *image_rung, samples, leads);
        // The next key's history.
        for (sample, lead) in samples.data_mut().iter_mut().zip(leads.data()) {
            sample.lead = *lead;
        }
        if trust.is_cut() {
            leads.data_mut().fill(Lead::by(Rung::Hold));
        } else if trust.doubts() {
            for row in 0..leads.height() {
                for (column, lead) in (0..).zip(leads.row_mut(row)) {
                    let is_by_flow =
                        lead.rung == Rung::Flow && models.flow_of(column, row).is_some();
                    if !trust.of(column, row) && !is_by_flow {
                        *lead = Lead::by(Rung::Hold);
                    }
                }
            }
        }
        *taken = choose::share(pool, leads, whole, shared);
    }

    /// Nothing moves in the newest key, which says nothing of how things move: it is held, and all
    /// that is known stays. Returns false where nothing is known of a field with these `points`.
    pub fn rest(&mut self, points: [u32; 2]) -> bool {
        if [self.samples.width(), self.samples.height()] != points {
            return false;
        }
        self.trust.clear();
        self.is_at_rest = true;
        self.leads.data_mut().fill(Lead::by(Rung::Hold));
        self.shared.data_mut().fill(index_of(Rung::Hold) as u8);
        self.taken = bit_of(Rung::Hold);
        true
    }

    /// Whether nothing moves in the newest key. What [`Evidence::samples`] says is then of the last
    /// key in which something did.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.is_at_rest
    }

    /// Whether luma has shown that the newest key is a cut that nobody declared.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.trust.is_cut()
    }

    /// Forgets everything: the scene is another.
    pub fn cut(&mut self) {
        let kept = std::mem::take(self);
        let Self { samples, older, traces, leads, whole, shared, .. } = kept;
        *self = Self { samples, older, traces, leads, whole, shared, ..Self::default() };
        for plane in [&mut self.samples, &mut self.older] {
            plane.data_mut().fill(Sample::default());
        }
        self.leads.data_mut().fill(Lead::by(self.image_rung));
        self.shared.data_mut().fill(index_of(self.image_rung) as u8);
        self.taken = bit_of(self.image_rung);
    }

    /// Whether the homography of the key to come is wanted: it is in use, or one of a few keys by
    /// which it is judged.
    #[must_use]
    pub fn asks_for_global(&self) -> bool {
        self.count.is_multiple_of(GLOBAL_KEYS) || self.takes(Rung::Global)
    }

    /// Whether some sample takes `rung`.
    #[must_use]
    pub fn takes(&self, rung: Rung) -> bool {
        self.taken & bit_of(rung) != 0
    }

    /// How the camera goes on best.
    #[must_use]
    pub fn order(&self) -> CameraOrder {
        CameraOrder::ALL[self.order.in_use()]
    }

    /// How what moves on its own goes on best, by all of it together.
    #[must_use]
    pub fn mover_order(&self) -> MoverOrder {
        MoverOrder::ALL[self.mover_order.in_use()]
    }

    /// The samples of the newest key.
    #[must_use]
    pub fn samples(&self) -> &Plane<Sample> {
        &self.samples
    }

    /// What leads the samples of the newest key on.
    #[must_use]
    pub fn leads(&self) -> &Plane<Lead> {
        &self.leads
    }

    /// The rung that the cells of a sample share, with those of all samples around it.
    #[must_use]
    #[inline(always)]
    pub fn shared_rung(&self, column: u32, row: u32) -> Option<Rung> {
        RUNGS.get(usize::from(self.shared.at(column, row))).copied()
    }

    /// The rung that all samples share, if they do.
    #[must_use]
    pub fn rung_of_all(&self) -> Option<Rung> {
        let (first, rest) = self.shared.data().split_first()?;
        let is_one = rest.iter().all(|shared| shared == first);
        RUNGS.get(usize::from(*first)).copied().filter(|_| is_one)
    }

    /// What leads a cell of depth key `depth` of the newest key on: that of the sample of its
    /// surface which is nearest to it among its own and those around, else [`unproven`] of the
    /// image's: a thing so thin that no sample lies on it goes by what the key says of it.
    #[must_use]
    #[inline(always)]
    pub fn lead_at(&self, x: u32, y: u32, depth: u32) -> Lead {
        let (column, row) = (x / STRIDE, y / STRIDE);
        let is_its = |column: u32, row: u32| {
            is_same_surface(self.samples.row(row)[column as usize].depth, depth)
        };
        if is_its(column, row) {
            return self.leads.at(column, row);
        }
        let last = [self.samples.width() - 1, self.samples.height() - 1];
        let rows = row.saturating_sub(1)..=(row + 1).min(last[1]);
        let mut around = rows.flat_map(|row| {
            let columns = column.saturating_sub(1)..=(column + 1).min(last[0]);
            columns.map(move |column| (column, row))
        });
        let found = around.find(|(column, row)| is_its(*column, *row));
        let trusted = || self.trust.of(column, row) && !self.trust.is_cut();
        match found {
            Some((column, row)) => self.leads.at(column, row),
            None if trusted() => Lead::by(unproven(self.image_rung)),
            None => Lead::by(Rung::Hold),
        }
    }
}
