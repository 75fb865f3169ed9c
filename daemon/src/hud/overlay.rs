//! Lays a small picture onto a frame of any colour format.

use foreframe_engine::ColorPlane;
use foreframe_engine::color::{OrderedRgba16, Rgb10a2, Rgba8, Texel, half_to_ordered};
use half::f16;
use tiny_skia::Pixmap;

/// How much of a panel there is, of 256: what lies behind it can still be seen.
pub(super) const PANEL_OPACITY: u32 = 216;

/// Lays `over` onto `picture` with its corner at `at`, each of its pixels `scale` pixels wide and
/// high. `opacity` is 0 to 256, times the alpha of `over`. What lies outside is left out.
pub(super) fn lay(picture: &mut ColorPlane, over: &Pixmap, at: [u32; 2], scale: u32, opacity: u32) {
    let (width, height) = (picture.width(), picture.height());
    let columns = (over.width() * scale).min(width.saturating_sub(at[0]));
    let rows = (over.height() * scale).min(height.saturating_sub(at[1]));
    let pixel = |column: u32, row: u32| {
        let pixel = over.pixels()[((row / scale) * over.width() + column / scale) as usize];
        let color = pixel.demultiply();
        ([color.red(), color.green(), color.blue()], u32::from(color.alpha()) * opacity / 255)
    };
    let first = |row: u32| ((at[1] + row) * width + at[0]) as usize;
    match picture {
        ColorPlane::Rgba8(plane) => {
            blend(plane.data_mut(), columns, rows, first, pixel, |[red, green, blue]| {
                Rgba8(u32::from_le_bytes([red, green, blue, 255]))
            });
        }
        ColorPlane::Rgb10a2(plane) => {
            blend(plane.data_mut(), columns, rows, first, pixel, |rgb| {
                let [red, green, blue] = rgb.map(|byte| u32::from(byte) * 1023 / 255);
                Rgb10a2(red | green << 10 | blue << 20 | 3 << 30)
            });
        }
        ColorPlane::Rgba16f(plane) => {
            blend(plane.data_mut(), columns, rows, first, pixel, |rgb| {
                let [red, green, blue] = rgb.map(|byte| ordered(linear(byte)));
                OrderedRgba16([red, green, blue, ordered(1.0)])
            });
        }
    }
}

fn blend<T: Texel>(
    texels: &mut [T],
    columns: u32,
    rows: u32,
    first: impl Fn(u32) -> usize,
    pixel: impl Fn(u32, u32) -> ([u8; 3], u32),
    texel: impl Fn([u8; 3]) -> T,
) {
    for row in 0..rows {
        let line = &mut texels[first(row)..][..columns as usize];
        for (column, under) in (0..).zip(line) {
            let (color, weight) = pixel(column, row);
            if weight > 0 {
                *under = T::mix(*under, texel(color), weight);
            }
        }
    }
}

/// sRGB decoded (IEC 61966-2-1).
fn linear(byte: u8) -> f32 {
    let encoded = f32::from(byte) / 255.0;
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::powf((encoded + 0.055) / 1.055, 2.4) }
}

fn ordered(value: f32) -> u16 {
    half_to_ordered(f16::from_f32(value).to_bits())
}
