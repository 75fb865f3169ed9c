//! The writing half of the container: sealed messages into MCAP chunks, one chunk per call.
//!
//! Chunks are uncompressed, carry a CRC, are built in memory and written once, and the file is
//! flushed after each, so a crash costs at most the chunk that was being written. What the bytes
//! of stream, submit, late-camera and UI messages mean is the business of [`super::writer`].

use std::collections::BTreeMap;
use std::io::Write;

use foreframe_protocol::UiPlane;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;

use super::codec::{Coding, Encoder, plane_hash};
use super::error::CaptureError;
use super::record::{self, BadRecord, FrameRecord, MAX_PLANES, MAX_RECORD, PlaneEntry, PlaneInfo};
use super::schema::{self, Topic};
use super::session::{Gap, SessionInfo};
use super::ui_plane;

/// One plane to record.
#[derive(Clone, Copy, Debug)]
pub struct PlaneBytes<'a> {
    /// What it is. `which` counts the planes of one kind in the frame from 0.
    pub info: PlaneInfo,
    /// Bytes from one row to the next, at least `info.row_bytes()`. The padding is not recorded.
    pub stride: u32,
    /// Pixels; row `y` starts at `y * stride`. The last row may lack its padding; more than that is
    /// a plane of another format, and refused.
    pub bytes: &'a [u8],
}

impl<'a> PlaneBytes<'a> {
    /// A plane without padding.
    #[must_use]
    pub fn tight(info: PlaneInfo, bytes: &'a [u8]) -> Self {
        Self { info, stride: u32::try_from(info.row_bytes()).unwrap_or(u32::MAX), bytes }
    }

    fn check(&self) -> Result<(), BadRecord> {
        record::check_plane(&self.info)?;
        let (row, stride) = (self.info.row_bytes(), u64::from(self.stride));
        if stride < row {
            return Err(BadRecord::new(format!("a stride of at least {row} bytes"), stride));
        }
        let most = stride * u64::from(self.info.height);
        if self.bytes.len() as u64 > most {
            return Err(BadRecord::new(
                format!("at most {most} bytes of {}", self.info.kind.name()),
                self.bytes.len(),
            ));
        }
        let needed = stride * (u64::from(self.info.height) - 1) + row;
        if (self.bytes.len() as u64) < needed {
            return Err(BadRecord::new(
                format!("{needed} bytes of {}", self.info.kind.name()),
                self.bytes.len(),
            ));
        }
        Ok(())
    }

    /// The pixels without padding, through `scratch` where there is any.
    fn tight_bytes<'b>(&'b self, scratch: &'b mut Vec<u8>) -> &'b [u8] {
        let (row, stride) = (self.info.row_bytes() as usize, self.stride as usize);
        if row == stride {
            return &self.bytes[..row * self.info.height as usize];
        }
        scratch.clear();
        for line in self.bytes.chunks(stride).take(self.info.height as usize) {
            scratch.extend_from_slice(&line[..row]);
        }
        scratch
    }
}

/// Writes a capture's chunks.
pub(super) struct Container<W: Write> {
    mcap: mcap::Writer<NoSeek<W>>,
    channels: BTreeMap<String, u16>,
    encoder: Encoder,
    tight: Vec<u8>,
}

impl<W: Write> std::fmt::Debug for Container<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Container").field("channels", &self.channels).finish_non_exhaustive()
    }
}

/// When a message is dated, and its number among those of its topic.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamp {
    pub(super) log_time: u64,
    pub(super) publish_time: u64,
    pub(super) sequence: u32,
}

impl<W: Write> Container<W> {
    pub(super) fn new(out: W, session: &SessionInfo) -> Result<Self, CaptureError> {
        let mcap = WriteOptions::new()
            .profile(format!("{}{}", schema::PROFILE_PREFIX, schema::VERSION))
            .library(session.software.clone())
            .compression(None)
            .chunk_size(None)
            .disable_seeking(true)
            .create(NoSeek::new(out))?;
        let mut container = Self {
            mcap,
            channels: BTreeMap::new(),
            encoder: Encoder::default(),
            tight: Vec::new(),
        };
        let text = serde_json::to_vec_pretty(session).expect("strings and integers become JSON");
        container.message(Topic::Session, at(0), &text)?;
        container.mcap.flush()?;
        Ok(container)
    }

    pub(super) fn stream(&mut self, stream: u32, create: &[u8]) -> Result<(), CaptureError> {
        let mut body = create.to_vec();
        record::seal(&mut body);
        self.message(Topic::Stream(stream), at(0), &body)?;
        Ok(self.mcap.flush()?)
    }

    pub(super) fn gap(&mut self, gap: &Gap) -> Result<(), CaptureError> {
        let text = serde_json::to_vec(gap).expect("strings and integers become JSON");
        self.message(Topic::Gap, at(gap.to_ns), &text)?;
        Ok(self.mcap.flush()?)
    }

    pub(super) fn late_camera(
        &mut self,
        stream: u32,
        stamp: Stamp,
        pose: &[u8],
    ) -> Result<(), CaptureError> {
        let mut body = pose.to_vec();
        record::seal(&mut body);
        self.message(Topic::LateCamera(stream), stamp, &body)?;
        Ok(self.mcap.flush()?)
    }

    /// Writes a UI plane as one chunk. Returns the stored bytes.
    pub(super) fn ui_plane(
        &mut self,
        stream: u32,
        stamp: Stamp,
        ui: &UiPlane,
        plane: &PlaneBytes<'_>,
        coding: Coding,
    ) -> Result<u64, CaptureError> {
        let checked = plane.check().and_then(|()| ui_plane::check_ui(ui, &plane.info));
        checked.map_err(|bad| unrecordable("a UI plane", bad))?;
        let (entry, stored) = self.encode(plane, coding)?;
        let message = ui_plane::message(stamp.log_time, ui, entry, &stored);
        self.message(Topic::UiPlane(stream), stamp, &message)?;
        self.mcap.flush()?;
        Ok(entry.stored_len)
    }

    /// A plane as it is stored, and its entry.
    fn encode(
        &mut self,
        plane: &PlaneBytes<'_>,
        coding: Coding,
    ) -> Result<(PlaneEntry, Vec<u8>), CaptureError> {
        let raw = plane.tight_bytes(&mut self.tight);
        let (stored, coding) = self
            .encoder
            .encode(raw, plane.info.layout, coding)
            .map_err(|source| CaptureError::Io { doing: "compressing a plane", source })?;
        let (stored_len, hash) = (stored.len() as u64, plane_hash(raw));
        Ok((PlaneEntry { info: plane.info, coding, stored_len, hash }, stored.to_vec()))
    }

    /// Writes one frame as one chunk. `stamp.log_time` is its arrival. Returns the stored bytes.
    pub(super) fn frame(
        &mut self,
        stream: u32,
        stamp: Stamp,
        submit: &[u8],
        planes: &[PlaneBytes<'_>],
        coding: Coding,
    ) -> Result<u64, CaptureError> {
        check_frame(submit, planes).map_err(|bad| unrecordable("a frame", bad))?;
        // The record names the stored length of every plane, so all are encoded before it stands
        // in the chunk. They wait in one buffer each: the frame, once, compressed.
        let mut entries = Vec::with_capacity(planes.len());
        let mut stored_planes = Vec::with_capacity(planes.len());
        for plane in planes {
            let (entry, stored) = self.encode(plane, coding)?;
            entries.push(entry);
            stored_planes.push(stored);
        }
        let record = FrameRecord {
            arrived_at_ns: stamp.log_time,
            content_time_ns: stamp.publish_time,
            submit: submit.to_vec(),
            planes: entries,
        };
        self.message(Topic::Frame(stream), stamp, &record.to_bytes())?;
        for (entry, stored) in record.planes.iter().zip(&stored_planes) {
            let topic = Topic::Plane(stream, entry.info.kind, entry.info.which);
            self.message(topic, stamp, stored)?;
        }
        self.mcap.flush()?;
        Ok(record.planes.iter().map(|entry| entry.stored_len).sum())
    }

    pub(super) fn finish(mut self) -> Result<W, CaptureError> {
        self.mcap.finish()?;
        Ok(self.mcap.into_inner().into_inner())
    }

    fn message(&mut self, topic: Topic, stamp: Stamp, data: &[u8]) -> Result<(), CaptureError> {
        let name = topic.name();
        let channel_id = match self.channels.get(&name) {
            Some(&id) => id,
            None => {
                let schema = topic.schema();
                let schema_id =
                    self.mcap.add_schema(schema.name, schema.encoding, schema.text.as_bytes())?;
                let metadata = BTreeMap::new();
                let id =
                    self.mcap.add_channel(schema_id, &name, schema.message_encoding, &metadata)?;
                self.channels.insert(name, id);
                id
            }
        };
        let Stamp { log_time, publish_time, sequence } = stamp;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        Ok(self.mcap.write_to_known_channel(&header, data)?)
    }
}

fn at(time: u64) -> Stamp {
    Stamp { log_time: time, publish_time: time, sequence: 0 }
}

fn check_frame(submit: &[u8], planes: &[PlaneBytes<'_>]) -> Result<(), BadRecord> {
    if planes.len() > MAX_PLANES {
        return Err(BadRecord::new(format!("at most {MAX_PLANES} planes"), planes.len()));
    }
    let most = MAX_RECORD / 2;
    if submit.len() > most {
        return Err(BadRecord::new(format!("a submit body of at most {most} bytes"), submit.len()));
    }
    for (index, plane) in planes.iter().enumerate() {
        plane.check()?;
        let before = planes[..index].iter().filter(|p| p.info.kind == plane.info.kind).count();
        if usize::from(plane.info.which) != before {
            return Err(BadRecord::new(
                format!("{} plane number {before}", plane.info.kind.name()),
                plane.info.which,
            ));
        }
    }
    Ok(())
}

pub(super) fn unrecordable(what: &'static str, bad: BadRecord) -> CaptureError {
    CaptureError::Unrecordable { what, expected: bad.expected, found: bad.found }
}
