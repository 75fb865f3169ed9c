//! How good motion looks: quality differences in JND between two ways to show it.
//!
//! Denes 2020, chapter 8. [`blur`] says how wide a thin line becomes on the retina and what energy
//! is left of it, [`judder`] how visible the copies of its spectrum are, [`quality_difference`]
//! weighs both, and [`schedule`] chooses refresh rate and resolution for a budget of pixels.
//!
//! The model knows no content: it stands for a line of one pixel across the motion, the worst case.
//! It was fitted from 50 to 165 Hz at 15 to 45 deg/s on an LCD of about 100 cd/m2.

pub mod blur;
pub mod judder;
pub mod schedule;

/// Weight of blur along the motion, JND per unit of energy (Denes 2020, table 8.4).
pub const WEIGHT_PARALLEL: f64 = 1.472_819;
/// Weight of blur across the motion (table 8.4).
pub const WEIGHT_ORTHOGONAL: f64 = 1.472_819;
/// Weight of judder (table 8.4).
pub const WEIGHT_JUDDER: f64 = 2.218_677;

/// Whether the eye can know where the object goes next.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Motion {
    /// Sinusoids, steady pans, what the viewer controls.
    Predictable,
    /// Random paths.
    Unpredictable,
}

/// How motion is shown.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shown {
    /// Frames per second, all different.
    pub refresh_hz: f64,
    /// Resolution that was rendered, pixels per degree.
    pub ppd: f64,
    /// Share of a frame during which it is lit, above 0 up to 1.
    pub persistence: f64,
}

/// What a quality difference is made of, JND each, signs as in the sum.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct QualityDifference {
    /// From blur along the motion.
    pub parallel: f64,
    /// From blur across the motion.
    pub orthogonal: f64,
    /// From judder.
    pub judder: f64,
}

impl QualityDifference {
    /// The whole, JND: at +1, three viewers of four prefer the first.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.parallel + self.orthogonal + self.judder
    }
}

/// By how much `this` looks better than `that`, for an object at `velocity` deg/s that the eye
/// follows (Denes 2020, equation 8.3).
///
/// Judder enters with a minus sign, unlike in the printed equation: its energy lowers quality, as
/// blur energy (what is left of the contrast) raises it. Only so does quality rise with the
/// refresh rate. Domain: rates, resolutions and persistence above 0, velocity 0 and up.
#[must_use]
pub fn quality_difference(
    this: Shown,
    that: Shown,
    velocity: f64,
    motion: Motion,
) -> QualityDifference {
    let [ours, theirs] = [this, that].map(|shown| parts(shown, velocity, motion));
    QualityDifference {
        parallel: ours.parallel - theirs.parallel,
        orthogonal: ours.orthogonal - theirs.orthogonal,
        judder: ours.judder - theirs.judder,
    }
}

/// Quality against nothing to see at all. Only differences mean something.
fn parts(shown: Shown, velocity: f64, motion: Motion) -> QualityDifference {
    let along = blur::energy(blur::parallel_sigma(shown, velocity, motion));
    let across = blur::energy(blur::resolution_sigma(shown.ppd));
    let judder = judder::energy(shown.refresh_hz, velocity, motion);
    QualityDifference {
        parallel: WEIGHT_PARALLEL * along,
        orthogonal: WEIGHT_ORTHOGONAL * across,
        judder: -WEIGHT_JUDDER * judder,
    }
}

#[cfg(test)]
mod tests;
