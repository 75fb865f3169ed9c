//! What the metrics compare: 8-bit sRGB-encoded pictures without alpha.
//!
//! Every colour format ends here, once. `rgba8` and `rgb10a2` in sRGB keep their encoded values;
//! linear light, halves and PQ are clipped at white and encoded. Chromaticities are left as the
//! stream has them: output and truth share them.

use foreframe_engine::color::{OrderedRgba16, ordered_to_half};
use foreframe_engine::format::{StreamFormat, Transfer};
use foreframe_engine::{ColorPlane, Plane};
use half::f16;

/// An 8-bit sRGB-encoded picture: red, green, blue.
pub type Srgb8 = Plane<[u8; 3]>;

/// Diffuse white of PQ content that does not state its own, in cd/m2 (ITU-R BT.2408).
const DEFAULT_WHITE_CD_M2: f32 = 203.0;

/// Converts a colour plane of a stream of this format.
///
/// White is 1 in linear light; in PQ it is `white_cd_m2`, or 203 cd/m2 where that is not stated.
/// NaN counts as black.
#[must_use]
pub fn to_srgb8(color: &ColorPlane, format: &StreamFormat) -> Srgb8 {
    let (width, height) = (color.width(), color.height());
    let encode = |value: f32| encode_channel(value, format);
    let pixels = match color {
        ColorPlane::Rgba8(plane) => {
            let table: [u8; 256] = std::array::from_fn(|v| encode(v as f32 / 255.0));
            let pixel = |word: u32| word.to_le_bytes().map(|v| table[usize::from(v)]);
            plane.data().iter().map(|texel| first_three(pixel(texel.0))).collect()
        }
        ColorPlane::Rgb10a2(plane) => {
            let table: Vec<u8> = (0..1024_u16).map(|v| encode(f32::from(v) / 1023.0)).collect();
            let pixel = |word: u32| [0, 10, 20].map(|s| table[(word >> s & 0x3ff) as usize]);
            plane.data().iter().map(|texel| pixel(texel.0)).collect()
        }
        ColorPlane::Rgba16f(plane) => {
            let channel = |v: u16| encode(f16::from_bits(ordered_to_half(v)).to_f32());
            let pixel = |texel: &OrderedRgba16| first_three(texel.0).map(channel);
            plane.data().iter().map(pixel).collect()
        }
    };
    Plane::from_vec(width, height, pixels)
}

fn first_three<T: Copy>([red, green, blue, _]: [T; 4]) -> [T; 3] {
    [red, green, blue]
}

/// One channel of the stream to an 8-bit sRGB-encoded level, rounded to the nearest.
fn encode_channel(value: f32, format: &StreamFormat) -> u8 {
    let encoded = match format.transfer {
        Transfer::Srgb => value,
        Transfer::Linear => srgb_encode(value.clamp(0.0, 1.0)),
        Transfer::Pq => {
            let stated = format.white_cd_m2;
            let white = if stated > 0.0 { stated } else { DEFAULT_WHITE_CD_M2 };
            srgb_encode((pq_to_cd_m2(value) / white).clamp(0.0, 1.0))
        }
    };
    // A float to integer cast saturates and takes NaN to 0.
    (encoded * 255.0).round() as u8
}

/// Encodes linear light 0..1 (IEC 61966-2-1).
#[must_use]
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes sRGB 0..1 to linear light (IEC 61966-2-1).
#[must_use]
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Luminance of a PQ value 0..1 (SMPTE ST 2084).
fn pq_to_cd_m2(encoded: f32) -> f32 {
    const M1: f32 = 2610.0 / 16384.0;
    const M2: f32 = 2523.0 / 4096.0 * 128.0;
    const C1: f32 = 3424.0 / 4096.0;
    const C2: f32 = 2413.0 / 4096.0 * 32.0;
    const C3: f32 = 2392.0 / 4096.0 * 32.0;
    let root = encoded.clamp(0.0, 1.0).powf(1.0 / M2);
    10_000.0 * ((root - C1).max(0.0) / (C2 - C3 * root)).powf(1.0 / M1)
}

#[cfg(test)]
mod tests {
    use foreframe_engine::color::{ColorFormat, Rgb10a2, Rgba8, half_to_ordered};

    use super::*;

    fn format(color: ColorFormat, transfer: Transfer, white_cd_m2: f32) -> StreamFormat {
        StreamFormat { color, transfer, white_cd_m2, ..StreamFormat::rgba8(1, 1) }
    }

    fn half_pixel(channels: [f32; 3]) -> ColorPlane {
        let [r, g, b] = channels.map(|v| half_to_ordered(f16::from_f32(v).to_bits()));
        ColorPlane::Rgba16f(Plane::from_vec(1, 1, vec![OrderedRgba16([r, g, b, 0])]))
    }

    #[test]
    fn srgb_bytes_stay_as_they_are_and_alpha_is_dropped() {
        for level in 0..=255_u8 {
            let word = u32::from_le_bytes([level, 255 - level, 7, level ^ 0x55]);
            let plane = ColorPlane::Rgba8(Plane::from_vec(1, 1, vec![Rgba8(word)]));
            let picture = to_srgb8(&plane, &StreamFormat::rgba8(1, 1));
            assert_eq!(picture.at(0, 0), [level, 255 - level, 7]);
        }
    }

    #[test]
    fn every_srgb_level_survives_the_way_through_linear_halves() {
        let linear = format(ColorFormat::Rgba16f, Transfer::Linear, 0.0);
        for level in 0..=255_u8 {
            let light = srgb_decode(f32::from(level) / 255.0);
            let picture = to_srgb8(&half_pixel([light; 3]), &linear);
            assert_eq!(picture.at(0, 0), [level; 3]);
        }
    }

    #[test]
    fn linear_light_is_clipped_to_black_and_white() {
        let linear = format(ColorFormat::Rgba16f, Transfer::Linear, 100.0);
        let picture = to_srgb8(&half_pixel([-0.5, 7.0, f32::NAN]), &linear);
        assert_eq!(picture.at(0, 0), [0, 255, 0]);
    }

    #[test]
    fn pq_is_clipped_at_the_white_that_the_stream_states() {
        // 100 cd/m2 is 0.508 in PQ, 520 of 1023.
        let word = 520 | 520 << 10 | 520 << 20;
        let plane = ColorPlane::Rgb10a2(Plane::from_vec(1, 1, vec![Rgb10a2(word)]));
        let of_white = |white| {
            let pq = format(ColorFormat::Rgb10a2, Transfer::Pq, white);
            to_srgb8(&plane, &pq).at(0, 0)[1]
        };
        assert_eq!(of_white(99.0), 255);
        let half_light = of_white(200.0);
        assert!((187..=189).contains(&half_light), "half of white is level 188: {half_light}");
        assert!(of_white(0.0) < half_light, "without a statement white is 203 cd/m2");
    }

    #[test]
    fn ten_bits_round_to_the_nearest_of_eight() {
        let word = 1023 | 2 << 10 | 512 << 20;
        let plane = ColorPlane::Rgb10a2(Plane::from_vec(1, 1, vec![Rgb10a2(word)]));
        let srgb = format(ColorFormat::Rgb10a2, Transfer::Srgb, 0.0);
        assert_eq!(to_srgb8(&plane, &srgb).at(0, 0), [255, 0, 128]);
    }
}
