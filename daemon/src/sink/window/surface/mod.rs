//! Pictures through a wgpu surface, on the GPU adapter and the device that make them.
//!
//! - [`policy`]: which present mode, which format
//! - [`pass`]: the pass that draws a picture on a surface, with its shader
//! - [`patience`]: how long something may fail before more is done about it
//! - [`output`]: one surface, and what it takes to present on it
//!
//! A driver may wait for the display in the middle of any call, so a surface has a thread of its
//! own, and the stream leaves its pictures on an [`Easel`]. Nothing that a driver does ends a
//! stream: where there is no surface, or none any more, the window is drawn by the CPU, and why is
//! said.

mod output;
mod pass;
mod patience;
mod policy;

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use foreframe_engine::backend::gpu::{Gpu, GpuError, GpuPicture};
use foreframe_engine::{ColorPlane, MonoTime, StreamFormat};
use tracing::warn;
use winit::event_loop::OwnedDisplayHandle;
use winit::window::Window as DesktopWindow;

use super::WindowEvent;
use super::easel::Easel;
use super::shared::Shared;
use super::wayland::Face;
use crate::stream::core::Told;
use crate::stream::thread::ask_for_real_time_work;
use output::Output;
use pass::Picture;

/// Time that driver and display have to make a surface.
const READY_WITHIN: Duration = Duration::from_secs(5);
/// Time that the thread has to end before it is left behind: drivers wait a second for a frame.
const END_WITHIN: Duration = Duration::from_secs(2);

/// Where surfaces are made.
#[derive(Clone, Debug)]
pub(super) enum Canvas {
    Wayland(Arc<Mutex<Face>>),
    Other { window: Arc<DesktopWindow>, display: OwnedDisplayHandle },
}

/// Why there is no surface, or none any more.
#[derive(Clone, Debug, thiserror::Error)]
pub(super) enum SurfaceError {
    /// There is no device to draw on it.
    #[error("the CPU makes the pictures")]
    NoGpu,
    /// The adapter has no way to this display.
    #[error(
        "expected an adapter that presents to this display, found {0}; choose one that does with --backend gpu:NAME"
    )]
    CannotPresent(String),
    /// All that is offered shows parts of two frames at once.
    #[error("expected mailbox or fifo among the present modes, found {0}")]
    NoMode(String),
    /// No format that a picture can be drawn in.
    #[error("expected a format that this daemon draws in, found {0}")]
    NoFormat(String),
    /// The driver makes none.
    #[error("the driver makes no surface: {0}")]
    Refused(String),
    /// Another device makes the pictures than draws them.
    #[error(
        "expected pictures of the device that draws the window, found those of another; open the stream again"
    )]
    OtherDevice,
    /// It does not come back as it was.
    #[error("expected an image of the surface, found that it was lost; open the stream again")]
    Lost,
    /// The device does not work, or no longer.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The driver, or what is between, is broken.
    #[error("the thread of the surface has panicked")]
    Panicked,
    /// There is no thread for it.
    #[error("no thread for the surface: {0}")]
    NoThread(String),
    /// The driver, or the display behind it, does not answer; nobody else may draw there.
    #[error("no surface within 5 s")]
    NoAnswer,
}

/// A picture that was left: on the easel, or on the GPU.
#[derive(Debug)]
struct Left {
    planned: MonoTime,
    kept: Option<GpuPicture>,
}

/// A surface that a GPU draws on.
#[derive(Debug)]
pub(super) struct GpuSurface {
    easel: Arc<Easel<Left>>,
    failed: Arc<Mutex<Option<SurfaceError>>>,
    /// Disconnected when the thread has ended.
    ended: Receiver<()>,
    shared: Arc<Shared>,
    /// Mode and format, for people.
    pub(super) name: String,
}

impl GpuSurface {
    /// Makes a surface on `canvas`.
    ///
    /// # Errors
    /// If there is none to be had.
    pub(super) fn start(
        gpu: &Arc<Gpu>,
        canvas: Canvas,
        format: &StreamFormat,
        shared: &Arc<Shared>,
    ) -> Result<Self, SurfaceError> {
        let easel = Arc::new(Easel::default());
        let failed = Arc::new(Mutex::new(None));
        let (tell, told) = sync_channel(1);
        let (ends, ended) = sync_channel(1);
        let life = Life {
            easel: Arc::clone(&easel),
            failed: Arc::clone(&failed),
            shared: Arc::clone(shared),
            _ends: ends,
        };
        let (gpu, format) = (Arc::clone(gpu), *format);
        thread::Builder::new()
            .name("foreframe-surface".to_owned())
            .spawn(move || life.live(|shared| Output::new(gpu, canvas, &format, shared), &tell))
            .map_err(|error| SurfaceError::NoThread(error.to_string()))?;
        match told.recv_timeout(READY_WITHIN) {
            Ok(made) => {
                made.map(|name| Self { easel, failed, ended, shared: Arc::clone(shared), name })
            }
            Err(RecvTimeoutError::Timeout) => Err(SurfaceError::NoAnswer),
            Err(RecvTimeoutError::Disconnected) => Err(SurfaceError::Panicked),
        }
    }

    /// Leaves `frame` to be drawn and presented at once.
    ///
    /// # Errors
    /// If the surface is no more; then nothing holds the canvas, and somebody else may draw there.
    pub(super) fn present(
        &self,
        planned: MonoTime,
        frame: &ColorPlane,
    ) -> Result<(), SurfaceError> {
        self.look()?;
        self.on_replaced(self.easel.leave(Left { planned, kept: None }, frame));
        Ok(())
    }

    /// The same for a picture that has stayed on the GPU.
    ///
    /// # Errors
    /// The same.
    pub(super) fn present_kept(
        &self,
        planned: MonoTime,
        picture: GpuPicture,
    ) -> Result<(), SurfaceError> {
        self.look()?;
        self.on_replaced(self.easel.leave_known(Left { planned, kept: Some(picture) }));
        Ok(())
    }

    /// Whether the surface works.
    fn look(&self) -> Result<(), SurfaceError> {
        self.failed.lock().unwrap_or_else(PoisonError::into_inner).clone().map_or(Ok(()), Err)
    }

    fn on_replaced(&self, replaced: Option<Left>) {
        if let Some(Left { planned, .. }) = replaced {
            self.shared.tell(WindowEvent::Told(Told::Discarded { planned }));
        }
    }
}

impl Drop for GpuSurface {
    fn drop(&mut self) {
        self.easel.close();
        if self.ended.recv_timeout(END_WITHIN) == Err(RecvTimeoutError::Timeout) {
            warn!("the driver does not come back, and the surface's thread is left behind");
        }
    }
}

/// What the thread has of its own.
struct Life {
    easel: Arc<Easel<Left>>,
    failed: Arc<Mutex<Option<SurfaceError>>>,
    shared: Arc<Shared>,
    _ends: SyncSender<()>,
}

impl Life {
    fn live(
        self,
        make: impl FnOnce(Arc<Shared>) -> Result<Output, SurfaceError>,
        tell: &SyncSender<Result<String, SurfaceError>>,
    ) {
        ask_for_real_time_work();
        let mut output = match make(Arc::clone(&self.shared)) {
            Ok(output) => output,
            // Whoever asked may have given up.
            Err(error) => return drop(tell.send(Err(error))),
        };
        if tell.send(Ok(output.name())).is_err() {
            return;
        }
        let mut drawn = None;
        while let Some((Left { planned, kept }, frame)) = self.easel.take(drawn.take()) {
            let picture = kept.as_ref().map_or(Picture::Here(&frame), Picture::Kept);
            let shown = output.show(planned, &picture);
            let discarded = WindowEvent::Told(Told::Discarded { planned });
            match shown {
                Ok(true) => {}
                Ok(false) => self.shared.tell(discarded),
                Err(why) => {
                    drop(output);
                    self.fail(why);
                    return self.shared.tell(discarded);
                }
            }
            drawn = Some(frame);
        }
    }

    fn fail(&self, why: SurfaceError) {
        *self.failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(why);
        // For the picture that is on display no longer, whoever draws the next one.
        self.shared.tell(WindowEvent::Told(Told::Moved));
    }
}

impl Drop for Life {
    fn drop(&mut self) {
        if thread::panicking() {
            self.fail(SurfaceError::Panicked);
        }
    }
}
