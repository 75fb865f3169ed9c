//! What an application would hand over of a probe, and the truth at every output frame.

use foreframe_engine::format::{
    CameraMotion, DepthConvention, DepthFormat, DepthMeaning, MotionConvention, MotionDirection,
    MotionFormat, MotionUnit, ValidRectUse,
};
use foreframe_engine::key::Camera;
use foreframe_engine::{MonoSpan, MonoTime, Plane, Rect, StreamFormat};
use foreframe_fixtures::Size;
use foreframe_fixtures::probes::{PICTURE, Probe};
use foreframe_fixtures::sequence::motion_bytes;
use foreframe_protocol::MotionFormat as WireMotionFormat;

use crate::recording::{Frame, OwnedPlane};
use crate::score::picture::Srgb8;

/// Time from key to key: 40 Hz.
const KEY_INTERVAL: MonoSpan = MonoSpan::from_ms(25);
/// Content time of time 0: late enough that motion points to a time above 0.
const START_NS: u64 = 1_000_000_000;
/// Samples of a jittered field lie on a grid of so many per pixel and axis; odd, so that one of
/// them is the centre.
const JITTER_GRID: u32 = 7;

/// A key as an application has it after rendering. Times are in key intervals.
#[derive(Clone, Debug)]
pub struct KeyShot {
    /// What the picture shows.
    pub time: f64,
    /// What its motion points back to.
    pub motion_from: f64,
    /// Whether the application says that nothing before relates to it.
    pub is_cut: bool,
    /// Size of the part of the picture that holds the image.
    pub size: Size,
    /// Red, green, blue, alpha of that part.
    pub color: Vec<u8>,
    /// Distance along the view axis, by pixel of that part.
    pub depth: Vec<f32>,
    /// Position at `motion_from` minus position at `time`, pixels, by pixel of that part.
    pub motion: Vec<[f32; 2]>,
    /// Class of every pixel of that part, where they are handed over.
    pub mask: Option<Vec<u8>>,
    /// Whether depth is handed over.
    pub has_depth: bool,
    /// Whether motion is handed over.
    pub has_motion: bool,
    /// Jitter of depth and motion that is declared, pixels.
    pub jitter: [f32; 2],
    camera: Camera,
    motion_from_camera: Camera,
}

/// How the application renders one key.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KeyRecipe {
    /// What the picture shows, key intervals.
    pub time: f64,
    /// What its motion points back to, key intervals.
    pub motion_from: f64,
    /// Whether it is declared to be a cut.
    pub is_cut: bool,
    /// Share of the full resolution per axis.
    pub scale: f64,
    /// Where depth and motion are sampled, in sevenths of a pixel from the centre, -3 to 3.
    pub jitter: [i32; 2],
    /// Whether that is declared.
    pub declares_jitter: bool,
    /// Whether a mask says what pixels show.
    pub has_mask: bool,
}

impl KeyRecipe {
    /// A key at `time` whose motion points back to `motion_from`, with nothing special about it.
    #[must_use]
    pub fn new(time: f64, motion_from: f64) -> Self {
        Self {
            time,
            motion_from,
            is_cut: false,
            scale: 1.0,
            jitter: [0; 2],
            declares_jitter: true,
            has_mask: false,
        }
    }

    /// Renders it.
    #[must_use]
    pub fn shoot(&self, probe: &Probe) -> KeyShot {
        let size = PICTURE.reduced(1.0 / self.scale);
        let (depth, motion) = self.fields(probe, size);
        let declared = if self.declares_jitter { self.jitter } else { [0; 2] };
        KeyShot {
            time: self.time,
            motion_from: self.motion_from,
            is_cut: self.is_cut,
            size,
            color: probe.color(self.time, size).rgba,
            depth,
            motion,
            mask: self.has_mask.then(|| probe.classes(self.time, size)),
            has_depth: true,
            has_motion: true,
            jitter: declared.map(|sevenths| sevenths as f32 / JITTER_GRID as f32),
            camera: camera(probe, self.time),
            motion_from_camera: camera(probe, self.motion_from),
        }
    }

    fn fields(&self, probe: &Probe, size: Size) -> (Vec<f32>, Vec<[f32; 2]>) {
        if self.jitter == [0; 2] {
            let fields = probe.fields(self.time, self.motion_from, size, size);
            return (fields.depth, fields.motion);
        }
        let fine = Size::new(size.width * JITTER_GRID, size.height * JITTER_GRID);
        let fields = probe.fields(self.time, self.motion_from, size, fine);
        let middle = JITTER_GRID.cast_signed() / 2;
        let [column, row] = self.jitter.map(|off| (middle + off).cast_unsigned());
        let places = (0..size.height).flat_map(|y| {
            (0..size.width).map(move |x| {
                (y * JITTER_GRID + row) as usize * fine.width as usize
                    + (x * JITTER_GRID + column) as usize
            })
        });
        places.map(|place| (fields.depth[place], fields.motion[place])).unzip()
    }
}

fn camera(probe: &Probe, time: f64) -> Camera {
    let foreframe_fixtures::Camera { view, projection } = probe.camera(time, PICTURE);
    Camera { view, projection }
}

/// Content time of `time`, which is in key intervals.
#[must_use]
pub fn content_time(time: f64) -> MonoTime {
    MonoTime::from_ns(START_NS)
        + MonoSpan::from_ns((time * KEY_INTERVAL.as_ns() as f64).round() as i64)
}

/// What the streams of all probes declare.
#[must_use]
pub fn stream_format() -> StreamFormat {
    StreamFormat {
        valid_rect_use: ValidRectUse::Stretch,
        depth: Some(DepthConvention {
            format: DepthFormat::F32,
            meaning: DepthMeaning::LinearView,
        }),
        motion: Some(MotionConvention {
            format: MotionFormat::Rg32f,
            direction: MotionDirection::CurrentToPrevious,
            unit: MotionUnit::Pixels,
            scale: [1.0; 2],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(PICTURE.width, PICTURE.height)
    }
}

impl KeyShot {
    /// As it reaches the engine, under this number.
    #[must_use]
    pub fn to_frame(&self, index: u64) -> Frame {
        let depth: Vec<u8> = self.depth.iter().flat_map(|depth| depth.to_le_bytes()).collect();
        let motion = motion_bytes(&self.motion, WireMotionFormat::Rg32f);
        let fields = |bytes, pixel| OwnedPlane { jitter: self.jitter, ..self.plane(bytes, pixel) };
        Frame {
            index,
            content_time: content_time(self.time),
            motion_from: self.has_motion.then(|| content_time(self.motion_from)),
            is_cut: self.is_cut,
            color: self.plane(&self.color, 4),
            depth: self.has_depth.then(|| fields(&depth, 4)),
            motion: self.has_motion.then(|| fields(&motion, 8)),
            mask: self.mask.as_ref().map(|mask| self.plane(mask, 1)),
            ui: None,
            camera: Some(self.camera),
            motion_from_camera: Some(self.motion_from_camera),
        }
    }

    /// A plane of full size whose top left part holds these pixels.
    fn plane(&self, bytes: &[u8], bytes_per_pixel: u32) -> OwnedPlane {
        let (stride, row) = (PICTURE.width * bytes_per_pixel, self.size.width * bytes_per_pixel);
        let mut padded = vec![0; (stride * PICTURE.height) as usize];
        let rows = padded.chunks_exact_mut(stride as usize);
        for (to, from) in rows.zip(bytes.chunks_exact(row as usize)) {
            to[..row as usize].copy_from_slice(from);
        }
        OwnedPlane {
            bytes: padded,
            width: PICTURE.width,
            height: PICTURE.height,
            stride,
            valid: Rect::full(self.size.width, self.size.height),
            jitter: [0.0; 2],
        }
    }
}

/// The true picture at `time`.
#[must_use]
pub fn truth(probe: &Probe, time: f64) -> Srgb8 {
    let frame = probe.color(time, PICTURE);
    let (pixels, _) = frame.rgba.as_chunks::<4>();
    let rgb = pixels.iter().map(|[red, green, blue, _]| [*red, *green, *blue]).collect();
    Plane::from_vec(frame.size.width, frame.size.height, rgb)
}

#[cfg(test)]
mod tests {
    use foreframe_fixtures::probes;

    use super::*;

    #[test]
    fn jitter_moves_the_samples_of_the_fields_and_not_the_picture() {
        let probe = probes::mixed();
        let plain = KeyRecipe::new(3.0, 2.0).shoot(&probe);
        let jittered = KeyRecipe { jitter: [3, -2], ..KeyRecipe::new(3.0, 2.0) }.shoot(&probe);
        assert_eq!(plain.color, jittered.color);
        assert_ne!(plain.depth, jittered.depth);
        assert_eq!(jittered.jitter, [3.0 / 7.0, -2.0 / 7.0]);
        // The centre of the finer grid is the centre of the pixel.
        let fine = Size::new(PICTURE.width * 7, PICTURE.height * 7);
        let fields = probe.fields(3.0, 2.0, PICTURE, fine);
        let centre = (40 * 7 + 3) * fine.width as usize + 60 * 7 + 3;
        let at = 40 * PICTURE.width as usize + 60;
        assert!((fields.depth[centre] - plain.depth[at]).abs() < 1e-3);
        let undeclared =
            KeyRecipe { jitter: [3, -2], declares_jitter: false, ..KeyRecipe::new(3.0, 2.0) };
        assert_eq!(undeclared.shoot(&probe).jitter, [0.0; 2]);
    }

    #[test]
    fn a_key_of_lower_resolution_fills_the_corner_of_planes_of_full_size() {
        let shot = KeyRecipe { scale: 0.5, ..KeyRecipe::new(3.0, 2.0) }.shoot(&probes::mixed());
        let frame = shot.to_frame(1);
        assert_eq!(frame.color.valid, Rect::full(96, 54));
        assert_eq!((frame.color.width, frame.color.bytes.len()), (192, 192 * 108 * 4));
        let row = 192 * 4;
        assert_eq!(frame.color.bytes[row..row + 96 * 4], shot.color[96 * 4..2 * 96 * 4]);
        assert!(frame.color.bytes[row + 96 * 4..2 * row].iter().all(|&byte| byte == 0));
    }
}
