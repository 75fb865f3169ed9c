//! Depth and motion of a key as decoded, before dilation and quantisation: for tools that follow
//! motion over several frames, which must not widen or round it at each.

use rayon::ThreadPool;

use super::camera::ProjectionDepth;
use super::color::image_rect;
use super::error::DecodeError;
use super::field::FieldInput;
use super::{CheckedKey, lacks_camera_motion};
use crate::format::StreamFormat;
use crate::key::KeyInput;
use crate::plane::{Plane, Rect};

/// Depth and motion on the field grid of one key.
#[derive(Clone, PartialEq, Debug)]
pub struct MotionField {
    /// Depth key per cell, larger is nearer. Empty without a depth plane.
    pub depth: Plane<u32>,
    /// Newer minus older position per cell, output pixels; NaN where none is known.
    pub displacement: Plane<[f32; 2]>,
    /// The part of the output that the cells share out evenly.
    pub image: Rect,
    /// Offset of the samples in cells: a cell of centre c shows the image at c + jitter.
    pub jitter: [f32; 2],
}

/// Decodes depth and motion of one key; None where it has no usable motion.
///
/// # Errors
/// Those of [`super::decode_key`].
pub fn decode_field(
    pool: &ThreadPool,
    format: &StreamFormat,
    input: &KeyInput<'_>,
) -> Result<Option<MotionField>, DecodeError> {
    let planes = CheckedKey::new(format, input)?;
    let has_motion = planes.motion.is_some() && input.motion_from.is_some() && !input.is_cut;
    if !has_motion || lacks_camera_motion(format, input, &planes) {
        return Ok(None);
    }
    let projection =
        input.camera.and_then(|camera| ProjectionDepth::from_projection(&camera.projection));
    let image = image_rect(format, &planes.color);
    let field = FieldInput::new(format, input, &planes, projection, image, pool)?;
    let mut columns = <[Vec<u16>; 2]>::default();
    let (mut depth, mut displacement) = (Plane::default(), Plane::default());
    if field.has_depth() {
        field.decode_depth(&mut columns, &mut depth);
    }
    field.decode_motion(&mut columns, &mut displacement)?;
    Ok(Some(MotionField { depth, displacement, image, jitter: field.jitter() }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{
        CameraMotion, DepthConvention, DepthFormat, DepthMeaning, MotionConvention,
        MotionDirection, MotionFormat, MotionUnit,
    };
    use crate::key::PlaneInput;
    use crate::time::MonoTime;

    fn plane(bytes: &[u8], bytes_per_pixel: u32) -> PlaneInput<'_> {
        PlaneInput {
            pixels: bytes.into(),
            width: 4,
            height: 2,
            stride: 4 * bytes_per_pixel,
            valid: Rect::full(4, 2),
            jitter: [0.0; 2],
        }
    }

    #[test]
    fn a_field_is_neither_widened_nor_rounded() {
        let format = StreamFormat {
            depth: Some(DepthConvention {
                format: DepthFormat::F32,
                meaning: DepthMeaning::Reversed,
            }),
            motion: Some(MotionConvention {
                format: MotionFormat::Rg32f,
                direction: MotionDirection::CurrentToPrevious,
                unit: MotionUnit::Uv,
                scale: [1.0, -1.0],
                camera_motion: CameraMotion::Included,
            }),
            ..StreamFormat::rgba8(4, 2)
        };
        let vectors: [f32; 16] =
            std::array::from_fn(|i| if i == 6 { f32::NAN } else { i as f32 / 1000.0 });
        let depths = [0.5_f32, 0.25, 1.0, 0.0, 0.5, 0.25, 1.0, 0.0].map(f32::to_le_bytes);
        let (vector_bytes, color) = (vectors.map(f32::to_le_bytes), [0; 32]);
        let mut input = KeyInput {
            index: 0,
            content_time: MonoTime::from_ns(9),
            motion_from: Some(MonoTime::from_ns(1)),
            is_cut: false,
            color: plane(&color, 4),
            depth: Some(plane(depths.as_flattened(), 4)),
            motion: Some(plane(vector_bytes.as_flattened(), 8)),
            mask: None,
            camera: None,
            motion_from_camera: None,
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let field = decode_field(&pool, &format, &input).unwrap().unwrap();
        assert_eq!(field.image, Rect::full(4, 2));
        for (cell, found) in field.displacement.data().iter().enumerate() {
            let expected = [-4.0 * vectors[2 * cell], 2.0 * vectors[2 * cell + 1]];
            assert_eq!(found[0].is_nan(), cell == 3);
            for (found, expected) in found.iter().zip(expected).filter(|(_, e)| !e.is_nan()) {
                assert!((found - expected).abs() < 1e-6, "expected {expected}, found {found}");
            }
        }
        assert!(field.depth.at(2, 0) > field.depth.at(0, 0));
        input.is_cut = true;
        assert_eq!(decode_field(&pool, &format, &input).unwrap(), None);
    }
}
