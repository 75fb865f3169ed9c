//! What the application says about one key frame, beside its pixels.

use foreframe_protocol::Camera;

/// Number, times and cameras of a key frame. Times are `CLOCK_MONOTONIC` nanoseconds.
#[derive(Clone, Copy, PartialEq, Debug)]
#[must_use]
pub struct Key {
    /// Sequence number; increases from key frame to key frame, by more than 1 where one was left
    /// out.
    pub index: u64,
    /// Simulation time that the picture shows; increases too.
    pub content_time_ns: u64,
    /// Content time that the motion plane points back to, whether or not that frame was
    /// submitted. None where the key frame has no motion that can be used.
    pub motion_from_ns: Option<u64>,
    /// Nothing before this key frame relates to it: a camera cut, a loaded level.
    pub is_cut: bool,
    /// Camera at `content_time_ns`.
    pub camera: Option<Camera>,
    /// Camera at `motion_from_ns`; needed where motion vectors lack the camera's motion.
    pub motion_from_camera: Option<Camera>,
}

impl Key {
    /// A key frame with neither motion nor camera.
    pub fn new(index: u64, content_time_ns: u64) -> Self {
        Self {
            index,
            content_time_ns,
            motion_from_ns: None,
            is_cut: false,
            camera: None,
            motion_from_camera: None,
        }
    }

    /// States the content time that the motion plane points back to.
    pub fn motion_from(mut self, motion_from_ns: u64) -> Self {
        self.motion_from_ns = Some(motion_from_ns);
        self
    }

    /// States that nothing before this key frame relates to it.
    pub fn cut(mut self) -> Self {
        self.is_cut = true;
        self
    }

    /// States the camera of this key frame.
    pub fn camera(mut self, camera: Camera) -> Self {
        self.camera = Some(camera);
        self
    }

    /// States the camera that the motion plane points back to.
    pub fn motion_from_camera(mut self, camera: Camera) -> Self {
        self.motion_from_camera = Some(camera);
        self
    }
}
