//! The sRGB curve between half floats of linear light and 8-bit levels, both ways by table.
//!
//! Built with `libm`, so every machine has the same tables. Each of the 256 levels survives the way
//! to a half and back: the steps between levels are everywhere wider than those between halves.

use std::sync::LazyLock;

use half::f16;

/// IEC 61966-2-1: encoded value of a linear one, 0 to 1.
fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    }
}

/// Inverse of [`encode`].
fn decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

#[expect(clippy::cast_possible_truncation, reason = "clamped to 0..=255 before the cast")]
#[expect(clippy::cast_sign_loss, reason = "clamped to 0..=255 before the cast")]
fn level(encoded: f64) -> u8 {
    // NaN becomes 0, as every float to integer cast does.
    (encoded * 255.0).clamp(0.0, 255.0).round() as u8
}

static LEVEL_OF_HALF: LazyLock<Vec<u8>> = LazyLock::new(|| {
    (0..=u16::MAX).map(|bits| level(encode(f16::from_bits(bits).to_f64()))).collect()
});
static HALF_OF_LEVEL: LazyLock<[f16; 256]> =
    LazyLock::new(|| std::array::from_fn(|level| f16::from_f64(decode(level as f64 / 255.0))));

/// The nearest of the 256 encoded levels. NaN and what is below 0 become 0, above 1 is 255.
#[must_use]
pub fn level_from_linear(linear: f16) -> u8 {
    LEVEL_OF_HALF[usize::from(linear.to_bits())]
}

/// Linear light of an encoded level.
#[must_use]
pub fn linear_from_level(level: u8) -> f16 {
    HALF_OF_LEVEL[usize::from(level)]
}

/// The nearest of the 256 levels of a value that is not encoded, as alpha.
#[must_use]
pub fn level_from_unit(unit: f16) -> u8 {
    level(unit.to_f64())
}

/// The value, 0 to 1, of a level that is not encoded.
#[must_use]
pub fn unit_from_level(level: u8) -> f16 {
    f16::from_f64(f64::from(level) / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_survives_the_way_to_a_half_and_back() {
        for level in 0..=255 {
            assert_eq!(level_from_linear(linear_from_level(level)), level);
            assert_eq!(level_from_unit(unit_from_level(level)), level);
        }
    }

    #[test]
    fn known_values_of_the_curve() {
        // Middle grey of 18 % is level 118 (117.6), and the linear part ends near level 10.
        assert_eq!(level_from_linear(f16::from_f32(0.18)), 118);
        assert_eq!(level_from_linear(f16::from_f32(0.003)), 10);
        assert_eq!(level_from_linear(f16::from_f32(0.5)), 188);
    }

    #[test]
    fn what_is_out_of_range_is_clamped() {
        for (value, expected) in
            [(f16::NAN, 0), (f16::NEG_INFINITY, 0), (f16::from_f32(-1.0), 0), (f16::INFINITY, 255)]
        {
            assert_eq!(level_from_linear(value), expected, "{value}");
        }
    }
}
