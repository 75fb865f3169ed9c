//! What the metrics compare: 8-bit sRGB-encoded pictures without alpha.
//!
//! Every colour format ends here through the converter of the image sinks, so that a score is of
//! the very pixels that a written image shows: `rgba8` sRGB keeps its bytes; linear light, halves
//! and PQ are clipped at white and encoded.

use foreframe_engine::{ColorPlane, Plane};
use foreframed::sink::srgb::SrgbConverter;

/// An 8-bit sRGB-encoded picture: red, green, blue.
pub type Srgb8 = Plane<[u8; 3]>;

/// Converts a colour plane of the stream that `converter` was made for.
#[must_use]
pub fn to_srgb8(color: &ColorPlane, converter: &SrgbConverter) -> Srgb8 {
    let mut bytes = Vec::new();
    converter.convert(color, &mut bytes);
    let (pixels, _) = bytes.as_chunks::<3>();
    Plane::from_vec(color.width(), color.height(), pixels.to_vec())
}

#[cfg(test)]
mod tests {
    use foreframe_engine::StreamFormat;
    use foreframe_engine::color::{ColorFormat, OrderedRgba16, Rgba8, half_to_ordered};
    use foreframe_engine::format::Transfer;
    use half::f16;

    use super::*;

    #[test]
    fn srgb_bytes_stay_as_they_are_row_by_row_and_alpha_is_dropped() {
        let texels = (0..6_u8).map(|i| Rgba8(u32::from_le_bytes([i, 100 + i, 200 + i, i ^ 0x55])));
        let plane = ColorPlane::Rgba8(Plane::from_vec(3, 2, texels.collect()));
        let picture = to_srgb8(&plane, &SrgbConverter::new(&StreamFormat::rgba8(3, 2)));
        assert_eq!((picture.width(), picture.height()), (3, 2));
        assert_eq!(picture.at(1, 1), [4, 104, 204]);
    }

    #[test]
    fn linear_light_is_clipped_at_white_and_encoded() {
        let format = StreamFormat {
            color: ColorFormat::Rgba16f,
            transfer: Transfer::Linear,
            ..StreamFormat::rgba8(1, 1)
        };
        let half = |value: f32| half_to_ordered(f16::from_f32(value).to_bits());
        let texel = OrderedRgba16([half(7.0), half(0.5), half(-1.0), half(1.0)]);
        let plane = ColorPlane::Rgba16f(Plane::from_vec(1, 1, vec![texel]));
        let picture = to_srgb8(&plane, &SrgbConverter::new(&format));
        assert_eq!(picture.at(0, 0), [255, 188, 0], "half of the light is level 188");
    }
}
