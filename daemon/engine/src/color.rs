//! Colour planes in canonical form: integers that may be interpolated channel by channel.
//!
//! [`Texel`] is the one definition of interpolation that every method uses. `rgba8` and `rgb10a2`
//! are kept as their packed 32-bit word. A half float is kept as a monotone
//! integer (sign-magnitude turned into an ordered `u16`), so that integer interpolation is
//! monotone, and weight 0 gives back the very bits that came in.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod sse2;
#[cfg(test)]
mod tests;

use zerocopy::{FromBytes, Immutable, IntoBytes};

use crate::plane::{Plane, Rect};
#[cfg(target_arch = "x86_64")]
use crate::simd::{has_avx2, has_avx512};
use crate::warp::sample::{Positions, sample};

/// How the channels of a colour plane are stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum ColorFormat {
    /// Four bytes: red, green, blue, alpha in memory order.
    #[default]
    Rgba8,
    /// One little-endian word: red in bits 0..10, green 10..20, blue 20..30, alpha 30..32.
    Rgb10a2,
    /// Four little-endian half floats: red, green, blue, alpha in memory order.
    Rgba16f,
}

impl ColorFormat {
    /// Bytes of one pixel.
    #[must_use]
    pub const fn bytes_per_pixel(self) -> u32 {
        match self {
            Self::Rgba8 | Self::Rgb10a2 => 4,
            Self::Rgba16f => 8,
        }
    }
}

/// One pixel of [`ColorFormat::Rgba8`]: red in the lowest byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, FromBytes, IntoBytes, Immutable)]
#[repr(transparent)]
pub struct Rgba8(pub u32);

/// One pixel of [`ColorFormat::Rgb10a2`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, FromBytes, IntoBytes, Immutable)]
#[repr(transparent)]
pub struct Rgb10a2(pub u32);

/// One pixel of [`ColorFormat::Rgba16f`], each channel as [`half_to_ordered`] maps it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable)]
#[repr(transparent)]
pub struct OrderedRgba16(pub [u16; 4]);

impl Default for OrderedRgba16 {
    /// Positive zero in every channel.
    fn default() -> Self {
        Self([half_to_ordered(0); 4])
    }
}

/// A pixel whose channels are integers that may be interpolated.
pub trait Texel: Copy + Default + PartialEq + Send + Sync + 'static {
    /// Bilinear mean of the corners top left, top right, bottom left, bottom right, at `fx`, `fy`
    /// in 1/256 of the way to the right and down (0 to 255). Weights are exact: each channel is
    /// `(sum of weight * corner + 32768) >> 16`. A corner of weight 65536 comes back unchanged.
    #[must_use]
    fn bilinear(corners: [Self; 4], fx: u32, fy: u32) -> Self;

    /// `(a * (256 - weight) + b * weight + 128) >> 8` per channel; `weight` is 0 to 256.
    #[must_use]
    fn mix(a: Self, b: Self, weight: u32) -> Self;

    /// Red, green, blue, alpha.
    #[must_use]
    fn channels(self) -> [u16; 4];

    /// The pixel of these channels, each of which fits its bits.
    #[must_use]
    fn of_channels(channels: [u16; 4]) -> Self;

    /// How bright it is, in steps of the format: about a quarter red, half green, a quarter blue.
    #[must_use]
    fn luma(self) -> i32;

    /// The same in 8 bits, of light from 0 to the format's usual white or beyond.
    #[must_use]
    fn luma8(self) -> u8;

    /// [`Texel::luma8`] of each of `texels`, into `out`.
    #[inline(always)]
    fn luma8_run(texels: &[Self], out: &mut [u8]) {
        for (luma, texel) in out.iter_mut().zip(texels) {
            *luma = texel.luma8();
        }
    }

    /// [`Texel::bilinear`] of pixels `i` and `i + 1` of `top` and `bottom` into each `out[i]`.
    #[inline(always)]
    fn bilinear_run(top: &[Self], bottom: &[Self], fx: u32, fy: u32, out: &mut [Self]) {
        for (texel, (top, bottom)) in out.iter_mut().zip(top.windows(2).zip(bottom.windows(2))) {
            *texel = Self::bilinear([top[0], top[1], bottom[0], bottom[1]], fx, fy);
        }
    }

    /// [`sample`] at each of `positions` into `out`, which is as long.
    #[inline(always)]
    fn sample_each(plane: &Plane<Self>, valid: Rect, positions: &impl Positions, out: &mut [Self]) {
        for (i, texel) in out.iter_mut().enumerate() {
            let [x, y] = positions.at(i);
            *texel = sample(plane, valid, x, y);
        }
    }
}

fn bilinear_weights(fx: u32, fy: u32) -> [u32; 4] {
    let (gx, gy) = (256 - fx, 256 - fy);
    [gx * gy, fx * gy, gx * fy, fx * fy]
}

/// Applies `channel` to the fields of packed words at `shifts`, each `mask` wide.
fn packed_channels<const N: usize>(
    words: [u32; N],
    fields: [(u32, u32); 4],
    channel: impl Fn([u32; N]) -> u32,
) -> u32 {
    fields.into_iter().fold(0, |packed, (shift, mask)| {
        packed | (channel(words.map(|word| (word >> shift) & mask)) << shift)
    })
}

const RGBA8_FIELDS: [(u32, u32); 4] = [(0, 0xff), (8, 0xff), (16, 0xff), (24, 0xff)];
const RGB10A2_FIELDS: [(u32, u32); 4] = [(0, 0x3ff), (10, 0x3ff), (20, 0x3ff), (30, 0x3)];

fn weigh(corners: [u32; 4], weights: [u32; 4]) -> u32 {
    let sum: u32 = corners.into_iter().zip(weights).map(|(corner, weight)| corner * weight).sum();
    (sum + 32768) >> 16
}

fn mix_channel([a, b]: [u32; 2], weight: u32) -> u32 {
    (a * (256 - weight) + b * weight + 128) >> 8
}

impl Rgba8 {
    /// The reference of [`Texel::bilinear`].
    #[cfg(any(test, not(target_arch = "x86_64")))]
    fn bilinear_by_channel(corners: [Self; 4], fx: u32, fy: u32) -> Self {
        let weights = bilinear_weights(fx, fy);
        Self(packed_channels(corners.map(|c| c.0), RGBA8_FIELDS, |c| weigh(c, weights)))
    }
}

/// Red, twice green and blue of a packed word.
fn packed_luma(word: u32, fields: [(u32, u32); 4]) -> i32 {
    let [red, green, blue, _] = fields.map(|(shift, mask)| word >> shift & mask);
    (red + 2 * green + blue).cast_signed()
}

impl Texel for Rgba8 {
    #[inline(always)]
    fn channels(self) -> [u16; 4] {
        self.0.to_le_bytes().map(u16::from)
    }

    #[inline(always)]
    fn of_channels(channels: [u16; 4]) -> Self {
        let [r, g, b, a] = channels.map(u32::from);
        Self(r | g << 8 | b << 16 | a << 24)
    }

    #[inline]
    fn luma(self) -> i32 {
        packed_luma(self.0, RGBA8_FIELDS)
    }

    #[inline(always)]
    fn luma8(self) -> u8 {
        (packed_luma(self.0, RGBA8_FIELDS) >> 2) as u8
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn luma8_run(texels: &[Self], out: &mut [u8]) {
        let done = if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            unsafe { avx2::luma8_run(texels, out) }
        } else {
            0
        };
        for (luma, texel) in out.iter_mut().zip(texels).skip(done) {
            *luma = texel.luma8();
        }
    }

    #[inline]
    fn bilinear(corners: [Self; 4], fx: u32, fy: u32) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            // SAFETY: every x86-64 processor has SSE2.
            Self(unsafe { sse2::bilinear_rgba8(corners.map(|corner| corner.0), fx, fy) })
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            Self::bilinear_by_channel(corners, fx, fy)
        }
    }

    fn mix(a: Self, b: Self, weight: u32) -> Self {
        Self(packed_channels([a.0, b.0], RGBA8_FIELDS, |c| mix_channel(c, weight)))
    }

    #[cfg(target_arch = "x86_64")]
    fn bilinear_run(top: &[Self], bottom: &[Self], fx: u32, fy: u32, out: &mut [Self]) {
        let done = if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            unsafe { avx2::bilinear_run(top, bottom, fx, fy, out) }
        } else {
            0
        };
        for i in done..out.len() {
            out[i] = Self::bilinear([top[i], top[i + 1], bottom[i], bottom[i + 1]], fx, fy);
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn sample_each(plane: &Plane<Self>, valid: Rect, positions: &impl Positions, out: &mut [Self]) {
        let done = if has_avx512() {
            // SAFETY: the processor has AVX-512, asked for just above.
            unsafe { avx512::sample_each(plane, valid, positions, out) }
        } else if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            unsafe { avx2::sample_each(plane, valid, positions, out) }
        } else {
            0
        };
        for (i, texel) in out.iter_mut().enumerate().skip(done) {
            let [x, y] = positions.at(i);
            *texel = sample(plane, valid, x, y);
        }
    }
}

impl Texel for Rgb10a2 {
    #[inline(always)]
    fn channels(self) -> [u16; 4] {
        [0, 10, 20, 30].map(|shift| (self.0 >> shift & 0x3ff) as u16)
    }

    #[inline(always)]
    fn of_channels(channels: [u16; 4]) -> Self {
        let [r, g, b, a] = channels.map(u32::from);
        Self(r | g << 10 | b << 20 | a << 30)
    }

    fn luma(self) -> i32 {
        packed_luma(self.0, RGB10A2_FIELDS)
    }

    #[inline(always)]
    fn luma8(self) -> u8 {
        (packed_luma(self.0, RGB10A2_FIELDS) >> 4) as u8
    }

    fn bilinear(corners: [Self; 4], fx: u32, fy: u32) -> Self {
        let weights = bilinear_weights(fx, fy);
        Self(packed_channels(corners.map(|c| c.0), RGB10A2_FIELDS, |c| weigh(c, weights)))
    }

    fn mix(a: Self, b: Self, weight: u32) -> Self {
        Self(packed_channels([a.0, b.0], RGB10A2_FIELDS, |c| mix_channel(c, weight)))
    }
}

impl Texel for OrderedRgba16 {
    #[inline(always)]
    fn channels(self) -> [u16; 4] {
        self.0
    }

    #[inline(always)]
    fn of_channels(channels: [u16; 4]) -> Self {
        Self(channels)
    }

    /// Of the ordered integers: about the logarithm of light.
    fn luma(self) -> i32 {
        let [red, green, blue, _] = self.0.map(i32::from);
        (red + 2 * green + blue) >> 4
    }

    /// What is below 0 is 0. Finite light reaches to 248, light up to 1 to 120.
    #[inline(always)]
    fn luma8(self) -> u8 {
        const ZERO: i32 = (4 * 0x8000) >> 4;
        ((self.luma() - ZERO) >> 5).clamp(0, 255) as u8
    }

    #[expect(clippy::cast_possible_truncation, reason = "a weighted mean of 16 bits has 16 bits")]
    fn bilinear(corners: [Self; 4], fx: u32, fy: u32) -> Self {
        let weights = bilinear_weights(fx, fy);
        Self(std::array::from_fn(|channel| {
            weigh(corners.map(|corner| u32::from(corner.0[channel])), weights) as u16
        }))
    }

    #[expect(clippy::cast_possible_truncation, reason = "a weighted mean of 16 bits has 16 bits")]
    fn mix(a: Self, b: Self, weight: u32) -> Self {
        Self(std::array::from_fn(|channel| {
            mix_channel([u32::from(a.0[channel]), u32::from(b.0[channel])], weight) as u16
        }))
    }
}

/// A colour plane in canonical form.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ColorPlane {
    /// Of [`ColorFormat::Rgba8`].
    Rgba8(Plane<Rgba8>),
    /// Of [`ColorFormat::Rgb10a2`].
    Rgb10a2(Plane<Rgb10a2>),
    /// Of [`ColorFormat::Rgba16f`].
    Rgba16f(Plane<OrderedRgba16>),
}

impl Default for ColorPlane {
    /// An empty plane.
    fn default() -> Self {
        Self::new(ColorFormat::Rgba8, 0, 0)
    }
}

impl ColorPlane {
    /// A plane of zero bits (black, transparent).
    #[must_use]
    pub fn new(format: ColorFormat, width: u32, height: u32) -> Self {
        match format {
            ColorFormat::Rgba8 => Self::Rgba8(Plane::new(width, height)),
            ColorFormat::Rgb10a2 => Self::Rgb10a2(Plane::new(width, height)),
            ColorFormat::Rgba16f => Self::Rgba16f(Plane::new(width, height)),
        }
    }

    /// Changes format and size, keeping the allocation where the format stays. Write every pixel
    /// before reading it.
    pub fn reset(&mut self, format: ColorFormat, width: u32, height: u32) {
        match (&mut *self, format) {
            (Self::Rgba8(plane), ColorFormat::Rgba8) => plane.resize(width, height),
            (Self::Rgb10a2(plane), ColorFormat::Rgb10a2) => plane.resize(width, height),
            (Self::Rgba16f(plane), ColorFormat::Rgba16f) => plane.resize(width, height),
            _ => {
                *self = Self::new(format, 0, 0);
                self.reset(format, width, height);
            }
        }
    }

    /// How the channels are stored.
    #[must_use]
    pub fn format(&self) -> ColorFormat {
        match self {
            Self::Rgba8(_) => ColorFormat::Rgba8,
            Self::Rgb10a2(_) => ColorFormat::Rgb10a2,
            Self::Rgba16f(_) => ColorFormat::Rgba16f,
        }
    }

    /// Pixels per row.
    #[must_use]
    pub fn width(&self) -> u32 {
        match self {
            Self::Rgba8(plane) => plane.width(),
            Self::Rgb10a2(plane) => plane.width(),
            Self::Rgba16f(plane) => plane.width(),
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        match self {
            Self::Rgba8(plane) => plane.height(),
            Self::Rgb10a2(plane) => plane.height(),
            Self::Rgba16f(plane) => plane.height(),
        }
    }

    /// Takes on the pixels, size and format of `other`, keeping the allocation where it fits.
    pub fn copy_from(&mut self, other: &Self) {
        match (&mut *self, other) {
            (Self::Rgba8(to), Self::Rgba8(from)) => to.copy_from(from),
            (Self::Rgb10a2(to), Self::Rgb10a2(from)) => to.copy_from(from),
            (Self::Rgba16f(to), Self::Rgba16f(from)) => to.copy_from(from),
            (to, from) => *to = from.clone(),
        }
    }

    /// The pixels in canonical form, as they lie in memory.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        match self {
            Self::Rgba8(plane) => plane.data().as_bytes(),
            Self::Rgb10a2(plane) => plane.data().as_bytes(),
            Self::Rgba16f(plane) => plane.data().as_bytes(),
        }
    }

    /// The pixels in canonical form, as they lie in memory.
    pub fn as_mut_bytes(&mut self) -> &mut [u8] {
        match self {
            Self::Rgba8(plane) => plane.data_mut().as_mut_bytes(),
            Self::Rgb10a2(plane) => plane.data_mut().as_mut_bytes(),
            Self::Rgba16f(plane) => plane.data_mut().as_mut_bytes(),
        }
    }

    /// Appends the pixels in wire form ([`ColorFormat`], row-major, no padding) to `out`.
    pub fn write_bytes(&self, out: &mut Vec<u8>) {
        match self {
            Self::Rgba8(plane) => {
                out.extend(plane.data().iter().flat_map(|texel| texel.0.to_le_bytes()));
            }
            Self::Rgb10a2(plane) => {
                out.extend(plane.data().iter().flat_map(|texel| texel.0.to_le_bytes()));
            }
            Self::Rgba16f(plane) => {
                let channels = plane.data().iter().flat_map(|texel| texel.0);
                out.extend(channels.flat_map(|ordered| ordered_to_half(ordered).to_le_bytes()));
            }
        }
    }
}

/// Maps the bits of a half float to an integer of the same order: -inf lowest, +inf highest.
#[must_use]
pub const fn half_to_ordered(bits: u16) -> u16 {
    if bits & 0x8000 == 0 { bits | 0x8000 } else { !bits }
}

/// Inverse of [`half_to_ordered`].
#[must_use]
pub const fn ordered_to_half(ordered: u16) -> u16 {
    if ordered & 0x8000 == 0 { !ordered } else { ordered & 0x7fff }
}
