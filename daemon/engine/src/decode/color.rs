//! Colour planes to canonical form: [`crate::color`] says what that is.
//!
//! Half floats are clamped on entry: NaN to 0, infinity to the largest finite half of its sign.

use rayon::ThreadPool;
use zerocopy::{FromBytes, IntoBytes};

use super::error::{DecodeError, PlaneName};
use super::geometry::CheckedPlane;
use crate::bands::for_each_row;
use crate::color::{ColorPlane, OrderedRgba16, Rgb10a2, Rgba8, Texel, half_to_ordered};
use crate::format::{ColorFormat, StreamFormat, ValidRectUse};
use crate::key::PlaneInput;
use crate::plane::{Plane, Rect};
use crate::warp::sample::sample;

/// Bits of the largest finite half.
const HALF_MAX: u16 = 0x7bff;
const HALF_EXPONENT: u16 = 0x7c00;
const HALF_SIGN: u16 = 0x8000;

/// The part of the output that shows the image of a key with this colour plane.
pub(super) fn image_rect(format: &StreamFormat, plane: &CheckedPlane<'_>) -> Rect {
    match format.valid_rect_use {
        ValidRectUse::Letterbox => plane.valid,
        ValidRectUse::Stretch | ValidRectUse::Multiplex => Rect::full(format.width, format.height),
    }
}

/// Reads `plane` into `color` and returns the rectangle of it that moves. `whole` keeps the plane
/// as it came where its valid rectangle is stretched; a reduced picture of a multiplexed stream
/// stays there, and `color` is left to who restores it.
pub(super) fn decode_color(
    pool: &ThreadPool,
    format: &StreamFormat,
    plane: &CheckedPlane<'_>,
    whole: &mut ColorPlane,
    color: &mut ColorPlane,
) -> Rect {
    let image = image_rect(format, plane);
    let stretch = plane.valid != image;
    let target = if stretch { &mut *whole } else { &mut *color };
    target.reset(format.color, format.width, format.height);
    read_color(pool, plane, target);
    if !stretch {
        return image;
    }
    color.reset(format.color, format.width, format.height);
    if format.valid_rect_use == ValidRectUse::Multiplex {
        return image;
    }
    match (&*whole, color) {
        (ColorPlane::Rgba8(from), ColorPlane::Rgba8(to)) => stretch_to(pool, from, plane.valid, to),
        (ColorPlane::Rgb10a2(from), ColorPlane::Rgb10a2(to)) => {
            stretch_to(pool, from, plane.valid, to);
        }
        (ColorPlane::Rgba16f(from), ColorPlane::Rgba16f(to)) => {
            stretch_to(pool, from, plane.valid, to);
        }
        _ => unreachable!("both were reset to the stream's format"),
    }
    image
}

/// Reads all of a UI plane with pixels of `format` into `ui`.
///
/// # Errors
/// If its numbers do not describe pixels that are there. `ui` is then as it was.
pub fn decode_ui(
    pool: &ThreadPool,
    format: ColorFormat,
    plane: &PlaneInput<'_>,
    ui: &mut ColorPlane,
) -> Result<(), DecodeError> {
    let plane = CheckedPlane::new(PlaneName::Ui, plane, format.bytes_per_pixel())?;
    ui.reset(format, plane.width, plane.height);
    read_color(pool, &plane, ui);
    Ok(())
}

/// Reads all of a plane into `target`, which has its size and format.
fn read_color(pool: &ThreadPool, plane: &CheckedPlane<'_>, target: &mut ColorPlane) {
    match target {
        ColorPlane::Rgba8(target) => {
            read_words(pool, plane, target, |Rgba8(word)| Rgba8(u32::from_le(word)));
        }
        ColorPlane::Rgb10a2(target) => {
            read_words(pool, plane, target, |Rgb10a2(word)| Rgb10a2(u32::from_le(word)));
        }
        ColorPlane::Rgba16f(target) => read_halves(pool, plane, target),
    }
}

/// Reads a plane that is kept as it comes, but for the order of its bytes.
fn read_words<T: Texel + FromBytes + IntoBytes>(
    pool: &ThreadPool,
    plane: &CheckedPlane<'_>,
    target: &mut Plane<T>,
    from_little_endian: impl Fn(T) -> T + Sync,
) {
    for_each_row(
        pool,
        target,
        #[inline(always)]
        |y, row| {
            plane.read_row(y, row.as_mut_bytes());
            for texel in row {
                *texel = from_little_endian(*texel);
            }
        },
    );
}

fn read_halves(pool: &ThreadPool, plane: &CheckedPlane<'_>, target: &mut Plane<OrderedRgba16>) {
    for_each_row(
        pool,
        target,
        #[inline(always)]
        |y, row| {
            plane.with_row(
                y,
                #[inline(always)]
                |bytes| {
                    for (texel, pixel) in row.iter_mut().zip(bytes.as_chunks().0) {
                        *texel = ordered_from_bytes(*pixel);
                    }
                },
            );
        },
    );
}

fn ordered_from_bytes(bytes: [u8; 8]) -> OrderedRgba16 {
    let (channels, _) = bytes.as_chunks::<2>();
    OrderedRgba16(std::array::from_fn(|channel| {
        half_to_ordered(finite_half(u16::from_le_bytes(channels[channel])))
    }))
}

/// The bits of a half float with NaN replaced by 0 and infinity by the largest finite one.
pub(super) fn finite_half(bits: u16) -> u16 {
    match bits & !HALF_SIGN {
        magnitude if magnitude < HALF_EXPONENT => bits,
        HALF_EXPONENT => (bits & HALF_SIGN) | HALF_MAX,
        _ => 0,
    }
}

/// Resamples `valid` of `from` to the whole of `to`, bilinear, pixel edges on pixel edges:
/// the centre of target pixel `i` lies at `(2 i + 1) * 256 * length / (2 * target) - 128` in Q8.
fn stretch_to<T: Texel>(pool: &ThreadPool, from: &Plane<T>, valid: Rect, to: &mut Plane<T>) {
    let (width, height) = (to.width(), to.height());
    let position = |index: u32, target: u32, start: u32, length: u32| {
        let within = u64::from(2 * index + 1) * 256 * u64::from(length) / (2 * u64::from(target));
        i32::try_from(u64::from(start) * 256 + within).expect("8192 pixels in Q8 fit 21 bits") - 128
    };
    for_each_row(
        pool,
        to,
        #[inline(always)]
        |y, row| {
            let from_y = position(y, height, valid.y, valid.height);
            for (x, texel) in (0..).zip(row) {
                *texel = sample(from, valid, position(x, width, valid.x, valid.width), from_y);
            }
        },
    );
}
