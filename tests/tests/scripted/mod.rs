//! A compositor of our own that does what it is told: the cases that real ones cannot give.
//!
//! It knows one window, on one output, and shows what was committed at each tick of its display, by
//! saying so. It draws nothing.

#![expect(clippy::unwrap_used, reason = "a fixture that cannot go on fails its test")]

use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::JoinHandle;

use foreframe_engine::MonoSpan;
use foreframed::clock;
use rustix::time::{ClockId, clock_gettime};
use tempfile::TempDir;
use wayland_protocols::wp::presentation_time::server::wp_presentation::{self, WpPresentation};
use wayland_protocols::wp::presentation_time::server::wp_presentation_feedback::{
    self, WpPresentationFeedback,
};
use wayland_protocols::xdg::shell::server::xdg_positioner::XdgPositioner;
use wayland_protocols::xdg::shell::server::xdg_surface::{self, XdgSurface};
use wayland_protocols::xdg::shell::server::xdg_toplevel::XdgToplevel;
use wayland_protocols::xdg::shell::server::xdg_wm_base::{self, XdgWmBase};
use wayland_server::protocol::wl_buffer::WlBuffer;
use wayland_server::protocol::wl_callback::WlCallback;
use wayland_server::protocol::wl_compositor::{self, WlCompositor};
use wayland_server::protocol::wl_output::{self, WlOutput};
use wayland_server::protocol::wl_region::WlRegion;
use wayland_server::protocol::wl_shm::{self, WlShm};
use wayland_server::protocol::wl_shm_pool::{self, WlShmPool};
use wayland_server::protocol::wl_surface::{self, WlSurface};
use wayland_server::{
    Client, DataInit, Dispatch, Display, DisplayHandle, GlobalDispatch, ListeningSocket, New,
    Resource,
};

/// What becomes of requests for feedback.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Feedback {
    Presented,
    Discarded,
    Never,
}

/// What the compositor does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Script {
    pub(crate) feedback: Feedback,
    pub(crate) has_callbacks: bool,
    pub(crate) releases: bool,
    /// Times by `CLOCK_MONOTONIC_RAW`.
    pub(crate) is_raw: bool,
    pub(crate) announced_mhz: i32,
    pub(crate) interval: MonoSpan,
    /// Ends in the middle of everything after so many commits.
    pub(crate) dies_after: Option<u32>,
}

impl Script {
    /// A good one, at 100 Hz.
    pub(crate) const GOOD: Self = Self {
        feedback: Feedback::Presented,
        has_callbacks: true,
        releases: true,
        is_raw: false,
        announced_mhz: 100_000,
        interval: MonoSpan::from_ms(10),
        dies_after: None,
    };
}

/// A running compositor. Ended when dropped.
pub(crate) struct Scripted {
    folder: TempDir,
    is_ending: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Scripted {
    pub(crate) fn start(script: Script) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("wl");
        let is_ending = Arc::new(AtomicBool::new(false));
        let (ready, is_ready) = channel();
        let ended = Arc::clone(&is_ending);
        let thread =
            std::thread::spawn(move || live(script, path, &ended, || ready.send(()).unwrap()));
        is_ready.recv().unwrap();
        Self { folder, is_ending, thread: Some(thread) }
    }

    pub(crate) fn environment(&self) -> Vec<(&'static str, String)> {
        vec![
            ("XDG_RUNTIME_DIR", self.folder.path().display().to_string()),
            ("WAYLAND_DISPLAY", "wl".to_owned()),
            ("DISPLAY", String::new()),
        ]
    }
}

impl Drop for Scripted {
    fn drop(&mut self) {
        self.is_ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the compositor did as it was told");
        }
    }
}

struct State {
    script: Script,
    commits: u32,
    pending: Content,
    /// Committed, for the next tick.
    current: Content,
    /// On the display.
    shown: Option<WlBuffer>,
    window: Option<(XdgSurface, XdgToplevel)>,
    is_configured: bool,
}

#[derive(Default)]
struct Content {
    buffer: Option<WlBuffer>,
    callbacks: Vec<WlCallback>,
    feedbacks: Vec<WpPresentationFeedback>,
}

fn live(script: Script, path: PathBuf, is_ending: &AtomicBool, ready: impl Fn()) {
    let mut display = Display::<State>::new().unwrap();
    let socket = ListeningSocket::bind_absolute(path).unwrap();
    let mut handle = display.handle();
    handle.create_global::<State, WlCompositor, ()>(4, ());
    handle.create_global::<State, WlShm, ()>(1, ());
    handle.create_global::<State, WlOutput, ()>(2, ());
    handle.create_global::<State, XdgWmBase, ()>(1, ());
    handle.create_global::<State, WpPresentation, ()>(1, ());
    let mut state = State {
        script,
        commits: 0,
        pending: Content::default(),
        current: Content::default(),
        shown: None,
        window: None,
        is_configured: false,
    };
    ready();
    let mut tick_at = clock::now();
    while !is_ending.load(Ordering::Relaxed) {
        if let Some(stream) = socket.accept().unwrap() {
            handle.insert_client(stream, Arc::new(())).unwrap();
        }
        display.dispatch_clients(&mut state).unwrap();
        if script.dies_after.is_some_and(|commits| state.commits >= commits) {
            return;
        }
        if clock::now() >= tick_at {
            tick_at += script.interval;
            state.tick();
        }
        display.flush_clients().unwrap();
        clock::sleep_until(tick_at.min(clock::now() + MonoSpan::from_us(500)));
    }
}

impl State {
    fn commit(&mut self) {
        if let Some((surface, toplevel)) = self.window.as_ref().filter(|_| !self.is_configured) {
            toplevel.configure(0, 0, Vec::new());
            surface.configure(1);
            self.is_configured = true;
        }
        let Some(buffer) = self.pending.buffer.take() else { return };
        self.commits += 1;
        let feedbacks = std::mem::take(&mut self.pending.feedbacks);
        let superseded = std::mem::replace(&mut self.current.feedbacks, feedbacks);
        if self.script.feedback != Feedback::Never {
            superseded.iter().for_each(WpPresentationFeedback::discarded);
        }
        self.current.callbacks.append(&mut self.pending.callbacks);
        if let Some(replaced) = self.current.buffer.replace(buffer)
            && self.script.releases
        {
            replaced.release();
        }
    }

    fn tick(&mut self) {
        let Some(buffer) = self.current.buffer.take() else { return };
        let id = if self.script.is_raw { ClockId::MonotonicRaw } else { ClockId::Monotonic };
        let now = clock_gettime(id);
        let refresh = 1_000_000_000_000 / i64::from(self.script.announced_mhz);
        for feedback in self.current.feedbacks.drain(..) {
            match self.script.feedback {
                Feedback::Presented => feedback.presented(
                    0,
                    now.tv_sec as u32,
                    now.tv_nsec as u32,
                    refresh as u32,
                    0,
                    0,
                    wp_presentation_feedback::Kind::empty(),
                ),
                Feedback::Discarded => feedback.discarded(),
                Feedback::Never => {}
            }
        }
        if self.script.has_callbacks {
            self.current.callbacks.drain(..).for_each(|callback| callback.done(0));
        }
        if let Some(before) = self.shown.replace(buffer)
            && self.script.releases
        {
            before.release();
        }
    }
}

/// Globals that are bound and say no more than `on_bind`.
macro_rules! globals {
    ($($interface:ty => |$state:ident, $resource:ident| $on_bind:expr;)*) => {$(
        impl GlobalDispatch<$interface, ()> for State {
            fn bind(
                $state: &mut Self,
                _: &DisplayHandle,
                _: &Client,
                resource: New<$interface>,
                (): &(),
                init: &mut DataInit<'_, Self>,
            ) {
                let $resource = init.init(resource, ());
                let () = $on_bind;
            }
        }
    )*};
}

globals! {
    WlCompositor => |_state, _resource| ();
    WlShm => |_state, shm| {
        shm.format(wl_shm::Format::Argb8888);
        shm.format(wl_shm::Format::Xrgb8888);
    };
    WlOutput => |state, output| {
        output.geometry(0, 0, 600, 340, wl_output::Subpixel::None, "none".into(), "none".into(), wl_output::Transform::Normal);
        output.mode(wl_output::Mode::Current, 640, 360, state.script.announced_mhz);
        output.scale(1);
        output.done();
    };
    XdgWmBase => |_state, _resource| ();
    WpPresentation => |state, presentation| presentation.clock_id(if state.script.is_raw { 4 } else { 1 });
}

/// Objects and what their requests lead to.
macro_rules! objects {
    ($($interface:ty => |$state:ident, $request:ident, $init:ident, $resource:ident| $on_request:expr;)*) => {$(
        impl Dispatch<$interface, ()> for State {
            fn request(
                $state: &mut Self,
                _: &Client,
                $resource: &$interface,
                $request: <$interface as Resource>::Request,
                (): &(),
                _: &DisplayHandle,
                $init: &mut DataInit<'_, Self>,
            ) {
                $on_request
            }
        }
    )*};
}

objects! {
    WlCompositor => |_state, request, init, _resource| match request {
        wl_compositor::Request::CreateSurface { id } => drop(init.init(id, ())),
        wl_compositor::Request::CreateRegion { id } => drop(init.init(id, ())),
        _ => {}
    };
    WlSurface => |state, request, init, _resource| match request {
        wl_surface::Request::Attach { buffer, .. } => state.pending.buffer = buffer,
        wl_surface::Request::Frame { callback } => {
            state.pending.callbacks.push(init.init(callback, ()));
        }
        wl_surface::Request::Commit => state.commit(),
        _ => {}
    };
    WlShm => |_state, request, init, _resource| if let wl_shm::Request::CreatePool { id, fd, .. } = request {
        let _memory: OwnedFd = fd;
        init.init(id, ());
    };
    WlShmPool => |_state, request, init, _resource| if let wl_shm_pool::Request::CreateBuffer { id, .. } = request {
        init.init(id, ());
    };
    XdgWmBase => |_state, request, init, _resource| match request {
        xdg_wm_base::Request::GetXdgSurface { id, .. } => drop(init.init(id, ())),
        xdg_wm_base::Request::CreatePositioner { id } => drop(init.init(id, ())),
        _ => {}
    };
    XdgSurface => |state, request, init, resource| if let xdg_surface::Request::GetToplevel { id } = request {
        state.window = Some((resource.clone(), init.init(id, ())));
        state.is_configured = false;
    };
    WpPresentation => |state, request, init, _resource| if let wp_presentation::Request::Feedback { callback, .. } = request {
        state.pending.feedbacks.push(init.init(callback, ()));
    };
    WlRegion => |_state, _request, _init, _resource| ();
    WlBuffer => |_state, _request, _init, _resource| ();
    WlCallback => |_state, _request, _init, _resource| ();
    WlOutput => |_state, _request, _init, _resource| ();
    XdgToplevel => |_state, _request, _init, _resource| ();
    XdgPositioner => |_state, _request, _init, _resource| ();
    WpPresentationFeedback => |_state, _request, _init, _resource| ();
}
