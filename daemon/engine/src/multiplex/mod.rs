//! Temporal resolution multiplexing: full and reduced keys in turn, seen as full ones.
//!
//! Denes 2020, *Perceptual models for high-refresh-rate rendering*, section 5.2. An application
//! that cannot render every picture in full renders every second one small. The eye adds up two
//! pictures in a row where they follow each other fast enough, so that what the reduced one lacks
//! can be in the full one twice. With `D` the way down to the reduced size, `U` the way up again
//! ([`lowpass`]) and `l` the light that the display makes of a level:
//!
//! ```text
//! (1) alpha = U i                                        i a reduced key           (5.1)
//! (2) beta  = level of 2 l(I) - l(b), b = U D I          I a full key              (5.2)
//! (3) rho   = what the display cannot show of (2)                                  (5.2.2)
//! (4) alpha' = level of l(alpha) + w rho                                           (5.4)
//! (5) w     = exp(-(c / 0.46)^3), c = |l(b) - l(alpha)| / (l(b) + l(alpha))        (5.5, 5.6)
//! ```
//!
//! ([`compose`].) Where nothing moves `alpha` is `b`, and the light of both pictures is twice that
//! of `I` within half a level each, clipped or not. This happens once per key, before anything else
//! sees it: every method, backend and capture works on what is shown. What successive keys are
//! compared by (luma of [`crate::evidence`], flow, diagnosis) is the picture without the detail,
//! [`KeyFrame::steady`], or every edge would count as a change.
//!
//! A full key makes up for the next reduced one only where the one before it was reduced: the first
//! key of all, and one after a key that got lost, are shown as they are. So one lost key costs the
//! light of one difference, and the next pair is right again. A picture that stays, as in a menu,
//! would stay with its detail twice: an application that stops sends its last full key once more.
//!
//! Departures: `D` and the filter of reduced keys are ours ([`lowpass`]), so that the application
//! renders at the smaller size as it always does, and not through a wide filter of its own.
//! Exactness: `Exact`. There is one way through, on the CPU, whatever the backend.

mod compose;
mod lowpass;

use rayon::ThreadPool;

use crate::color::{ColorPlane, Texel};
use crate::finish::FinishConfig;
use crate::format::{StreamFormat, ValidRectUse};
use crate::key::KeyFrame;
use crate::plane::{Plane, Rect};
use compose::Light;
use lowpass::{Fraction, LowPass};

/// What multiplexing keeps of one stream.
#[derive(Debug)]
pub struct Multiplex {
    light: Light,
    lowpass: LowPass,
    turn: Turn,
    /// The last full key as it came, where [`Turn::MadeUp`] says so.
    original: ColorPlane,
}

/// What the newest key was.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Turn {
    /// Full, and shown as it is, or there is none.
    Plain,
    /// Full, and it makes up for a reduced one.
    MadeUp,
    /// Reduced, to columns and rows.
    Reduced([u32; 2]),
}

impl Multiplex {
    /// For a stream of `format`, shown by the display of `config`; None where it does not
    /// multiplex.
    #[must_use]
    pub fn new(format: &StreamFormat, config: &FinishConfig) -> Option<Self> {
        if format.valid_rect_use != ValidRectUse::Multiplex {
            return None;
        }
        Some(Self {
            light: Light::new(format, config)?,
            lowpass: LowPass::default(),
            turn: Turn::Plain,
            original: ColorPlane::default(),
        })
    }

    /// Makes of `key`, as it was decoded, what is shown. `reduced` is the plane as it came and the
    /// part of it that holds the picture, where that is smaller than the output; `older` is the key
    /// before.
    pub fn take_key(
        &mut self,
        pool: &ThreadPool,
        reduced: Option<(&ColorPlane, Rect)>,
        older: Option<&KeyFrame>,
        key: &mut KeyFrame,
    ) {
        if key.is_cut {
            self.turn = Turn::Plain;
        }
        self.turn = match (reduced, self.turn) {
            (Some((from, part)), turn) => {
                let older = older.filter(|_| turn == Turn::MadeUp);
                self.restore(pool, from, part, older, key);
                Turn::Reduced([part.width, part.height])
            }
            (None, Turn::Reduced(size)) => {
                self.make_up(pool, size, key);
                Turn::MadeUp
            }
            (None, Turn::Plain | Turn::MadeUp) => Turn::Plain,
        };
    }

    /// (1), and (4) where `older` is the full key before.
    fn restore(
        &mut self,
        pool: &ThreadPool,
        from: &ColorPlane,
        part: Rect,
        older: Option<&KeyFrame>,
        key: &mut KeyFrame,
    ) {
        let KeyFrame { color, steady, .. } = key;
        match (from, &mut *color) {
            (ColorPlane::Rgba8(from), ColorPlane::Rgba8(to)) => {
                self.lowpass.of_reduced(pool, from, part, to);
            }
            (ColorPlane::Rgb10a2(from), ColorPlane::Rgb10a2(to)) => {
                self.lowpass.of_reduced(pool, from, part, to);
            }
            (ColorPlane::Rgba16f(from), ColorPlane::Rgba16f(to)) => {
                self.lowpass.of_reduced(pool, from, part, to);
            }
            _ => unreachable!("both were reset to the stream's format"),
        }
        steady.copy_from(color);
        let Some(older) = older else { return };
        match (&self.original, &older.steady, color) {
            (ColorPlane::Rgba8(full), ColorPlane::Rgba8(low), ColorPlane::Rgba8(to)) => {
                self.light.add_rest(pool, [full, low], to);
            }
            (ColorPlane::Rgb10a2(full), ColorPlane::Rgb10a2(low), ColorPlane::Rgb10a2(to)) => {
                self.light.add_rest(pool, [full, low], to);
            }
            (ColorPlane::Rgba16f(full), ColorPlane::Rgba16f(low), ColorPlane::Rgba16f(to)) => {
                self.light.add_rest(pool, [full, low], to);
            }
            _ => unreachable!("keys of one stream have one format"),
        }
    }

    /// (2), for reduced keys of `size`.
    fn make_up(&mut self, pool: &ThreadPool, size: [u32; 2], key: &mut KeyFrame) {
        let format = key.color.format();
        let (width, height) = (key.color.width(), key.color.height());
        std::mem::swap(&mut self.original, &mut key.color);
        key.color.reset(format, width, height);
        key.steady.reset(format, width, height);
        let Self { light, lowpass, original, .. } = self;
        match (&*original, &mut key.steady, &mut key.color) {
            (ColorPlane::Rgba8(full), ColorPlane::Rgba8(low), ColorPlane::Rgba8(to)) => {
                make_up(pool, light, lowpass, size, (full, low, to));
            }
            (ColorPlane::Rgb10a2(full), ColorPlane::Rgb10a2(low), ColorPlane::Rgb10a2(to)) => {
                make_up(pool, light, lowpass, size, (full, low, to));
            }
            (ColorPlane::Rgba16f(full), ColorPlane::Rgba16f(low), ColorPlane::Rgba16f(to)) => {
                make_up(pool, light, lowpass, size, (full, low, to));
            }
            _ => unreachable!("all have just been given one format"),
        }
    }
}

fn make_up<T: Texel + Fraction>(
    pool: &ThreadPool,
    light: &Light,
    lowpass: &mut LowPass,
    size: [u32; 2],
    (full, low, to): (&Plane<T>, &mut Plane<T>, &mut Plane<T>),
) {
    lowpass.of_full(pool, full, size, low);
    light.make_up(pool, [full, low], to);
}

#[cfg(test)]
mod tests;
