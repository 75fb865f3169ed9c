//! Eight floats that a wide register holds, for sums over a neighbourhood of eight places at once.
//!
//! Plain Rust: every operation is that of one `f32`, eight times, so that the result is the same
//! on every processor. Inside [`crate::simd::widest`] the compiler makes one instruction of each.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number of lanes.
pub(crate) const LANES: usize = 8;

/// Eight floats.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[repr(align(32))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

/// What `part` gives for either axis. Unlike `map` of an array it is a part of its caller, which
/// may be compiled for wider registers.
#[inline(always)]
pub(crate) fn both<T>(part: impl Fn(usize) -> T) -> [T; 2] {
    [part(0), part(1)]
}

/// A condition per lane.
pub(crate) type Mask = [bool; LANES];

impl Lanes {
    #[inline(always)]
    pub(crate) fn all(value: f32) -> Self {
        Self([value; LANES])
    }

    /// The floats with these bits.
    #[inline(always)]
    pub(crate) fn from_bits(bits: &[u32; LANES]) -> Self {
        let mut lanes = Self::default();
        for (lane, bits) in lanes.0.iter_mut().zip(bits) {
            *lane = f32::from_bits(*bits);
        }
        lanes
    }

    #[inline(always)]
    pub(crate) fn abs(mut self) -> Self {
        for lane in &mut self.0 {
            *lane = lane.abs();
        }
        self
    }

    #[inline(always)]
    pub(crate) fn max(mut self, other: Self) -> Self {
        for (lane, other) in self.0.iter_mut().zip(other.0) {
            *lane = if *lane > other { *lane } else { other };
        }
        self
    }

    /// These where `mask` holds, else `other`.
    #[inline(always)]
    pub(crate) fn or(mut self, mask: &Mask, other: Self) -> Self {
        for ((lane, other), mask) in self.0.iter_mut().zip(other.0).zip(mask) {
            *lane = if *mask { *lane } else { other };
        }
        self
    }

    #[inline(always)]
    pub(crate) fn is_below(self, other: Self) -> Mask {
        let mut mask = [false; LANES];
        for ((mask, lane), other) in mask.iter_mut().zip(self.0).zip(other.0) {
            *mask = lane < other;
        }
        mask
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $op:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for (lane, other) in self.0.iter_mut().zip(other.0) {
                    *lane $op other;
                }
                self
            }
        }
    };
}
operator!(Add, add, +=);
operator!(Sub, sub, -=);
operator!(Mul, mul, *=);
operator!(Div, div, /=);

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for lane in &mut self.0 {
            *lane = -*lane;
        }
        self
    }
}
