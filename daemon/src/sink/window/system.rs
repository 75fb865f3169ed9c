//! The desktop as the daemon sees it: one thread that makes windows and hears of them.
//!
//! winit allows one event loop per process, and it may wait for the display without a limit. So it
//! has a thread of its own, the others ask it by messages, and whoever waits for an answer does so
//! for a limited time. When the display goes, or anything in that thread panics, all windows are
//! told.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread;
use std::time::Duration;

use foreframe_engine::MonoSpan;
use tracing::{debug, info, warn};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, KeyEvent, WindowEvent as DesktopEvent};
use winit::event_loop::{
    ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy, OwnedDisplayHandle,
};
use winit::keyboard::{Key, NamedKey};
use winit::monitor::MonitorHandle;
use winit::platform::wayland::EventLoopBuilderExtWayland as _;
use winit::window::{Fullscreen, Window as DesktopWindow, WindowAttributes, WindowId};

use super::host::Host;
use super::pane::Pane;
use super::shared::Shared;
use super::wayland::Role;
use super::{Closed, Layout, WindowConfig, WindowError, WindowEvent, WindowOptions};
use crate::stream::core::Told;

/// Time that a display has to answer. A busy one takes a few hundred milliseconds.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// Time between two looks at the refresh rates of monitors: not every display tells of a change.
const MODE_POLL: Duration = Duration::from_millis(500);
/// What the desktop calls a window that several streams share.
const SHARED_TITLE: &str = "Foreframe";
/// Time that the thread has to end before it is left behind.
const END_WITHIN: Duration = Duration::from_secs(1);

/// The thread that owns all windows. Ended when dropped.
#[derive(Debug)]
pub struct WindowSystem {
    opener: WindowOpener,
    /// Disconnected when the thread has ended.
    ended: std::sync::mpsc::Receiver<()>,
}

/// Opens windows, from any thread.
#[derive(Clone)]
pub struct WindowOpener {
    proxy: EventLoopProxy<Request>,
}

impl fmt::Debug for WindowOpener {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("WindowOpener").finish_non_exhaustive()
    }
}

/// A window as the desktop made it.
#[derive(Debug)]
pub(super) struct Opened {
    /// What the window is closed by.
    pub(super) host: WindowId,
    pub(super) window: Arc<DesktopWindow>,
    /// What to draw on without Wayland.
    pub(super) pane: Pane,
    pub(super) display: OwnedDisplayHandle,
    /// Announced refresh interval of its monitor.
    pub(super) refresh_interval: Option<MonoSpan>,
    pub(super) role: Role,
}

/// What other threads ask for.
#[derive(Debug)]
enum Request {
    Open(WindowConfig, Arc<Shared>, SyncSender<Result<Opened, WindowError>>),
    Close(WindowId, Arc<Shared>),
    End,
}

impl WindowSystem {
    /// Connects to the display that the environment names.
    ///
    /// # Errors
    /// If there is none, it does not answer, or it lacks the wanted monitor.
    pub fn start(options: &WindowOptions) -> Result<Self, WindowError> {
        let (tell, told) = channel();
        let (_end_with_thread, ended) = sync_channel::<()>(1);
        let options = options.clone();
        thread::Builder::new().name("foreframe-windows".to_owned()).spawn(move || {
            let _end_with_thread = _end_with_thread;
            live(options, tell);
        })?;
        let proxy = match told.recv_timeout(ANSWER_WITHIN) {
            Ok(answer) => answer?,
            Err(RecvTimeoutError::Timeout) => return Err(WindowError::NoAnswer("none in 5 s")),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(WindowError::NoAnswer("one that broke its thread"));
            }
        };
        Ok(Self { opener: WindowOpener { proxy }, ended })
    }

    /// What streams open their windows with.
    #[must_use]
    pub fn opener(&self) -> WindowOpener {
        self.opener.clone()
    }
}

impl Drop for WindowSystem {
    fn drop(&mut self) {
        if self.opener.proxy.send_event(Request::End).is_err() {
            return; // it has ended already
        }
        if self.ended.recv_timeout(END_WITHIN) == Err(RecvTimeoutError::Timeout) {
            warn!("the display does not answer, and its thread is left behind");
        }
    }
}

impl WindowOpener {
    /// Asks for a window, and waits for it for a limited time.
    pub(super) fn open(
        &self,
        config: &WindowConfig,
        shared: &Arc<Shared>,
    ) -> Result<Opened, WindowError> {
        const GONE: WindowError = WindowError::NoAnswer("one that is gone");
        let (reply, answer) = sync_channel(1);
        let request = Request::Open(config.clone(), Arc::clone(shared), reply);
        self.proxy.send_event(request).map_err(|_| GONE)?;
        match answer.recv_timeout(ANSWER_WITHIN) {
            Ok(opened) => opened,
            Err(RecvTimeoutError::Timeout) => Err(WindowError::NoAnswer("none in 5 s")),
            Err(RecvTimeoutError::Disconnected) => Err(GONE),
        }
    }

    pub(super) fn close(&self, window: WindowId, shared: &Arc<Shared>) {
        if self.proxy.send_event(Request::Close(window, Arc::clone(shared))).is_err() {
            debug!("a window was gone before it was closed");
        }
    }
}

/// What winit says, without the place in its source that it names before.
fn without_place(error: &str) -> &str {
    let after_file = error.split_once(".rs:").and_then(|(_, line)| line.split_once(": "));
    after_file.map_or(error, |(_, said)| said)
}

/// The life of the thread.
fn live(options: WindowOptions, tell: Sender<Result<EventLoopProxy<Request>, WindowError>>) {
    let built = EventLoop::with_user_event().with_any_thread(true).build();
    let event_loop = match built {
        Ok(event_loop) => event_loop,
        Err(error) => {
            let error = WindowError::NoDisplay(without_place(&error.to_string()).to_owned());
            // Whoever asked may have given up.
            return drop(tell.send(Err(error)));
        }
    };
    let proxy = event_loop.create_proxy();
    let mut desktop = Desktop { options, windows: BTreeMap::new(), start: Some((tell, proxy)) };
    match event_loop.run_app(&mut desktop) {
        Ok(()) => {}
        Err(error) => warn!(%error, "the display is gone, and all windows with it"),
    }
}

type Start = (Sender<Result<EventLoopProxy<Request>, WindowError>>, EventLoopProxy<Request>);

/// Everything that the thread knows.
struct Desktop {
    options: WindowOptions,
    windows: BTreeMap<WindowId, Host>,
    /// Until the display has said which monitors there are.
    start: Option<Start>,
}

impl Drop for Desktop {
    fn drop(&mut self) {
        self.windows.values().for_each(|host| host.close(Closed::WithDisplay));
    }
}

impl ApplicationHandler<Request> for Desktop {
    fn resumed(&mut self, display: &ActiveEventLoop) {
        let Some((tell, proxy)) = self.start.take() else { return };
        let monitor = find_monitor(display, self.options.monitor.as_deref());
        let is_good = monitor.is_ok();
        if tell.send(monitor.map(|_| proxy)).is_err() || !is_good {
            display.exit();
        }
    }

    fn user_event(&mut self, display: &ActiveEventLoop, request: Request) {
        match request {
            Request::Open(config, shared, reply) => {
                let opened = self.open(display, &config, &shared);
                if let Err(unwanted) = reply.send(opened)
                    && let Ok(Opened { host, .. }) = unwanted.0
                {
                    self.close(host, &shared);
                }
            }
            Request::Close(window, shared) => self.close(window, &shared),
            Request::End => display.exit(),
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, id: WindowId, event: DesktopEvent) {
        let Some(host) = self.windows.get_mut(&id) else {
            return self.pane_event(id, &event);
        };
        match event {
            DesktopEvent::CloseRequested => host.close(Closed::ByUser),
            DesktopEvent::Destroyed => host.close(Closed::WithDisplay),
            DesktopEvent::Resized(_) => host.arrange(),
            DesktopEvent::ScaleFactorChanged { scale_factor, .. } => {
                debug!(scale_factor, "the window's scale has changed");
                host.arrange();
            }
            DesktopEvent::Occluded(is_hidden) => {
                host.tell(WindowEvent::Told(Told::Visible(!is_hidden)));
            }
            DesktopEvent::KeyboardInput { event, is_synthetic: false, .. } => {
                on_key(host, &event);
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, display: &ActiveEventLoop) {
        for host in self.windows.values_mut() {
            let interval = host.window.current_monitor().as_ref().and_then(refresh_interval);
            if interval != host.refresh_interval {
                host.refresh_interval = interval;
                if let Some(interval) = interval {
                    host.tell(WindowEvent::Told(Told::Mode(interval)));
                }
            }
        }
        display.set_control_flow(match self.windows.is_empty() {
            true => ControlFlow::Wait,
            false => ControlFlow::wait_duration(MODE_POLL),
        });
    }
}

impl Desktop {
    /// A window inside another has heard what is meant for that: whoever has the keyboard, keys are
    /// for all.
    fn pane_event(&self, id: WindowId, event: &DesktopEvent) {
        if let DesktopEvent::KeyboardInput { event, is_synthetic: false, .. } = event
            && let Some(host) = self.windows.values().find(|host| host.has_inside(id))
        {
            on_key(host, event);
        }
    }

    fn open(
        &mut self,
        display: &ActiveEventLoop,
        config: &WindowConfig,
        shared: &Arc<Shared>,
    ) -> Result<Opened, WindowError> {
        let is_shared = self.options.layout == Layout::SideBySide;
        let open = self.windows.keys().next().copied().filter(|_| is_shared);
        let id = match open {
            Some(id) => id,
            None => self.open_host(display, config, is_shared)?,
        };
        let host = self.windows.get_mut(&id).expect("it is open");
        let pane = match host.add(display, Arc::clone(shared), config.clone()) {
            Ok(pane) => pane,
            Err(error) => {
                if host.is_empty() {
                    self.windows.remove(&id);
                }
                return Err(error);
            }
        };
        Ok(Opened {
            host: id,
            window: Arc::clone(&host.window),
            pane,
            display: display.owned_display_handle(),
            refresh_interval: host.refresh_interval,
            role: host.role(),
        })
    }

    fn leave_side_by_side(&mut self, lacking: &str) {
        warn!(lacking, "streams cannot be side by side; each gets a window");
        self.options.layout = Layout::Single;
    }

    fn open_host(
        &mut self,
        display: &ActiveEventLoop,
        config: &WindowConfig,
        is_shared: bool,
    ) -> Result<WindowId, WindowError> {
        let monitor = find_monitor(display, self.options.monitor.as_deref())?;
        let size = PhysicalSize::new(config.format.width, config.format.height);
        let title = if is_shared { SHARED_TITLE } else { &config.title };
        let mut attributes = WindowAttributes::default().with_title(title).with_inner_size(size);
        if self.options.is_fullscreen {
            attributes = attributes.with_fullscreen(Some(Fullscreen::Borderless(monitor)));
        } else if let Some(monitor) = monitor {
            attributes = attributes.with_position(monitor.position());
        }
        let window = display.create_window(attributes);
        let window = Arc::new(window.map_err(|error| WindowError::Refused(error.to_string()))?);
        let monitor = window.current_monitor().or_else(|| display.available_monitors().next());
        let refresh_interval = monitor.as_ref().and_then(refresh_interval);
        info!(
            title,
            monitor = monitor.as_ref().and_then(MonitorHandle::name),
            scale_factor = window.scale_factor(),
            "window opens"
        );
        let id = window.id();
        let several =
            is_shared.then(|| Host::for_several(Arc::clone(&window), display, refresh_interval));
        let host = match several {
            None => Host::new(window, refresh_interval),
            Some(Err(WindowError::Lacks(lacking))) => {
                self.leave_side_by_side(lacking);
                window.set_title(&config.title);
                Host::new(window, refresh_interval)
            }
            Some(host) => host?,
        };
        self.windows.insert(id, host);
        Ok(id)
    }

    fn close(&mut self, window: WindowId, shared: &Arc<Shared>) {
        if self.windows.get_mut(&window).is_some_and(|host| !host.remove(shared)) {
            self.windows.remove(&window);
        }
    }
}

fn on_key(host: &Host, event: &KeyEvent) {
    if event.state != ElementState::Pressed || event.repeat {
        return;
    }
    match &event.logical_key {
        Key::Named(NamedKey::Escape) => host.close(Closed::ByUser),
        Key::Character(text) => match text.to_lowercase().as_str() {
            "q" => host.close(Closed::ByUser),
            "f" => host.window.set_fullscreen(match host.window.fullscreen() {
                Some(_) => None,
                None => Some(Fullscreen::Borderless(None)),
            }),
            other => {
                if let Some(key) = other.chars().next() {
                    host.tell(WindowEvent::Key(key));
                }
            }
        },
        _ => {}
    }
}

/// The monitor of this name, if one is wanted.
fn find_monitor(
    display: &ActiveEventLoop,
    wanted: Option<&str>,
) -> Result<Option<MonitorHandle>, WindowError> {
    let Some(wanted) = wanted else { return Ok(None) };
    let is_wanted = |monitor: &MonitorHandle| monitor.name().as_deref() == Some(wanted);
    let found = display.available_monitors().find(is_wanted);
    if found.is_some() {
        return Ok(found);
    }
    let names: Vec<_> = display.available_monitors().filter_map(|it| it.name()).collect();
    Err(WindowError::NoMonitor { wanted: wanted.to_owned(), found: names.join(", ") })
}

fn refresh_interval(monitor: &MonitorHandle) -> Option<MonoSpan> {
    let rate_mhz = monitor.refresh_rate_millihertz().filter(|&rate| rate > 0)?;
    Some(MonoSpan::from_hz(f64::from(rate_mhz) / 1_000.0))
}
