//! Phase: the position of an in-between frame after its key, as a Q12 fixed-point number.

use crate::time::{MonoSpan, MonoTime};

/// (content time - newest key's) / (newest key's - its `motion_from`).
/// 0 at the newest key, 1 one motion span later. Q12, range 0 to 4 inclusive.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Debug)]
pub struct Phase(u16);

impl Phase {
    /// At the newest key.
    pub const ZERO: Self = Self(0);
    /// One motion span after it.
    pub const ONE: Self = Self(1 << Self::FRACTION_BITS);
    /// The farthest that the fixed point of the warp kernels allows.
    pub const MAX: Self = Self(4 << Self::FRACTION_BITS);
    /// Fraction bits of the fixed point.
    pub const FRACTION_BITS: u32 = 12;

    /// The phase of `content_time` after a key at `key_time` whose motion spans `motion_span`,
    /// rounded to the nearest step and clamped to the range. Zero for an empty span.
    #[must_use]
    pub fn at(content_time: MonoTime, key_time: MonoTime, motion_span: MonoSpan) -> Self {
        if motion_span <= MonoSpan::ZERO || content_time <= key_time {
            return Self::ZERO;
        }
        let span = i128::from(motion_span.as_ns());
        let after = i128::from((content_time - key_time).as_ns());
        let steps = ((after << Self::FRACTION_BITS) + span / 2) / span;
        Self(u16::try_from(steps).unwrap_or(u16::MAX).min(Self::MAX.0))
    }

    /// From a real number, rounded and clamped to the range; NaN becomes zero.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "clamped to 0..=4 before the cast")]
    #[expect(clippy::cast_sign_loss, reason = "clamped to 0..=4 before the cast")]
    pub fn from_f64(phase: f64) -> Self {
        let scale = f64::from(Self::ONE.0);
        Self((phase.clamp(0.0, 4.0) * scale).round() as u16)
    }

    /// From a Q12 integer, clamped to the range.
    #[must_use]
    #[expect(clippy::cast_sign_loss, reason = "clamped to 0..=16384 before the cast")]
    pub(crate) fn from_q12(q12: i32) -> Self {
        Self(q12.clamp(0, i32::from(Self::MAX.0)) as u16)
    }

    /// As a real number, exactly.
    #[must_use]
    pub fn as_f64(self) -> f64 {
        f64::from(self.0) / f64::from(Self::ONE.0)
    }

    /// The Q12 integer that the kernels use, 0 to 16384.
    #[must_use]
    pub fn q12(self) -> i32 {
        i32::from(self.0)
    }
}
