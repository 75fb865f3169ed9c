//! The colours of the tool's pictures: dark ink on a light page, and hues that stay apart for
//! readers who do not tell red from green.

use foreframe_engine::trajectory::rung::Rung;
use tiny_skia::Color;

/// Red, green, blue, 8-bit sRGB.
pub type Rgb = [u8; 3];

/// The page.
pub const PAGE: Rgb = [250, 250, 248];
/// Behind lanes and plots.
pub const PANEL: Rgb = [240, 240, 236];
/// Text and outlines.
pub const INK: Rgb = [34, 36, 40];
/// Secondary text and axes.
pub const MUTED: Rgb = [105, 108, 116];
/// Lines of a grid.
pub const GRID: Rgb = [218, 218, 212];
/// Key frames as they arrive.
pub const KEY: Rgb = [34, 36, 40];
/// Real frames on the display.
pub const REAL: Rgb = [0, 114, 178];
/// Synthesised frames on the display.
pub const SYNTHESISED: Rgb = [86, 180, 233];
/// Frames shown again.
pub const REPEATED: Rgb = [230, 159, 0];
/// Frames that were not shown.
pub const DROPPED: Rgb = [204, 51, 17];
/// Colours of series, after Okabe and Ito (2008): hues that stay apart for readers who do not tell
/// red from green, on a light page and on a dark one.
pub const HUES: [Rgb; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [120, 94, 60],
];

/// Colour of what goes on by a model; None where it is held.
#[must_use]
pub const fn rung_color(rung: Rung) -> Option<Rgb> {
    match rung {
        Rung::Hold => None,
        Rung::Global => Some(HUES[5]),
        Rung::Linear => Some(HUES[0]),
        Rung::Affine => Some(HUES[2]),
        Rung::Quadratic => Some(HUES[4]),
        Rung::World(_) => Some(HUES[1]),
        Rung::Flow => Some(HUES[3]),
    }
}

/// Opaque colour for tiny-skia.
#[must_use]
pub fn opaque([red, green, blue]: Rgb) -> Color {
    Color::from_rgba8(red, green, blue, 255)
}

/// Colour of an error picture for `error` in 0 to 255: white, yellow, red, black. Lightness falls
/// all the way.
#[must_use]
pub fn heat(error: u8) -> Rgb {
    const STOPS: [Rgb; 4] = [[255, 255, 255], [255, 205, 70], [200, 40, 30], [20, 0, 20]];
    let step = usize::from(error / 85).min(2);
    let way = u32::from(error) - step as u32 * 85;
    let (from, to) = (STOPS[step], STOPS[step + 1]);
    std::array::from_fn(|channel| {
        let mixed = u32::from(from[channel]) * (85 - way) + u32::from(to[channel]) * way;
        u8::try_from((mixed + 42) / 85).expect("between two bytes")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_goes_from_white_to_nearly_black_and_always_darker() {
        let luma = |[r, g, b]: Rgb| 2126 * u32::from(r) + 7152 * u32::from(g) + 722 * u32::from(b);
        assert_eq!(heat(0), [255; 3]);
        assert_eq!(heat(255), [20, 0, 20]);
        for error in 0..255 {
            assert!(luma(heat(error + 1)) < luma(heat(error)), "from {error}");
        }
    }
}
