//! A capture file as a [`Recording`]: one stream of it, planes read when they are asked for.
//!
//! Frames become key frames of the engine through the daemon's own translation, so that what is
//! replayed or scored is what the daemon would have been given.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use anyhow::Context as _;
use foreframe_engine::{KeyInput, MonoTime, PlaneInput, StreamFormat};
use foreframe_protocol::{PlaneDescriptor, PlaneKind, ProfileName, Submit};
use foreframed::capture::{
    Capture, CaptureInfo, CapturedPlane, DISPLAY_ORIGIN, PIXELS_PER_DEGREE,
    PIXELS_PER_DEGREE_IS_GIVEN, PlaneInfo, ReadAt,
};
use foreframed::ingest::{self, PlaneSource};

use super::{Frame, FrameHead, OwnedPlane, Recording, Wanted};
use crate::virtual_time::{TimedPose, TimedUi};

/// What a user should know about a file that is not whole: one line each.
#[must_use]
pub fn warnings(info: &CaptureInfo) -> Vec<String> {
    let mut warnings = Vec::new();
    if let Some(tail) = &info.tail {
        warnings.push(format!("the file ends early, its last whole frame is used: {tail}"));
    }
    warnings.extend(info.damaged.iter().map(|damage| format!("a part is skipped: {damage}")));
    if info.gaps > 0 {
        warnings
            .push(format!("{} frames or user interfaces arrived and were not recorded", info.gaps));
    }
    warnings
}

/// The first stream of a capture that has frames.
#[derive(Debug)]
pub struct CaptureRecording<S = File> {
    capture: Arc<Capture<S>>,
    stream: usize,
    format: StreamFormat,
    heads: Vec<FrameHead>,
    /// Number in the file and motion planes of each frame.
    places: Vec<Place>,
}

#[derive(Clone, Debug)]
struct Place {
    number: usize,
    /// Planes of [`FrameHead::motions`], in that order.
    motions: Vec<PlaneInfo>,
}

impl CaptureRecording {
    /// Opens the file at `path` and reads what its frames have, without their pixels.
    ///
    /// # Errors
    /// If it is no capture that can be read.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        let name = path.display();
        let capture = Capture::open(path).with_context(|| format!("opening {name}"))?;
        Self::new(capture).with_context(|| format!("reading {name}"))
    }
}

impl<S: ReadAt> CaptureRecording<S> {
    /// Reads what the frames of an open capture have.
    ///
    /// # Errors
    /// If a frame's record cannot be read.
    pub fn new(capture: Capture<S>) -> anyhow::Result<Self> {
        let stream = capture.times().next().map_or(0, |first| first.stream);
        let (mut heads, mut places) = (Vec::new(), Vec::new());
        for (number, times) in capture.times().enumerate().filter(|(_, t)| t.stream == stream) {
            let (submit, planes) = capture.describe(number)?;
            let motions: Vec<_> = planes
                .into_iter()
                .filter(|info| info.kind == PlaneKind::Motion && info.motion_from_ns.is_some())
                .collect();
            let from = |info: &PlaneInfo| info.motion_from_ns.map(MonoTime::from_ns);
            heads.push(FrameHead {
                content_time: MonoTime::from_ns(times.content_time_ns),
                arrived_at: MonoTime::from_ns(times.arrived_at_ns),
                is_cut: submit.is_cut,
                motions: motions.iter().filter_map(from).collect(),
            });
            places.push(Place { number, motions });
        }
        let format = ingest::stream_format(&capture.streams()[stream].format);
        Ok(Self { capture: Arc::new(capture), stream, format, heads, places })
    }

    /// What was recorded.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.capture.session().name
    }

    /// A hash of its format and of all that its frames show, 32 hexadecimal digits: what tells it
    /// from any other.
    ///
    /// # Errors
    /// If a frame's record cannot be read.
    pub fn content_hash(&self) -> anyhow::Result<String> {
        Ok(format!("{:032x}", self.capture.content_hash(self.stream)?))
    }

    /// The angular size of a pixel that the daemon worked with when it recorded. None where it had
    /// none, or the capture comes from elsewhere.
    ///
    /// # Errors
    /// If it is not a number of 1 to 1000.
    pub fn pixels_per_degree(&self) -> anyhow::Result<Option<f32>> {
        let Some(text) = self.capture.session().config.get(PIXELS_PER_DEGREE) else {
            return Ok(None);
        };
        let ppd = text.parse().ok().filter(|ppd| (1.0..=1000.0).contains(ppd));
        let ppd = ppd.with_context(|| {
            format!("{PIXELS_PER_DEGREE} of the session: expected 1 to 1000, found `{text}`")
        })?;
        Ok(Some(ppd))
    }

    /// Whether the user of the daemon gave that size, so that it held for every display.
    #[must_use]
    pub fn is_ppd_given(&self) -> bool {
        let config = &self.capture.session().config;
        config.get(PIXELS_PER_DEGREE_IS_GIVEN).is_some_and(|text| text == "true")
    }

    /// The display that the application named for its picture.
    #[must_use]
    pub fn display_profile(&self) -> Option<ProfileName> {
        self.capture.streams()[self.stream].format.display_profile
    }

    /// A refresh of the display that the daemon worked with when it recorded. None where the
    /// capture comes from elsewhere.
    ///
    /// # Errors
    /// If it is not a time before the first key arrived.
    pub fn display_origin(&self) -> anyhow::Result<Option<MonoTime>> {
        let Some(text) = self.capture.session().config.get(DISPLAY_ORIGIN) else {
            return Ok(None);
        };
        let first = self.heads.first().map_or(MonoTime::ZERO, |head| head.arrived_at);
        let origin = text.parse().ok().map(MonoTime::from_ns).filter(|origin| *origin <= first);
        let origin = origin.with_context(|| {
            let first = first.as_ns();
            format!("{DISPLAY_ORIGIN} of the session: expected 0 to {first}, found `{text}`")
        })?;
        Ok(Some(origin))
    }

    /// Poses that arrived after their keys and led pictures of the daemon that recorded.
    #[must_use]
    pub fn late_cameras(&self) -> Vec<TimedPose> {
        let of_stream = self.capture.late_cameras().iter().filter(|it| it.stream == self.stream);
        of_stream
            .map(|captured| TimedPose {
                arrives_at: MonoTime::from_ns(captured.arrived_at_ns),
                content_time: MonoTime::from_ns(captured.pose.content_time_ns),
                view: captured.pose.view,
            })
            .collect()
    }

    /// When each user interface arrived that came between key frames, and its number in the file.
    #[must_use]
    pub fn ui_arrivals(&self) -> Vec<(usize, MonoTime)> {
        let numbered = self.capture.ui_planes().enumerate();
        let of_stream = numbered.filter(|(_, captured)| captured.stream == self.stream);
        of_stream.map(|(number, it)| (number, MonoTime::from_ns(it.arrived_at_ns))).collect()
    }

    /// Reads user interfaces by their numbers in the file, each dated as its number comes with.
    pub fn read_uis(
        &self,
        numbered: Vec<(usize, MonoTime)>,
    ) -> impl Iterator<Item = anyhow::Result<TimedUi>> + use<S> {
        let (capture, stream) = (Arc::clone(&self.capture), self.stream);
        numbered.into_iter().map(move |(number, arrives_at)| {
            let captured =
                capture.ui_planes().nth(number).context("the user interface is there")?;
            let (ui, pixels) = (captured.ui, capture.ui_pixels(number)?.bytes);
            let format = &capture.streams()[stream].format;
            let input = ingest::ui_input(format, &ui, PlaneSource::Packed(&pixels))?;
            let plane = owned(input.plane, &pixels);
            Ok(TimedUi { arrives_at, place: input.place, plane })
        })
    }

    /// What a user should know about the file before trusting a result: one line each.
    ///
    /// # Errors
    /// If the first frame's record cannot be read.
    pub fn warnings(&self) -> anyhow::Result<Vec<String>> {
        let info = self.capture.info()?;
        let mut warnings = warnings(&info);
        if info.streams.len() > 1 {
            let (used, all) = (self.stream + 1, info.streams.len());
            warnings.push(format!("only stream {used} of {all} is used"));
        }
        Ok(warnings)
    }

    /// Camera of the frame that shows this content time.
    fn camera_at(
        &self,
        content_time: MonoTime,
    ) -> anyhow::Result<Option<foreframe_protocol::Camera>> {
        let Some(frame) = self.heads.iter().position(|head| head.content_time == content_time)
        else {
            return Ok(None);
        };
        Ok(self.capture.submit(self.places[frame].number)?.camera)
    }
}

impl<S: ReadAt> Recording for CaptureRecording<S> {
    fn format(&self) -> &StreamFormat {
        &self.format
    }

    fn heads(&self) -> &[FrameHead] {
        &self.heads
    }

    fn read(&mut self, frame: usize, wanted: Wanted) -> anyhow::Result<Frame> {
        let place = &self.places[frame];
        let motion = match wanted {
            Wanted::Key { motion: Some(plane) } => Some(place.motions[plane]),
            Wanted::Key { motion: None } | Wanted::Color => None,
        };
        let format = &self.capture.streams()[self.stream].format;
        let is_wanted = |info: &PlaneInfo| match info.kind {
            PlaneKind::Color => true,
            PlaneKind::Depth | PlaneKind::Mask => wanted != Wanted::Color,
            PlaneKind::Motion => motion == Some(*info),
            PlaneKind::Ui => wanted != Wanted::Color && format.ui == Some(format.color),
        };
        let captured = self.capture.frame_with(place.number, is_wanted)?;
        let mut submit = captured.submit;
        self.describe_motion(&mut submit, motion)?;
        for &kind in PlaneKind::ALL {
            if captured.plane(kind).is_none() {
                submit.planes.set(kind, None);
            }
        }
        let bytes = |kind| captured.plane(kind).map(|plane: &CapturedPlane| &plane.bytes[..]);
        let source = |kind| bytes(kind).map(PlaneSource::Packed);
        let input = ingest::key_input(format, &submit, source)?;
        let ui = ingest::ui_of_key(format, &submit, source)?;
        Ok(frame_of(&input, ui.map(|ui| ui.plane), bytes))
    }
}

impl<S: ReadAt> CaptureRecording<S> {
    /// Makes `submit` speak of one of the frame's motion planes, or of none. The message as it
    /// was recorded describes the first.
    fn describe_motion(
        &self,
        submit: &mut Submit,
        motion: Option<PlaneInfo>,
    ) -> anyhow::Result<()> {
        let motion_from_ns = motion.and_then(|info| info.motion_from_ns);
        if motion_from_ns != submit.motion_from_ns {
            submit.motion_from_ns = motion_from_ns;
            submit.motion_from_camera = match motion_from_ns {
                Some(from) => self.camera_at(MonoTime::from_ns(from))?,
                None => None,
            };
        }
        let descriptor = motion.map(|info| PlaneDescriptor {
            offset: 0,
            width: info.width,
            height: info.height,
            stride: 0,
            valid: info.valid,
            jitter: info.jitter,
        });
        submit.planes.set(PlaneKind::Motion, descriptor);
        Ok(())
    }
}

fn owned(plane: PlaneInput<'_>, bytes: &[u8]) -> OwnedPlane {
    OwnedPlane {
        bytes: bytes.to_vec(),
        width: plane.width,
        height: plane.height,
        stride: plane.stride,
        valid: plane.valid,
        jitter: plane.jitter,
    }
}

/// The frame of `input` and `ui`, whose pixels are in `bytes`.
fn frame_of<'a>(
    input: &KeyInput<'_>,
    ui: Option<PlaneInput<'_>>,
    bytes: impl Fn(PlaneKind) -> Option<&'a [u8]>,
) -> Frame {
    let plane = |kind, plane| owned(plane, bytes(kind).unwrap_or_default());
    Frame {
        index: input.index,
        content_time: input.content_time,
        motion_from: input.motion_from,
        is_cut: input.is_cut,
        color: plane(PlaneKind::Color, input.color),
        depth: input.depth.map(|depth| plane(PlaneKind::Depth, depth)),
        motion: input.motion.map(|motion| plane(PlaneKind::Motion, motion)),
        mask: input.mask.map(|mask| plane(PlaneKind::Mask, mask)),
        ui: ui.map(|ui| plane(PlaneKind::Ui, ui)),
        camera: input.camera,
        motion_from_camera: input.motion_from_camera,
    }
}
