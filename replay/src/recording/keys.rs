//! Reads planned keys, with their motion from wherever the plan found it.
//!
//! Where every key has motion of its own step, planes reach the engine in the stream's convention,
//! untouched. As soon as one key's motion has to be composed, all keys of the recording get motion
//! planes of 32-bit floats in the engine's own sense, since a stream has one convention.

use anyhow::Context as _;
use foreframe_engine::decode::{MotionField, decode_field};
use foreframe_engine::format::{
    CameraMotion, MotionConvention, MotionDirection, MotionFormat, MotionUnit,
};
use foreframe_engine::{Plane, Rect, StreamFormat};
use rayon::ThreadPool;

use super::compose::{Field, compose};
use super::plan::{MotionSource, Plan, PlannedKey};
use super::{Frame, OwnedPlane, Recording, Wanted};

/// What a rewritten motion plane holds: displacements as the engine has them.
const REWRITTEN: MotionConvention = MotionConvention {
    format: MotionFormat::Rg32f,
    direction: MotionDirection::PreviousToCurrent,
    unit: MotionUnit::Pixels,
    scale: [1.0; 2],
    camera_motion: CameraMotion::Included,
};

/// Reads the keys of one recording.
#[derive(Debug)]
pub struct KeyReader {
    recorded: StreamFormat,
    format: StreamFormat,
    /// Decodes fields, where motion is rewritten.
    pool: Option<ThreadPool>,
}

impl KeyReader {
    /// A reader for the keys of `plan`, of a recording in this format.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn new(recorded: &StreamFormat, plan: &Plan) -> anyhow::Result<Self> {
        let is_composed = |key: &PlannedKey| matches!(key.motion, MotionSource::Composed { .. });
        let mut reader = Self { recorded: *recorded, format: *recorded, pool: None };
        if plan.keys.iter().any(is_composed) {
            reader.format.motion = Some(REWRITTEN);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            reader.pool = Some(pool.context("starting a thread to decode motion with")?);
        }
        Ok(reader)
    }

    /// The format of the keys as they are read: that of the recording, except perhaps for motion.
    #[must_use]
    pub fn format(&self) -> &StreamFormat {
        &self.format
    }

    /// Reads key number `key` of `plan`, with its cut flag and motion as planned.
    ///
    /// # Errors
    /// If a frame cannot be read, or its motion cannot be decoded.
    pub fn read(
        &self,
        recording: &mut dyn Recording,
        plan: &Plan,
        key: usize,
    ) -> anyhow::Result<Frame> {
        let planned = plan.keys.get(key).context("the recording has no frames")?;
        let PlannedKey { frame, is_cut, motion } = planned;
        let wanted = match motion {
            MotionSource::Own { plane } => Some(*plane),
            MotionSource::Composed { path } => path.first().map(|(_, plane)| *plane),
            MotionSource::None => None,
        };
        let mut read = recording.read(*frame, Wanted::Key { motion: wanted })?;
        read.is_cut = *is_cut;
        if *motion == MotionSource::None {
            (read.motion, read.motion_from, read.motion_from_camera) = (None, None, None);
        }
        let Some(pool) = &self.pool else { return Ok(read) };
        let Some(newest) = self.field(pool, &read)? else {
            (read.motion, read.motion_from) = (None, None);
            return Ok(read);
        };
        let jitter = newest.jitter;
        let scale = pixels_of_plane(&read.color.valid, &newest.image);
        let displacement = match motion {
            MotionSource::Composed { path } => {
                let mut fields = vec![field_of(newest)];
                for (frame, plane) in &path[1..] {
                    let wanted = Wanted::Key { motion: Some(*plane) };
                    let older = Frame { is_cut: false, ..recording.read(*frame, wanted)? };
                    let field = self.field(pool, &older)?.with_context(|| {
                        format!("frame {frame}: expected a motion plane that can be used")
                    })?;
                    fields.push(field_of(field));
                    read.motion_from = older.motion_from;
                }
                compose(&fields)
            }
            MotionSource::Own { .. } | MotionSource::None => newest.displacement,
        };
        read.motion = Some(rewritten(&displacement, scale, jitter));
        Ok(read)
    }

    /// Depth and motion of a frame in the engine's sense; None where it has no usable motion.
    fn field(&self, pool: &ThreadPool, frame: &Frame) -> anyhow::Result<Option<MotionField>> {
        decode_field(pool, &self.recorded, &frame.as_input())
            .with_context(|| format!("motion of key {}", frame.index))
    }
}

fn field_of(field: MotionField) -> Field {
    let MotionField { depth, displacement, image, jitter } = field;
    let cell_px = pixels_of_plane(&image, &Rect::full(displacement.width(), displacement.height()));
    Field {
        depth,
        displacement,
        valid: image,
        offset: [jitter[0] * cell_px[0], jitter[1] * cell_px[1]],
    }
}

/// Pixels of one rectangle per pixel of another.
fn pixels_of_plane(of: &Rect, per: &Rect) -> [f32; 2] {
    [of.width as f32 / per.width as f32, of.height as f32 / per.height as f32]
}

/// Displacements in output pixels as a plane of [`REWRITTEN`].
fn rewritten(
    displacement: &Plane<[f32; 2]>,
    color_px_per_output_px: [f32; 2],
    jitter: [f32; 2],
) -> OwnedPlane {
    let (width, height) = (displacement.width(), displacement.height());
    let vectors = displacement.data().iter();
    let scaled = vectors.map(|d| [0, 1].map(|axis| d[axis] * color_px_per_output_px[axis]));
    OwnedPlane {
        bytes: scaled.flatten().flat_map(f32::to_le_bytes).collect(),
        width,
        height,
        stride: width * MotionFormat::Rg32f.bytes_per_pixel(),
        valid: Rect::full(width, height),
        jitter,
    }
}
