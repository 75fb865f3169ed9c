//! Reading a capture: one frame at a time, in any order.
//!
//! [`Capture::open`] walks the file once (see [`super::index`]) and keeps a few dozen bytes per
//! frame; pixels are read, decoded and checked against their hash when a frame is asked for. A
//! frame that comes out of here is bit for bit what was recorded, or it is an error.

use std::fs::File;
use std::io::ErrorKind;
use std::path::Path;

use foreframe_protocol::{Body as _, CreateStream, PlaneKind, StreamFormat, Submit};
use xxhash_rust::xxh3::Xxh3;

use super::codec::{self, Coding};
use super::error::CaptureError;
use super::index::{CapturedPose, FrameEntry, Index, Span};
use super::info::CaptureInfo;
use super::layout::pixel_layout;
use super::record::{BadRecord, FrameRecord, PlaneEntry, PlaneInfo};
use super::session::{Gap, SessionInfo};
use super::source::ReadAt;
use super::ui_plane::CapturedUi;
use super::writer::check_planes;

/// An open capture.
#[derive(Debug)]
pub struct Capture<S = File> {
    source: S,
    index: Index,
    streams: Vec<CreateStream>,
}

/// One plane of a frame.
#[derive(Clone, PartialEq, Debug)]
pub struct CapturedPlane {
    /// What it is.
    pub info: PlaneInfo,
    /// Pixels, row by row, without padding.
    pub bytes: Vec<u8>,
}

/// One frame.
#[derive(Clone, PartialEq, Debug)]
pub struct CapturedFrame {
    /// Number of the frame in the file, from 0.
    pub number: usize,
    /// Position of its stream in [`Capture::streams`].
    pub stream: usize,
    /// When it arrived, nanoseconds of the monotonic clock.
    pub arrived_at_ns: u64,
    /// What the application said of it. Offsets and strides speak of the application's memory.
    pub submit: Submit,
    /// Colour first.
    pub planes: Vec<CapturedPlane>,
}

impl CapturedFrame {
    /// The first plane of this kind; of motion, the one that `submit` describes.
    #[must_use]
    pub fn plane(&self, kind: PlaneKind) -> Option<&CapturedPlane> {
        self.planes.iter().find(|plane| plane.info.kind == kind)
    }

    /// The colour plane, which every frame has.
    ///
    /// # Panics
    /// If a caller took the colour plane out.
    #[must_use]
    pub fn color(&self) -> &CapturedPlane {
        self.plane(PlaneKind::Color).expect("the reader refuses a frame without colour")
    }

    /// The motion plane that points back to this content time.
    #[must_use]
    pub fn motion_from(&self, content_time_ns: u64) -> Option<&CapturedPlane> {
        self.planes.iter().find(|plane| {
            plane.info.kind == PlaneKind::Motion
                && plane.info.motion_from_ns == Some(content_time_ns)
        })
    }
}

/// When a frame arrived and what it shows, known without reading its pixels.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FrameTimes {
    /// Position of its stream in [`Capture::streams`].
    pub stream: usize,
    /// When it arrived, nanoseconds of the monotonic clock.
    pub arrived_at_ns: u64,
    /// Simulation time that it shows, nanoseconds.
    pub content_time_ns: u64,
}

impl Capture {
    /// Opens the file at `path`. A file that a crash cut off opens up to its last whole frame.
    ///
    /// # Errors
    /// If the file cannot be read, is no capture, is of another version, or ends before the first
    /// stream was described.
    pub fn open(path: &Path) -> Result<Self, CaptureError> {
        let cannot_open = |source| CaptureError::Open { path: path.to_owned(), source };
        let file = File::open(path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => CaptureError::Missing,
            _ => cannot_open(error),
        })?;
        if file.metadata().map_err(cannot_open)?.is_dir() {
            return Err(CaptureError::Folder);
        }
        Self::from_source(file)
    }
}

impl<S: ReadAt> Capture<S> {
    /// Opens a capture that is not a file.
    ///
    /// # Errors
    /// Those of [`Capture::open`].
    pub fn from_source(source: S) -> Result<Self, CaptureError> {
        let index = Index::scan(&source)?;
        let streams = index
            .streams
            .iter()
            .map(|stream| {
                CreateStream::parse(&stream.create).map_err(|error| CaptureError::Damaged {
                    what: "a stream",
                    at: stream.at,
                    expected: "a create-stream body".to_owned(),
                    found: error.to_string(),
                })
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { source, index, streams })
    }

    /// What was recorded and by what.
    #[must_use]
    pub fn session(&self) -> &SessionInfo {
        &self.index.session
    }

    /// The streams, in the order in which they began. At least one.
    #[must_use]
    pub fn streams(&self) -> &[CreateStream] {
        &self.streams
    }

    /// Whole frames in the file, of all streams.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.index.frames.len()
    }

    /// Times of every frame, in the order of the file.
    pub fn times(&self) -> impl ExactSizeIterator<Item = FrameTimes> + '_ {
        self.index.frames.iter().map(|entry| FrameTimes {
            stream: entry.stream,
            arrived_at_ns: entry.arrived_at_ns,
            content_time_ns: entry.content_time_ns,
        })
    }

    /// Poses that arrived after a key frame and led a picture, in the order of the file.
    #[must_use]
    pub fn late_cameras(&self) -> &[CapturedPose] {
        &self.index.late_cameras
    }

    /// UI planes that arrived between key frames and were shown, in the order of the file.
    pub fn ui_planes(&self) -> impl ExactSizeIterator<Item = &CapturedUi> + '_ {
        self.index.ui_planes.iter().map(|entry| &entry.captured)
    }

    /// The pixels of one of [`Capture::ui_planes`].
    ///
    /// # Errors
    /// If there is no such plane, or it is not what was recorded.
    pub fn ui_pixels(&self, number: usize) -> Result<CapturedPlane, CaptureError> {
        let Some(ui) = self.index.ui_planes.get(number) else {
            let frames = self.index.ui_planes.len();
            return Err(CaptureError::NoSuchFrame { frames, found: number });
        };
        let layout = pixel_layout(self.format(ui.captured.stream), PlaneKind::Ui);
        if layout != Some(ui.entry.info.layout) {
            let expected = layout.map_or("no ui plane".to_owned(), |layout| layout.to_string());
            let bad = BadRecord::new(expected, ui.entry.info.layout);
            return Err(damaged("a ui plane", ui.stored, bad));
        }
        self.plane(number, &ui.entry, ui.stored)
    }

    /// Frames, or user interfaces between them, that arrived and were not recorded.
    #[must_use]
    pub fn gaps(&self) -> &[Gap] {
        &self.index.gaps
    }

    /// Everything that can be said without reading a pixel.
    ///
    /// # Errors
    /// If the record of the first frame of the first stream cannot be read.
    pub fn info(&self) -> Result<CaptureInfo, CaptureError> {
        let first = self.index.frames.iter().position(|frame| frame.stream == 0);
        let camera = match first {
            Some(number) => self.submit(number)?.camera.is_some(),
            None => false,
        };
        Ok(CaptureInfo::new(&self.index, &self.streams, camera))
    }

    /// The submit message of a frame, without its pixels.
    ///
    /// # Errors
    /// If there is no such frame, or its record cannot be read.
    pub fn submit(&self, number: usize) -> Result<Submit, CaptureError> {
        let (entry, record) = self.record(number)?;
        self.parse_submit(entry, &record)
    }

    /// The submit message of a frame and what each of its planes is, without any pixels.
    ///
    /// # Errors
    /// If there is no such frame, or its record cannot be read.
    pub fn describe(&self, number: usize) -> Result<(Submit, Vec<PlaneInfo>), CaptureError> {
        let (entry, record) = self.record(number)?;
        let submit = self.parse_submit(entry, &record)?;
        Ok((submit, record.planes.iter().map(|plane| plane.info).collect()))
    }

    /// A hash of all that one of [`Capture::streams`] shows: its format, and of each frame its
    /// times, cameras and pixels. How the pixels are stored and when they arrived takes no part.
    /// Pixels are not read: their hashes are in the records.
    ///
    /// # Errors
    /// If a frame's record cannot be read.
    pub fn content_hash(&self, stream: usize) -> Result<u128, CaptureError> {
        let mut hash = Xxh3::new();
        hash.update(&self.index.streams[stream].create);
        let mut bytes = Vec::new();
        for number in 0..self.frame_count() {
            let (entry, record) = self.record(number)?;
            if entry.stream != stream {
                continue;
            }
            let submit = self.parse_submit(entry, &record)?;
            bytes.clear();
            bytes.extend(submit.content_time_ns.to_le_bytes());
            bytes.extend(submit.motion_from_ns.unwrap_or(u64::MAX).to_le_bytes());
            bytes.push(u8::from(submit.is_cut));
            for camera in [submit.camera, submit.motion_from_camera] {
                bytes.push(u8::from(camera.is_some()));
                for matrix in camera.iter().flat_map(|camera| [camera.view, camera.projection]) {
                    bytes.extend(matrix.iter().flat_map(|element| element.to_le_bytes()));
                }
            }
            for plane in record.planes {
                PlaneEntry { coding: Coding::RAW, stored_len: 0, ..plane }.write(&mut bytes);
            }
            hash.update(&bytes);
        }
        Ok(hash.digest128())
    }

    /// A frame with all its planes.
    ///
    /// # Errors
    /// If there is no such frame, or anything about it is not what was recorded.
    pub fn frame(&self, number: usize) -> Result<CapturedFrame, CaptureError> {
        self.frame_with(number, |_| true)
    }

    /// A frame with those planes that `wanted` picks, and colour.
    ///
    /// # Errors
    /// Those of [`Capture::frame`].
    pub fn frame_with(
        &self,
        number: usize,
        wanted: impl Fn(&PlaneInfo) -> bool,
    ) -> Result<CapturedFrame, CaptureError> {
        let (entry, record) = self.record(number)?;
        let submit = self.parse_submit(entry, &record)?;
        let infos = record.planes.iter().map(|plane| &plane.info);
        check_planes(self.format(entry.stream), &submit, infos)
            .map_err(|bad| damaged("a frame record", entry.record, bad))?;
        let planes = record
            .planes
            .iter()
            .zip(&entry.planes)
            .filter(|(plane, _)| plane.info.kind == PlaneKind::Color || wanted(&plane.info))
            .map(|(plane, &span)| self.plane(number, plane, span))
            .collect::<Result<_, _>>()?;
        let (stream, arrived_at_ns) = (entry.stream, entry.arrived_at_ns);
        Ok(CapturedFrame { number, stream, arrived_at_ns, submit, planes })
    }

    /// The frames one after another; only one is in memory at a time. After an error the next
    /// frame follows.
    pub fn frames(
        &self,
    ) -> impl ExactSizeIterator<Item = Result<CapturedFrame, CaptureError>> + '_ {
        (0..self.frame_count()).map(|number| self.frame(number))
    }

    fn format(&self, stream: usize) -> &StreamFormat {
        &self.streams[stream].format
    }

    fn record(&self, number: usize) -> Result<(&FrameEntry, FrameRecord), CaptureError> {
        let frames = self.frame_count();
        let Some(entry) = self.index.frames.get(number) else {
            return Err(CaptureError::NoSuchFrame { frames, found: number });
        };
        let bytes = self.read(entry.record)?;
        let record = FrameRecord::parse(&bytes)
            .map_err(|bad| damaged("a frame record", entry.record, bad))?;
        Ok((entry, record))
    }

    fn parse_submit(
        &self,
        entry: &FrameEntry,
        record: &FrameRecord,
    ) -> Result<Submit, CaptureError> {
        let bad = |expected: &str, found: String| {
            damaged("a submit body", entry.record, BadRecord::new(expected, found))
        };
        let submit = Submit::parse(&record.submit)
            .map_err(|error| bad("what it says", error.to_string()))?;
        if submit.content_time_ns != entry.content_time_ns {
            return Err(bad(
                &format!("content time {} of the record", entry.content_time_ns),
                submit.content_time_ns.to_string(),
            ));
        }
        Ok(submit)
    }

    fn plane(
        &self,
        frame: usize,
        entry: &PlaneEntry,
        span: Span,
    ) -> Result<CapturedPlane, CaptureError> {
        let info = entry.info;
        let bad = |expected: String, found: String| CaptureError::Plane {
            plane: info.kind.name(),
            frame,
            expected,
            found,
        };
        let stored = self.read(span)?;
        let raw_len = usize::try_from(info.raw_len()).unwrap_or(usize::MAX);
        let bytes = codec::decode(stored, raw_len, info.layout, entry.coding)
            .map_err(|found| bad(format!("{raw_len} bytes of {}", entry.coding.name()), found))?;
        let hash = codec::plane_hash(&bytes);
        if hash != entry.hash {
            return Err(bad(format!("hash {:032x}", entry.hash), format!("{hash:032x}")));
        }
        Ok(CapturedPlane { info, bytes })
    }

    fn read(&self, span: Span) -> Result<Vec<u8>, CaptureError> {
        // The index holds only spans that lie inside the file.
        let mut bytes = vec![0; usize::try_from(span.len).unwrap_or(usize::MAX)];
        self.source
            .read_exact_at(&mut bytes, span.at)
            .map_err(|source| CaptureError::Io { doing: "reading a capture", source })?;
        Ok(bytes)
    }
}

fn damaged(what: &'static str, span: Span, bad: BadRecord) -> CaptureError {
    CaptureError::Damaged { what, at: span.at, expected: bad.expected, found: bad.found }
}
