//! Keys of a scene in memory, as a client's slot holds them.

use foreframe_engine::key::Camera;
use foreframe_engine::{MonoTime, Rect, StreamFormat};
use foreframe_fixtures::client::{CLIENT_MOTION, stream_options};
use foreframe_fixtures::{Recipe, RenderedKey, Renderer, SceneInfo, Size};
use foreframed::ingest;

use crate::recording::{Frame, OwnedPlane};

/// Keys of a sequence at most, and at least; between them as many as fit into [`BUDGET`].
const MOST_KEYS: usize = 16;
const LEAST_KEYS: usize = 8;
/// Bytes of the planes of a sequence.
const BUDGET: usize = 256 << 20;
/// Time from key to key: 40 Hz.
pub(super) const KEY_INTERVAL_S: f64 = 0.025;

/// Some keys of one scene.
#[derive(Debug)]
pub(super) struct RenderedKeys {
    /// What the stream declares.
    pub(super) format: StreamFormat,
    /// The keys in a row, their times still to be filled in. The first is a cut: the sequence is
    /// shown over and over, and its end does not lead to its beginning.
    pub(super) keys: Vec<Frame>,
}

/// Planes, in bytes, that a key and an in-between frame have to read or write at least once.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct MovedBytes {
    /// Planes of a key as they arrive.
    pub planes: usize,
    /// Colour of a frame.
    pub color: usize,
    /// Depth key and velocity of every cell of the field grid.
    pub field: usize,
}

impl MovedBytes {
    /// Read and written by taking in a key: its planes become colour and field.
    pub(super) fn key(&self) -> usize {
        self.planes + self.color + self.field
    }

    /// Read and written by making a frame: colour and field are read, colour is written.
    pub(super) fn frame(&self) -> usize {
        2 * self.color + self.field
    }
}

impl RenderedKeys {
    /// Renders them.
    pub(super) fn render(info: &SceneInfo, size: Size, field_ratio: f64) -> Self {
        let renderer = Renderer::new((info.build)());
        let recipe =
            Recipe { depth_ratio: field_ratio, motion_ratio: field_ratio, ..Recipe::new(size) };
        let message = stream_options(&recipe, CLIENT_MOTION).to_message(1);
        let pixels = size.width as usize * size.height as usize;
        let cells = (pixels as f64 / (field_ratio * field_ratio)) as usize;
        let key_bytes = 4 * pixels + 8 * cells;
        let count = (BUDGET / key_bytes).clamp(LEAST_KEYS, MOST_KEYS) as u32;
        let keys = (1..=count).map(|index| {
            let time = f64::from(index) * KEY_INTERVAL_S;
            let key = RenderedKey::render(&renderer, &recipe, time, time - KEY_INTERVAL_S);
            let (depth, motion) = (key.depth_bytes(), key.motion_bytes(CLIENT_MOTION));
            Frame {
                index: u64::from(index),
                content_time: MonoTime::from_ns(0),
                motion_from: None,
                is_cut: index == 1,
                color: plane(key.color.rgba, size, 4),
                depth: Some(plane(depth, key.depth_size, 4)),
                motion: Some(plane(motion, key.motion_size, CLIENT_MOTION.bytes_per_pixel())),
                mask: None,
                ui: None,
                camera: Some(camera(&key.camera)),
                motion_from_camera: Some(camera(&key.motion_from_camera)),
            }
        });
        Self { format: ingest::stream_format(&message.format), keys: keys.collect() }
    }

    /// What one key, and one frame after it, have to move.
    pub(super) fn bytes(&self) -> MovedBytes {
        let Frame { color, depth, motion, .. } = &self.keys[0];
        let fields = [depth, motion].map(|plane| plane.as_ref().map_or(0, |p| p.bytes.len()));
        let cells = depth.as_ref().map_or(0, |plane| plane.width as usize * plane.height as usize);
        MovedBytes {
            planes: color.bytes.len() + fields[0] + fields[1],
            color: color.bytes.len(),
            field: 8 * cells,
        }
    }
}

fn plane(bytes: Vec<u8>, size: Size, bytes_per_pixel: u32) -> OwnedPlane {
    OwnedPlane {
        bytes,
        width: size.width,
        height: size.height,
        stride: size.width * bytes_per_pixel,
        valid: Rect::full(size.width, size.height),
        jitter: [0.0; 2],
    }
}

fn camera(camera: &foreframe_fixtures::scene::Camera) -> Camera {
    Camera { view: camera.view, projection: camera.projection }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_those_of_the_planes_that_are_read_and_written() {
        let info = SceneInfo::by_name("static").unwrap();
        let rendered = RenderedKeys::render(info, Size::new(64, 32), 2.0);
        let (pixels, cells) = (64 * 32, 32 * 16);
        // Colour of 4 bytes, depth of 4, motion of 4; in the engine 4 of depth, 4 of velocity.
        let bytes = rendered.bytes();
        let expected =
            MovedBytes { planes: 4 * pixels + 8 * cells, color: 4 * pixels, field: 8 * cells };
        assert_eq!(bytes, expected);
        assert_eq!(bytes.key(), 8 * pixels + 16 * cells);
        assert_eq!(bytes.frame(), 8 * pixels + 8 * cells);
    }

    #[test]
    fn motion_is_what_the_stream_declares() {
        let info = SceneInfo::by_name("pan").unwrap();
        let size = Size::new(64, 32);
        let rendered = RenderedKeys::render(info, size, 2.0);
        let declared = rendered.format.motion.unwrap().format.bytes_per_pixel();
        let motion = rendered.keys[0].motion.as_ref().unwrap();
        assert_eq!(motion.stride, motion.width * declared);
        assert_eq!(motion.bytes.len(), (motion.stride * motion.height) as usize);
    }
}
