//! What the compositor says, on a thread of its own.
//!
//! It reads with a time limit, so that it can be ended, and holds the right to read no longer than
//! that: winit reads from the same socket. Presentation times become our clock's here.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use foreframe_engine::{MonoSpan, MonoTime};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use tracing::{debug, warn};
use wayland_client::globals::GlobalListContents;
use wayland_client::protocol::wl_buffer::{self, WlBuffer};
use wayland_client::protocol::wl_callback::{self, WlCallback};
use wayland_client::protocol::wl_compositor::WlCompositor;
use wayland_client::protocol::wl_region::WlRegion;
use wayland_client::protocol::wl_registry::{self, WlRegistry};
use wayland_client::protocol::wl_shm::{self, WlShm};
use wayland_client::protocol::wl_shm_pool::WlShmPool;
use wayland_client::protocol::wl_subcompositor::WlSubcompositor;
use wayland_client::protocol::wl_subsurface::WlSubsurface;
use wayland_client::protocol::wl_surface::WlSurface;
use wayland_client::{Connection, Dispatch, EventQueue, QueueHandle, WEnum, delegate_noop};
use wayland_protocols::wp::presentation_time::client::wp_presentation::{self, WpPresentation};
use wayland_protocols::wp::presentation_time::client::wp_presentation_feedback::{
    self, WpPresentationFeedback,
};
use wayland_protocols::wp::viewporter::client::wp_viewport::WpViewport;
use wayland_protocols::wp::viewporter::client::wp_viewporter::WpViewporter;

use super::answers::{Answers, Change};
use crate::clock;
use crate::sink::window::shared::Shared;
use crate::sink::window::{Closed, Feedback, WindowEvent};
use crate::stream::core::Told;

/// How often it looks whether it is to end.
const STOP_POLL: Timespec = Timespec { tv_sec: 0, tv_nsec: 20_000_000 };
/// A refresh interval this much off the one before is another mode; compositors round.
const MODE_PERCENT: i64 = 2;
/// So many answers in a row have to name another refresh interval to make a mode.
const ANSWERS_TO_SWITCH: u32 = 4;
/// A frame was shown within this time of hearing of it, or the compositor's clock is not what it
/// says.
const PLAUSIBLE: MonoSpan = MonoSpan::from_ms(1_000);

/// Open when the compositor wants another frame: then a driver that waits for that does not wait.
#[derive(Clone, Debug)]
pub(in crate::sink::window) struct Gate(Arc<AtomicBool>);

impl Gate {
    pub(in crate::sink::window) fn open() -> Self {
        Self(Arc::new(AtomicBool::new(true)))
    }

    pub(in crate::sink::window) fn is_open(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// For a driver that has nothing to wait for.
    pub(in crate::sink::window) fn reopen(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    pub(super) fn shut(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// The thread's own state, and what it shares with the stream's.
pub(super) struct Listener {
    shared: Arc<Shared>,
    answers: Arc<Mutex<Answers>>,
    /// The kernel's number of the clock of presentation times.
    clock: u32,
    pub(super) knows_rgbx: bool,
    /// The newest frame whose callback has come in this batch, and when.
    drawn: Option<(MonoTime, MonoTime)>,
    refresh_interval: Option<MonoSpan>,
    /// Another interval, and how many answers in a row named it.
    candidate: (MonoSpan, u32),
    has_warned: bool,
}

impl Listener {
    pub(super) fn new(shared: Arc<Shared>, answers: Arc<Mutex<Answers>>) -> Self {
        Self {
            shared,
            answers,
            clock: 1,
            knows_rgbx: false,
            drawn: None,
            refresh_interval: None,
            candidate: (MonoSpan::ZERO, 0),
            has_warned: false,
        }
    }

    /// Reads until it is told to end or the compositor is gone.
    pub(super) fn listen(mut self, mut queue: EventQueue<Self>, is_ending: &AtomicBool) {
        while !is_ending.load(Ordering::Relaxed) {
            if let Err(error) = self.read_once(&mut queue) {
                warn!(%error, "the window is lost");
                return self.shared.close(Closed::WithDisplay);
            }
        }
    }

    fn read_once(&mut self, queue: &mut EventQueue<Self>) -> io::Result<()> {
        queue.dispatch_pending(self).map_err(io::Error::other)?;
        if let Some((planned, heard_at)) = self.drawn.take() {
            self.tell(Told::Presented { planned, presented_at: heard_at, heard_at });
        }
        // What cannot be sent now is sent with the next frame, or fails to be read below.
        drop(queue.flush());
        let Some(guard) = queue.prepare_read() else { return Ok(()) };
        let mut ready = [PollFd::from_borrowed_fd(guard.connection_fd(), PollFlags::IN)];
        match poll(&mut ready, Some(&STOP_POLL)) {
            Ok(0) | Err(Errno::INTR) => return Ok(()),
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        match guard.read() {
            Ok(_) => Ok(()),
            // Another thread was faster.
            Err(wayland_client::backend::WaylandError::Io(error))
                if error.kind() == io::ErrorKind::WouldBlock =>
            {
                Ok(())
            }
            Err(error) => Err(io::Error::other(error)),
        }
    }

    fn tell(&self, told: Told) {
        self.shared.tell(WindowEvent::Told(told));
    }

    fn answer(&self, on: impl FnOnce(&mut Answers) -> Option<Change>) -> Feedback {
        let mut answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        let change = on(&mut answers);
        let mode = answers.mode();
        drop(answers);
        change.into_iter().for_each(|change| self.shared.tell(change.into()));
        mode
    }

    fn on_interval(&mut self, interval: MonoSpan) {
        let is_like = |a: MonoSpan, b: MonoSpan| {
            let allowed = a.scale(MODE_PERCENT, 100);
            a - b <= allowed && b - a <= allowed
        };
        if self.refresh_interval.is_some_and(|known| is_like(interval, known)) {
            self.candidate.1 = 0;
            return;
        }
        let named = if is_like(interval, self.candidate.0) { self.candidate.1 + 1 } else { 1 };
        self.candidate = (interval, named);
        if named >= ANSWERS_TO_SWITCH {
            if self.refresh_interval.replace(interval).is_some() {
                self.tell(Told::Mode(interval));
            }
            self.candidate.1 = 0;
        }
    }

    /// By our clock; the time of hearing where the compositor's makes no sense.
    fn presented_at(&mut self, time_ns: u64, heard_at: MonoTime) -> MonoTime {
        let told = clock::from_other_clock(self.clock, time_ns);
        let is_plausible = |at: &MonoTime| {
            let ago = heard_at - *at;
            ago < PLAUSIBLE && ago > MonoSpan::ZERO - PLAUSIBLE
        };
        told.filter(is_plausible).unwrap_or_else(|| {
            if !self.has_warned {
                warn!(clock = self.clock, "presentation times make no sense; taken as heard");
                self.has_warned = true;
            }
            heard_at
        })
    }
}

impl From<Change> for WindowEvent {
    fn from(change: Change) -> Self {
        match change {
            Change::Feedback(feedback) => Self::Feedback(feedback),
            Change::Visible(is_visible) => Self::Told(Told::Visible(is_visible)),
        }
    }
}

impl Dispatch<WpPresentationFeedback, MonoTime> for Listener {
    fn event(
        state: &mut Self,
        _: &WpPresentationFeedback,
        event: wp_presentation_feedback::Event,
        &planned: &MonoTime,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        let heard_at = clock::now();
        match event {
            wp_presentation_feedback::Event::Presented {
                tv_sec_hi,
                tv_sec_lo,
                tv_nsec,
                refresh,
                ..
            } => {
                let seconds = u64::from(tv_sec_hi) << 32 | u64::from(tv_sec_lo);
                let time_ns = seconds.saturating_mul(1_000_000_000).saturating_add(tv_nsec.into());
                let presented_at = state.presented_at(time_ns, heard_at);
                if refresh > 0 {
                    state.on_interval(MonoSpan::from_ns(refresh.into()));
                }
                state.answer(Answers::on_presented);
                state.tell(Told::Presented { planned, presented_at, heard_at });
            }
            wp_presentation_feedback::Event::Discarded => {
                let mode = state.answer(|answers| {
                    answers.on_discarded();
                    None
                });
                // Where callbacks tell of frames, feedback is only tried.
                if mode == Feedback::Presentation {
                    state.tell(Told::Discarded { planned });
                }
            }
            _ => {}
        }
    }
}

impl Dispatch<WlCallback, MonoTime> for Listener {
    fn event(
        state: &mut Self,
        _: &WlCallback,
        event: wl_callback::Event,
        &planned: &MonoTime,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        let wl_callback::Event::Done { .. } = event else { return };
        let mode = state.answer(Answers::on_callback);
        if mode != Feedback::FrameCallbacks {
            return;
        }
        // Frames that were replaced before they were drawn are told of together with the one that
        // was.
        if let Some((replaced, _)) = state.drawn.replace((planned, clock::now())) {
            state.tell(Told::Discarded { planned: replaced });
        }
    }
}

impl Dispatch<WlCallback, Gate> for Listener {
    fn event(
        _: &mut Self,
        _: &WlCallback,
        event: wl_callback::Event,
        Gate(is_open): &Gate,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wl_callback::Event::Done { .. } = event {
            is_open.store(true, Ordering::Relaxed);
        }
    }
}

impl Dispatch<WlBuffer, Arc<AtomicBool>> for Listener {
    fn event(
        _: &mut Self,
        _: &WlBuffer,
        event: wl_buffer::Event,
        is_busy: &Arc<AtomicBool>,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wl_buffer::Event::Release = event {
            is_busy.store(false, Ordering::Release); // SYNC buffer-released
        }
    }
}

impl Dispatch<WpPresentation, ()> for Listener {
    fn event(
        state: &mut Self,
        _: &WpPresentation,
        event: wp_presentation::Event,
        (): &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wp_presentation::Event::ClockId { clk_id } = event {
            debug!(clock = clk_id, "presentation times");
            state.clock = clk_id;
        }
    }
}

impl Dispatch<WlShm, ()> for Listener {
    fn event(
        state: &mut Self,
        _: &WlShm,
        event: wl_shm::Event,
        (): &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wl_shm::Event::Format { format: WEnum::Value(wl_shm::Format::Xbgr8888) } = event {
            state.knows_rgbx = true;
        }
    }
}

impl Dispatch<WlRegistry, GlobalListContents> for Listener {
    fn event(
        _: &mut Self,
        _: &WlRegistry,
        _: wl_registry::Event,
        _: &GlobalListContents,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        // Globals that come later are of no use to a surface that is there already.
    }
}

delegate_noop!(Listener: ignore WlShmPool);
delegate_noop!(Listener: ignore WlCompositor);
delegate_noop!(Listener: ignore WlRegion);
delegate_noop!(Listener: ignore WlSubcompositor);
delegate_noop!(Listener: ignore WlSubsurface);
delegate_noop!(Listener: ignore WlSurface);
delegate_noop!(Listener: ignore WpViewporter);
delegate_noop!(Listener: ignore WpViewport);
