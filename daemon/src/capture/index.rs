//! The index of a capture: found by walking record headers, never by trusting the summary.
//!
//! A capture that a crash cut off has no summary, so the walk is the only way for it; using the
//! same way for whole files means that recovery is not a special case. The walk reads headers and
//! small messages, skips pixels, and takes a few reads per frame. What it acts on is checked:
//! session, streams and gaps by the CRC of their chunk or their own hash, frame records by theirs.
//!
//! [`super::walk`] does the walking; here is what it finds, and what must hold before it starts:
//! the file is an MCAP file, a capture, and of a version that is understood.

use std::collections::BTreeMap;
use std::io;

use foreframe_protocol::{LateCamera, PlaneMap};
use mcap::records::{Record, op};

use super::error::CaptureError;
use super::record::PlaneEntry;
use super::schema;
use super::session::{Gap, SessionInfo};
use super::source::{ReadAt, Window};
use super::ui_plane::UiEntry;
use super::walk::{Stop, Walk};

/// Where and why a capture ends early, or a chunk could not be used.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Damage {
    /// Offset in the file.
    pub at: u64,
    /// What the format asks for.
    pub expected: String,
    /// What is there.
    pub found: String,
}

impl std::fmt::Display for Damage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "at byte {}: expected {}, found {}", self.at, self.expected, self.found)
    }
}

/// One stream of the file.
#[derive(Clone, Debug)]
pub(super) struct StreamEntry {
    pub(super) id: u32,
    /// Offset of its message.
    pub(super) at: u64,
    /// Body of its create-stream message.
    pub(super) create: Vec<u8>,
}

/// One whole frame of the file.
#[derive(Clone, Debug)]
pub(super) struct FrameEntry {
    /// Position in [`Index::streams`].
    pub(super) stream: usize,
    pub(super) content_time_ns: u64,
    pub(super) arrived_at_ns: u64,
    /// Offset and length of the frame record.
    pub(super) record: Span,
    /// Offset and length of the stored bytes of each plane of the record.
    pub(super) planes: Vec<Span>,
}

/// A pose that arrived after a key frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CapturedPose {
    /// Position of its stream in [`super::Capture::streams`].
    pub stream: usize,
    /// When it arrived, nanoseconds of the monotonic clock.
    pub arrived_at_ns: u64,
    /// The pose.
    pub pose: LateCamera,
}

/// A run of bytes in the file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Span {
    pub(super) at: u64,
    pub(super) len: u64,
}

impl Span {
    pub(super) fn end(self) -> u64 {
        self.at + self.len
    }
}

/// Planes of one kind that the frames of a capture have.
#[derive(Clone, Debug, Default)]
pub(super) struct PlaneStatistics {
    pub(super) planes: u64,
    pub(super) raw_bytes: u64,
    pub(super) stored_bytes: u64,
    /// Planes per name of coding.
    pub(super) codings: BTreeMap<&'static str, u64>,
}

impl PlaneStatistics {
    pub(super) fn count(&mut self, plane: &PlaneEntry) {
        self.planes += 1;
        self.raw_bytes += plane.info.raw_len();
        self.stored_bytes += plane.stored_len;
        *self.codings.entry(plane.coding.name()).or_default() += 1;
    }
}

/// Everything known about a capture without reading a pixel.
#[derive(Clone, Debug)]
pub(super) struct Index {
    pub(super) session: SessionInfo,
    pub(super) streams: Vec<StreamEntry>,
    pub(super) frames: Vec<FrameEntry>,
    pub(super) late_cameras: Vec<CapturedPose>,
    pub(super) ui_planes: Vec<UiEntry>,
    pub(super) gaps: Vec<Gap>,
    pub(super) planes: PlaneMap<PlaneStatistics>,
    pub(super) size: u64,
    /// Set where the file ends before its end marker, or its chain of records breaks.
    pub(super) tail: Option<Damage>,
    /// Chunks, or parts of them, that could not be used.
    pub(super) damaged: Vec<Damage>,
}

/// Opcode and length in front of every record.
const RECORD_HEAD: u64 = 9;
/// Longest header or channel record that is read; ours are far shorter.
pub(super) const MAX_SMALL: usize = 64 * 1024;

fn reading(source: io::Error) -> CaptureError {
    CaptureError::Io { doing: "reading a capture", source }
}

impl Index {
    /// Walks `source`.
    pub(super) fn scan<S: ReadAt>(source: &S) -> Result<Self, CaptureError> {
        let mut window = Window::new(source).map_err(reading)?;
        check_magic(&mut window)?;
        let header_end = check_header(&mut window)?;
        let mut walk = Walk::new(window);
        let tail = match walk.records(header_end) {
            Ok(()) => None,
            Err(Stop::Broken(damage)) => Some(damage),
            Err(Stop::Io(error)) => return Err(reading(error)),
        };
        walk.finish(tail)
    }
}

fn check_magic<S: ReadAt>(window: &mut Window<'_, S>) -> Result<(), CaptureError> {
    let len = usize::try_from(window.size().min(8)).unwrap_or(8);
    let found = window.bytes(0, len).map_err(reading)?.unwrap_or_default();
    if found == mcap::MAGIC {
        return Ok(());
    }
    let mut expected = [0; 8];
    expected.copy_from_slice(mcap::MAGIC);
    Err(CaptureError::NotMcap { expected, found: found.to_vec() })
}

/// Checks profile and version; returns where the header ends.
fn check_header<S: ReadAt>(window: &mut Window<'_, S>) -> Result<u64, CaptureError> {
    let at = mcap::MAGIC.len() as u64;
    let empty = CaptureError::Empty { len: window.size() };
    let Some((opcode, body)) = record_head(window, at).map_err(reading)? else {
        return Err(empty);
    };
    let damaged = |expected: &str, found: String| CaptureError::Damaged {
        what: "the header",
        at,
        expected: expected.to_owned(),
        found,
    };
    if opcode != op::HEADER || body.len > MAX_SMALL as u64 {
        let expected = format!("a header record of at most {MAX_SMALL} bytes");
        return Err(damaged(&expected, format!("record {opcode:#04x} of {} bytes", body.len)));
    }
    let Some(bytes) = window.bytes(body.at, small(body.len)).map_err(reading)? else {
        return Err(empty);
    };
    let profile = match mcap::parse_record(op::HEADER, bytes) {
        Ok(Record::Header(header)) => header.profile,
        Ok(other) => return Err(damaged("a header", format!("{other:?}"))),
        Err(error) => return Err(damaged("a header", error.to_string())),
    };
    let Some(version) = profile.strip_prefix(schema::PROFILE_PREFIX) else {
        return Err(CaptureError::Foreign { expected: schema::PROFILE_PREFIX, found: profile });
    };
    if version != schema::VERSION.to_string() {
        let found = version.to_owned();
        return Err(CaptureError::Version { expected: schema::VERSION, found });
    }
    Ok(body.end())
}

/// A length that was checked to be small.
pub(super) fn small(len: u64) -> usize {
    usize::try_from(len).unwrap_or(usize::MAX)
}

/// Opcode and body of the record at `at`; None where the file ends inside its head.
pub(super) fn record_head<S: ReadAt>(
    window: &mut Window<'_, S>,
    at: u64,
) -> io::Result<Option<(u8, Span)>> {
    let Some([opcode, len @ ..]) = window.array::<{ RECORD_HEAD as usize }>(at)? else {
        return Ok(None);
    };
    Ok(Some((opcode, Span { at: at + RECORD_HEAD, len: u64::from_le_bytes(len) })))
}
