//! Reads a colour plane between its pixels.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256i, __m512i};

use crate::color::Texel;
use crate::plane::{Plane, Rect};

/// Where the pixels of a run are read, Q8 pixels, x and y.
pub trait Positions {
    /// Where pixel `i` is read.
    fn at(&self, i: usize) -> [i32; 2];

    /// Where pixels `i` to `i + 7` are read.
    ///
    /// # Safety
    /// The processor has AVX2, and the run has 8 pixels from `i` on.
    #[cfg(target_arch = "x86_64")]
    unsafe fn eight(&self, i: usize) -> [__m256i; 2];

    /// Where pixels `i` to `i + 15` are read.
    ///
    /// # Safety
    /// The processor has AVX-512 with 16-bit lanes, and the run has 16 pixels from `i` on.
    #[cfg(target_arch = "x86_64")]
    unsafe fn sixteen(&self, i: usize) -> [__m512i; 2];

    /// A bit for each of the pixels from `i` on, of which the colour is used. The others' may be
    /// any.
    fn wanted(&self, _i: usize) -> u16 {
        u16::MAX
    }
}

/// Positions that were computed before: x and y of each pixel.
#[derive(Clone, Copy, Debug)]
pub struct Listed<'a> {
    /// To the right.
    pub xs: &'a [i32],
    /// Down; as many.
    pub ys: &'a [i32],
}

impl Positions for Listed<'_> {
    #[inline(always)]
    fn at(&self, i: usize) -> [i32; 2] {
        [self.xs[i], self.ys[i]]
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    unsafe fn eight(&self, i: usize) -> [__m256i; 2] {
        use std::arch::x86_64::_mm256_loadu_si256;
        let eight = |list: &[i32]| -> __m256i {
            let eight: &[i32; 8] = list[i..].first_chunk().expect("the run has 8 pixels from i on");
            // SAFETY: the caller has AVX2; 8 values of 32 bits are there, and the load needs no
            // alignment.
            unsafe { _mm256_loadu_si256(eight.as_ptr().cast()) }
        };
        [eight(self.xs), eight(self.ys)]
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    unsafe fn sixteen(&self, i: usize) -> [__m512i; 2] {
        use std::arch::x86_64::_mm512_loadu_si512;
        let sixteen = |list: &[i32]| -> __m512i {
            let sixteen: &[i32; 16] =
                list[i..].first_chunk().expect("the run has 16 pixels from i on");
            // SAFETY: the caller has AVX-512; 16 values of 32 bits are there, and the load needs
            // no alignment.
            unsafe { _mm512_loadu_si512(sixteen.as_ptr().cast()) }
        };
        [sixteen(self.xs), sixteen(self.ys)]
    }
}

/// The colour at (`x`, `y`) in Q8 pixels, bilinear, clamped to the pixel centres of `valid`, which
/// lies inside the plane.
#[must_use]
#[inline]
pub fn sample<T: Texel>(plane: &Plane<T>, valid: Rect, x: i32, y: i32) -> T {
    let (x0, x1, fx) = neighbours(x, valid.x, valid.width);
    let (y0, y1, fy) = neighbours(y, valid.y, valid.height);
    let width = plane.width() as usize;
    let top = &plane.data()[y0 as usize * width..][..width];
    let (left, right) = (x0 as usize, x1 as usize);
    if fx | fy == 0 {
        return top[left];
    }
    let bottom = &plane.data()[y1 as usize * width..][..width];
    T::bilinear([top[left], top[right], bottom[left], bottom[right]], fx, fy)
}

/// [`sample`] at (`x + 256 i`, `y`) into each `out[i]`.
#[inline(always)]
pub fn sample_run<T: Texel>(plane: &Plane<T>, valid: Rect, [x, y]: [i32; 2], out: &mut [T]) {
    let (top, bottom, fy) = neighbours(y, valid.y, valid.height);
    let fx = (x & 0xff).cast_unsigned();
    let count = out.len() + usize::from(fx | fy != 0);
    let start = usize::try_from((x >> 8) - valid.x.cast_signed()).ok();
    let Some(start) = start.filter(|start| start + count <= valid.width as usize) else {
        for (x, texel) in (x..).step_by(256).zip(out) {
            *texel = sample(plane, valid, x, y);
        }
        return;
    };
    let columns = |y: u32| &plane.row(y)[valid.x as usize + start..][..count];
    if fx | fy == 0 {
        out.copy_from_slice(columns(top));
    } else {
        T::bilinear_run(columns(top), columns(bottom), fx, fy, out);
    }
}

/// The two pixels around a Q8 position inside `start..start + length`, and the way between them.
#[expect(clippy::cast_sign_loss, reason = "clamped to 0 and above before the cast")]
#[expect(clippy::cast_possible_wrap, reason = "planes are at most 8192 pixels wide and high")]
#[inline]
fn neighbours(position: i32, start: u32, length: u32) -> (u32, u32, u32) {
    let first = (start << 8) as i32;
    let last = ((start + length - 1) << 8) as i32;
    let clamped = position.clamp(first, last) as u32;
    let low = clamped >> 8;
    (low, (low + 1).min(start + length - 1), clamped & 0xff)
}
