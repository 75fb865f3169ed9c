//! A folder of numbered PNG files: `frame_000000.png` and so on, 8-bit sRGB.
//!
//! The number is that of the output frame, so a frame that was dropped leaves a gap.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use foreframe_engine::{ColorPlane, StreamFormat};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};

use super::srgb::SrgbConverter;

/// Writes frames into one folder.
#[derive(Debug)]
pub struct PngSink {
    dir: PathBuf,
    converter: SrgbConverter,
    rgb: Vec<u8>,
}

impl PngSink {
    /// Makes the folder, if it is not there.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create(dir: &Path, format: &StreamFormat) -> io::Result<Self> {
        fs::create_dir_all(dir)?;
        Ok(Self { dir: dir.to_owned(), converter: SrgbConverter::new(format), rgb: Vec::new() })
    }

    /// The files of this sink in `dir`, those of an earlier one too, in any order. None where there
    /// is no such folder.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn files_in(dir: &Path) -> io::Result<Vec<PathBuf>> {
        let entries = match fs::read_dir(dir) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries?,
        };
        let paths = entries.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
        Ok(paths.into_iter().filter(|path| is_frame_file(path)).collect())
    }

    /// Writes output frame number `index`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&mut self, index: u64, frame: &ColorPlane) -> io::Result<()> {
        self.converter.convert(frame, &mut self.rgb);
        let file = File::create(self.dir.join(file_name(index)))?;
        // The cheapest settings that still compress: a sink has to keep up with the display.
        PngEncoder::new_with_quality(BufWriter::new(file), CompressionType::Fast, FilterType::Sub)
            .write_image(&self.rgb, frame.width(), frame.height(), ExtendedColorType::Rgb8)
            .map_err(io::Error::other)
    }
}

fn file_name(index: u64) -> String {
    format!("frame_{index:06}.png")
}

/// Whether this sink could have written it.
fn is_frame_file(path: &Path) -> bool {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return false };
    let index = name.strip_prefix("frame_").and_then(|rest| rest.strip_suffix(".png"));
    index.and_then(|index| index.parse().ok()).is_some_and(|index| file_name(index) == name)
}

#[cfg(test)]
mod tests {
    use foreframe_engine::Plane;
    use foreframe_engine::color::Rgba8;

    use super::*;

    #[test]
    fn its_files_are_told_from_others_by_their_names() {
        for (name, is_one) in [
            ("frame_000000.png", true),
            ("frame_1234567.png", true),
            ("frame_0000001.png", false),
            ("frame_12.png", false),
            ("frame_+00012.png", false),
            ("frame_000012.jpg", false),
            ("my_frame_000012.png", false),
        ] {
            assert_eq!(is_frame_file(&Path::new("some folder").join(name)), is_one, "{name}");
        }
    }

    #[test]
    fn a_written_file_reads_back_exactly() {
        let dir = tempfile::tempdir().unwrap();
        let format = StreamFormat::rgba8(5, 3);
        let texels: Vec<_> = (0..15_u32).map(|i| Rgba8(i * 0x0001_0f03)).collect();
        let frame = ColorPlane::Rgba8(Plane::from_vec(5, 3, texels.clone()));
        let mut sink = PngSink::create(&dir.path().join("made"), &format).unwrap();
        sink.write(42, &frame).unwrap();
        let image = image::open(dir.path().join("made/frame_000042.png")).unwrap().into_rgb8();
        let expected: Vec<u8> =
            texels.iter().flat_map(|texel| texel.0.to_le_bytes()[..3].to_vec()).collect();
        assert_eq!((image.width(), image.height(), image.into_raw()), (5, 3, expected));
    }
}
