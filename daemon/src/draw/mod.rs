//! Drawing for the HUD and for the pictures of the tool: a canvas over tiny-skia, text over
//! ab_glyph, and drawings that become pixels or SVG.
//!
//! Software only and with a built-in font, so that a picture has the same pixels on every machine.
//! Positions are pixels from the top left corner; nothing outside the canvas is drawn, and nothing
//! fails: what does not fit is clipped.

mod axis;
mod canvas;
mod drawing;
pub mod palette;
mod text;

pub use axis::{LinearAxis, LogAxis};
pub use canvas::Canvas;
pub use drawing::Drawing;
pub use text::{Anchor, TextStyle, text_width};

/// A picture in 8-bit sRGB, alpha ignored: `width * height` pixels of 4 bytes, row by row.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rgba8Image<'a> {
    width: u32,
    height: u32,
    pixels: &'a [u8],
}

impl<'a> Rgba8Image<'a> {
    /// None unless it has pixels and `pixels` holds all of them and no more.
    #[must_use]
    pub fn new(width: u32, height: u32, pixels: &'a [u8]) -> Option<Self> {
        let bytes = u64::from(width) * u64::from(height) * 4;
        (bytes > 0 && bytes == pixels.len() as u64).then_some(Self { width, height, pixels })
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Red, green, blue of the pixels, row by row.
    pub fn rgb(&self) -> impl Iterator<Item = [u8; 3]> + 'a {
        self.pixels.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]])
    }

    /// Red, green, blue of one pixel inside.
    #[must_use]
    pub fn at(&self, x: u32, y: u32) -> [u8; 3] {
        let first = (y as usize * self.width as usize + x as usize) * 4;
        [self.pixels[first], self.pixels[first + 1], self.pixels[first + 2]]
    }
}
