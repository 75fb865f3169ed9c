//! A stream with every plane, a key frame and a UI plane of it, and a pool for its output.

use foreframe_protocol::*;

pub(crate) const IDENTITY: [f32; 16] =
    [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

pub(crate) fn stream() -> CreateStream {
    let format = StreamFormat {
        depth: Some(DepthConvention { format: DepthFormat::F32, meaning: DepthMeaning::Reversed }),
        motion: Some(MotionConvention {
            format: MotionFormat::Rg16f,
            direction: MotionDirection::CurrentToPrevious,
            unit: MotionUnit::Ndc,
            scale: [1.0, -1.0],
            camera_motion: CameraMotion::Missing,
        }),
        ui: Some(ColorFormat::Rgba8),
        mask: Some(MaskFormat::Class8),
        white_cd_m2: 203.0,
        ..StreamFormat::rgba8(1920, 1080)
    };
    let mut max_sizes = format.full_sizes();
    max_sizes.set(PlaneKind::Depth, Some(PlaneSize { width: 960, height: 540 }));
    max_sizes.set(PlaneKind::Motion, Some(PlaneSize { width: 1280, height: 720 }));
    CreateStream { stream: 1, format, max_sizes, slots: 3 }
}

pub(crate) fn submit() -> Submit {
    let stream = stream();
    let mut offset = 0;
    let planes = PlaneMap::from_fn(|kind| {
        let (size, pixel) = (*stream.max_sizes.get(kind)?, stream.format.bytes_per_pixel(kind)?);
        let plane = PlaneDescriptor::packed(offset, size, pixel);
        offset = (offset + plane.byte_len(pixel)).next_multiple_of(limits::OFFSET_ALIGN);
        Some(PlaneDescriptor { jitter: [0.25, -0.5], ..plane })
    });
    let camera = Camera { view: IDENTITY, projection: IDENTITY };
    Submit {
        stream: 1,
        slot: 2,
        key_index: 77,
        content_time_ns: 2_000_000_000,
        motion_from_ns: Some(1_975_000_000),
        is_cut: true,
        planes,
        camera: Some(camera),
        motion_from_camera: Some(camera),
    }
}

pub(crate) fn ui_plane() -> UiPlane {
    let size = PlaneSize { width: 320, height: 64 };
    let plane = PlaneDescriptor {
        valid: Rect { x: 8, y: 2, width: 300, height: 60 },
        ..PlaneDescriptor::packed(4096, size, 4)
    };
    UiPlane { stream: 1, slot: 1, ui_index: 900, place: [-20, 1000], plane }
}

/// Bytes of a slot that holds [`submit`].
pub(crate) const SLOT_BYTES: u64 = 32 << 20;

pub(crate) fn output_pool() -> OutputPool {
    OutputPool {
        stream: 0,
        pool: 4,
        slots: 3,
        width: 640,
        height: 360,
        stride: 2560,
        color: ColorFormat::Rgba8,
        transfer: Transfer::Srgb,
        primaries: Primaries::Bt709,
        white_cd_m2: 0.0,
        slot_bytes: 921_600,
    }
}
