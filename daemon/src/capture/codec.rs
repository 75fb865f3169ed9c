//! Plane codec: how the bytes of one plane stand in the file.
//!
//! A plane is filtered (or not), then compressed (or not), on its own, and carries the xxh3-128 of
//! its raw bytes, so "the replay saw the very bytes that were recorded" can be proved. Decoding
//! allocates the raw size that the frame record declares, which the reader has checked against the
//! stream's format before, and nothing else that grows with what the file says.

use xxhash_rust::xxh3::xxh3_128;

use super::filter::{self, PixelLayout};

/// Compression of a plane.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Codec {
    /// As it is.
    Raw,
    /// LZ4 block, without a length prefix.
    Lz4,
    /// Zstandard frame, level 1.
    Zstd,
}

/// What is done to a plane before compression.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Filter {
    /// Nothing.
    None,
    /// Steps between neighbours, byte by significance: see [`super::filter`].
    ShuffleDelta,
}

/// A codec and a filter. [`Coding::FAST`] for recording live, [`Coding::SMALL`] for files to keep.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Coding {
    /// Applied last when writing.
    pub codec: Codec,
    /// Applied first when writing.
    pub filter: Filter,
}

impl Coding {
    /// No work at all: the disk is the limit.
    pub const RAW: Self = Self { codec: Codec::Raw, filter: Filter::None };
    /// Keeps up with an application on one core.
    pub const FAST: Self = Self { codec: Codec::Lz4, filter: Filter::None };
    /// The smallest file.
    pub const SMALL: Self = Self { codec: Codec::Zstd, filter: Filter::ShuffleDelta };
    /// Every combination.
    pub const ALL: [Self; 6] = [
        Self::RAW,
        Self::FAST,
        Self { codec: Codec::Zstd, filter: Filter::None },
        Self { codec: Codec::Raw, filter: Filter::ShuffleDelta },
        Self { codec: Codec::Lz4, filter: Filter::ShuffleDelta },
        Self::SMALL,
    ];

    /// Name in reports: `raw`, `lz4`, `zstd`, with `+delta` where the filter is on.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match (self.codec, self.filter) {
            (Codec::Raw, Filter::None) => "raw",
            (Codec::Lz4, Filter::None) => "lz4",
            (Codec::Zstd, Filter::None) => "zstd",
            (Codec::Raw, Filter::ShuffleDelta) => "raw+delta",
            (Codec::Lz4, Filter::ShuffleDelta) => "lz4+delta",
            (Codec::Zstd, Filter::ShuffleDelta) => "zstd+delta",
        }
    }

    /// Numbers in the file: codec, filter.
    #[must_use]
    pub(super) const fn to_wire(self) -> [u8; 2] {
        let codec = match self.codec {
            Codec::Raw => 0,
            Codec::Lz4 => 1,
            Codec::Zstd => 2,
        };
        let filter = match self.filter {
            Filter::None => 0,
            Filter::ShuffleDelta => 1,
        };
        [codec, filter]
    }

    /// Inverse of [`Coding::to_wire`]; None for numbers that this version does not know.
    #[must_use]
    pub(super) fn from_wire(wire: [u8; 2]) -> Option<Self> {
        Self::ALL.into_iter().find(|coding| coding.to_wire() == wire)
    }
}

/// Level of [`Codec::Zstd`]: the lowest of the regular ones.
const ZSTD_LEVEL: i32 = 1;

/// xxh3-128 of the raw bytes of a plane.
#[must_use]
pub fn plane_hash(raw: &[u8]) -> u128 {
    xxh3_128(raw)
}

/// Compresses planes, keeping its buffers and its zstd context from plane to plane.
#[derive(Default)]
pub(super) struct Encoder {
    filtered: Vec<u8>,
    compressed: Vec<u8>,
    zstd: Option<zstd::bulk::Compressor<'static>>,
}

impl std::fmt::Debug for Encoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Encoder").finish_non_exhaustive()
    }
}

impl Encoder {
    /// Encodes `raw`, a whole number of pixels of `layout`. The bytes stay valid until the next
    /// call. Where compression would grow the plane, it is stored with [`Codec::Raw`] instead.
    pub(super) fn encode<'a>(
        &'a mut self,
        raw: &'a [u8],
        layout: PixelLayout,
        wanted: Coding,
    ) -> std::io::Result<(&'a [u8], Coding)> {
        let input = match wanted.filter {
            Filter::None => raw,
            Filter::ShuffleDelta => {
                self.filtered.resize(raw.len(), 0);
                filter::forward(raw, layout, &mut self.filtered);
                &self.filtered
            }
        };
        let length = match wanted.codec {
            Codec::Raw => return Ok((input, wanted)),
            Codec::Lz4 => {
                let bound = lz4_flex::block::get_maximum_output_size(input.len());
                self.compressed.resize(bound, 0);
                lz4_flex::block::compress_into(input, &mut self.compressed)
                    .map_err(std::io::Error::other)?
            }
            Codec::Zstd => {
                self.compressed.resize(zstd::zstd_safe::compress_bound(input.len()), 0);
                let zstd = match &mut self.zstd {
                    Some(zstd) => zstd,
                    none => none.insert(zstd::bulk::Compressor::new(ZSTD_LEVEL)?),
                };
                zstd.compress_to_buffer(input, &mut self.compressed)?
            }
        };
        if length >= raw.len() {
            return Ok((raw, Coding::RAW));
        }
        Ok((&self.compressed[..length], wanted))
    }
}

/// Decodes `stored` into exactly `raw_len` bytes. The error says what was found instead.
pub(super) fn decode(
    stored: Vec<u8>,
    raw_len: usize,
    layout: PixelLayout,
    coding: Coding,
) -> Result<Vec<u8>, String> {
    let decompressed = match coding.codec {
        Codec::Raw => stored,
        Codec::Lz4 => {
            let mut out = vec![0; raw_len];
            let length = lz4_flex::block::decompress_into(&stored, &mut out)
                .map_err(|error| format!("an LZ4 block with an error: {error}"))?;
            out.truncate(length);
            out
        }
        Codec::Zstd => zstd::bulk::decompress(&stored, raw_len)
            .map_err(|error| format!("a zstd frame with an error: {error}"))?,
    };
    if decompressed.len() != raw_len {
        return Err(format!("{} bytes", decompressed.len()));
    }
    Ok(match coding.filter {
        Filter::None => decompressed,
        Filter::ShuffleDelta => {
            let mut raw = vec![0; raw_len];
            filter::inverse(&decompressed, layout, &mut raw);
            raw
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rgba() -> PixelLayout {
        PixelLayout::new(1, 4).unwrap()
    }

    proptest! {
        #[test]
        fn every_coding_gives_back_the_bytes(
            pixels in proptest::collection::vec(any::<[u8; 4]>(), 1..2000),
            smooth: bool,
        ) {
            let raw: Vec<u8> = if smooth {
                (0..pixels.len()).flat_map(|i| [(i / 9) as u8, 7, (i / 5) as u8, 255]).collect()
            } else {
                pixels.concat()
            };
            let mut encoder = Encoder::default();
            for wanted in Coding::ALL {
                let (stored, coding) = encoder.encode(&raw, rgba(), wanted).unwrap();
                prop_assert!(stored.len() <= raw.len(), "{} grew the plane", coding.name());
                let back = decode(stored.to_vec(), raw.len(), rgba(), coding);
                prop_assert_eq!(back.as_ref(), Ok(&raw), "{}", coding.name());
            }
        }

        #[test]
        fn arbitrary_bytes_decode_to_the_declared_length_or_an_error(
            stored in proptest::collection::vec(any::<u8>(), 0..300),
            pixels in 0_usize..200,
        ) {
            for coding in Coding::ALL {
                if let Ok(raw) = decode(stored.clone(), pixels * 4, rgba(), coding) {
                    prop_assert_eq!(raw.len(), pixels * 4);
                }
            }
        }
    }

    #[test]
    fn smooth_planes_shrink_with_every_codec() {
        let raw: Vec<u8> = (0..64_000_u32).flat_map(|i| (i / 7).to_le_bytes()).collect();
        let layout = PixelLayout::new(4, 1).unwrap();
        let mut encoder = Encoder::default();
        for wanted in [Coding::FAST, Coding::SMALL] {
            let (stored, coding) = encoder.encode(&raw, layout, wanted).unwrap();
            assert_eq!(coding, wanted);
            assert!(stored.len() < raw.len() / 2, "{}: {}", coding.name(), stored.len());
        }
    }

    #[test]
    fn a_frame_that_inflates_past_the_declared_length_is_refused() {
        let bomb = zstd::bulk::compress(&vec![0; 1 << 20], 1).unwrap();
        let coding = Coding { codec: Codec::Zstd, filter: Filter::None };
        let error = decode(bomb, 4096, rgba(), coding).unwrap_err();
        assert!(error.contains("zstd"), "{error}");
    }

    #[test]
    fn unknown_codings_are_refused() {
        assert_eq!(Coding::from_wire([3, 0]), None);
        assert_eq!(Coding::from_wire([0, 2]), None);
        for coding in Coding::ALL {
            assert_eq!(Coding::from_wire(coding.to_wire()), Some(coding));
        }
    }
}
