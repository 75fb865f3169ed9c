//! YUV4MPEG2: one header, then raw frames at a constant rate. `ffmpeg -i FILE` and `mpv FILE` read
//! it.
//!
//! 8-bit 4:4:4 (`C444`), limited range, BT.709 matrix (ITU-R BT.709-6, 2015, sections 3 and 4). No
//! chroma is thrown away, so odd sizes need no rule and no chroma siting has to be guessed.
//!
//! With R, G, B in 0..=255 and coefficients in 1/65536 (round half up, integers throughout):
//! (1) `Y  =  16 + (11966 R + 40254 G +  4064 B) / 65536`
//! (2) `Cb = 128 + (-6596 R - 22189 G + 28785 B) / 65536`
//! (3) `Cr = 128 + (28784 R - 26145 G -  2639 B) / 65536`
//!
//! The coefficients are 219/255 and 224/255 times those of the standard, rounded so that (1) sums
//! to 219/255 and (2) and (3) to 0: white is 235, and grey has no colour.
//!
//! A refresh that showed nothing new is a frame as well, or the file would play too fast. Of a
//! longer rest one second is written: a stream that stood still for an hour does not cost the disk
//! an hour of frames at once when it goes on.

use std::io::{self, Write};

use foreframe_engine::{ColorPlane, MonoSpan, StreamFormat};

use super::srgb::SrgbConverter;

const Y: [i32; 3] = [11_966, 40_254, 4_064];
const CB: [i32; 3] = [-6_596, -22_189, 28_785];
const CR: [i32; 3] = [28_784, -26_145, -2_639];

/// Writes frames into one y4m stream.
#[derive(Debug)]
pub struct Y4mSink<W> {
    out: W,
    converter: SrgbConverter,
    rgb: Vec<u8>,
    /// The last frame as it was written: what a repeated refresh shows again.
    encoded: Vec<u8>,
    /// Refreshes of one second.
    most_repeats: u64,
}

impl<W: Write> Y4mSink<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(mut out: W, format: &StreamFormat, interval: MonoSpan) -> io::Result<Self> {
        let (frames, seconds) = frame_rate(interval);
        let (width, height) = (format.width, format.height);
        writeln!(
            out,
            "YUV4MPEG2 W{width} H{height} F{frames}:{seconds} Ip A1:1 C444 XCOLORRANGE=LIMITED"
        )?;
        let converter = SrgbConverter::new(format);
        let most_repeats = frames.unsigned_abs().div_ceil(seconds.unsigned_abs());
        Ok(Self { out, converter, rgb: Vec::new(), encoded: Vec::new(), most_repeats })
    }

    /// Writes one frame.
    ///
    /// # Errors
    /// If it cannot be written: the disk is full, the reader of the pipe has gone.
    pub fn write(&mut self, frame: &ColorPlane) -> io::Result<()> {
        self.converter.convert(frame, &mut self.rgb);
        self.encoded.clear();
        for matrix_row in [(Y, 16), (CB, 128), (CR, 128)] {
            let pixels = self.rgb.chunks_exact(3);
            self.encoded.extend(pixels.map(|rgb| component(matrix_row, [rgb[0], rgb[1], rgb[2]])));
        }
        self.write_encoded()
    }

    /// Writes the last frame again, for refreshes in a row that showed nothing new: as often as
    /// that, or for one second if that is less. Nothing before the first frame.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn repeat(&mut self, refreshes: u64) -> io::Result<()> {
        if self.encoded.is_empty() {
            return Ok(());
        }
        (0..refreshes.min(self.most_repeats)).try_for_each(|_| self.write_encoded())
    }

    fn write_encoded(&mut self) -> io::Result<()> {
        self.out.write_all(b"FRAME\n")?;
        self.out.write_all(&self.encoded)?;
        self.out.flush()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "(1) to (3) stay inside 16..=240")]
#[expect(clippy::cast_sign_loss, reason = "(1) to (3) stay inside 16..=240")]
fn component(([red, green, blue], offset): ([i32; 3], i32), rgb: [u8; 3]) -> u8 {
    let [r, g, b] = rgb.map(i32::from);
    (offset + ((red * r + green * g + blue * b + 32_768) >> 16)) as u8
}

/// Frames and seconds of the header's rate: whole hertz, thousands over 1001, or millihertz.
fn frame_rate(interval: MonoSpan) -> (i64, i64) {
    let ns = interval.as_ns().max(1);
    let close = |frames: i64, seconds: i64| (1_000_000_000 * seconds - ns * frames).abs() <= frames;
    let rounded = (1_000_000_000 + ns / 2) / ns;
    if close(rounded, 1) {
        (rounded, 1)
    } else if close(rounded * 1000, 1001) {
        (rounded * 1000, 1001)
    } else {
        ((1_000_000_000_000 + ns / 2) / ns, 1000)
    }
}

#[cfg(test)]
mod tests {
    use foreframe_engine::Plane;
    use foreframe_engine::color::Rgba8;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn components_are_those_of_the_standard_to_the_rounding(rgb: [u8; 3]) {
            let [red, green, blue] = rgb.map(|code| f64::from(code) / 255.0);
            let luma = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
            let expected = [
                (Y, 16, 16.0 + 219.0 * luma),
                (CB, 128, 128.0 + 224.0 * (blue - luma) / 1.8556),
                (CR, 128, 128.0 + 224.0 * (red - luma) / 1.5748),
            ];
            for (row, offset, exact) in expected {
                let found = f64::from(component((row, offset), rgb));
                prop_assert!((found - exact).abs() < 0.51, "{rgb:?}: {found}, not {exact}");
            }
        }
    }

    #[test]
    fn grey_has_no_colour_and_spans_the_limited_range() {
        for code in 0..=255 {
            assert_eq!(component((CB, 128), [code; 3]), 128);
            assert_eq!(component((CR, 128), [code; 3]), 128);
        }
        assert_eq!(component((Y, 16), [0; 3]), 16);
        assert_eq!(component((Y, 16), [255; 3]), 235);
    }

    #[test]
    fn rates_are_written_as_players_expect_them() {
        for (hz, rate) in [
            (120.0, (120, 1)),
            (144.0, (144, 1)),
            (59.94, (59_940, 1000)),
            (60_000.0 / 1001.0, (60_000, 1001)),
            (120_000.0 / 1001.0, (120_000, 1001)),
            (165.25, (165_250, 1000)),
        ] {
            assert_eq!(frame_rate(MonoSpan::from_hz(hz)), rate, "{hz} Hz");
        }
    }

    #[test]
    fn a_stream_is_a_header_and_whole_frames_repeats_included() {
        let mut bytes = Vec::new();
        let format = StreamFormat::rgba8(3, 1);
        let mut sink = Y4mSink::create(&mut bytes, &format, MonoSpan::from_hz(120.0)).unwrap();
        sink.repeat(1).unwrap();
        let texels = vec![Rgba8(0xff00_00ff), Rgba8(0xffff_ffff), Rgba8(0)];
        sink.write(&ColorPlane::Rgba8(Plane::from_vec(3, 1, texels))).unwrap();
        sink.repeat(1).unwrap();
        let header = b"YUV4MPEG2 W3 H1 F120:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
        let frame = b"FRAME\n\x3f\xeb\x10\x66\x80\x80\xf0\x80\x80";
        assert_eq!(bytes, [&header[..], frame, frame].concat());
    }
}
