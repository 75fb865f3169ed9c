//! The walk over the records of a capture: from the end of the header to the end marker.
//!
//! A chunk that is damaged inside costs its own frames: the walk goes on at the next chunk. Where
//! the chain of records itself breaks, the walk ends there and says so. A frame counts once all
//! planes that its record names have followed it; a number that is missing in the sequence of
//! frames, or in the summary's count of messages, is damage too.

use std::collections::BTreeMap;
use std::io;

use foreframe_protocol::{Body as _, LateCamera, PlaneKind, PlaneMap};
use mcap::records::{Record, op};

use super::error::CaptureError;
use super::index::{
    CapturedPose, Damage, FrameEntry, Index, MAX_SMALL, PlaneStatistics, Span, StreamEntry,
    record_head, small,
};
use super::record::{self, BadRecord, FrameRecord, MAX_RECORD, PlaneEntry};
use super::schema::Topic;
use super::session::{Gap, SessionInfo};
use super::source::{ReadAt, Window};
use super::ui_plane::{self, CapturedUi, UiEntry};

/// Longest session, stream or gap message.
const MAX_CONTROL: usize = 1024 * 1024;
/// Most damaged places that are remembered; a file with more is noise.
const MAX_DAMAGED: usize = 1000;

/// What stops the walk.
pub(super) enum Stop {
    /// The file cannot be read.
    Io(io::Error),
    /// The chain of records breaks here.
    Broken(Damage),
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

fn broken<T>(at: u64, expected: impl Into<String>, found: impl ToString) -> Result<T, Stop> {
    Err(Stop::Broken(Damage { at, expected: expected.into(), found: found.to_string() }))
}

/// A frame whose planes are still being found.
struct Pending {
    entry: FrameEntry,
    stream: u32,
    expected: Vec<PlaneEntry>,
}

/// The chunk being walked.
#[derive(Clone, Copy)]
struct Chunk {
    records: Span,
    crc: u32,
    is_checked: bool,
}

pub(super) struct Walk<'a, S> {
    window: Window<'a, S>,
    channels: BTreeMap<u16, Option<Topic>>,
    session: Option<SessionInfo>,
    streams: Vec<StreamEntry>,
    frames: Vec<FrameEntry>,
    late_cameras: Vec<CapturedPose>,
    ui_planes: Vec<UiEntry>,
    gaps: Vec<Gap>,
    planes: PlaneMap<PlaneStatistics>,
    pending: Option<Pending>,
    damaged: Vec<Damage>,
    messages: u64,
    /// Sequence number that the next frame of each stream has.
    next_frame: Vec<u32>,
}

impl<'a, S: ReadAt> Walk<'a, S> {
    pub(super) fn new(window: Window<'a, S>) -> Self {
        Self {
            window,
            channels: BTreeMap::new(),
            session: None,
            streams: Vec::new(),
            frames: Vec::new(),
            late_cameras: Vec::new(),
            ui_planes: Vec::new(),
            gaps: Vec::new(),
            planes: PlaneMap::default(),
            pending: None,
            damaged: Vec::new(),
            messages: 0,
            next_frame: Vec::new(),
        }
    }

    pub(super) fn finish(mut self, tail: Option<Damage>) -> Result<Index, CaptureError> {
        self.drop_pending();
        let size = self.window.size();
        // Whatever else was found, without these two nothing can be decoded.
        let (Some(session), false) = (self.session, self.streams.is_empty()) else {
            return match self.damaged.into_iter().next() {
                Some(Damage { at, expected, found }) => {
                    Err(CaptureError::Damaged { what: "session or stream", at, expected, found })
                }
                None => Err(CaptureError::Empty { len: size }),
            };
        };
        Ok(Index {
            session,
            streams: self.streams,
            frames: self.frames,
            late_cameras: self.late_cameras,
            ui_planes: self.ui_planes,
            gaps: self.gaps,
            planes: self.planes,
            size,
            tail,
            damaged: self.damaged,
        })
    }

    /// Walks the records of the file from `at` to the end marker.
    pub(super) fn records(&mut self, mut at: u64) -> Result<(), Stop> {
        loop {
            let body = match self.next_record(at, self.window.size())? {
                (op::DATA_END, body) => return self.summary(body),
                (op::CHUNK, body) => {
                    match self.chunk(body) {
                        Err(Stop::Broken(damage)) => self.damage(damage),
                        other => other?,
                    }
                    body
                }
                (_, body) => body,
            };
            at = body.end();
        }
    }

    /// The record at `at`, which must lie before `end`.
    fn next_record(&mut self, at: u64, end: u64) -> Result<(u8, Span), Stop> {
        let size = self.window.size();
        let Some((opcode, body)) = record_head(&mut self.window, at)? else {
            return broken(at, "a record", format!("the end of the file at byte {size}"));
        };
        // A file system that lost its tail in a power cut fills it with zeros.
        if opcode == 0 {
            return broken(at, "a record", "opcode 0");
        }
        if body.len > end.saturating_sub(body.at) {
            let found = format!("{} bytes before byte {end}", end.saturating_sub(body.at));
            return broken(at, format!("a record of {} bytes", body.len), found);
        }
        Ok((opcode, body))
    }

    /// Walks what follows the data: the number of messages must be the one that was found, and the
    /// file must end in its end marker.
    fn summary(&mut self, data_end: Span) -> Result<(), Stop> {
        // It holds a CRC of 4 bytes. Anything longer was another record once.
        if data_end.len != 4 {
            return broken(data_end.at, "the end of the data, 4 bytes", data_end.len);
        }
        let mut at = data_end.end();
        loop {
            let (opcode, body) = self.next_record(at, self.window.size())?;
            match opcode {
                op::FOOTER => return self.end_marker(body.end()),
                op::STATISTICS => self.statistics(body)?,
                _ => {}
            }
            at = body.end();
        }
    }

    fn statistics(&mut self, body: Span) -> Result<(), Stop> {
        let Some(count) = self.window.array::<8>(body.at)?.filter(|_| body.len >= 8) else {
            return broken(body.at, "statistics", format!("{} bytes", body.len));
        };
        let (count, messages) = (u64::from_le_bytes(count), self.messages);
        if count != messages && self.damaged.is_empty() {
            let expected = format!("{count} messages as the summary says");
            self.damage(Damage { at: body.at, expected, found: messages.to_string() });
        }
        Ok(())
    }

    fn end_marker(&mut self, at: u64) -> Result<(), Stop> {
        match self.window.bytes(at, mcap::MAGIC.len())? {
            Some(found) if found == mcap::MAGIC => Ok(()),
            Some(found) => {
                let found = format!("{found:02x?}");
                broken(at, "the end marker", found)
            }
            None => broken(at, "the end marker", "the end of the file"),
        }
    }

    fn damage(&mut self, damage: Damage) {
        if self.damaged.len() < MAX_DAMAGED {
            self.damaged.push(damage);
        }
    }

    fn drop_pending(&mut self) {
        if let Some(Pending { entry, expected, .. }) = self.pending.take() {
            let lacking = &expected[entry.planes.len()].info;
            let expected = format!("the {} plane of the frame", lacking.kind.name());
            self.damage(Damage { at: entry.record.at, expected, found: "none".to_owned() });
        }
    }

    /// Walks the records inside a chunk.
    fn chunk(&mut self, body: Span) -> Result<(), Stop> {
        let mut chunk = self.chunk_header(body)?;
        let (mut at, end) = (chunk.records.at, chunk.records.end());
        while at < end {
            let (opcode, body) = self.next_record(at, end)?;
            match opcode {
                op::CHANNEL => self.channel(body, &mut chunk)?,
                op::MESSAGE => self.message(body, &mut chunk)?,
                _ => {}
            }
            at = body.end();
        }
        Ok(())
    }

    fn chunk_header(&mut self, body: Span) -> Result<Chunk, Stop> {
        // start time 8, end time 8, uncompressed size 8, CRC 4, length of compression 4
        const FIXED: u64 = 32;
        let short = "a chunk header";
        if body.len < FIXED + 8 {
            return broken(body.at, short, format!("{} bytes", body.len));
        }
        let Some(fixed) = self.window.array::<32>(body.at)? else {
            return broken(body.at, short, "the end of the file");
        };
        let word = |at: usize| {
            u32::from_le_bytes([fixed[at], fixed[at + 1], fixed[at + 2], fixed[at + 3]])
        };
        let (crc, compression_len) = (word(24), word(28));
        if compression_len != 0 {
            let len = compression_len.min(16) as usize;
            let name = self.window.bytes(body.at + FIXED, len)?.unwrap_or_default();
            let found = format!("compression `{}`", String::from_utf8_lossy(name).escape_debug());
            return broken(body.at, "an uncompressed chunk", found);
        }
        let Some(len) = self.window.array::<8>(body.at + FIXED)? else {
            return broken(body.at, short, "the end of the file");
        };
        let records = Span { at: body.at + FIXED + 8, len: u64::from_le_bytes(len) };
        if records.len > body.len - FIXED - 8 {
            let expected = format!("at most {} bytes of records", body.len - FIXED - 8);
            return broken(body.at, expected, records.len);
        }
        Ok(Chunk { records, crc, is_checked: false })
    }

    fn channel(&mut self, body: Span, chunk: &mut Chunk) -> Result<(), Stop> {
        if body.len > MAX_SMALL as u64 {
            return broken(body.at, format!("a channel of at most {MAX_SMALL} bytes"), body.len);
        }
        let bytes = self.window.bytes(body.at, small(body.len))?.unwrap_or_default();
        match mcap::parse_record(op::CHANNEL, bytes) {
            Ok(Record::Channel(channel)) => {
                let topic = Topic::parse(&channel.topic);
                self.channels.insert(channel.id, topic);
                // Messages of others are skipped: one bit must not make ours theirs.
                if topic.is_none() { self.check_crc(chunk) } else { Ok(()) }
            }
            Ok(other) => broken(body.at, "a channel", format!("{other:?}")),
            Err(error) => broken(body.at, "a channel", error),
        }
    }

    fn message(&mut self, body: Span, chunk: &mut Chunk) -> Result<(), Stop> {
        // channel 2, sequence 4, log time 8, publish time 8
        const HEAD: u64 = 22;
        let head = if body.len < HEAD { None } else { self.window.array::<22>(body.at)? };
        let Some(head) = head else {
            return broken(body.at, "a message header", format!("{} bytes", body.len));
        };
        self.messages += 1;
        let channel = u16::from_le_bytes([head[0], head[1]]);
        let sequence = u32::from_le_bytes([head[2], head[3], head[4], head[5]]);
        let time = |at: usize| {
            head[at..].first_chunk().map_or(0, |bytes: &[u8; 8]| u64::from_le_bytes(*bytes))
        };
        let data = Span { at: body.at + HEAD, len: body.len - HEAD };
        let Some(&topic) = self.channels.get(&channel) else {
            return broken(body.at, "a channel that was described before", channel);
        };
        let Some(topic) = topic else { return Ok(()) };
        match topic {
            Topic::Plane(stream, kind, which) => self.plane(data, (stream, kind, which)),
            Topic::Frame(stream) => self.frame(data, stream, sequence, [time(6), time(14)]),
            Topic::LateCamera(stream) => {
                self.check_crc(chunk)?;
                self.late_camera(data, stream, time(6))
            }
            Topic::UiPlane(stream) => self.ui_plane(data, stream, time(6)),
            Topic::Session | Topic::Gap | Topic::Stream(_) => {
                self.check_crc(chunk)?;
                self.control(data, topic)
            }
        }
    }

    /// Session, stream and gap messages: small, and rare.
    fn control(&mut self, data: Span, topic: Topic) -> Result<(), Stop> {
        if data.len > MAX_CONTROL as u64 {
            return broken(data.at, format!("a message of at most {MAX_CONTROL} bytes"), data.len);
        }
        let bytes = self.window.bytes(data.at, small(data.len))?.unwrap_or_default();
        match topic {
            Topic::Session if self.session.is_none() => match serde_json::from_slice(bytes) {
                Ok(session) => self.session = Some(session),
                Err(error) => return broken(data.at, "a session", error),
            },
            Topic::Gap => match serde_json::from_slice(bytes) {
                Ok(gap) => self.gaps.push(gap),
                Err(error) => return broken(data.at, "a gap", error),
            },
            Topic::Stream(id) if self.streams.iter().all(|stream| stream.id != id) => {
                match record::unseal(bytes) {
                    Ok(create) => {
                        let (at, create) = (data.at, create.to_vec());
                        self.streams.push(StreamEntry { id, at, create });
                        self.next_frame.push(0);
                    }
                    Err(BadRecord { expected, found }) => return broken(data.at, expected, found),
                }
            }
            _ => return broken(data.at, "one such message", format!("a second {topic:?}")),
        }
        Ok(())
    }

    fn late_camera(&mut self, data: Span, stream: u32, arrived_at_ns: u64) -> Result<(), Stop> {
        if data.len > MAX_RECORD as u64 {
            return broken(data.at, format!("a pose of at most {MAX_RECORD} bytes"), data.len);
        }
        let Some(index) = self.streams.iter().position(|entry| entry.id == stream) else {
            return broken(data.at, "a stream that was described before", stream);
        };
        let bytes = self.window.bytes(data.at, small(data.len))?.unwrap_or_default();
        let pose = match record::unseal(bytes) {
            Ok(body) => LateCamera::parse(body),
            Err(BadRecord { expected, found }) => return broken(data.at, expected, found),
        };
        match pose {
            Ok(pose) => self.late_cameras.push(CapturedPose { stream: index, arrived_at_ns, pose }),
            Err(error) => return broken(data.at, "a late-camera body", error),
        }
        Ok(())
    }

    fn ui_plane(&mut self, data: Span, stream: u32, arrived_at_ns: u64) -> Result<(), Stop> {
        let Some(index) = self.streams.iter().position(|entry| entry.id == stream) else {
            return broken(data.at, "a stream that was described before", stream);
        };
        if data.len < ui_plane::LENGTH_BYTES {
            return broken(data.at, "a record and its length", format!("{} bytes", data.len));
        }
        let room = (data.len - ui_plane::LENGTH_BYTES).min(MAX_RECORD as u64);
        let length = self.window.array::<4>(data.at)?.map_or(0, u32::from_le_bytes);
        let length = u64::from(length);
        if length > room {
            return broken(data.at, format!("a record of at most {room} bytes"), length);
        }
        let record = Span { at: data.at + ui_plane::LENGTH_BYTES, len: length };
        let stored = Span { at: record.end(), len: data.end() - record.end() };
        let bytes = self.window.bytes(record.at, small(record.len))?.unwrap_or_default();
        match ui_plane::parse(bytes, stored.len, arrived_at_ns) {
            Ok((ui, entry)) => {
                let captured = CapturedUi { stream: index, arrived_at_ns, ui };
                self.ui_planes.push(UiEntry { captured, entry, stored });
                self.count_plane(&entry);
                Ok(())
            }
            Err(BadRecord { expected, found }) => broken(data.at, expected, found),
        }
    }

    fn count_plane(&mut self, plane: &PlaneEntry) {
        let kind = plane.info.kind;
        let mut statistics = self.planes.get(kind).cloned().unwrap_or_default();
        statistics.count(plane);
        self.planes.set(kind, Some(statistics));
    }

    fn frame(
        &mut self,
        data: Span,
        stream: u32,
        sequence: u32,
        times: [u64; 2],
    ) -> Result<(), Stop> {
        self.drop_pending();
        if data.len > MAX_RECORD as u64 {
            return broken(data.at, format!("a record of at most {MAX_RECORD} bytes"), data.len);
        }
        let Some(index) = self.streams.iter().position(|entry| entry.id == stream) else {
            return broken(data.at, "a stream that was described before", stream);
        };
        let next = std::mem::replace(&mut self.next_frame[index], sequence.wrapping_add(1));
        if next != sequence {
            let expected = format!("frame {next} of stream {stream}");
            self.damage(Damage { at: data.at, expected, found: sequence.to_string() });
        }
        let bytes = self.window.bytes(data.at, small(data.len))?.unwrap_or_default();
        let record = match FrameRecord::parse(bytes) {
            Ok(record) => record,
            Err(BadRecord { expected, found }) => return broken(data.at, expected, found),
        };
        let [arrived_at_ns, content_time_ns] = times;
        if (record.arrived_at_ns, record.content_time_ns) != (arrived_at_ns, content_time_ns) {
            let expected = format!(
                "times {} and {} of the record",
                record.arrived_at_ns, record.content_time_ns
            );
            return broken(data.at, expected, format!("{arrived_at_ns} and {content_time_ns}"));
        }
        let first = record.planes.first().map(|plane| plane.info.kind);
        if first != Some(PlaneKind::Color) {
            return broken(data.at, "a color plane first", format!("{first:?}"));
        }
        let planes = Vec::with_capacity(record.planes.len());
        let entry =
            FrameEntry { stream: index, content_time_ns, arrived_at_ns, record: data, planes };
        self.pending = Some(Pending { entry, stream, expected: record.planes });
        Ok(())
    }

    fn plane(&mut self, data: Span, found: (u32, PlaneKind, u8)) -> Result<(), Stop> {
        let Some(pending) = &mut self.pending else {
            return broken(data.at, "a frame before its planes", found.1.name());
        };
        let next = &pending.expected[pending.entry.planes.len()];
        let wanted = (pending.stream, next.info.kind, next.info.which);
        if (wanted, next.stored_len) != (found, data.len) {
            let expected = format!("plane {wanted:?} of {} bytes", next.stored_len);
            let found = format!("{found:?} of {} bytes", data.len);
            self.pending = None;
            return broken(data.at, expected, found);
        }
        pending.entry.planes.push(data);
        if pending.entry.planes.len() == pending.expected.len()
            && let Some(whole) = self.pending.take()
        {
            whole.expected.iter().for_each(|plane| self.count_plane(plane));
            self.frames.push(whole.entry);
        }
        Ok(())
    }

    fn check_crc(&mut self, chunk: &mut Chunk) -> Result<(), Stop> {
        // 0 means that the writer did not compute one.
        if chunk.is_checked || chunk.crc == 0 {
            return Ok(());
        }
        let mut hasher = crc32fast::Hasher::new();
        let (mut at, end) = (chunk.records.at, chunk.records.end());
        while at < end {
            let len = (end - at).min(4096);
            hasher.update(self.window.bytes(at, small(len))?.unwrap_or_default());
            at += len;
        }
        let found = hasher.finalize();
        if found != chunk.crc {
            let expected = format!("chunk CRC {:08x}", chunk.crc);
            return broken(chunk.records.at, expected, format!("{found:08x}"));
        }
        chunk.is_checked = true;
        Ok(())
    }
}
