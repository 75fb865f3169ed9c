//! Instants and spans of `CLOCK_MONOTONIC`, in nanoseconds.
//!
//! The only place that does arithmetic on raw nanoseconds; everything else uses these types, so a
//! time cannot be mistaken for a duration, a count or another clock.

use std::fmt;
use std::ops::{Add, AddAssign, Neg, Sub, SubAssign};

/// An instant of the monotonic clock, nanoseconds since its epoch. Range: 0 to 292 years.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct MonoTime(i64);

/// A signed duration in nanoseconds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct MonoSpan(i64);

impl MonoTime {
    /// The epoch of the clock.
    pub const ZERO: Self = Self(0);
    /// Later than every instant that can be reached.
    pub const FAR_FUTURE: Self = Self(i64::MAX);

    /// From nanoseconds as they stand in a message. Values beyond 292 years saturate.
    #[must_use]
    pub fn from_ns(ns: u64) -> Self {
        Self(i64::try_from(ns).unwrap_or(i64::MAX))
    }

    /// Nanoseconds since the epoch, for a message or a report.
    #[must_use]
    pub fn as_ns(self) -> u64 {
        self.0.max(0).unsigned_abs()
    }

    /// `self - earlier`, negative when `earlier` is later. Saturates.
    #[must_use]
    pub fn since(self, earlier: Self) -> MonoSpan {
        MonoSpan(self.0.saturating_sub(earlier.0))
    }
}

impl MonoSpan {
    /// No time at all.
    pub const ZERO: Self = Self(0);
    /// Longer than every span that can be reached.
    pub const MAX: Self = Self(i64::MAX);

    /// From signed nanoseconds.
    #[must_use]
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// From whole microseconds.
    #[must_use]
    pub const fn from_us(us: i64) -> Self {
        Self(us * 1_000)
    }

    /// From whole milliseconds.
    #[must_use]
    pub const fn from_ms(ms: i64) -> Self {
        Self(ms * 1_000_000)
    }

    /// From seconds, rounded to the nearest nanosecond; NaN becomes zero, the rest saturates.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "float to int casts saturate")]
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self((seconds * 1e9).round() as i64)
    }

    /// The period of `hz`, to the nearest nanosecond.
    #[must_use]
    pub fn from_hz(hz: f64) -> Self {
        Self::from_secs_f64(1.0 / hz)
    }

    /// Signed nanoseconds.
    #[must_use]
    pub const fn as_ns(self) -> i64 {
        self.0
    }

    /// Seconds.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a report needs no more than 53 bits")]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / 1e9
    }

    /// Milliseconds.
    #[must_use]
    pub fn as_ms_f64(self) -> f64 {
        self.as_secs_f64() * 1e3
    }

    /// `self * numerator / denominator` in 128 bits, rounded towards minus infinity.
    /// `denominator` must not be 0.
    #[must_use]
    pub fn scale(self, numerator: i64, denominator: i64) -> Self {
        let wide = i128::from(self.0) * i128::from(numerator);
        let quotient = wide.div_euclid(i128::from(denominator));
        Self(i64::try_from(quotient).unwrap_or(if quotient < 0 { i64::MIN } else { i64::MAX }))
    }
}

impl Add<MonoSpan> for MonoTime {
    type Output = Self;
    fn add(self, span: MonoSpan) -> Self {
        Self(self.0.saturating_add(span.0))
    }
}

impl Sub<MonoSpan> for MonoTime {
    type Output = Self;
    fn sub(self, span: MonoSpan) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}

impl Sub for MonoTime {
    type Output = MonoSpan;
    fn sub(self, earlier: Self) -> MonoSpan {
        self.since(earlier)
    }
}

impl AddAssign<MonoSpan> for MonoTime {
    fn add_assign(&mut self, span: MonoSpan) {
        *self = *self + span;
    }
}

impl Add for MonoSpan {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for MonoSpan {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl AddAssign for MonoSpan {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for MonoSpan {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Neg for MonoSpan {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl fmt::Debug for MonoTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ns", self.0)
    }
}

impl fmt::Debug for MonoSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ns", self.0)
    }
}

impl fmt::Display for MonoSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} ms", self.as_ms_f64())
    }
}
