//! Frame records: the description of a frame and its planes, as `schemas/frame.txt` lays it out.
//!
//! A record ends in a hash of itself and names the hash of each plane, so every byte that a reader
//! acts on is covered. Parsing takes any bytes and never allocates more than they hold.

use xxhash_rust::xxh3::xxh3_64;

use super::codec::Coding;
use super::filter::PixelLayout;
use foreframe_protocol::limits::MAX_SIZE;
use foreframe_protocol::{PlaneKind, Rect};

/// Everything about one plane but its bytes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlaneInfo {
    /// What it shows.
    pub kind: PlaneKind,
    /// Which one of its kind in the frame, from 0.
    pub which: u8,
    /// How a pixel divides into elements.
    pub layout: PixelLayout,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The part that holds the image.
    pub valid: Rect,
    /// Sub-pixel offset of the samples, pixels of this plane, x right, y down.
    pub jitter: [f32; 2],
    /// Content time that motion points back to.
    pub motion_from_ns: Option<u64>,
}

impl PlaneInfo {
    /// Bytes of one row without padding.
    #[must_use]
    pub fn row_bytes(&self) -> u64 {
        u64::from(self.width) * self.layout.pixel_bytes() as u64
    }

    /// Bytes of the plane without padding.
    #[must_use]
    pub fn raw_len(&self) -> u64 {
        self.row_bytes() * u64::from(self.height)
    }
}

/// One entry of the plane table of a frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct PlaneEntry {
    pub(super) info: PlaneInfo,
    pub(super) coding: Coding,
    pub(super) stored_len: u64,
    pub(super) hash: u128,
}

/// A frame record, parsed.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct FrameRecord {
    pub(super) arrived_at_ns: u64,
    pub(super) content_time_ns: u64,
    pub(super) submit: Vec<u8>,
    pub(super) planes: Vec<PlaneEntry>,
}

/// Why bytes are no record: what was expected, what was found.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct BadRecord {
    pub(super) expected: String,
    pub(super) found: String,
}

impl BadRecord {
    pub(super) fn new(expected: impl Into<String>, found: impl ToString) -> Self {
        Self { expected: expected.into(), found: found.to_string() }
    }
}

/// Most planes that one frame can have.
pub(super) const MAX_PLANES: usize = 16;
/// Longest frame record: a submit body fits a packet of the protocol, 1 KiB.
pub(super) const MAX_RECORD: usize = 8192;
const NO_TIME: u64 = u64::MAX;
const ENTRY_LEN: usize = 80;
const HEAD_LEN: usize = 24;
const HASH_LEN: usize = 8;

/// Appends the xxh3-64 of `bytes` to them.
pub(super) fn seal(bytes: &mut Vec<u8>) {
    let hash = xxh3_64(bytes);
    bytes.extend(hash.to_le_bytes());
}

/// Takes the hash off the end of a sealed record, if it is right.
pub(super) fn unseal(bytes: &[u8]) -> Result<&[u8], BadRecord> {
    let Some((body, stored)) = bytes.split_last_chunk::<HASH_LEN>() else {
        return Err(BadRecord::new(
            "a record that ends in its hash",
            format!("{} bytes", bytes.len()),
        ));
    };
    let (stored, found) = (u64::from_le_bytes(*stored), xxh3_64(body));
    if stored == found {
        Ok(body)
    } else {
        Err(BadRecord::new(format!("hash {stored:016x}"), format!("{found:016x}")))
    }
}

/// Reads little-endian fields one after another.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], BadRecord> {
        let Some((head, rest)) = self.0.split_first_chunk::<N>() else {
            return Err(BadRecord::new(format!("{N} more bytes"), self.0.len()));
        };
        self.0 = rest;
        Ok(*head)
    }

    fn bytes(&mut self, len: usize) -> Result<&'a [u8], BadRecord> {
        let Some((head, rest)) = self.0.split_at_checked(len) else {
            return Err(BadRecord::new(format!("{len} more bytes"), self.0.len()));
        };
        self.0 = rest;
        Ok(head)
    }

    fn u32(&mut self) -> Result<u32, BadRecord> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn f32(&mut self) -> Result<f32, BadRecord> {
        Ok(f32::from_le_bytes(self.take()?))
    }

    fn u64(&mut self) -> Result<u64, BadRecord> {
        Ok(u64::from_le_bytes(self.take()?))
    }
}

impl PlaneEntry {
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        let info = &self.info;
        let [codec, filter] = self.coding.to_wire();
        let PixelLayout { element_bytes, channels } = info.layout;
        let kind = u8::try_from(info.kind.code()).unwrap_or(u8::MAX);
        out.extend([kind, info.which, codec, filter, element_bytes, channels, 0, 0]);
        let Rect { x, y, width, height } = info.valid;
        for number in [info.width, info.height, x, y, width, height] {
            out.extend(number.to_le_bytes());
        }
        for jitter in info.jitter {
            out.extend(jitter.to_le_bytes());
        }
        for number in [info.motion_from_ns.unwrap_or(NO_TIME), info.raw_len(), self.stored_len] {
            out.extend(number.to_le_bytes());
        }
        out.extend(self.hash.to_le_bytes());
    }

    fn parse(fields: &mut Fields<'_>) -> Result<Self, BadRecord> {
        let [kind, which, codec, filter, element_bytes, channels, _, _] = fields.take()?;
        let kind = PlaneKind::from_code(u32::from(kind))
            .ok_or_else(|| BadRecord::new("a plane kind 0 to 4", kind))?;
        let coding = Coding::from_wire([codec, filter]).ok_or_else(|| {
            BadRecord::new("codec 0 to 2 and filter 0 or 1", format!("{codec} and {filter}"))
        })?;
        let layout = PixelLayout::new(element_bytes, channels).ok_or_else(|| {
            BadRecord::new(
                "1 to 4 elements of 1, 2 or 4 bytes",
                format!("{channels} of {element_bytes}"),
            )
        })?;
        let [width, height] = [fields.u32()?, fields.u32()?];
        let [x, y] = [fields.u32()?, fields.u32()?];
        let valid = Rect { x, y, width: fields.u32()?, height: fields.u32()? };
        let jitter = [fields.f32()?, fields.f32()?];
        let motion_from_ns = Some(fields.u64()?).filter(|&time| time != NO_TIME);
        let info = PlaneInfo { kind, which, layout, width, height, valid, jitter, motion_from_ns };
        let (raw_len, stored_len) = (fields.u64()?, fields.u64()?);
        let hash = u128::from_le_bytes(fields.take()?);
        check_plane(&info)?;
        if raw_len != info.raw_len() {
            return Err(BadRecord::new(format!("{} raw bytes", info.raw_len()), raw_len));
        }
        if stored_len > raw_len {
            return Err(BadRecord::new(format!("at most {raw_len} stored bytes"), stored_len));
        }
        Ok(Self { info, coding, stored_len, hash })
    }
}

/// Whether a plane has a size that can be stored and a rectangle inside it.
pub(super) fn check_plane(info: &PlaneInfo) -> Result<(), BadRecord> {
    let size = 1..=MAX_SIZE;
    if !size.contains(&info.width) || !size.contains(&info.height) {
        return Err(BadRecord::new(
            format!("a {} plane of 1x1 to {MAX_SIZE}x{MAX_SIZE}", info.kind.name()),
            format!("{}x{}", info.width, info.height),
        ));
    }
    let valid = info.valid;
    if !valid.fits(info.width, info.height) {
        return Err(BadRecord::new(
            format!("a valid rectangle inside {}x{}", info.width, info.height),
            format!("{}x{} at {}, {}", valid.width, valid.height, valid.x, valid.y),
        ));
    }
    if !info.jitter.iter().all(|jitter| jitter.is_finite()) {
        return Err(BadRecord::new("finite jitter", format!("{:?}", info.jitter)));
    }
    Ok(())
}

impl FrameRecord {
    /// The record as it stands in the file.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let len = HEAD_LEN + self.submit.len() + ENTRY_LEN * self.planes.len() + HASH_LEN;
        let mut out = Vec::with_capacity(len);
        out.extend(self.arrived_at_ns.to_le_bytes());
        out.extend(self.content_time_ns.to_le_bytes());
        for len in [self.submit.len(), self.planes.len()] {
            out.extend(u32::try_from(len).unwrap_or(u32::MAX).to_le_bytes());
        }
        out.extend(&self.submit);
        for plane in &self.planes {
            plane.write(&mut out);
        }
        seal(&mut out);
        out
    }

    /// Parses a record.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, BadRecord> {
        let mut fields = Fields(unseal(bytes)?);
        let (arrived_at_ns, content_time_ns) = (fields.u64()?, fields.u64()?);
        let (submit_len, planes) = (fields.u32()?, fields.u32()? as usize);
        let submit = fields.bytes(submit_len as usize)?.to_vec();
        if planes > MAX_PLANES {
            return Err(BadRecord::new(format!("at most {MAX_PLANES} planes"), planes));
        }
        let planes =
            (0..planes).map(|_| PlaneEntry::parse(&mut fields)).collect::<Result<_, _>>()?;
        if !fields.0.is_empty() {
            return Err(BadRecord::new(
                "the end of the record",
                format!("{} bytes more", fields.0.len()),
            ));
        }
        Ok(Self { arrived_at_ns, content_time_ns, submit, planes })
    }
}
