//! Motion planes to displacements: newer minus older position, output pixels, x right, y down.

use super::error::DecodeError;
use crate::format::{MotionConvention, MotionDirection, MotionFormat, MotionUnit};

/// What a stored vector is multiplied with, per axis.
///
/// `image` is the size in output pixels of the part of the output that shows the image;
/// `valid` is the size in pixels of the colour plane's valid rectangle, which is the same unless
/// the rectangle is stretched.
pub(super) fn pixels_per_unit(
    convention: &MotionConvention,
    image: [f32; 2],
    valid: [f32; 2],
) -> Result<[f32; 2], DecodeError> {
    let scale = convention.scale;
    if !scale.iter().all(|factor| factor.is_finite() && factor.abs() > 0.0) {
        return Err(DecodeError::MotionScale { found: scale });
    }
    let unit = match convention.unit {
        MotionUnit::Pixels => [image[0] / valid[0], image[1] / valid[1]],
        MotionUnit::Uv => image,
        MotionUnit::Ndc => [image[0] * 0.5, image[1] * -0.5],
    };
    let sign = match convention.direction {
        MotionDirection::CurrentToPrevious => -1.0,
        MotionDirection::PreviousToCurrent => 1.0,
    };
    Ok([scale[0] * unit[0] * sign, scale[1] * unit[1] * sign])
}

/// Reads one stored vector.
#[inline(always)]
pub(super) fn stored_motion(format: MotionFormat, row: &[u8], x: usize) -> [f32; 2] {
    match format {
        MotionFormat::Rg16f => {
            let word = u32::from_le_bytes(row.as_chunks::<4>().0[x]);
            [f32_from_half(word & 0xffff), f32_from_half(word >> 16)]
        }
        MotionFormat::Rg32f => {
            let (channels, _) = row.as_chunks::<8>().0[x].as_chunks::<4>();
            [f32::from_le_bytes(channels[0]), f32::from_le_bytes(channels[1])]
        }
    }
}

/// The value of a half float; NaN for infinity too, as neither is a displacement.
///
/// Moving the exponent and mantissa into place and scaling by 2^112 corrects the exponent's bias
/// and makes subnormal halves normal, both exactly, without a branch.
#[inline(always)]
fn f32_from_half(bits: u32) -> f32 {
    let magnitude = f32::from_bits((bits & 0x7fff) << 13) * f32::from_bits((127 + 112) << 23);
    let poison = if bits & 0x7c00 == 0x7c00 { f32::NAN } else { 0.0 };
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    magnitude * sign + poison
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finite_half_reads_as_its_own_value_and_the_others_as_nan() {
        for bits in 0..=u16::MAX {
            let (ours, theirs) = (f32_from_half(u32::from(bits)), half::f16::from_bits(bits));
            if theirs.is_finite() {
                assert!((f64::from(ours) - theirs.to_f64()).abs() == 0.0, "{bits:#06x}");
            } else {
                assert!(ours.is_nan(), "{bits:#06x}");
            }
        }
    }
}
