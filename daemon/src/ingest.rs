//! From what arrives to what the engine takes: formats, key frames, and the order of keys.
//!
//! Pure: the live daemon and the replay tool hand over the same messages and so get the same input.
//! The protocol has checked every field by itself; here is checked what needs the key before
//! ([`KeyOrder`]) and that the pixels are there in full ([`key_input`]).

use foreframe_engine::{
    self as engine, KeyInput, MonoTime, Pixels, PlaneInput, ReadPixels, UiInput,
    format as convention,
};
use foreframe_protocol as protocol;
use foreframe_protocol::{PlaneDescriptor, PlaneKind, Submit, UiPlane};

/// A key frame that cannot be handed to the engine.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IngestError {
    /// Content time runs backwards, or stands still.
    #[error(
        "content_time_ns: expected more than {expected}, that of the key before, found {found}"
    )]
    ContentTime {
        /// Of the key before.
        expected: u64,
        /// Of this key.
        found: u64,
    },
    /// Sequence numbers run backwards, or stand still.
    #[error("key_index: expected more than {expected}, that of the key before, found {found}")]
    KeyIndex {
        /// Of the key before.
        expected: u64,
        /// Of this key.
        found: u64,
    },
    /// A plane without all of its pixels.
    #[error("{plane} plane: expected {expected} bytes, found {found}")]
    PlaneBytes {
        /// The plane.
        plane: PlaneKind,
        /// What its size asks for.
        expected: u64,
        /// What there is.
        found: u64,
    },
    /// A plane that the stream did not declare, or colour missing.
    #[error("planes: expected {expected}, found {found}")]
    Planes {
        /// What the stream declares.
        expected: &'static str,
        /// What the key has.
        found: &'static str,
    },
}

impl IngestError {
    /// The part that was wrong, what it should have been and what it was, for an error message.
    #[must_use]
    pub fn parts(&self) -> (String, String, String) {
        match self {
            Self::ContentTime { expected, found } => (
                "submit.content_time_ns".into(),
                format!("more than {expected}"),
                found.to_string(),
            ),
            Self::KeyIndex { expected, found } => {
                ("submit.key_index".into(), format!("more than {expected}"), found.to_string())
            }
            Self::PlaneBytes { plane, expected, found } => {
                (format!("{plane} plane"), format!("{expected} bytes"), format!("{found} bytes"))
            }
            Self::Planes { expected, found } => {
                ("submit.plane_bits".into(), (*expected).into(), (*found).into())
            }
        }
    }
}

/// The engine's words for what a stream declares. User interfaces have the format of colour.
#[must_use]
pub fn stream_format(format: &protocol::StreamFormat) -> engine::StreamFormat {
    engine::StreamFormat {
        width: format.width,
        height: format.height,
        color: match format.color {
            protocol::ColorFormat::Rgba8 => convention::ColorFormat::Rgba8,
            protocol::ColorFormat::Rgb10a2 => convention::ColorFormat::Rgb10a2,
            protocol::ColorFormat::Rgba16f => convention::ColorFormat::Rgba16f,
        },
        transfer: match format.transfer {
            protocol::Transfer::Srgb => convention::Transfer::Srgb,
            protocol::Transfer::Pq => convention::Transfer::Pq,
            protocol::Transfer::Linear => convention::Transfer::Linear,
        },
        primaries: match format.primaries {
            protocol::Primaries::Bt709 => convention::Primaries::Bt709,
            protocol::Primaries::Bt2020 => convention::Primaries::Bt2020,
            protocol::Primaries::DisplayP3 => convention::Primaries::DisplayP3,
        },
        white_cd_m2: format.white_cd_m2,
        valid_rect_use: match format.valid_rect_use {
            protocol::ValidRectUse::Letterbox => convention::ValidRectUse::Letterbox,
            protocol::ValidRectUse::Stretch => convention::ValidRectUse::Stretch,
            protocol::ValidRectUse::Multiplex => convention::ValidRectUse::Multiplex,
        },
        depth: format.depth.map(depth),
        motion: format.motion.map(motion),
    }
}

fn depth(depth: protocol::DepthConvention) -> convention::DepthConvention {
    convention::DepthConvention {
        format: match depth.format {
            protocol::DepthFormat::F32 => convention::DepthFormat::F32,
            protocol::DepthFormat::F16 => convention::DepthFormat::F16,
            protocol::DepthFormat::U16 => convention::DepthFormat::U16,
            protocol::DepthFormat::U24 => convention::DepthFormat::U24,
        },
        meaning: match depth.meaning {
            protocol::DepthMeaning::Standard => convention::DepthMeaning::Standard,
            protocol::DepthMeaning::Reversed => convention::DepthMeaning::Reversed,
            protocol::DepthMeaning::LinearView => convention::DepthMeaning::LinearView,
        },
    }
}

fn motion(motion: protocol::MotionConvention) -> convention::MotionConvention {
    convention::MotionConvention {
        format: match motion.format {
            protocol::MotionFormat::Rg16f => convention::MotionFormat::Rg16f,
            protocol::MotionFormat::Rg32f => convention::MotionFormat::Rg32f,
        },
        direction: match motion.direction {
            protocol::MotionDirection::CurrentToPrevious => {
                convention::MotionDirection::CurrentToPrevious
            }
            protocol::MotionDirection::PreviousToCurrent => {
                convention::MotionDirection::PreviousToCurrent
            }
        },
        unit: match motion.unit {
            protocol::MotionUnit::Pixels => convention::MotionUnit::Pixels,
            protocol::MotionUnit::Uv => convention::MotionUnit::Uv,
            protocol::MotionUnit::Ndc => convention::MotionUnit::Ndc,
        },
        scale: motion.scale,
        camera_motion: match motion.camera_motion {
            protocol::CameraMotion::Included => convention::CameraMotion::Included,
            protocol::CameraMotion::Missing => convention::CameraMotion::Missing,
        },
    }
}

/// Holds the keys of one stream to their order: index and content time grow from key to key.
#[derive(Clone, Copy, Debug, Default)]
pub struct KeyOrder {
    newest: Option<(u64, u64)>,
}

impl KeyOrder {
    /// Takes note of a key.
    ///
    /// # Errors
    /// If it does not come after the one before.
    pub fn check(&mut self, submit: &Submit) -> Result<(), IngestError> {
        let (index, content_time) = (submit.key_index, submit.content_time_ns);
        if let Some((last_index, last_time)) = self.newest {
            if index <= last_index {
                return Err(IngestError::KeyIndex { expected: last_index, found: index });
            }
            if content_time <= last_time {
                return Err(IngestError::ContentTime { expected: last_time, found: content_time });
            }
        }
        self.newest = Some((index, content_time));
        Ok(())
    }
}

/// Where the pixels of a plane of a key are.
#[derive(Clone, Copy, Debug)]
pub enum PlaneSource<'a> {
    /// In memory of our own, rows without padding.
    Packed(&'a [u8]),
    /// In the slot that the client submitted, laid out as it described.
    InSlot(&'a dyn ReadPixels),
}

/// A key frame as the engine takes it. `source` gives the pixels of a plane.
///
/// # Errors
/// If a plane is not declared by the stream, or not all of its pixels are there.
pub fn key_input<'a>(
    format: &protocol::StreamFormat,
    submit: &Submit,
    source: impl Fn(PlaneKind) -> Option<PlaneSource<'a>>,
) -> Result<KeyInput<'a>, IngestError> {
    let plane = |kind| {
        let Some(descriptor) = submit.planes.get(kind) else { return Ok(None) };
        let bytes_per_pixel = format.bytes_per_pixel(kind).ok_or(IngestError::Planes {
            expected: "the planes that the stream declares",
            found: "another one",
        })?;
        let source = source(kind).unwrap_or(PlaneSource::Packed(&[]));
        plane_input(kind, descriptor, bytes_per_pixel, source).map(Some)
    };
    Ok(KeyInput {
        index: submit.key_index,
        content_time: MonoTime::from_ns(submit.content_time_ns),
        motion_from: submit.motion_from_ns.map(MonoTime::from_ns),
        is_cut: submit.is_cut,
        color: plane(PlaneKind::Color)?
            .ok_or(IngestError::Planes { expected: "a color plane", found: "none" })?,
        depth: plane(PlaneKind::Depth)?,
        motion: plane(PlaneKind::Motion)?,
        mask: plane(PlaneKind::Mask)?,
        camera: submit.camera.map(camera),
        motion_from_camera: submit.motion_from_camera.map(camera),
    })
}

/// The user interface that came with a key frame, as the engine takes it; None if none did.
/// `source` gives the pixels of a plane.
///
/// # Errors
/// As [`key_input`].
pub fn ui_of_key<'a>(
    format: &protocol::StreamFormat,
    submit: &Submit,
    source: impl Fn(PlaneKind) -> Option<PlaneSource<'a>>,
) -> Result<Option<UiInput<'a>>, IngestError> {
    let Some(descriptor) = submit.planes.get(PlaneKind::Ui) else { return Ok(None) };
    let source = source(PlaneKind::Ui).unwrap_or(PlaneSource::Packed(&[]));
    ui_plane(format, descriptor, [0; 2], source).map(Some)
}

/// A user interface that came by itself, as the engine takes it.
///
/// # Errors
/// As [`key_input`].
pub fn ui_input<'a>(
    format: &protocol::StreamFormat,
    ui: &UiPlane,
    source: PlaneSource<'a>,
) -> Result<UiInput<'a>, IngestError> {
    ui_plane(format, &ui.plane, ui.place, source)
}

fn ui_plane<'a>(
    format: &protocol::StreamFormat,
    descriptor: &PlaneDescriptor,
    place: [i32; 2],
    source: PlaneSource<'a>,
) -> Result<UiInput<'a>, IngestError> {
    if format.ui != Some(format.color) {
        let expected = "UI planes with the format of colour";
        return Err(IngestError::Planes { expected, found: "none, or others" });
    }
    let bytes_per_pixel = format.color.bytes_per_pixel();
    let plane = plane_input(PlaneKind::Ui, descriptor, bytes_per_pixel, source)?;
    Ok(UiInput { plane, place })
}

fn plane_input<'a>(
    kind: PlaneKind,
    descriptor: &PlaneDescriptor,
    bytes_per_pixel: u32,
    source: PlaneSource<'a>,
) -> Result<PlaneInput<'a>, IngestError> {
    let PlaneDescriptor { width, height, valid, jitter, .. } = *descriptor;
    let row = width.saturating_mul(bytes_per_pixel);
    let (pixels, stride) = match source {
        PlaneSource::Packed(bytes) => (Pixels::Bytes(bytes), row),
        PlaneSource::InSlot(reader) => (Pixels::Reader(reader), descriptor.stride),
    };
    let expected = u64::from(stride) * u64::from(height.saturating_sub(1)) + u64::from(row);
    let found = pixels.byte_count();
    if found != expected {
        return Err(IngestError::PlaneBytes { plane: kind, expected, found });
    }
    let protocol::Rect { x, y, width: valid_width, height: valid_height } = valid;
    let valid = engine::Rect { x, y, width: valid_width, height: valid_height };
    Ok(PlaneInput { pixels, width, height, stride, valid, jitter })
}

fn camera(camera: protocol::Camera) -> engine::Camera {
    engine::Camera { view: camera.view, projection: camera.projection }
}

#[cfg(test)]
mod tests {
    use foreframe_protocol::{PlaneMap, PlaneSize};

    use super::*;

    fn submit(key_index: u64, content_time_ns: u64) -> Submit {
        let mut planes = PlaneMap::default();
        let size = PlaneSize { width: 3, height: 2 };
        planes.set(PlaneKind::Color, Some(PlaneDescriptor::packed(0, size, 4)));
        Submit {
            stream: 1,
            slot: 0,
            key_index,
            content_time_ns,
            motion_from_ns: None,
            is_cut: false,
            planes,
            camera: None,
            motion_from_camera: None,
        }
    }

    #[test]
    fn keys_that_do_not_move_forward_say_what_was_expected_and_found() {
        let mut order = KeyOrder::default();
        order.check(&submit(5, 100)).unwrap();
        let found = |error: IngestError| error.to_string();
        assert_eq!(
            found(order.check(&submit(5, 101)).unwrap_err()),
            "key_index: expected more than 5, that of the key before, found 5"
        );
        assert_eq!(
            found(order.check(&submit(6, 100)).unwrap_err()),
            "content_time_ns: expected more than 100, that of the key before, found 100"
        );
        order.check(&submit(6, 101)).unwrap();
    }

    #[test]
    fn a_key_that_was_refused_leaves_the_order_as_it_was() {
        let mut order = KeyOrder::default();
        order.check(&submit(5, 100)).unwrap();
        order.check(&submit(900, 50)).unwrap_err();
        order.check(&submit(6, 101)).unwrap();
    }

    #[test]
    fn a_plane_with_missing_or_surplus_pixels_is_refused() {
        let format = protocol::StreamFormat::rgba8(3, 2);
        let pixels = [0; 28];
        for (count, is_whole) in [(24, true), (23, false), (28, false), (0, false)] {
            let input =
                key_input(&format, &submit(0, 0), |_| Some(PlaneSource::Packed(&pixels[..count])));
            assert_eq!(input.is_ok(), is_whole, "{count} bytes");
        }
    }

    #[test]
    fn a_plane_that_was_not_declared_is_refused() {
        let format = protocol::StreamFormat::rgba8(3, 2);
        let mut submit = submit(0, 0);
        let size = PlaneSize { width: 1, height: 1 };
        submit.planes.set(PlaneKind::Depth, Some(PlaneDescriptor::packed(64, size, 4)));
        let error =
            key_input(&format, &submit, |_| Some(PlaneSource::Packed(&[0; 24]))).unwrap_err();
        assert!(matches!(error, IngestError::Planes { .. }), "{error}");
    }
}
