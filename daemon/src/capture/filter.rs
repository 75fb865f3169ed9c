//! The shuffle-and-delta filter: makes planes easier to compress, without loss.
//!
//! A plane is a run of pixels of `channels` elements of `E::SIZE` bytes, little-endian. Forward:
//!
//! (1) d = x - x of the same channel one pixel earlier (0 before the first), wrapping;
//! (2) z = zigzag(d), so that small steps of either sign have small codes;
//! (3) byte b of z of channel c of pixel i goes to `out[(c * E::SIZE + b) * pixels + i]`.
//!
//! Smooth planes become long runs of near-zero bytes, one run per byte significance. Rows follow
//! each other without a restart: the step from one row's end to the next row's start costs little.
//! Any bit pattern survives, NaN payloads included, because elements are treated as integers.

/// An element of a pixel.
trait Element: Copy {
    const SIZE: usize;
    const ZERO: Self;
    fn read(bytes: &[u8]) -> Self;
    fn write(self, bytes: &mut [u8]);
    fn byte(self, index: usize) -> u8;
    fn from_byte(byte: u8, index: usize) -> Self;
    fn or(self, other: Self) -> Self;
    fn forward(self, before: Self) -> Self;
    fn inverse(self, before: Self) -> Self;
}

macro_rules! element {
    ($unsigned:ty) => {
        impl Element for $unsigned {
            const SIZE: usize = size_of::<Self>();
            const ZERO: Self = 0;
            #[inline]
            fn read(bytes: &[u8]) -> Self {
                Self::from_le_bytes(bytes.try_into().expect("the slice has the element's size"))
            }
            #[inline]
            fn write(self, bytes: &mut [u8]) {
                bytes.copy_from_slice(&self.to_le_bytes());
            }
            #[inline]
            fn byte(self, index: usize) -> u8 {
                self.to_le_bytes()[index]
            }
            #[inline]
            fn from_byte(byte: u8, index: usize) -> Self {
                Self::from(byte) << (8 * index)
            }
            #[inline]
            fn or(self, other: Self) -> Self {
                self | other
            }
            #[inline]
            fn forward(self, before: Self) -> Self {
                let step = self.wrapping_sub(before);
                let sign = (step.cast_signed() >> (Self::BITS - 1)).cast_unsigned();
                (step << 1) ^ sign
            }
            #[inline]
            fn inverse(self, before: Self) -> Self {
                let step = (self >> 1) ^ (self & 1).wrapping_neg();
                before.wrapping_add(step)
            }
        }
    };
}
element!(u8);
element!(u16);
element!(u32);

/// Pixels handled at once: small enough that the byte rows of one block stay in the first-level
/// cache, large enough that the loop overhead does not show. Any value gives the same bytes.
const BLOCK: usize = 512;

fn forward_channels<E: Element>(raw: &[u8], channels: usize, out: &mut [u8]) {
    let pixel_bytes = channels * E::SIZE;
    let pixels = raw.len() / pixel_bytes;
    for channel in 0..channels {
        let mut before = E::ZERO;
        let mut codes = [E::ZERO; BLOCK];
        for (block, pixel_run) in raw.chunks(BLOCK * pixel_bytes).enumerate() {
            let run = pixel_run.len() / pixel_bytes;
            for (code, pixel) in codes.iter_mut().zip(pixel_run.chunks_exact(pixel_bytes)) {
                let element = E::read(&pixel[channel * E::SIZE..][..E::SIZE]);
                *code = element.forward(before);
                before = element;
            }
            for byte in 0..E::SIZE {
                let start = (channel * E::SIZE + byte) * pixels + block * BLOCK;
                for (out, code) in out[start..][..run].iter_mut().zip(&codes) {
                    *out = code.byte(byte);
                }
            }
        }
    }
}

fn inverse_channels<E: Element>(filtered: &[u8], channels: usize, raw: &mut [u8]) {
    let pixel_bytes = channels * E::SIZE;
    let pixels = raw.len() / pixel_bytes;
    for channel in 0..channels {
        let mut before = E::ZERO;
        for (block, pixel_run) in raw.chunks_mut(BLOCK * pixel_bytes).enumerate() {
            let run = pixel_run.len() / pixel_bytes;
            let mut codes = [E::ZERO; BLOCK];
            for byte in 0..E::SIZE {
                let start = (channel * E::SIZE + byte) * pixels + block * BLOCK;
                for (code, &stored) in codes.iter_mut().zip(&filtered[start..][..run]) {
                    *code = code.or(E::from_byte(stored, byte));
                }
            }
            for (code, pixel) in codes.iter().zip(pixel_run.chunks_exact_mut(pixel_bytes)) {
                before = code.inverse(before);
                before.write(&mut pixel[channel * E::SIZE..][..E::SIZE]);
            }
        }
    }
}

/// How a pixel divides into elements.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PixelLayout {
    /// Bytes of one element: 1, 2 or 4.
    pub element_bytes: u8,
    /// Elements of one pixel: 1 to 4.
    pub channels: u8,
}

impl PixelLayout {
    /// A layout, if the two numbers are in range.
    #[must_use]
    pub fn new(element_bytes: u8, channels: u8) -> Option<Self> {
        (matches!(element_bytes, 1 | 2 | 4) && (1..=4).contains(&channels))
            .then_some(Self { element_bytes, channels })
    }

    /// Bytes of one pixel.
    #[must_use]
    pub fn pixel_bytes(self) -> usize {
        usize::from(self.element_bytes) * usize::from(self.channels)
    }
}

impl std::fmt::Display for PixelLayout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} x {} bytes", self.channels, self.element_bytes)
    }
}

/// Filters `raw` into `out`. Both have the same length, a whole number of pixels.
pub(super) fn forward(raw: &[u8], layout: PixelLayout, out: &mut [u8]) {
    let channels = usize::from(layout.channels);
    match layout.element_bytes {
        1 => forward_channels::<u8>(raw, channels, out),
        2 => forward_channels::<u16>(raw, channels, out),
        _ => forward_channels::<u32>(raw, channels, out),
    }
}

/// Undoes [`forward`].
pub(super) fn inverse(filtered: &[u8], layout: PixelLayout, raw: &mut [u8]) {
    let channels = usize::from(layout.channels);
    match layout.element_bytes {
        1 => inverse_channels::<u8>(filtered, channels, raw),
        2 => inverse_channels::<u16>(filtered, channels, raw),
        _ => inverse_channels::<u32>(filtered, channels, raw),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn filtered(raw: &[u8], layout: PixelLayout) -> Vec<u8> {
        let mut out = vec![0; raw.len()];
        forward(raw, layout, &mut out);
        out
    }

    proptest! {
        #[test]
        fn any_plane_comes_back_bit_for_bit(
            element_shift in 0_u8..3,
            channels in 1_u8..=4,
            pixels in prop_oneof![0_usize..9, 500_usize..530, 1020_usize..1030],
            seed: u64,
        ) {
            let layout = PixelLayout::new(1 << element_shift, channels).unwrap();
            let mut state = seed | 1;
            let raw: Vec<u8> = (0..pixels * layout.pixel_bytes())
                .map(|_| {
                    state ^= state << 13;
                    state ^= state >> 7;
                    state ^= state << 17;
                    state.to_le_bytes()[3]
                })
                .collect();
            let mut back = vec![0; raw.len()];
            inverse(&filtered(&raw, layout), layout, &mut back);
            prop_assert_eq!(back, raw);
        }
    }

    #[test]
    fn a_ramp_of_u16_becomes_one_constant_byte_row_and_one_of_zeros() {
        let raw: Vec<u8> = (0..600_u16).flat_map(|x| (1000 + 3 * x).to_le_bytes()).collect();
        let out = filtered(&raw, PixelLayout::new(2, 1).unwrap());
        // A step of +3 has the zigzag code 6.
        assert!(out[1..600].iter().all(|&low| low == 6), "low bytes: {:?}", &out[..8]);
        assert!(out[601..].iter().all(|&high| high == 0), "high bytes: {:?}", &out[600..608]);
    }

    #[test]
    fn channels_do_not_mix() {
        let raw: Vec<u8> = (0..64).flat_map(|x| [x, 255, 0, 255 - x]).collect();
        let out = filtered(&raw, PixelLayout::new(1, 4).unwrap());
        assert!(out[1..64].iter().all(|&code| code == 2), "+1 is 2");
        assert!(out[65..192].iter().all(|&code| code == 0 || code == 1), "constants do not step");
        assert!(out[193..].iter().all(|&code| code == 1), "-1 is 1");
    }

    #[test]
    fn layouts_that_do_not_exist_are_refused() {
        for (element_bytes, channels) in [(0, 1), (3, 1), (8, 1), (1, 0), (4, 5)] {
            assert_eq!(
                PixelLayout::new(element_bytes, channels),
                None,
                "{element_bytes}x{channels}"
            );
        }
    }
}
