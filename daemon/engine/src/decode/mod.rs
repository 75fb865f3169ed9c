//! The border of the engine: converts what a stream declared to the one convention inside.
//!
//! Owns every conversion of stream conventions (direction, unit, scale, jitter, depth meaning,
//! plane ratio, valid rectangle) and every check of plane geometry and of poisoned numbers.
//! Inside there is one convention: colour at the size of the output, depth keys that grow towards
//! the eye, motion as newer minus older position in output pixels, both on one field grid.
//!
//! The field grid takes, per axis, the resolution of the finer of the depth and motion planes.
//! The other plane, and a jitter that differs, are resampled by nearest sample: a mean of two
//! depths or of two motions belongs to no surface. A key is converted completely or not at all.

mod camera;
mod color;
mod depth;
mod error;
mod field;
mod geometry;
mod motion;
mod motion_field;

#[cfg(test)]
mod tests;

pub(crate) use camera::StillWorld;
pub use color::decode_ui;
pub use error::{DecodeError, PlaneName};
pub use motion_field::{MotionField, decode_field};

use rayon::ThreadPool;

use crate::color::ColorPlane;
use crate::format::{CameraMotion, DepthMeaning, StreamFormat, ValidRectUse};
use crate::key::{KeyFrame, KeyInput};
use crate::mask;
use crate::plane::{Plane, Rect};
use crate::time::MonoTime;
use crate::trajectory::dilate_motion::{DilateParams, dilate_motion};
use crate::trajectory::flow::Flow;
use camera::ProjectionDepth;
use field::FieldInput;
use geometry::CheckedPlane;

/// Buffers of the decode step, kept from key to key.
#[derive(Clone, Debug, Default)]
pub struct DecodeScratch {
    color: ColorPlane,
    displacement: Plane<[f32; 2]>,
    /// The motion of the picture, where a mask asks for it.
    picture: Plane<[f32; 2]>,
    columns: [Vec<u16>; 2],
}

impl DecodeScratch {
    /// The colour plane of the key that was decoded last as it came, if that was reduced.
    #[must_use]
    pub fn reduced_color(&self) -> &ColorPlane {
        &self.color
    }

    /// Motion as decoded of the key that was decoded last, if that has motion.
    #[must_use]
    pub fn displacement(&self) -> &Plane<[f32; 2]> {
        &self.displacement
    }

    /// Gives `key`, which was decoded last and has motion, its motion as decoded.
    pub fn hand_displacement(&mut self, key: &mut KeyFrame) {
        std::mem::swap(&mut self.displacement, &mut key.displacement);
    }

    /// Whether cells of `key`, which was decoded last and has motion, go by that of the picture.
    #[must_use]
    pub fn asks_for_picture(&self, key: &KeyFrame) -> bool {
        mask::asks_for_picture(&key.mask, &self.displacement)
    }

    /// Gives those cells what `flow` found since `from`, the content time of the key before.
    pub fn take_picture(
        &mut self,
        pool: &ThreadPool,
        flow: &Flow,
        from: MonoTime,
        pixels_per_degree: Option<f32>,
        key: &mut KeyFrame,
    ) {
        let Some(span) = key.motion_span() else { return };
        let interval = key.content_time - from;
        #[expect(clippy::cast_possible_truncation, reason = "a ratio of two intervals")]
        let scale = (span.as_secs_f64() / interval.as_secs_f64()) as f32;
        flow.fill([key.mask.width(), key.mask.height()], &mut self.picture);
        mask::take_picture(&key.mask, &self.picture, scale, &mut self.displacement);
        let params = DilateParams { pixels_per_degree, span };
        dilate_motion(pool, &params, &key.depth, &self.displacement, &mut key.velocity);
    }

    /// Gives `key`, which was decoded last and has no motion, that which `flow` found since `from`,
    /// as if it had been decoded. Motion that no eye can follow is damped where `pixels_per_degree`
    /// is given.
    pub fn take_flow(
        &mut self,
        pool: &ThreadPool,
        flow: &Flow,
        from: MonoTime,
        pixels_per_degree: Option<f32>,
        key: &mut KeyFrame,
    ) {
        let mut cells = [key.depth.width(), key.depth.height()];
        if cells.contains(&0) {
            cells = flow.cells();
            key.field_offset = [0; 2];
        }
        flow.fill(cells, &mut self.displacement);
        let params = DilateParams { pixels_per_degree, span: key.content_time - from };
        dilate_motion(pool, &params, &key.depth, &self.displacement, &mut key.velocity);
        key.motion_from = Some(from);
    }
}

/// What was noticed while a key was decoded.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct DecodeReport {
    /// What the projection says that depth means, where it contradicts the stream.
    pub depth_contradiction: Option<DepthMeaning>,
    /// Vectors lack the camera's motion, and depth or one of the two cameras is missing.
    pub lacks_camera_motion: bool,
    /// The part of [`DecodeScratch::reduced_color`] that holds the picture, where a multiplexed
    /// stream sent a reduced one. The key's colour is then still to be made.
    pub reduced: Option<Rect>,
}

/// Converts one key frame into `key`, whose buffers are reused. Motion that no eye can follow is
/// damped where `pixels_per_degree` is given.
///
/// # Errors
/// If its planes contradict the stream's format. `key` then holds no key frame.
pub fn decode_key(
    pool: &ThreadPool,
    format: &StreamFormat,
    input: &KeyInput<'_>,
    pixels_per_degree: Option<f32>,
    scratch: &mut DecodeScratch,
    key: &mut KeyFrame,
) -> Result<DecodeReport, DecodeError> {
    let planes = CheckedKey::new(format, input)?;
    let mut report = DecodeReport::default();
    key.index = input.index;
    key.content_time = input.content_time;
    key.is_cut = input.is_cut;
    key.is_found_cut = false;
    key.camera = input.camera;
    key.motion_from_camera = input.motion_from_camera;
    key.acceleration.resize(0, 0);
    key.came.resize(0, 0);
    key.displacement.resize(0, 0);
    key.steady.reset(format.color, 0, 0);
    key.valid =
        color::decode_color(pool, format, &planes.color, &mut scratch.color, &mut key.color);
    let is_reduced =
        format.valid_rect_use == ValidRectUse::Multiplex && planes.color.valid != key.valid;
    report.reduced = is_reduced.then_some(planes.color.valid);
    let projection =
        input.camera.and_then(|camera| ProjectionDepth::from_projection(&camera.projection));
    let field = FieldInput::new(format, input, &planes, projection, key.valid, pool)?;
    key.field_offset = field.offset();
    key.inverse_distance_per_depth_key = field.inverse_distance_per_depth_key();
    key.motion_from = None;
    if field.has_depth() {
        report.depth_contradiction = field.decode_depth(&mut scratch.columns, &mut key.depth);
    } else {
        key.depth.resize(0, 0);
    }
    field.decode_mask(planes.mask.as_ref(), &mut scratch.columns, &mut key.mask);
    let span = planes.motion.and(input.motion_from).map(|from| input.content_time - from);
    report.lacks_camera_motion =
        span.is_some() && !input.is_cut && lacks_camera_motion(format, input, &planes);
    let Some(span) = span.filter(|_| !input.is_cut && !report.lacks_camera_motion) else {
        key.velocity.resize(0, 0);
        return Ok(report);
    };
    field.decode_motion(&mut scratch.columns, &mut scratch.displacement)?;
    if !key.mask.data().is_empty() {
        mask::fill_invalid(pool, &key.mask, &key.depth, &mut scratch.displacement);
    }
    let params = DilateParams { pixels_per_degree, span };
    dilate_motion(pool, &params, &key.depth, &scratch.displacement, &mut key.velocity);
    key.motion_from = input.motion_from;
    Ok(report)
}

/// Whether vectors lack the camera's motion, and something that it is worked out from is missing.
fn lacks_camera_motion(
    format: &StreamFormat,
    input: &KeyInput<'_>,
    planes: &CheckedKey<'_>,
) -> bool {
    format.motion.is_some_and(|motion| motion.camera_motion == CameraMotion::Missing)
        && (planes.depth.is_none() || input.camera.is_none() || input.motion_from_camera.is_none())
}

/// The planes of a key, each checked on its own and against the stream.
struct CheckedKey<'a> {
    color: CheckedPlane<'a>,
    depth: Option<CheckedPlane<'a>>,
    motion: Option<CheckedPlane<'a>>,
    mask: Option<CheckedPlane<'a>>,
}

impl<'a> CheckedKey<'a> {
    fn new(format: &StreamFormat, input: &KeyInput<'a>) -> Result<Self, DecodeError> {
        let (width, height, max) = (format.width, format.height, StreamFormat::MAX_SIZE);
        if width == 0 || height == 0 || width > max || height > max {
            return Err(DecodeError::StreamSize { max, width, height });
        }
        if (input.color.width, input.color.height) != (width, height) {
            return Err(DecodeError::ColorSize {
                expected_width: width,
                expected_height: height,
                width: input.color.width,
                height: input.color.height,
            });
        }
        let color =
            CheckedPlane::new(PlaneName::Color, &input.color, format.color.bytes_per_pixel())?;
        let field_plane = |plane, found: Option<_>, bytes_per_pixel: Option<u32>| {
            let Some(found) = found else { return Ok(None) };
            let bytes_per_pixel = bytes_per_pixel.ok_or(DecodeError::Undeclared { plane })?;
            let checked = CheckedPlane::new(plane, &found, bytes_per_pixel)?;
            // Keys of either size may have the same depth and motion.
            let finest = match format.valid_rect_use {
                ValidRectUse::Multiplex => Rect::full(width, height),
                ValidRectUse::Letterbox | ValidRectUse::Stretch => color.valid,
            };
            checked.check_ratio(plane, color.valid, finest)?;
            Ok(Some(checked))
        };
        let depth_bytes = format.depth.map(|depth| depth.format.bytes_per_pixel());
        let motion_bytes = format.motion.map(|motion| motion.format.bytes_per_pixel());
        let depth = field_plane(PlaneName::Depth, input.depth, depth_bytes)?;
        let motion = field_plane(PlaneName::Motion, input.motion, motion_bytes)?;
        let mask = field_plane(PlaneName::Mask, input.mask, Some(1))?;
        for camera in [&input.camera, &input.motion_from_camera].into_iter().flatten() {
            camera::check_camera(camera)?;
        }
        if let Some(motion_from) = input.motion_from.filter(|from| *from >= input.content_time) {
            let content_time = input.content_time;
            return Err(DecodeError::MotionFrom { content_time, motion_from });
        }
        Ok(Self { color, depth, motion, mask })
    }
}

/// The part of the output that shows the image of a key with this valid rectangle.
#[expect(clippy::cast_precision_loss, reason = "sizes up to 8192 are exact")]
fn size(rect: Rect) -> [f32; 2] {
    [rect.width as f32, rect.height as f32]
}
