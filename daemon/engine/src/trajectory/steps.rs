//! Pixels as the fixed point of velocities and accelerations.

/// 1/32 pixels, rounded half away from zero; any number beyond [`super::dilate_motion::MAX_DISPLACEMENT_PX`]
/// and for NaN.
///
/// A cast would saturate, which compilers do one number at a time: adding 2^23 moves a whole number
/// into the low bits of the mantissa.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "at most 1023 * 32, which fits an i16")]
pub(super) fn steps(px: f32) -> i16 {
    const TWO_TO_23: f32 = 8_388_608.0;
    let scaled = px * 32.0;
    let magnitude = ((scaled.abs() + 0.5).floor() + TWO_TO_23).to_bits() as i16;
    if scaled < 0.0 { magnitude.wrapping_neg() } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn steps_are_those_of_a_cast(px in -1023.0..=1023.0_f32) {
            let magnitude = ((px * 32.0).abs() + 0.5) as i16;
            prop_assert_eq!(steps(px), if px < 0.0 { -magnitude } else { magnitude });
        }
    }

    #[test]
    fn halves_are_rounded_away_from_zero() {
        for (px, expected) in [(0.0, 0), (1.0 / 64.0, 1), (-1.0 / 64.0, -1), (3.0 / 64.0, 2)] {
            assert_eq!(steps(px), expected, "{px}");
        }
        assert_eq!((steps(1023.0), steps(-1023.0)), (32_736, -32_736));
    }
}
