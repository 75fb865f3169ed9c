//! What a capture holds, in one struct that can be printed.

use std::collections::BTreeMap;

use foreframe_protocol::{CreateStream, PlaneKind};

use super::index::{Damage, Index};
use super::session::SessionInfo;

/// What a capture holds, known without reading a pixel.
#[derive(Clone, Debug)]
pub struct CaptureInfo {
    /// What was recorded and by what.
    pub session: SessionInfo,
    /// Whole frames, of all streams.
    pub frames: usize,
    /// Columns of colour in the first stream.
    pub width: u32,
    /// Rows of colour in the first stream.
    pub height: u32,
    /// From the first to the last content time of the first stream, seconds.
    pub duration_s: f64,
    /// Frames, or user interfaces between them, that arrived and were not recorded.
    pub gaps: u64,
    /// Where and why the file ends early, if it does.
    pub tail: Option<Damage>,
    /// Parts of the file that could not be used.
    pub damaged: Vec<Damage>,
    /// Planes that any frame has, in the order of their codes.
    pub planes: Vec<PlanesInfo>,
    /// Whether the first frame of the first stream has a camera.
    pub camera: bool,
    /// The streams.
    pub streams: Vec<StreamInfo>,
    /// Bytes of the file.
    pub size_bytes: u64,
}

/// The planes of one kind.
#[derive(Clone, Debug)]
pub struct PlanesInfo {
    /// Their kind.
    pub kind: PlaneKind,
    /// How many there are in the file.
    pub count: u64,
    /// Their pixels, bytes.
    pub raw_bytes: u64,
    /// What they take in the file, bytes.
    pub stored_bytes: u64,
    /// How many planes per name of coding.
    pub codings: BTreeMap<&'static str, u64>,
}

/// One stream.
#[derive(Clone, Debug)]
pub struct StreamInfo {
    /// What the application declared.
    pub create: CreateStream,
    /// Whole frames.
    pub frames: usize,
    /// Poses that arrived after a key frame.
    pub late_cameras: usize,
    /// UI planes that arrived between key frames.
    pub ui_planes: usize,
}

impl CaptureInfo {
    pub(super) fn new(index: &Index, streams: &[CreateStream], camera: bool) -> Self {
        let first = || index.frames.iter().filter(|frame| frame.stream == 0);
        let content = first().map(|frame| frame.content_time_ns);
        let span_ns = match (content.clone().min(), content.max()) {
            (Some(first), Some(last)) => last - first,
            _ => 0,
        };
        let format = &streams[0].format;
        Self {
            session: index.session.clone(),
            frames: index.frames.len(),
            width: format.width,
            height: format.height,
            duration_s: std::time::Duration::from_nanos(span_ns).as_secs_f64(),
            gaps: index.gaps.iter().map(|gap| gap.count).fold(0, u64::saturating_add),
            tail: index.tail.clone(),
            damaged: index.damaged.clone(),
            planes: index
                .planes
                .iter()
                .map(|(kind, statistics)| PlanesInfo {
                    kind,
                    count: statistics.planes,
                    raw_bytes: statistics.raw_bytes,
                    stored_bytes: statistics.stored_bytes,
                    codings: statistics.codings.clone(),
                })
                .collect(),
            camera,
            streams: streams
                .iter()
                .enumerate()
                .map(|(position, create)| StreamInfo {
                    create: *create,
                    frames: index.frames.iter().filter(|frame| frame.stream == position).count(),
                    late_cameras: index
                        .late_cameras
                        .iter()
                        .filter(|pose| pose.stream == position)
                        .count(),
                    ui_planes: index
                        .ui_planes
                        .iter()
                        .filter(|ui| ui.captured.stream == position)
                        .count(),
                })
                .collect(),
            size_bytes: index.size,
        }
    }

    /// Whether the file lacks its end.
    #[must_use]
    pub fn is_truncated(&self) -> bool {
        self.tail.is_some()
    }
}
