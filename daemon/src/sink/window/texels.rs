//! Pictures as displays take them: four bytes a texel, in their order, of their size.
//!
//! A picture is drawn row by row, straight from the engine's plane: whoever has the memory takes as
//! many rows at once as suit it, and no second picture is kept. Pictures of 8-bit sRGB need no more
//! than that; others are converted first.

use foreframe_engine::color::ColorFormat;
use foreframe_engine::format::{Primaries, Transfer};
use foreframe_engine::{ColorPlane, Rect, StreamFormat};

use super::placement::Placement;
use crate::sink::srgb::SrgbConverter;

/// Order of the bytes of a texel in memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ByteOrder {
    /// Red, green, blue, unused: the engine's own. `Xbgr8888` in Wayland's words.
    Rgbx,
    /// Blue, green, red, unused: what every display knows. `Xrgb8888` in Wayland's words.
    Bgrx,
}

/// Makes texels of the pictures of one stream.
#[derive(Debug)]
pub(super) struct Texels {
    pub(super) order: ByteOrder,
    /// For pictures that are not 8-bit sRGB already.
    converter: Option<SrgbConverter>,
    rgb: Vec<u8>,
    columns: Columns,
}

/// Which column of a picture each texel of a row shows.
#[derive(Debug, Default)]
struct Columns {
    /// Columns of the picture.
    width: usize,
    /// One for each texel; empty where each shows its own.
    shown: Vec<usize>,
}

/// One picture, to be drawn.
#[derive(Debug)]
pub(super) struct Picture<'a> {
    order: ByteOrder,
    source: Source<'a>,
    /// Columns and rows of the source.
    size: [usize; 2],
    columns: &'a Columns,
    place: Rect,
}

#[derive(Debug)]
enum Source<'a> {
    Rgba(&'a [u8]),
    Rgb(&'a [u8]),
}

impl Texels {
    pub(super) fn new(format: &StreamFormat, order: ByteOrder) -> Self {
        let is_plain = format.color == ColorFormat::Rgba8
            && format.transfer == Transfer::Srgb
            && format.primaries == Primaries::Bt709;
        let converter = (!is_plain).then(|| SrgbConverter::new(format));
        Self { order, converter, rgb: Vec::new(), columns: Columns::default() }
    }

    /// `frame` as it is to be drawn into a buffer of this placement.
    pub(super) fn picture<'a>(
        &'a mut self,
        frame: &'a ColorPlane,
        placement: &Placement,
    ) -> Picture<'a> {
        let size = [frame.width() as usize, frame.height() as usize];
        self.columns.fit(size[0], placement.picture.width as usize);
        let source = match &self.converter {
            Some(converter) => {
                converter.convert(frame, &mut self.rgb);
                Source::Rgb(&self.rgb)
            }
            None => Source::Rgba(frame.as_bytes()),
        };
        let (order, columns, place) = (self.order, &self.columns, placement.picture);
        Picture { order, source, size, columns, place }
    }
}

impl Columns {
    /// `width` columns are to be shown by `across` texels.
    fn fit(&mut self, width: usize, across: usize) {
        let is_fit =
            self.width == width && self.shown.len() == if width == across { 0 } else { across };
        if !is_fit {
            self.width = width;
            let shown = if width == across { 0 } else { across };
            self.shown = (0..shown).map(|x| x * width / across).collect();
        }
    }
}

impl Picture<'_> {
    /// All of its texels as they lie in memory, where those of a buffer with nothing at its sides
    /// are the same.
    pub(super) fn as_it_is(&self) -> Option<&[u8]> {
        match self.source {
            Source::Rgba(bytes) if self.order == ByteOrder::Rgbx && self.is_unscaled() => {
                Some(bytes)
            }
            _ => None,
        }
    }

    fn is_unscaled(&self) -> bool {
        self.columns.shown.is_empty() && self.size[1] == self.place.height as usize
    }

    /// Draws row `y`, counted from the top of the picture's place, into `row`, which has the bytes
    /// of its texels alone.
    pub(super) fn draw_row(&self, y: u32, row: &mut [u8]) {
        let [width, height] = self.size;
        let source_y = y as usize * height / self.place.height as usize;
        match self.source {
            Source::Rgba(bytes) => {
                let pixels = bytes[source_y * width * 4..][..width * 4].as_chunks::<4>().0;
                self.draw(pixels, row, |&pixel| pixel);
            }
            Source::Rgb(bytes) => {
                let pixels = bytes[source_y * width * 3..][..width * 3].as_chunks::<3>().0;
                self.draw(pixels, row, |&[red, green, blue]| [red, green, blue, 255]);
            }
        }
    }

    fn draw<const N: usize>(
        &self,
        pixels: &[[u8; N]],
        row: &mut [u8],
        rgba: impl Fn(&[u8; N]) -> [u8; 4],
    ) {
        match self.order {
            ByteOrder::Rgbx => self.place_pixels(pixels, row, rgba),
            ByteOrder::Bgrx => self.place_pixels(pixels, row, |pixel| {
                let [red, green, blue, _] = rgba(pixel);
                [blue, green, red, 255]
            }),
        }
    }

    fn place_pixels<const N: usize>(
        &self,
        pixels: &[[u8; N]],
        row: &mut [u8],
        texel_of: impl Fn(&[u8; N]) -> [u8; 4],
    ) {
        let texels = row.as_chunks_mut::<4>().0;
        if self.columns.shown.is_empty() {
            for (texel, pixel) in texels.iter_mut().zip(pixels) {
                *texel = texel_of(pixel);
            }
        } else {
            for (texel, &column) in texels.iter_mut().zip(&self.columns.shown) {
                *texel = texel_of(&pixels[column]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn two_pixels(format: &StreamFormat) -> ColorPlane {
        let mut frame = ColorPlane::new(format.color, 2, 1);
        frame.as_mut_bytes().copy_from_slice(&[1, 2, 3, 255, 4, 5, 6, 255]);
        frame
    }

    /// All rows of the picture's place.
    fn drawn(texels: &mut Texels, frame: &ColorPlane, placement: &Placement) -> Vec<u8> {
        let picture = texels.picture(frame, placement);
        let Rect { width, height, .. } = placement.picture;
        let mut all = vec![0; width as usize * height as usize * 4];
        for (y, row) in (0..height).zip(all.chunks_exact_mut(width as usize * 4)) {
            picture.draw_row(y, row);
        }
        all
    }

    #[test]
    fn bytes_are_in_the_order_of_the_display() {
        let format = StreamFormat::rgba8(2, 1);
        let (frame, placement) = (two_pixels(&format), Placement::scaled([2, 1], [2, 1]));
        let mut texels = Texels::new(&format, ByteOrder::Bgrx);
        assert_eq!(drawn(&mut texels, &frame, &placement), [3, 2, 1, 255, 6, 5, 4, 255]);
        assert_eq!(texels.picture(&frame, &placement).as_it_is(), None);
        let mut texels = Texels::new(&format, ByteOrder::Rgbx);
        assert_eq!(drawn(&mut texels, &frame, &placement), [1, 2, 3, 255, 4, 5, 6, 255]);
        assert_eq!(texels.picture(&frame, &placement).as_it_is(), Some(frame.as_bytes()));
        let larger = Placement::scaled([2, 1], [4, 2]);
        assert_eq!(texels.picture(&frame, &larger).as_it_is(), None, "it is scaled");
    }

    #[test]
    fn other_formats_become_srgb() {
        let format = StreamFormat { color: ColorFormat::Rgb10a2, ..StreamFormat::rgba8(1, 1) };
        let mut frame = ColorPlane::new(format.color, 1, 1);
        frame.as_mut_bytes().copy_from_slice(&0x3ff_u32.to_le_bytes());
        let mut texels = Texels::new(&format, ByteOrder::Rgbx);
        let placement = Placement::scaled([1, 1], [1, 1]);
        assert_eq!(texels.picture(&frame, &placement).as_it_is(), None);
        assert_eq!(drawn(&mut texels, &frame, &placement), [255, 0, 0, 255]);
    }

    proptest! {
        #[test]
        fn each_texel_shows_the_pixel_at_its_place(
            size in [1_u32..9, 1_u32..9], windows: [[u8; 2]; 2], is_bgr: bool,
        ) {
            let format = StreamFormat::rgba8(size[0], size[1]);
            let mut frame = ColorPlane::new(format.color, size[0], size[1]);
            for (at, pixel) in frame.as_mut_bytes().chunks_exact_mut(4).enumerate() {
                pixel.copy_from_slice(&[at as u8, at as u8 + 100, 200 - at as u8, 255]);
            }
            let order = if is_bgr { ByteOrder::Bgrx } else { ByteOrder::Rgbx };
            let mut texels = Texels::new(&format, order);
            // The second finds what the first left.
            for window in windows {
                let placement = Placement::scaled(size, window.map(|length| u32::from(length % 32)));
                let [across, down] = [placement.picture.width, placement.picture.height];
                let all = drawn(&mut texels, &frame, &placement);
                for (at, texel) in (0..across * down).zip(all.chunks_exact(4)) {
                    let [x, y] = [at % across * size[0] / across, at / across * size[1] / down];
                    let red = texel[if is_bgr { 2 } else { 0 }];
                    prop_assert_eq!(u32::from(red), y * size[0] + x);
                }
            }
        }
    }
}
