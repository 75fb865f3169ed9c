//! Digests of output frames: xxh3-128 over size, format and pixels in wire form.

use foreframe_engine::ColorPlane;
use foreframe_engine::color::ColorFormat;
use xxhash_rust::xxh3::Xxh3;

/// Digests frames one by one and all together.
#[derive(Clone, Default)]
pub struct FrameDigester {
    all: Xxh3,
    bytes: Vec<u8>,
}

impl std::fmt::Debug for FrameDigester {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FrameDigester").field("all", &self.all()).finish_non_exhaustive()
    }
}

impl FrameDigester {
    /// Adds a frame and returns its own digest, 32 hexadecimal digits.
    pub fn add(&mut self, frame: &ColorPlane) -> String {
        self.bytes.clear();
        let format: u32 = match frame.format() {
            ColorFormat::Rgba8 => 0,
            ColorFormat::Rgb10a2 => 1,
            ColorFormat::Rgba16f => 2,
        };
        for number in [frame.width(), frame.height(), format] {
            self.bytes.extend(number.to_le_bytes());
        }
        frame.write_bytes(&mut self.bytes);
        self.all.update(&self.bytes);
        hex(xxhash_rust::xxh3::xxh3_128(&self.bytes))
    }

    /// The digest of all frames so far, in order.
    #[must_use]
    pub fn all(&self) -> String {
        hex(self.all.digest128())
    }
}

fn hex(digest: u128) -> String {
    format!("{digest:032x}")
}

#[cfg(test)]
mod tests {
    use foreframe_engine::Plane;
    use foreframe_engine::color::{Rgb10a2, Rgba8};

    use super::*;

    fn digest(frame: &ColorPlane) -> String {
        FrameDigester::default().add(frame)
    }

    fn frame(width: u32, height: u32, word: u32) -> ColorPlane {
        let texels = vec![Rgba8(word); (width * height) as usize];
        ColorPlane::Rgba8(Plane::from_vec(width, height, texels))
    }

    #[test]
    fn a_digest_tells_pixels_sizes_and_formats_apart() {
        let plain = frame(4, 2, 7);
        assert_eq!(digest(&plain), digest(&plain.clone()));
        let ten_bit = ColorPlane::Rgb10a2(Plane::from_vec(4, 2, vec![Rgb10a2(7); 8]));
        for other in [frame(2, 4, 7), frame(4, 2, 6), ten_bit] {
            assert_ne!(digest(&plain), digest(&other));
        }
        assert_eq!(digest(&plain).len(), 32);
    }

    #[test]
    fn the_digest_of_all_depends_on_the_order() {
        let all = |words: [u32; 2]| {
            let mut digester = FrameDigester::default();
            for word in words {
                digester.add(&frame(4, 2, word));
            }
            digester.all()
        };
        assert_eq!(all([1, 2]), all([1, 2]));
        assert_ne!(all([1, 2]), all([2, 1]));
    }
}
