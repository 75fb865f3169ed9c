//! Strategies that make any message that a peer may send.

use foreframe_protocol::*;
use proptest::prelude::*;

fn coded<T: Copy + std::fmt::Debug + 'static>(all: &'static [T]) -> impl Strategy<Value = T> {
    proptest::sample::select(all)
}

fn scale() -> impl Strategy<Value = f32> {
    prop_oneof![0.001_f32..1e6, -1e6_f32..-0.001]
}

fn depth() -> impl Strategy<Value = DepthConvention> {
    (coded(DepthFormat::ALL), coded(DepthMeaning::ALL))
        .prop_map(|(format, meaning)| DepthConvention { format, meaning })
}

fn motion() -> impl Strategy<Value = MotionConvention> {
    (
        coded(MotionFormat::ALL),
        coded(MotionDirection::ALL),
        coded(MotionUnit::ALL),
        [scale(), scale()],
        coded(CameraMotion::ALL),
    )
        .prop_map(|(format, direction, unit, scale, camera_motion)| MotionConvention {
            format,
            direction,
            unit,
            scale,
            camera_motion,
        })
}

/// Any name, of up to 16 characters of up to 4 bytes each.
fn profile_name() -> impl Strategy<Value = ProfileName> {
    "[^\\pC]{1,16}".prop_map(|name| ProfileName::new(&name).expect("at most 64 bytes of text"))
}

prop_compose! {
    /// Any stream that may be asked for.
    pub(crate) fn any_stream()(
        stream in 1..=u32::MAX,
        (width, height) in (1..=8192_u32, 1..=8192_u32),
        color in coded(ColorFormat::ALL),
        transfer in coded(Transfer::ALL),
        primaries in coded(Primaries::ALL),
        white_cd_m2 in 0.0..=10_000.0_f32,
        valid_rect_use in coded(ValidRectUse::ALL),
        depth in proptest::option::of(depth()),
        motion in proptest::option::of(motion()),
        ui in proptest::option::of(coded(ColorFormat::ALL)),
        mask in proptest::option::of(coded(MaskFormat::ALL)),
        ratio in 1.0..=4.0_f64,
        slots in 1..=8_u32,
        display_profile in proptest::option::of(profile_name()),
    ) -> CreateStream {
        let format = StreamFormat {
            width, height, color, transfer, primaries, white_cd_m2, valid_rect_use, depth, motion,
            ui, mask, display_profile,
        };
        let mut max_sizes = format.full_sizes();
        let over = |size: u32| (f64::from(size) / ratio).round().max(1.0) as u32;
        for kind in [PlaneKind::Depth, PlaneKind::Motion, PlaneKind::Mask] {
            if let Some(size) = max_sizes.get_mut(kind) {
                *size = PlaneSize { width: over(width), height: over(height) };
            }
        }
        CreateStream { stream, format, max_sizes, slots }
    }
}

prop_compose! {
    /// Any plane that fits some stream.
    fn any_plane()(
        offset in 0..1_u64 << 30,
        (width, height) in (1..=8192_u32, 1..=8192_u32),
        stride in 0..=131_072_u32,
        corner in (0.0..1.0_f64, 0.0..1.0_f64),
        jitter in [-1.0..=1.0_f32, -1.0..=1.0_f32],
    ) -> PlaneDescriptor {
        let x = (corner.0 * f64::from(width)) as u32;
        let y = (corner.1 * f64::from(height)) as u32;
        PlaneDescriptor {
            offset: offset * 16,
            width,
            height,
            stride,
            valid: Rect { x, y, width: width - x, height: height - y },
            jitter,
        }
    }
}

fn any_camera() -> impl Strategy<Value = Camera> {
    // A dominant diagonal is invertible.
    let matrix = || {
        proptest::array::uniform16(-1.0..1.0_f32).prop_map(|mut matrix| {
            for index in [0, 5, 10, 15] {
                matrix[index] += 10.0;
            }
            matrix
        })
    };
    (matrix(), matrix()).prop_map(|(view, projection)| Camera { view, projection })
}

prop_compose! {
    /// Any key frame that fits some stream.
    pub(crate) fn any_submit()(
        stream in 1..=u32::MAX,
        slot in 0..8_u32,
        key_index: u64,
        content_time_ns in 1..=limits::MAX_TIME_NS,
        motion_from in proptest::option::of(0.0..1.0_f64),
        is_cut: bool,
        color in any_plane(),
        others in proptest::array::uniform4(proptest::option::of(any_plane())),
        camera in proptest::option::of(any_camera()),
        motion_from_camera in proptest::option::of(any_camera()),
    ) -> Submit {
        let mut others = others.into_iter();
        let planes = PlaneMap::from_fn(|kind| match kind {
            PlaneKind::Color => Some(color),
            _ => others.next().expect("four"),
        });
        let motion_from_ns = motion_from
            .map(|part| ((content_time_ns as f64 * part) as u64).min(content_time_ns - 1));
        Submit {
            stream, slot, key_index, content_time_ns, motion_from_ns, is_cut, planes, camera,
            motion_from_camera,
        }
    }
}
