//! Keys of a scene as an engine takes them in, without a client between.

use foreframe_engine::key::Camera;
use foreframe_engine::{KeyInput, MonoSpan, MonoTime, PlaneInput, Rect, StreamFormat};
use foreframe_fixtures::client::{CLIENT_MOTION, stream_options};
use foreframe_fixtures::{Recipe, RenderedKey, Renderer, SceneInfo, Size};
use foreframed::ingest;

/// Time from key to key.
pub(crate) const INTERVAL: MonoSpan = MonoSpan::from_ms(25);

/// The keys of a scene, and what their stream declares.
pub(crate) struct Rendered {
    pub(crate) format: StreamFormat,
    pub(crate) keys: Vec<RenderedKey>,
    size: Size,
}

impl Rendered {
    /// `count` keys of `scene`, with depth and motion that many times smaller than colour.
    pub(crate) fn new(
        scene: &SceneInfo,
        size: Size,
        [depth_ratio, motion_ratio]: [f64; 2],
        count: u32,
    ) -> Self {
        let renderer = Renderer::new((scene.build)());
        let recipe = Recipe { depth_ratio, motion_ratio, ..Recipe::new(size) };
        let message = stream_options(&recipe, CLIENT_MOTION).to_message(1);
        let interval = INTERVAL.as_secs_f64();
        let keys = (1..=count).map(|index| {
            let time = f64::from(index) * interval;
            RenderedKey::render(&renderer, &recipe, time, time - interval)
        });
        Self { format: ingest::stream_format(&message.format), keys: keys.collect(), size }
    }

    /// Lends key `index`, as of `content_time`, in the form that an engine takes.
    pub(crate) fn with_input(
        &self,
        index: usize,
        content_time: MonoTime,
        take: impl FnOnce(&KeyInput<'_>),
    ) {
        let key = &self.keys[index];
        let (depth, motion) = (key.depth_bytes(), key.motion_bytes(CLIENT_MOTION));
        let plane = |bytes, size: Size| {
            let pixels = size.width as usize * size.height as usize;
            let bytes: &[u8] = bytes;
            PlaneInput {
                pixels: bytes.into(),
                width: size.width,
                height: size.height,
                stride: (bytes.len() / pixels * size.width as usize) as u32,
                valid: Rect::full(size.width, size.height),
                jitter: [0.0; 2],
            }
        };
        let camera = |camera: &foreframe_fixtures::scene::Camera| Camera {
            view: camera.view,
            projection: camera.projection,
        };
        let input = KeyInput {
            index: content_time.as_ns(),
            content_time,
            motion_from: Some(content_time - INTERVAL),
            is_cut: false,
            color: plane(&key.color.rgba, self.size),
            depth: Some(plane(&depth, key.depth_size)),
            motion: Some(plane(&motion, key.motion_size)),
            mask: None,
            camera: Some(camera(&key.camera)),
            motion_from_camera: Some(camera(&key.motion_from_camera)),
        };
        take(&input);
    }
}
