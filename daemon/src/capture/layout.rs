//! How the pixels of a stream's planes divide into elements: what the filter needs to know.

use foreframe_protocol::{
    ColorFormat, DepthFormat, MotionFormat, PlaneDescriptor, PlaneKind, StreamFormat,
};

use super::filter::PixelLayout;
use super::record::PlaneInfo;

/// Layout of the pixels of a plane; None where the stream has no such plane.
#[must_use]
pub fn pixel_layout(format: &StreamFormat, kind: PlaneKind) -> Option<PixelLayout> {
    let color = |format| match format {
        ColorFormat::Rgba8 => (1, 4),
        ColorFormat::Rgb10a2 => (4, 1),
        ColorFormat::Rgba16f => (2, 4),
    };
    let (element_bytes, channels) = match kind {
        PlaneKind::Color => color(format.color),
        PlaneKind::Depth => match format.depth?.format {
            DepthFormat::F32 | DepthFormat::U24 => (4, 1),
            DepthFormat::F16 | DepthFormat::U16 => (2, 1),
        },
        PlaneKind::Motion => match format.motion?.format {
            MotionFormat::Rg16f => (2, 2),
            MotionFormat::Rg32f => (4, 2),
        },
        PlaneKind::Ui => color(format.ui?),
        PlaneKind::Mask => format.mask.map(|_| (1, 1))?,
    };
    Some(PixelLayout { element_bytes, channels })
}

impl PlaneInfo {
    /// The first plane of its kind, as a submit message describes it. None where the stream has no
    /// such plane.
    #[must_use]
    pub fn described(
        format: &StreamFormat,
        kind: PlaneKind,
        descriptor: &PlaneDescriptor,
        motion_from_ns: Option<u64>,
    ) -> Option<Self> {
        Some(Self {
            kind,
            which: 0,
            layout: pixel_layout(format, kind)?,
            width: descriptor.width,
            height: descriptor.height,
            valid: descriptor.valid,
            jitter: descriptor.jitter,
            motion_from_ns: motion_from_ns.filter(|_| kind == PlaneKind::Motion),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use foreframe_protocol::{
        CameraMotion, DepthConvention, DepthMeaning, MaskFormat, MotionConvention, MotionDirection,
        MotionUnit,
    };

    #[test]
    fn every_layout_has_the_bytes_per_pixel_of_the_protocol() {
        for &color in ColorFormat::ALL {
            for &depth in DepthFormat::ALL {
                for &motion in MotionFormat::ALL {
                    let format = StreamFormat {
                        color,
                        ui: Some(color),
                        depth: Some(DepthConvention {
                            format: depth,
                            meaning: DepthMeaning::Reversed,
                        }),
                        motion: Some(MotionConvention {
                            format: motion,
                            direction: MotionDirection::CurrentToPrevious,
                            unit: MotionUnit::Pixels,
                            scale: [1.0; 2],
                            camera_motion: CameraMotion::Included,
                        }),
                        mask: Some(MaskFormat::Class8),
                        ..StreamFormat::rgba8(8, 8)
                    };
                    for &kind in PlaneKind::ALL {
                        let bytes = pixel_layout(&format, kind).map(PixelLayout::pixel_bytes);
                        let expected = format.bytes_per_pixel(kind).map(|bytes| bytes as usize);
                        assert_eq!(bytes, expected, "{kind}");
                    }
                }
            }
        }
    }

    #[test]
    fn planes_that_are_not_declared_have_no_layout() {
        let format = StreamFormat::rgba8(8, 8);
        for &kind in &PlaneKind::ALL[1..] {
            assert_eq!(pixel_layout(&format, kind), None, "{kind}");
        }
    }
}
