//! Depth planes to depth keys: `u32`, larger is nearer, proportional to 1 / distance.
//!
//! A key is the near distance over the distance, as a fraction of 2^32 - 1. Then one part in 256
//! of a key is one part in 256 of the distance at any distance, which is what the tolerance of the
//! scatter means. With a perspective camera the near distance is the projection's; without one a
//! depth buffer is taken as that of a far plane at infinity, and a linear depth as if the near
//! plane were [`LINEAR_NEAR`] away. Nearer than the near plane saturates. NaN counts as far.
//!
//! Computed in f64: `1 - d` of a far point keeps too few bits in f32.

use super::camera::ProjectionDepth;
use crate::format::{DepthConvention, DepthFormat, DepthMeaning};

/// Near distance that linear depth is measured by where no camera tells one, world units. A key
/// of a point 2^20 units away still has 12 bits.
const LINEAR_NEAR: f64 = 1.0 / 16.0;

/// Turns stored depth into keys.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum DepthToKey {
    /// key = scale * stored + offset, as a fraction.
    Buffer { scale: f64, offset: f64 },
    /// key = near / stored, as a fraction.
    Linear { near: f64 },
}

impl DepthToKey {
    /// The conversion for what a stream declared and, if there is one, the projection says; and
    /// the meaning that the projection contradicts the declaration with.
    pub(super) fn new(
        declared: DepthMeaning,
        projection: Option<ProjectionDepth>,
    ) -> (Self, Option<DepthMeaning>) {
        match (declared, projection) {
            (DepthMeaning::LinearView, None) => (Self::Linear { near: LINEAR_NEAR }, None),
            // Half the near distance: a projection with clip z from -w to w, which linear depth
            // does not depend on, reads as one whose near plane is twice as far.
            (DepthMeaning::LinearView, Some(projection)) => {
                (Self::Linear { near: 0.5 / projection.inverse_near() }, None)
            }
            (DepthMeaning::Standard, None) => (Self::Buffer { scale: -1.0, offset: 1.0 }, None),
            (DepthMeaning::Reversed, None) => (Self::Buffer { scale: 1.0, offset: 0.0 }, None),
            (_, Some(projection)) => {
                let scale = 1.0 / (projection.b * projection.inverse_near());
                let conversion = Self::Buffer { scale, offset: -projection.a * scale };
                let contradicts = projection.meaning != declared;
                (conversion, contradicts.then_some(projection.meaning))
            }
        }
    }

    /// 1 / distance along the view axis of a key of 1; None for a buffer whose projection is not
    /// known.
    #[expect(clippy::cast_possible_truncation, reason = "24 bits of distance are enough")]
    pub(super) fn inverse_distance_per_key(
        self,
        projection: Option<ProjectionDepth>,
    ) -> Option<f32> {
        let of_nearest = match self {
            Self::Linear { near } => Some(1.0 / near),
            Self::Buffer { .. } => projection.map(|projection| projection.inverse_near()),
        };
        of_nearest.map(|inverse| (inverse / f64::from(u32::MAX)) as f32)
    }

    /// Writes the keys of stored values.
    #[inline(always)]
    pub(super) fn write_keys(self, stored: impl Iterator<Item = f64>, keys: &mut [u32]) {
        // A loop for each: one that chooses at every value is not made for wide registers.
        match self {
            Self::Buffer { scale, offset } => {
                for (key, stored) in keys.iter_mut().zip(stored) {
                    *key = of_fraction(scale * stored + offset);
                }
            }
            Self::Linear { near } => {
                for (key, stored) in keys.iter_mut().zip(stored) {
                    // A distance of 0 or behind the eye is as near as can be.
                    *key = of_fraction(near / stored.max(0.0) + stored * 0.0);
                }
            }
        }
    }
}

#[inline(always)]
fn of_fraction(fraction: f64) -> u32 {
    whole(fraction * f64::from(u32::MAX))
}

/// `value as u32`: rounded down, saturating, NaN is 0. Unlike the cast, AVX2 does it to several
/// at once: adding 2^52 moves a whole number into the low bits of the mantissa.
#[inline(always)]
fn whole(value: f64) -> u32 {
    const TWO_TO_52: f64 = 4_503_599_627_370_496.0;
    let saturated = value.max(0.0).min(f64::from(u32::MAX)).floor();
    ((saturated + TWO_TO_52).to_bits() & u64::from(u32::MAX)) as u32
}

/// Reads one stored value; integers are normalised to 0..1.
#[inline(always)]
pub(super) fn stored_depth(format: DepthFormat, row: &[u8], x: usize) -> f64 {
    match format {
        DepthFormat::F32 => f64::from(f32::from_le_bytes(bytes(row, x))),
        DepthFormat::F16 => half::f16::from_le_bytes(bytes(row, x)).to_f64(),
        DepthFormat::U16 => f64::from(u16::from_le_bytes(bytes(row, x))) / 65535.0,
        DepthFormat::U24 => {
            f64::from(u32::from_le_bytes(bytes(row, x)) & 0x00ff_ffff) / 16_777_215.0
        }
    }
}

/// Clip z / w of a stored value, for [`super::camera::CameraMotion::displacement`].
#[expect(clippy::cast_possible_truncation, reason = "0 to 1 needs no more than an f32")]
pub(super) fn clip_depth(
    convention: DepthConvention,
    projection: Option<ProjectionDepth>,
    stored: f64,
) -> f32 {
    let depth = match (convention.meaning, projection) {
        (DepthMeaning::LinearView, Some(projection)) => projection.a + projection.b / stored,
        _ => stored,
    };
    depth as f32
}

#[inline(always)]
fn bytes<const N: usize>(row: &[u8], x: usize) -> [u8; N] {
    row.as_chunks::<N>().0[x]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whole_numbers_are_those_of_the_cast(value: f64, small in -10.0..5e9_f64) {
            prop_assert_eq!(whole(value), value as u32);
            prop_assert_eq!(whole(small), small as u32);
        }
    }

    #[test]
    fn no_number_is_nothing_and_too_large_ones_are_the_largest() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 4_294_967_295.5, 0.999] {
            assert_eq!(whole(value), value as u32, "{value}");
        }
    }
}
