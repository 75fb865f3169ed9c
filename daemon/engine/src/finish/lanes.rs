//! The channels of a pixel, wide enough to be added up.
//!
//! A pixel of four bytes becomes one word with 16 bits for each channel: 64 of its largest values
//! and a rounding still fit, at 8 and at 10 bits. Halves take 32 bits a channel.

#[cfg(target_arch = "x86_64")]
pub(super) mod avx2;

use std::cell::RefCell;
use std::ops::Add;

use super::selection::FULL;
use crate::color::{OrderedRgba16, Rgb10a2, Rgba8, Texel};
#[cfg(target_arch = "x86_64")]
use crate::simd::has_avx2;

/// A sum of the channels of up to 64 pixels.
pub(super) trait Lanes: Copy + Default + Send + Sync + Add<Output = Self> {
    /// Each channel so many times.
    fn times(self, weight: u32) -> Self;

    /// Each channel plus half, shifted down, which leaves a channel of one pixel. Bits above that
    /// are not defined; [`Wide::narrow`] passes over them.
    fn rounded(self, shift: u32) -> Self;

    /// Calls `work` with a row of the thread, kept from row to row, whatever it holds.
    fn with_row(work: impl FnOnce(&mut Vec<Self>));
}

/// The body of [`Lanes::with_row`].
///
/// Taken and put back, as a closure given to the thread's storage is not made for AVX2.
macro_rules! with_row {
    ($lanes:ty) => {
        #[inline(always)]
        fn with_row(work: impl FnOnce(&mut Vec<Self>)) {
            thread_local! {
                static ROW: RefCell<Vec<$lanes>> = const { RefCell::new(Vec::new()) };
            }
            let mut row = ROW.take();
            work(&mut row);
            ROW.set(row);
        }
    };
}

/// A pixel that can be added up.
pub(super) trait Wide: Texel {
    type Lanes: Lanes;

    fn widen(self) -> Self::Lanes;
    fn narrow(lanes: Self::Lanes) -> Self;

    /// Of each column, the pixels of three rows weighed and added up.
    #[inline(always)]
    fn weigh(rows: [&[Self]; 3], weights: [u32; 3], sums: &mut [Self::Lanes]) {
        weigh_from(0, rows, weights, sums);
    }

    /// Every second column with its neighbours: 1 2 1 of `sums[2 i..]`, of which 16 make a pixel.
    #[inline(always)]
    fn halve(sums: &[Self::Lanes], row: &mut [Self]) {
        halve_from(0, sums, row);
    }

    /// Twice as many columns: 1 6 1 of `sums[i..]` and 4 4 of `sums[i + 1..]` in turn, of which 64
    /// make a pixel.
    #[inline(always)]
    fn expand(sums: &[Self::Lanes], row: &mut [Self]) {
        expand_from(0, sums, row);
    }
}

#[inline(always)]
fn weigh_from<T: Wide>(done: usize, rows: [&[T]; 3], weights: [u32; 3], sums: &mut [T::Lanes]) {
    for (column, sum) in sums.iter_mut().enumerate().skip(done) {
        let [above, here, below] = rows.map(|row| row[column].widen());
        *sum = above.times(weights[0]) + here.times(weights[1]) + below.times(weights[2]);
    }
}

#[inline(always)]
fn halve_from<T: Wide>(done: usize, sums: &[T::Lanes], row: &mut [T]) {
    for (column, texel) in row.iter_mut().enumerate().skip(done) {
        let [before, here, after] = [0, 1, 2].map(|tap| sums[2 * column + tap]);
        *texel = T::narrow((before + here.times(2) + after).rounded(4));
    }
}

#[inline(always)]
fn expand_from<T: Wide>(done: usize, sums: &[T::Lanes], row: &mut [T]) {
    for (column, texel) in row.iter_mut().enumerate().skip(done) {
        *texel = expanded(sums, column);
    }
}

/// What [`Wide::expand`] makes of one column.
#[inline(always)]
pub(super) fn expanded<T: Wide>(sums: &[T::Lanes], column: usize) -> T {
    let [before, here, after] = [0, 1, 2].map(|tap| sums[column / 2 + tap]);
    let sum = if column.is_multiple_of(2) {
        before + here.times(6) + after
    } else {
        here.times(4) + after.times(4)
    };
    T::narrow(sum.rounded(6))
}

/// `original`, and `blurred` as far as `weight` of [`FULL`] says: (1) of `super::compensate`.
#[inline(always)]
pub(super) fn mixed<T: Wide>(original: T, blurred: T, weight: u8) -> T {
    let (mut levels, blurred) = (original.channels(), blurred.channels());
    let [of_blurred, of_original] = [u32::from(weight), u32::from(FULL - weight)];
    for (level, blurred) in levels.iter_mut().zip(blurred) {
        let sum = of_original * u32::from(*level) + of_blurred * u32::from(blurred);
        *level = ((sum + u32::from(FULL / 2)) / u32::from(FULL)) as u16;
    }
    T::of_channels(levels)
}

/// Four channels of 16 bits, red lowest.
#[derive(Clone, Copy, Default)]
#[repr(transparent)]
pub(super) struct Packed(u64);

const BYTES: u64 = 0x00ff_00ff_00ff_00ff;
const ONES: u64 = 0x0001_0001_0001_0001;

impl Add for Packed {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }
}

impl Lanes for Packed {
    #[inline(always)]
    fn times(self, weight: u32) -> Self {
        Self(self.0.wrapping_mul(weight.into()))
    }

    #[inline(always)]
    fn rounded(self, shift: u32) -> Self {
        Self(self.0.wrapping_add(ONES << (shift - 1)) >> shift)
    }

    with_row!(Packed);
}

impl Wide for Rgba8 {
    type Lanes = Packed;

    #[inline(always)]
    fn widen(self) -> Self::Lanes {
        let word = u64::from(self.0);
        let pairs = (word | word << 16) & 0x0000_ffff_0000_ffff;
        Packed((pairs | pairs << 8) & BYTES)
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "four bytes have come together below")]
    fn narrow(Packed(lanes): Self::Lanes) -> Self {
        let lanes = lanes & BYTES;
        let pairs = (lanes | lanes >> 8) & 0x0000_ffff_0000_ffff;
        Self((pairs | pairs >> 16) as u32)
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn weigh(rows: [&[Self]; 3], weights: [u32; 3], sums: &mut [Packed]) {
        let mut done = 0;
        if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            done = unsafe { avx2::weigh(rows, weights, sums) };
        }
        weigh_from(done, rows, weights, sums);
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn halve(sums: &[Packed], row: &mut [Self]) {
        let mut done = 0;
        if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            done = unsafe { avx2::halve(sums, row) };
        }
        halve_from(done, sums, row);
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn expand(sums: &[Packed], row: &mut [Self]) {
        let mut done = 0;
        if has_avx2() {
            // SAFETY: the processor has AVX2, asked for just above.
            done = unsafe { avx2::expand(sums, row) };
        }
        expand_from(done, sums, row);
    }
}

impl Wide for Rgb10a2 {
    type Lanes = Packed;

    #[inline(always)]
    fn widen(self) -> Self::Lanes {
        let [r, g, b, a] = self.channels().map(u64::from);
        Packed(r | g << 16 | b << 32 | a << 48)
    }

    #[inline(always)]
    fn narrow(Packed(lanes): Self::Lanes) -> Self {
        let [r, g, b, a] = [0, 16, 32, 48].map(|shift| (lanes >> shift & 0x3ff) as u16);
        Self::of_channels([r, g, b, a & 3])
    }
}

/// Four channels of 32 bits.
#[derive(Clone, Copy, Default)]
pub(super) struct Quad([u32; 4]);

impl Add for Quad {
    type Output = Self;

    #[inline(always)]
    fn add(self, Self(other): Self) -> Self {
        Self(std::array::from_fn(|channel| self.0[channel].wrapping_add(other[channel])))
    }
}

impl Lanes for Quad {
    #[inline(always)]
    fn times(self, weight: u32) -> Self {
        Self(self.0.map(|channel| channel.wrapping_mul(weight)))
    }

    #[inline(always)]
    fn rounded(self, shift: u32) -> Self {
        Self(self.0.map(|channel| (channel + (1 << (shift - 1))) >> shift))
    }

    with_row!(Quad);
}

impl Wide for OrderedRgba16 {
    type Lanes = Quad;

    #[inline(always)]
    fn widen(self) -> Self::Lanes {
        Quad(self.0.map(u32::from))
    }

    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a mean of 16 bits has 16 bits")]
    fn narrow(Quad(lanes): Self::Lanes) -> Self {
        Self(lanes.map(|channel| channel as u16))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_kept<T: Wide + std::fmt::Debug>(texel: T) {
        assert_eq!(T::narrow(texel.widen()), texel);
        assert_eq!(T::of_channels(texel.channels()), texel);
        let sum = texel.widen().times(32) + texel.widen().times(32);
        assert_eq!(T::narrow(sum.rounded(6)), texel, "64 of one pixel are that pixel");
    }

    #[test]
    fn pixels_come_back_and_64_of_the_brightest_fit() {
        for word in [0, u32::MAX, 0x1234_5678, 0xff00_ff00, 0x0102_0304] {
            is_kept(Rgba8(word));
            is_kept(Rgb10a2(word));
        }
        is_kept(OrderedRgba16([u16::MAX, 0, 0x8000, 77]));
    }
}
