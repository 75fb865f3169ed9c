//! (2) of [`super`] for one channel, by integers.
//!
//! A finite half is m 2^e with m below 2^11 and e from -24 to 5: in steps of 2^-24 it has at most
//! 40 bits, and its product with a weight in the same steps at most 64.

use crate::color::{half_to_ordered, ordered_to_half};

/// Bits of the largest finite half.
const LARGEST: u128 = 0x7bff;
const SIGN: u16 = 0x8000;
/// Bits of the fraction of a fixed-point number.
const FRACTION: u32 = 24;

/// Magnitude of a finite half in steps of 2^-24.
#[inline(always)]
fn magnitude(bits: u16) -> u64 {
    let (exponent, fraction) = (u32::from(bits >> 10 & 0x1f), u64::from(bits & 0x3ff));
    if exponent == 0 { fraction } else { (fraction | 0x400) << (exponent - 1) }
}

/// The half nearest to `value` steps of 2^-48, ties to even, the largest one beyond it.
#[inline(always)]
fn nearest(value: i128) -> u16 {
    let (sign, value) = (if value < 0 { SIGN } else { 0 }, value.unsigned_abs());
    // Bits below the 11 that are kept, or below the smallest half.
    let below = (128 - value.leading_zeros()).saturating_sub(11).max(FRACTION);
    let (kept, half, rest) = (value >> below, 1 << (below - 1), value & ((1 << below) - 1));
    let is_up = rest > half || (rest == half && kept & 1 == 1);
    // The leading bit, and a carry out of the fraction, count the exponent up by themselves.
    let bits = (u128::from(below - FRACTION) << 10) + kept + u128::from(is_up);
    sign | bits.min(LARGEST) as u16
}

/// What is left of the picture under an alpha, in 2^-24.
#[inline(always)]
pub(super) fn rest_under(alpha: u16) -> u64 {
    let alpha = ordered_to_half(alpha);
    let is_negative = alpha & SIGN != 0;
    let alpha = if is_negative { 0 } else { magnitude(alpha).min(1 << FRACTION) };
    (1 << FRACTION) - alpha
}

/// (2) of a channel, in the order of monotone integers; `rest` is [`rest_under`] its alpha.
#[inline(always)]
pub(super) fn over(ui: u16, picture: u16, rest: u64) -> u16 {
    match rest {
        0 => return ui,
        rest if rest == 1 << FRACTION => return picture,
        _ => {}
    }
    let weighed = |ordered: u16, weight: u64| {
        let bits = ordered_to_half(ordered);
        let product = i128::from(magnitude(bits) * weight);
        if bits & SIGN == 0 { product } else { -product }
    };
    half_to_ordered(nearest(weighed(ui, 1 << FRACTION) + weighed(picture, rest)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(bits: u16) -> f64 {
        half::f16::from_bits(bits).to_f64()
    }

    #[test]
    fn every_finite_half_is_itself() {
        for bits in (0..0x7c00).chain(0x8001..0xfc00) {
            let fixed = i128::from(magnitude(bits)) << FRACTION;
            assert_eq!(nearest(if bits & SIGN == 0 { fixed } else { -fixed }), bits);
            let found = magnitude(bits) as f64 / f64::from(1 << FRACTION);
            assert_eq!(found.to_bits(), value(bits).abs().to_bits());
        }
    }

    #[test]
    fn what_lies_between_goes_to_the_nearest_and_ties_go_to_even() {
        for step in [1_i64, 3, 2047, 2048, 2049, 2051, 4098, 4102, 123_457, 1 << 39] {
            // In quarters of the smallest half.
            for value in [step, -step] {
                let expected = half::f16::from_f64(value as f64 / f64::from(1 << (FRACTION + 2)));
                let found = nearest(i128::from(value) << (FRACTION - 2));
                assert_eq!(found, expected.to_bits(), "{value}");
            }
        }
        assert_eq!(nearest(1 << 66), 0x7bff, "and nothing becomes infinite");
    }

    #[test]
    fn it_is_the_sum_of_what_is_left_and_what_lies_over_it() {
        let halves = [0_u16, 1, 0x3ff, 0x1234, 0x3c00, 0x4321, 0x7bff, 0x8001, 0xb800, 0xfbff];
        for alpha in [0x2e66_u16, 0x3800, 0x3bff] {
            let rest = rest_under(half_to_ordered(alpha));
            for ui in halves {
                for picture in halves {
                    let exact = value(ui) + value(picture) * (1.0 - value(alpha));
                    let found = over(half_to_ordered(ui), half_to_ordered(picture), rest);
                    let found = value(ordered_to_half(found));
                    let step = (exact.abs() / 1024.0).max(1.0 / f64::from(1 << FRACTION));
                    let error = (found - exact.clamp(-65504.0, 65504.0)).abs();
                    assert!(error <= step * 0.5001, "{ui:x} {picture:x} {alpha:x}");
                }
            }
        }
    }
}
