//! Pictures through a wgpu surface, on the GPU adapter and the device that make them.
//!
//! - [`policy`]: which present mode, which format
//! - [`pass`]: the pass that draws a picture on a surface, with its shader
//! - [`patience`]: how long something may fail before more is done about it
//! - [`again`]: when a surface that was lost is made again
//! - [`output`]: one surface, and what it takes to present on it
//!
//! A driver may wait for the display in the middle of any call, so a surface has a thread of its
//! own, and the stream leaves its pictures on an [`Easel`]. Nothing that a driver does ends a
//! stream: where there is no surface, or none at the moment, the window is drawn by the CPU, and why
//! is said.

mod again;
mod output;
mod pass;
mod patience;
mod policy;

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use foreframe_engine::backend::gpu::{Gpu, GpuError, GpuPicture};
use foreframe_engine::{ColorPlane, MonoSpan, MonoTime, StreamFormat};
use tracing::warn;
use winit::event_loop::OwnedDisplayHandle;

use super::WindowEvent;
use super::easel::Easel;
use super::pane::Pane;
use super::shared::Shared;
use super::wayland::Face;
use crate::stream::core::Told;
use crate::stream::real_time;
pub(super) use again::Losses;
use output::Output;
use pass::Picture;

/// Time that driver and display have to make a surface.
const READY_WITHIN: MonoSpan = MonoSpan::from_ms(5_000);
/// Time that the thread has to end before it is left behind: drivers wait a second for a frame.
const END_WITHIN: Duration = Duration::from_secs(2);

/// Where surfaces are made.
#[derive(Clone, Debug)]
pub(super) enum Canvas {
    Wayland(Arc<Mutex<Face>>),
    Other { window: Pane, display: OwnedDisplayHandle },
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
    #[error("expected pictures of the device that draws the window, found those of another")]
    OtherDevice,
    /// It does not come back as it was.
    #[error("expected an image of the surface, found that it was lost")]
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
    /// The driver, or the display behind it, does not answer. The first time nobody else may draw there; one
    /// that is made again leaves the window to the CPU.
    #[error("no surface within 5 s")]
    NoAnswer,
}

/// A picture that was left: on the easel, or on the GPU.
#[derive(Debug)]
struct Left {
    planned: MonoTime,
    kept: Option<GpuPicture>,
}

/// A surface that is being made, on a thread of its own.
#[derive(Debug)]
pub(super) struct Coming {
    told: Receiver<Result<String, SurfaceError>>,
    ready_by: MonoTime,
    /// Taken when it is made.
    link: Option<Link>,
}

/// A surface that a GPU draws on.
#[derive(Debug)]
pub(super) struct GpuSurface {
    link: Link,
    /// Mode and format, for people.
    pub(super) name: String,
}

/// What the stream has of the surface's thread.
#[derive(Debug)]
struct Link {
    easel: Arc<Easel<Left>>,
    failed: Arc<Mutex<Option<SurfaceError>>>,
    /// Disconnected when the thread has ended.
    ended: Receiver<()>,
    shared: Arc<Shared>,
}

impl Coming {
    /// Begins to make a surface on `canvas`.
    ///
    /// # Errors
    /// If there is no thread for it.
    pub(super) fn begin(
        gpu: &Arc<Gpu>,
        canvas: Canvas,
        format: &StreamFormat,
        shared: &Arc<Shared>,
        now: MonoTime,
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
        let link = Link { easel, failed, ended, shared: Arc::clone(shared) };
        Ok(Self { told, ready_by: now + READY_WITHIN, link: Some(link) })
    }

    /// Waits for it as long as driver and display have.
    ///
    /// # Errors
    /// If there is none to be had.
    pub(super) fn wait(mut self) -> Result<GpuSurface, SurfaceError> {
        let told =
            self.told.recv_timeout(Duration::from_nanos(READY_WITHIN.as_ns().unsigned_abs()));
        match told {
            Ok(made) => self.take(made),
            Err(RecvTimeoutError::Timeout) => Err(SurfaceError::NoAnswer),
            Err(RecvTimeoutError::Disconnected) => Err(SurfaceError::Panicked),
        }
    }

    /// The surface, or why there is none; None while that is open at `now`.
    pub(super) fn poll(&mut self, now: MonoTime) -> Option<Result<GpuSurface, SurfaceError>> {
        match self.told.try_recv() {
            Ok(made) => Some(self.take(made)),
            Err(TryRecvError::Empty) if now < self.ready_by => None,
            Err(TryRecvError::Empty) => Some(Err(SurfaceError::NoAnswer)),
            Err(TryRecvError::Disconnected) => Some(Err(SurfaceError::Panicked)),
        }
    }

    fn take(&mut self, made: Result<String, SurfaceError>) -> Result<GpuSurface, SurfaceError> {
        let (name, link) = (made?, self.link.take());
        link.map(|link| GpuSurface { link, name }).ok_or(SurfaceError::Panicked)
    }
}

impl Drop for Coming {
    fn drop(&mut self) {
        // Nobody wants it any more: its thread ends when it is there.
        if let Some(link) = &self.link {
            link.easel.close();
        }
    }
}

impl GpuSurface {
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
        self.on_replaced(self.link.easel.leave(Left { planned, kept: None }, frame));
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
        self.on_replaced(self.link.easel.leave_known(Left { planned, kept: Some(picture) }));
        Ok(())
    }

    /// Whether the surface works.
    fn look(&self) -> Result<(), SurfaceError> {
        self.link.failed.lock().unwrap_or_else(PoisonError::into_inner).clone().map_or(Ok(()), Err)
    }

    /// Fails from now on, as if it had been lost.
    pub(super) fn lose(&self) {
        *self.link.failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(SurfaceError::Lost);
    }

    fn on_replaced(&self, replaced: Option<Left>) {
        if let Some(Left { planned, .. }) = replaced {
            self.link.shared.tell(WindowEvent::Told(Told::Discarded { planned }));
        }
    }
}

impl Drop for GpuSurface {
    fn drop(&mut self) {
        self.link.easel.close();
        if self.link.ended.recv_timeout(END_WITHIN) == Err(RecvTimeoutError::Timeout) {
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
        real_time::ask_for_work();
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
