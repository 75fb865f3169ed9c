//! UI planes that came between key frames: one message each, description and pixels.
//!
//! The description is a frame record whose body is that of the protocol's UI plane and whose only
//! plane is the interface; so the same hashes cover it.

use foreframe_protocol::{Body as _, PlaneKind, UiPlane};

use super::index::Span;
use super::record::{BadRecord, FrameRecord, PlaneEntry, PlaneInfo};

/// Bytes of the length in front of the record.
pub(super) const LENGTH_BYTES: u64 = 4;

/// A UI plane that arrived between key frames, without its pixels.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CapturedUi {
    /// Position of its stream in [`super::Capture::streams`].
    pub stream: usize,
    /// When it arrived, nanoseconds of the monotonic clock.
    pub arrived_at_ns: u64,
    /// What the application said of it. Offset and stride speak of the application's memory.
    pub ui: UiPlane,
}

/// What the index keeps of one.
#[derive(Clone, Debug)]
pub(super) struct UiEntry {
    pub(super) captured: CapturedUi,
    pub(super) entry: PlaneEntry,
    /// The stored pixels.
    pub(super) stored: Span,
}

/// Whether a plane is the one that `ui` describes.
pub(super) fn check_ui(ui: &UiPlane, info: &PlaneInfo) -> Result<(), BadRecord> {
    let is_first = info.kind == PlaneKind::Ui && info.which == 0;
    let described = (ui.plane.width, ui.plane.height, ui.plane.valid);
    if is_first && described == (info.width, info.height, info.valid) {
        return Ok(());
    }
    let found = format!("{} of {}x{}", info.kind.name(), info.width, info.height);
    let expected = format!("a ui plane of {} as described", ui.plane.size());
    Err(BadRecord::new(expected, found))
}

/// The message of a UI plane whose pixels are stored as `stored`.
pub(super) fn message(
    arrived_at_ns: u64,
    ui: &UiPlane,
    plane: PlaneEntry,
    stored: &[u8],
) -> Vec<u8> {
    let record = FrameRecord {
        arrived_at_ns,
        content_time_ns: arrived_at_ns,
        submit: ui.to_bytes(),
        planes: vec![plane],
    };
    let record = record.to_bytes();
    let length = u32::try_from(record.len()).unwrap_or(u32::MAX);
    [&length.to_le_bytes()[..], &record, stored].concat()
}

/// What a record says; `stored_len` bytes follow it, and it is dated `arrived_at_ns`.
pub(super) fn parse(
    record: &[u8],
    stored_len: u64,
    arrived_at_ns: u64,
) -> Result<(UiPlane, PlaneEntry), BadRecord> {
    let record = FrameRecord::parse(record)?;
    if record.arrived_at_ns != arrived_at_ns {
        return Err(BadRecord::new(
            format!("time {} of the record", record.arrived_at_ns),
            arrived_at_ns,
        ));
    }
    let ui =
        UiPlane::parse(&record.submit).map_err(|error| BadRecord::new("a ui-plane body", error))?;
    let [plane] = record.planes[..] else {
        return Err(BadRecord::new("one plane", record.planes.len()));
    };
    check_ui(&ui, &plane.info)?;
    if plane.stored_len != stored_len {
        return Err(BadRecord::new(format!("{} stored bytes", plane.stored_len), stored_len));
    }
    Ok((ui, plane))
}
