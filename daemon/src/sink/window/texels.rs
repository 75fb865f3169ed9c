//! Pictures as displays take them: four bytes a texel, in their order, of their size.

use foreframe_engine::color::ColorFormat;
use foreframe_engine::format::{Primaries, Transfer};
use foreframe_engine::{ColorPlane, StreamFormat};

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
    /// The last picture drawn, and how: what lies outside it is black already.
    drawn: Vec<u8>,
    placement: Option<Placement>,
}

impl Texels {
    pub(super) fn new(format: &StreamFormat, order: ByteOrder) -> Self {
        let is_plain = format.color == ColorFormat::Rgba8
            && format.transfer == Transfer::Srgb
            && format.primaries == Primaries::Bt709;
        let converter = (!is_plain).then(|| SrgbConverter::new(format));
        Self { order, converter, rgb: Vec::new(), drawn: Vec::new(), placement: None }
    }

    /// The picture's own bytes, where they are texels of this order already.
    pub(super) fn as_they_are<'a>(&self, frame: &'a ColorPlane) -> Option<&'a [u8]> {
        (self.order == ByteOrder::Rgbx && self.converter.is_none()).then(|| frame.as_bytes())
    }

    /// A whole buffer with the picture in its place, to the nearest pixel, and black around it.
    pub(super) fn draw(&mut self, frame: &ColorPlane, placement: &Placement) -> &[u8] {
        if self.placement != Some(*placement) {
            self.drawn.clear();
            self.drawn.resize(placement.byte_len(), 0);
            self.placement = Some(*placement);
        }
        let (source, bytes_per_pixel) = match &self.converter {
            Some(converter) => {
                converter.convert(frame, &mut self.rgb);
                (self.rgb.as_slice(), 3)
            }
            None => (frame.as_bytes(), 4),
        };
        let size = [frame.width() as usize, frame.height() as usize];
        let picture = placement.picture;
        let [across, down] = [picture.width as usize, picture.height as usize];
        let rows = self.drawn.chunks_exact_mut(placement.buffer[0] as usize * 4);
        for (y, row) in rows.skip(picture.y as usize).take(down).enumerate() {
            let source_row = &source[y * size[1] / down * size[0] * bytes_per_pixel..];
            let row = &mut row[picture.x as usize * 4..][..across * 4];
            for (x, texel) in row.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                let pixel = &source_row[x * size[0] / across * bytes_per_pixel..];
                *texel = match self.order {
                    ByteOrder::Rgbx => [pixel[0], pixel[1], pixel[2], 255],
                    ByteOrder::Bgrx => [pixel[2], pixel[1], pixel[0], 255],
                };
            }
        }
        &self.drawn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_pixels(format: &StreamFormat) -> ColorPlane {
        let mut frame = ColorPlane::new(format.color, 2, 1);
        frame.as_mut_bytes().copy_from_slice(&[1, 2, 3, 255, 4, 5, 6, 255]);
        frame
    }

    #[test]
    fn bytes_are_in_the_order_of_the_display() {
        let format = StreamFormat::rgba8(2, 1);
        let (frame, placement) = (two_pixels(&format), Placement::scaled([2, 1], [2, 1]));
        let mut texels = Texels::new(&format, ByteOrder::Bgrx);
        assert_eq!(texels.draw(&frame, &placement), [3, 2, 1, 255, 6, 5, 4, 255]);
        assert_eq!(texels.as_they_are(&frame), None);
        let mut texels = Texels::new(&format, ByteOrder::Rgbx);
        assert_eq!(texels.draw(&frame, &placement), [1, 2, 3, 255, 4, 5, 6, 255]);
        assert_eq!(texels.as_they_are(&frame), Some(frame.as_bytes()));
    }

    #[test]
    fn a_picture_is_scaled_to_its_place_and_black_is_around_it() {
        let format = StreamFormat::rgba8(2, 1);
        let (frame, placement) = (two_pixels(&format), Placement::scaled([2, 1], [4, 4]));
        let mut texels = Texels::new(&format, ByteOrder::Rgbx);
        let drawn = texels.draw(&frame, &placement).to_vec();
        let reds: Vec<u8> = drawn.iter().step_by(4).copied().collect();
        assert_eq!(reds, [0, 0, 0, 0, 1, 1, 4, 4, 1, 1, 4, 4, 0, 0, 0, 0]);
        let narrow = Placement::scaled([2, 1], [2, 3]);
        let drawn = texels.draw(&frame, &narrow);
        assert_eq!(drawn[..8], [0; 8], "what the larger one left is gone");
    }

    #[test]
    fn other_formats_become_srgb() {
        let format = StreamFormat { color: ColorFormat::Rgb10a2, ..StreamFormat::rgba8(1, 1) };
        let mut frame = ColorPlane::new(format.color, 1, 1);
        frame.as_mut_bytes().copy_from_slice(&0x3ff_u32.to_le_bytes());
        let mut texels = Texels::new(&format, ByteOrder::Rgbx);
        assert_eq!(texels.as_they_are(&frame), None);
        let placement = Placement::scaled([1, 1], [1, 1]);
        assert_eq!(texels.draw(&frame, &placement), [255, 0, 0, 255]);
    }
}
