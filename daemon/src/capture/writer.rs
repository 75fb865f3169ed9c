//! Writing a capture: streams, frames, late cameras, UI planes and gaps, as they happen.
//!
//! The writer does its work on the caller's thread and spawns none, so that a recorder can put it
//! behind a queue and the cores stay with the engine. After each call everything handed over is in
//! the file; [`CaptureWriter::finish`] adds the summary that lets tools seek, and dropping the
//! writer does the same but cannot report an error.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use foreframe_protocol::{
    Body as _, CreateStream, LateCamera, PlaneDescriptor, PlaneKind, PlaneSize, StreamFormat,
    Submit, UiPlane,
};

use super::codec::Coding;
use super::container::{Container, PlaneBytes, Stamp, unrecordable};
use super::error::CaptureError;
use super::layout::pixel_layout;
use super::record::{BadRecord, PlaneInfo};
use super::session::{Gap, SessionInfo};

/// Writes one capture.
#[derive(Debug)]
pub struct CaptureWriter<W: Write = BufWriter<File>> {
    container: Container<W>,
    streams: Vec<OpenStream>,
    coding: Coding,
}

#[derive(Debug)]
struct OpenStream {
    id: u32,
    format: StreamFormat,
    frames: u32,
    poses: u32,
    ui_planes: u32,
}

impl CaptureWriter {
    /// Creates or replaces the file at `path`.
    ///
    /// # Errors
    /// If the file cannot be created or written.
    pub fn create(path: &Path, session: &SessionInfo) -> Result<Self, CaptureError> {
        let file = File::create(path)
            .map_err(|source| CaptureError::Open { path: path.to_owned(), source })?;
        Self::to_writer(BufWriter::new(file), session)
    }
}

impl<W: Write> CaptureWriter<W> {
    /// Writes to `out`, which is flushed after each call. Planes are coded [`Coding::FAST`].
    ///
    /// # Errors
    /// If `out` cannot be written.
    pub fn to_writer(out: W, session: &SessionInfo) -> Result<Self, CaptureError> {
        let container = Container::new(out, session)?;
        Ok(Self { container, streams: Vec::new(), coding: Coding::FAST })
    }

    /// Codes planes differently from here on.
    #[must_use]
    pub fn with_coding(mut self, coding: Coding) -> Self {
        self.coding = coding;
        self
    }

    /// Records that a stream begins. Its number must be new in this file.
    ///
    /// # Errors
    /// If the number was used before, or the file cannot be written.
    pub fn add_stream(&mut self, create: &CreateStream) -> Result<(), CaptureError> {
        let id = create.stream;
        if self.streams.iter().any(|stream| stream.id == id) {
            let bad = BadRecord::new("a stream number that is new in the file", id);
            return Err(unrecordable("a stream", bad));
        }
        self.container.stream(id, &create.to_bytes())?;
        let format = create.format;
        self.streams.push(OpenStream { id, format, frames: 0, poses: 0, ui_planes: 0 });
        Ok(())
    }

    /// Records a frame: colour first, then whatever other planes it has. Several motion planes with
    /// different `motion_from_ns` may follow each other, the one of `submit` first.
    /// Returns the bytes that its planes take in the file.
    ///
    /// # Errors
    /// If the stream was not added, a plane does not fit the stream's format, or the file cannot be
    /// written. After a failed write, all further calls fail.
    pub fn write_frame(
        &mut self,
        arrived_at_ns: u64,
        submit: &Submit,
        planes: &[PlaneBytes<'_>],
    ) -> Result<u64, CaptureError> {
        let Some(stream) = self.streams.iter_mut().find(|stream| stream.id == submit.stream) else {
            let bad = BadRecord::new("a frame of a stream that was added", submit.stream);
            return Err(unrecordable("a frame", bad));
        };
        let infos = planes.iter().map(|plane| &plane.info);
        check_planes(&stream.format, submit, infos).map_err(|bad| unrecordable("a frame", bad))?;
        let stamp = Stamp {
            log_time: arrived_at_ns,
            publish_time: submit.content_time_ns,
            sequence: stream.frames,
        };
        stream.frames = stream.frames.wrapping_add(1);
        self.container.frame(stream.id, stamp, &submit.to_bytes(), planes, self.coding)
    }

    /// Records a pose that arrived after a key frame.
    ///
    /// # Errors
    /// If its stream was not added, or the file cannot be written.
    pub fn late_camera(
        &mut self,
        arrived_at_ns: u64,
        pose: &LateCamera,
    ) -> Result<(), CaptureError> {
        let Some(stream) = self.streams.iter_mut().find(|stream| stream.id == pose.stream) else {
            let bad = BadRecord::new("a pose of a stream that was added", pose.stream);
            return Err(unrecordable("a late camera", bad));
        };
        let stamp = Stamp {
            log_time: arrived_at_ns,
            publish_time: pose.content_time_ns,
            sequence: stream.poses,
        };
        stream.poses = stream.poses.wrapping_add(1);
        self.container.late_camera(stream.id, stamp, &pose.to_bytes())
    }

    /// Records a user interface that came between key frames, with its pixels. Returns the bytes
    /// that they take in the file.
    ///
    /// # Errors
    /// If its stream was not added, the plane does not fit the stream's format, or the file cannot
    /// be written.
    pub fn ui_plane(
        &mut self,
        arrived_at_ns: u64,
        ui: &UiPlane,
        plane: &PlaneBytes<'_>,
    ) -> Result<u64, CaptureError> {
        let Some(stream) = self.streams.iter_mut().find(|stream| stream.id == ui.stream) else {
            let bad = BadRecord::new("a UI plane of a stream that was added", ui.stream);
            return Err(unrecordable("a UI plane", bad));
        };
        if pixel_layout(&stream.format, PlaneKind::Ui) != Some(plane.info.layout) {
            let bad = BadRecord::new("UI planes as the stream declares", plane.info.layout);
            return Err(unrecordable("a UI plane", bad));
        }
        let stamp = Stamp {
            log_time: arrived_at_ns,
            publish_time: arrived_at_ns,
            sequence: stream.ui_planes,
        };
        stream.ui_planes = stream.ui_planes.wrapping_add(1);
        self.container.ui_plane(stream.id, stamp, ui, plane, self.coding)
    }

    /// Records that frames are missing.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn gap(&mut self, gap: &Gap) -> Result<(), CaptureError> {
        self.container.gap(gap)
    }

    /// Writes summary and end marker, flushes, and gives back what was written to.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(self) -> Result<W, CaptureError> {
        self.container.finish()
    }
}

/// Whether planes are those of a frame in `format`: colour first, each with the declared pixels and
/// the size that `submit` gives it, none but the user interface larger than the stream.
pub(super) fn check_planes<'a>(
    format: &StreamFormat,
    submit: &Submit,
    planes: impl Iterator<Item = &'a PlaneInfo>,
) -> Result<(), BadRecord> {
    let mut has_color = false;
    for plane in planes {
        let name = plane.kind.name();
        if !has_color && plane.kind != PlaneKind::Color {
            return Err(BadRecord::new("a color plane first", name));
        }
        has_color = true;
        let Some(layout) = pixel_layout(format, plane.kind) else {
            return Err(BadRecord::new("planes that the stream declares", name));
        };
        if plane.layout != layout {
            let expected = format!("{name} pixels of {layout}");
            return Err(BadRecord::new(expected, plane.layout));
        }
        let size = PlaneSize { width: plane.width, height: plane.height };
        let described = submit.planes.get(plane.kind).map(PlaneDescriptor::size);
        if plane.which == 0 && described != Some(size) {
            let described = described.map_or("no size".to_owned(), |size| size.to_string());
            let expected = format!("{name} of {described} as in the submit message");
            return Err(BadRecord::new(expected, size));
        }
        let full = PlaneSize { width: format.width, height: format.height };
        let is_larger = size.width > full.width || size.height > full.height;
        if is_larger && plane.kind != PlaneKind::Ui {
            return Err(BadRecord::new(format!("{name} of at most {full}"), size));
        }
    }
    if has_color { Ok(()) } else { Err(BadRecord::new("a color plane", "no plane")) }
}
