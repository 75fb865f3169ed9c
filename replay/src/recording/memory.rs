//! A recording in memory, for tests: a textured patch that moves over a flat wall.
//!
//! Everything about it is known exactly: whole pixels of motion, so that moving the patch along its
//! motion gives the truth to the bit, and a wall without texture, so that any fill of what the
//! patch uncovers gives the truth too.

use foreframe_engine::format::{
    CameraMotion, DepthConvention, DepthFormat, DepthMeaning, MotionConvention, MotionDirection,
    MotionFormat, MotionUnit,
};
use foreframe_engine::{MonoSpan, MonoTime, Rect, StreamFormat};

use super::{Frame, FrameHead, OwnedPlane, Recording, Wanted};

pub(crate) const WIDTH: u32 = 96;
pub(crate) const HEIGHT: u32 = 48;
const WALL: [u8; 4] = [90, 110, 70, 255];

/// Frames and how often each was read, with what.
#[derive(Clone, Debug)]
pub(crate) struct MemoryRecording {
    format: StreamFormat,
    pub(crate) heads: Vec<FrameHead>,
    pub(crate) frames: Vec<StoredFrame>,
    pub(crate) reads: Vec<(usize, Wanted)>,
}

/// All planes of a frame.
#[derive(Clone, Debug)]
pub(crate) struct StoredFrame {
    pub(crate) color: OwnedPlane,
    pub(crate) depth: Option<OwnedPlane>,
    pub(crate) motions: Vec<OwnedPlane>,
}

/// Content time of a frame: 120 Hz from 1 s.
pub(crate) fn time(frame: i64) -> MonoTime {
    MonoTime::from_ns(1_000_000_000) + MonoSpan::from_hz(120.0).scale(frame, 1)
}

fn plane(pixel_bytes: u32, pixel: impl Fn(i64, i64) -> Vec<u8>) -> OwnedPlane {
    let positions = (0..i64::from(HEIGHT)).flat_map(|y| (0..i64::from(WIDTH)).map(move |x| (x, y)));
    OwnedPlane {
        bytes: positions.flat_map(|(x, y)| pixel(x, y)).collect(),
        width: WIDTH,
        height: HEIGHT,
        stride: WIDTH * pixel_bytes,
        valid: Rect::full(WIDTH, HEIGHT),
        jitter: [0.0; 2],
    }
}

impl MemoryRecording {
    /// `count` frames of a patch that moves by `step` pixels a frame, with motion planes that
    /// point back by `spans` frames each.
    pub(crate) fn moving_patch(count: i64, step: [i64; 2], spans: &[i64]) -> Self {
        let frame = |frame: i64| {
            let [left, top] = [20 + step[0] * frame, 14 + step[1] * frame];
            let in_patch = move |x: i64, y: i64| {
                (left..left + 24).contains(&x) && (top..top + 18).contains(&y)
            };
            StoredFrame {
                color: plane(4, |x, y| {
                    if in_patch(x, y) { texture(x - left, y - top) } else { WALL }.to_vec()
                }),
                depth: Some(plane(4, |x, y| {
                    let distance: f32 = if in_patch(x, y) { 2.0 } else { 10.0 };
                    distance.to_le_bytes().to_vec()
                })),
                motions: spans
                    .iter()
                    .map(|span| {
                        plane(8, |x, y| {
                            let is_moving = i64::from(in_patch(x, y));
                            step.map(|s| (s * span * is_moving) as f32)
                                .into_iter()
                                .flat_map(f32::to_le_bytes)
                                .collect()
                        })
                    })
                    .collect(),
            }
        };
        let head = |frame: i64| FrameHead {
            content_time: time(frame),
            arrived_at: time(frame) + MonoSpan::from_ms(20),
            is_cut: false,
            motions: spans.iter().map(|span| time(frame - span)).collect(),
        };
        Self {
            format: StreamFormat {
                depth: Some(DepthConvention {
                    format: DepthFormat::F32,
                    meaning: DepthMeaning::LinearView,
                }),
                motion: Some(MotionConvention {
                    format: MotionFormat::Rg32f,
                    direction: MotionDirection::PreviousToCurrent,
                    unit: MotionUnit::Pixels,
                    scale: [1.0; 2],
                    camera_motion: CameraMotion::Included,
                }),
                ..StreamFormat::rgba8(WIDTH, HEIGHT)
            },
            heads: (0..count).map(head).collect(),
            frames: (0..count).map(frame).collect(),
            reads: Vec::new(),
        }
    }

    /// Declares the motion planes otherwise.
    pub(crate) fn declare_motion(&mut self, declare: impl Fn(&mut MotionConvention)) {
        self.format.motion.iter_mut().for_each(declare);
    }

    /// Overwrites every plane of a frame with noise.
    pub(crate) fn poison(&mut self, frame: usize) {
        let stored = &mut self.frames[frame];
        let planes = [&mut stored.color].into_iter().chain(&mut stored.depth);
        for plane in planes.chain(&mut stored.motions) {
            for (i, byte) in plane.bytes.iter_mut().enumerate() {
                *byte = (i as u32).wrapping_mul(2_654_435_761).to_le_bytes()[3];
            }
        }
    }
}

fn texture(x: i64, y: i64) -> [u8; 4] {
    let hash = ((x * 73 + y * 151) as u32).wrapping_mul(2_654_435_761).to_le_bytes();
    [hash[3], hash[2], hash[3] ^ 0x3c, 255]
}

impl Recording for MemoryRecording {
    fn format(&self) -> &StreamFormat {
        &self.format
    }

    fn heads(&self) -> &[FrameHead] {
        &self.heads
    }

    fn read(&mut self, frame: usize, wanted: Wanted) -> anyhow::Result<Frame> {
        self.reads.push((frame, wanted));
        let (head, stored) = (&self.heads[frame], &self.frames[frame]);
        let (depth, motion) = match wanted {
            Wanted::Color => (None, None),
            Wanted::Key { motion } => (stored.depth.clone(), motion),
        };
        Ok(Frame {
            index: frame as u64,
            content_time: head.content_time,
            motion_from: motion.map(|plane| head.motions[plane]),
            is_cut: head.is_cut,
            color: stored.color.clone(),
            depth,
            motion: motion.map(|plane| stored.motions[plane].clone()),
            mask: None,
            ui: None,
            camera: None,
            motion_from_camera: None,
        })
    }
}
