//! A compositor of our own that does what it is told: the cases that real ones cannot give.
//!
//! It knows windows and surfaces inside them, on outputs of its own, and shows what was committed
//! at each tick of its display, by saying so. It draws nothing, but looks at what it is given
//! ([`Seen`]). A [`Script`] says how it is from the start, and each [`Order`] changes that.

#![allow(dead_code, reason = "each test file uses its own part of the fixture")]
#![expect(clippy::unwrap_used, reason = "a fixture that cannot go on fails its test")]

mod objects;
pub(crate) mod stage;

use std::collections::HashMap;
use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use foreframe_engine::MonoSpan;
use foreframed::clock;
use rustix::time::{ClockId, clock_gettime};
use tempfile::TempDir;
use wayland_protocols::wp::presentation_time::server::wp_presentation::WpPresentation;
use wayland_protocols::wp::presentation_time::server::wp_presentation_feedback::{
    self, WpPresentationFeedback,
};
use wayland_protocols::wp::viewporter::server::wp_viewporter::WpViewporter;
use wayland_protocols::xdg::shell::server::xdg_surface::XdgSurface;
use wayland_protocols::xdg::shell::server::xdg_toplevel::XdgToplevel;
use wayland_protocols::xdg::shell::server::xdg_wm_base::XdgWmBase;
use wayland_server::backend::ObjectId;
use wayland_server::protocol::wl_buffer::WlBuffer;
use wayland_server::protocol::wl_callback::WlCallback;
use wayland_server::protocol::wl_compositor::WlCompositor;
use wayland_server::protocol::wl_keyboard::{KeyState, WlKeyboard};
use wayland_server::protocol::wl_output::{self, WlOutput};
use wayland_server::protocol::wl_seat::WlSeat;
use wayland_server::protocol::wl_shm::WlShm;
use wayland_server::protocol::wl_subcompositor::WlSubcompositor;
use wayland_server::protocol::wl_surface::WlSurface;
use wayland_server::{Display, ListeningSocket, Resource as _};

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
    /// The surface inside a window that was made first gets no buffer back and no answer.
    pub(crate) starves_first_cell: bool,
    pub(crate) has_viewporter: bool,
    pub(crate) has_subcompositor: bool,
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
        starves_first_cell: false,
        has_viewporter: true,
        has_subcompositor: true,
        is_raw: false,
        announced_mhz: 100_000,
        interval: MonoSpan::from_ms(10),
        dies_after: None,
    };
}

/// Names of the outputs.
pub(crate) const OUTPUTS: [&str; 2] = ["LEFT", "RIGHT"];

/// What a running compositor is told.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Order {
    /// Windows have this size from now on, in logical pixels.
    Resize([i32; 2]),
    /// Outputs have so many pixels per logical one.
    Scale(i32),
    /// The display has another rate, mHz, and keeps it.
    Mode(i32),
    /// Whether anybody sees the windows: without, nothing is drawn, and frames are discarded when
    /// the next replaces them.
    Show(bool),
    /// Whether it reads and answers anything at all.
    Freeze(bool),
    /// A key of the keyboard is pressed and released: `f`, `h` or `q`.
    Press(char),
}

/// A surface as it was committed last.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Seen {
    /// Whether it is inside a window's.
    pub(crate) is_cell: bool,
    /// Where it is in that, in logical pixels.
    pub(crate) position: [i32; 2],
    /// Columns and rows of the buffer.
    pub(crate) buffer: [i32; 2],
    pub(crate) scale: i32,
    /// What it is stretched to, in logical pixels.
    pub(crate) destination: Option<[i32; 2]>,
    /// First three bytes of a texel in the corner and of one in the middle.
    pub(crate) corner: [u8; 3],
    pub(crate) middle: [u8; 3],
    pub(crate) commits: u32,
    /// Output that it was asked to fill, by its number, while it is to fill one.
    pub(crate) fills: Option<Option<usize>>,
}

/// A running compositor. Ended when dropped.
pub(crate) struct Scripted {
    folder: TempDir,
    orders: Sender<Order>,
    common: Arc<Common>,
    thread: Option<JoinHandle<()>>,
}

/// What both threads know.
#[derive(Default)]
struct Common {
    is_ending: AtomicBool,
    ticks: AtomicU64,
    seen: Mutex<Vec<Seen>>,
}

impl Scripted {
    pub(crate) fn start(script: Script) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("wl");
        let common = Arc::<Common>::default();
        let (ready, is_ready) = channel();
        let (orders, ordered) = channel();
        let shared = Arc::clone(&common);
        let thread = std::thread::spawn(move || {
            live(script, path, shared, &ordered, || ready.send(()).unwrap());
        });
        is_ready.recv().unwrap();
        Self { folder, orders, common, thread: Some(thread) }
    }

    pub(crate) fn environment(&self) -> Vec<(&'static str, String)> {
        vec![
            ("XDG_RUNTIME_DIR", self.folder.path().display().to_string()),
            ("WAYLAND_DISPLAY", "wl".to_owned()),
            ("DISPLAY", String::new()),
        ]
    }

    pub(crate) fn order(&self, order: Order) {
        self.orders.send(order).expect("the compositor lives");
    }

    /// The surfaces that something was committed to, oldest first.
    pub(crate) fn seen(&self) -> Vec<Seen> {
        self.common.seen.lock().unwrap().clone()
    }

    /// Refreshes so far.
    pub(crate) fn ticks(&self) -> u64 {
        self.common.ticks.load(Ordering::Relaxed)
    }
}

impl Drop for Scripted {
    fn drop(&mut self) {
        self.common.is_ending.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the compositor did as it was told");
        }
    }
}

struct State {
    script: Script,
    commits: u32,
    serial: u32,
    scale: i32,
    size: [i32; 2],
    is_shown: bool,
    /// Oldest first.
    surfaces: Vec<Surface>,
    buffers: HashMap<ObjectId, Buffer>,
    pools: HashMap<ObjectId, Arc<File>>,
    outputs: Vec<(usize, WlOutput)>,
    keyboards: Vec<WlKeyboard>,
}

struct Surface {
    surface: WlSurface,
    role: Role,
    pending: Content,
    /// Committed, for the next tick.
    current: Content,
    /// On the display.
    shown: Option<WlBuffer>,
    seen: Seen,
}

#[derive(Default)]
enum Role {
    #[default]
    None,
    Cell,
    Window {
        surface: XdgSurface,
        toplevel: Option<XdgToplevel>,
        is_configured: bool,
    },
}

#[derive(Default)]
struct Content {
    buffer: Option<WlBuffer>,
    callbacks: Vec<WlCallback>,
    feedbacks: Vec<WpPresentationFeedback>,
    destination: Option<[i32; 2]>,
    /// Applied by the window's commit.
    position: Option<[i32; 2]>,
}

struct Buffer {
    pool: Arc<File>,
    offset: i32,
    size: [i32; 2],
    stride: i32,
}

fn live(
    script: Script,
    path: PathBuf,
    common: Arc<Common>,
    orders: &Receiver<Order>,
    ready: impl Fn(),
) {
    let mut display = Display::<State>::new().unwrap();
    let socket = ListeningSocket::bind_absolute(path).unwrap();
    let mut handle = display.handle();
    handle.create_global::<State, WlCompositor, ()>(4, ());
    handle.create_global::<State, WlShm, ()>(1, ());
    handle.create_global::<State, WlSeat, ()>(5, ());
    for output in 0..OUTPUTS.len() {
        handle.create_global::<State, WlOutput, usize>(4, output);
    }
    handle.create_global::<State, XdgWmBase, ()>(1, ());
    handle.create_global::<State, WpPresentation, ()>(1, ());
    if script.has_subcompositor {
        handle.create_global::<State, WlSubcompositor, ()>(1, ());
    }
    if script.has_viewporter {
        handle.create_global::<State, WpViewporter, ()>(1, ());
    }
    let mut state = State {
        script,
        commits: 0,
        serial: 0,
        scale: 1,
        size: [0; 2],
        is_shown: true,
        surfaces: Vec::new(),
        buffers: HashMap::new(),
        pools: HashMap::new(),
        outputs: Vec::new(),
        keyboards: Vec::new(),
    };
    ready();
    let mut tick_at = clock::now();
    let mut is_frozen = false;
    while !common.is_ending.load(Ordering::Relaxed) {
        for order in orders.try_iter() {
            match order {
                Order::Freeze(is_so) => is_frozen = is_so,
                order => state.follow(order),
            }
        }
        if !is_frozen {
            if let Some(stream) = socket.accept().unwrap() {
                handle.insert_client(stream, Arc::new(())).unwrap();
            }
            display.dispatch_clients(&mut state).unwrap();
        }
        if script.dies_after.is_some_and(|commits| state.commits >= commits) {
            return;
        }
        if clock::now() >= tick_at {
            tick_at += state.script.interval;
            common.ticks.fetch_add(1, Ordering::Relaxed);
            if state.is_shown && !is_frozen {
                state.tick();
            }
        }
        *common.seen.lock().unwrap() = state.seen();
        display.flush_clients().unwrap();
        clock::sleep_until(tick_at.min(clock::now() + MonoSpan::from_us(500)));
    }
}

impl State {
    fn follow(&mut self, order: Order) {
        match order {
            Order::Resize(size) => {
                self.size = size;
                for index in 0..self.surfaces.len() {
                    self.configure(index);
                }
            }
            Order::Scale(scale) => {
                self.scale = scale;
                self.describe_outputs();
            }
            Order::Mode(mhz) => {
                self.script.announced_mhz = mhz;
                self.script.interval = MonoSpan::from_hz(f64::from(mhz) / 1_000.0);
                self.describe_outputs();
            }
            Order::Show(is_shown) => self.is_shown = is_shown,
            Order::Freeze(_) => {}
            Order::Press(key) => self.press(key),
        }
    }

    fn describe_outputs(&self) {
        self.outputs.iter().for_each(|(index, output)| self.describe(*index, output));
    }

    fn describe(&self, index: usize, output: &WlOutput) {
        let place = if index == 0 { 0 } else { 640 };
        output.geometry(
            place,
            0,
            600,
            340,
            wl_output::Subpixel::None,
            "none".into(),
            "none".into(),
            wl_output::Transform::Normal,
        );
        output.mode(wl_output::Mode::Current, 640, 360, self.script.announced_mhz);
        output.scale(self.scale);
        output.name(OUTPUTS[index].into());
        output.done();
    }

    fn press(&mut self, key: char) {
        let code = objects::KEYS.iter().find(|(name, _)| *name == key).expect("a known key").1;
        let is_window = |it: &&Surface| matches!(it.role, Role::Window { .. });
        let window = self.surfaces.iter().find(is_window).expect("a window").surface.clone();
        for keyboard in &self.keyboards {
            self.serial += 4;
            keyboard.enter(self.serial, &window, Vec::new());
            keyboard.modifiers(self.serial + 1, 0, 0, 0, 0);
            keyboard.key(self.serial + 2, self.serial, code, KeyState::Pressed);
            keyboard.key(self.serial + 3, self.serial, code, KeyState::Released);
        }
    }

    fn find(&mut self, surface: &WlSurface) -> &mut Surface {
        let found = self.surfaces.iter_mut().find(|it| it.surface == *surface);
        found.expect("a surface that was made")
    }

    /// Tells a window its size, and whether it fills its output.
    fn configure(&mut self, index: usize) {
        const FULLSCREEN: u32 = 2;
        const ACTIVATED: u32 = 4;
        self.serial += 1;
        let Surface { role, seen, .. } = &self.surfaces[index];
        let Role::Window { surface, toplevel: Some(toplevel), .. } = role else { return };
        let states = [ACTIVATED, FULLSCREEN];
        let count = if seen.fills.is_some() { 2 } else { 1 };
        let bytes = states[..count].iter().flat_map(|state| state.to_ne_bytes()).collect();
        toplevel.configure(self.size[0], self.size[1], bytes);
        surface.configure(self.serial);
    }

    fn commit(&mut self, surface: &WlSurface) {
        let index = self.surfaces.iter().position(|it| it.surface == *surface).unwrap();
        if let Role::Window { is_configured, toplevel: Some(_), .. } =
            &mut self.surfaces[index].role
            && !std::mem::replace(is_configured, true)
        {
            for (_, output) in &self.outputs[..1] {
                surface.enter(output);
            }
            self.configure(index);
        }
        if let Role::Window { .. } = self.surfaces[index].role {
            for it in &mut self.surfaces {
                it.seen.position = it.pending.position.take().unwrap_or(it.seen.position);
            }
        }
        let starves = self.starves(index);
        let it = &mut self.surfaces[index];
        it.seen.destination = it.pending.destination.take().or(it.seen.destination);
        let Some(buffer) = it.pending.buffer.take() else { return };
        self.commits += 1;
        it.seen.commits += 1;
        if let Some(known) = self.buffers.get(&buffer.id()) {
            it.seen.buffer = known.size;
            it.seen.corner = known.texel([0, 0]);
            it.seen.middle = known.texel(known.size.map(|length| length / 2));
        }
        let feedbacks = std::mem::take(&mut it.pending.feedbacks);
        let superseded = std::mem::replace(&mut it.current.feedbacks, feedbacks);
        if self.script.feedback != Feedback::Never && !starves {
            superseded.iter().for_each(WpPresentationFeedback::discarded);
        }
        it.current.callbacks.append(&mut it.pending.callbacks);
        if let Some(replaced) = it.current.buffer.replace(buffer)
            && self.script.releases
            && !starves
        {
            replaced.release();
        }
    }

    /// Whether a surface gets no answer.
    fn starves(&self, index: usize) -> bool {
        // Frames that toolkits draw around windows are made of such surfaces, too.
        let has_picture = |it: &Surface| it.seen.commits > 0 || it.pending.buffer.is_some();
        let first = self.surfaces.iter().position(|it| it.seen.is_cell && has_picture(it));
        self.script.starves_first_cell && first == Some(index)
    }

    fn tick(&mut self) {
        for index in 0..self.surfaces.len() {
            if !self.starves(index) {
                self.surfaces[index].tick(&self.script);
            }
        }
    }

    fn seen(&self) -> Vec<Seen> {
        let committed = self.surfaces.iter().filter(|it| it.seen.commits > 0);
        committed.map(|it| it.seen.clone()).collect()
    }
}

impl Buffer {
    fn texel(&self, [x, y]: [i32; 2]) -> [u8; 3] {
        let mut texel = [0; 3];
        let at = self.offset + y * self.stride + x * 4;
        self.pool.read_exact_at(&mut texel, u64::try_from(at).unwrap()).unwrap();
        texel
    }
}

impl Surface {
    fn new(surface: WlSurface) -> Self {
        let seen = Seen {
            is_cell: false,
            position: [0; 2],
            buffer: [0; 2],
            scale: 1,
            destination: None,
            corner: [0; 3],
            middle: [0; 3],
            commits: 0,
            fills: None,
        };
        let [pending, current] = [(); 2].map(|()| Content::default());
        Self { surface, role: Role::None, pending, current, shown: None, seen }
    }

    fn tick(&mut self, script: &Script) {
        let Some(buffer) = self.current.buffer.take() else { return };
        let id = if script.is_raw { ClockId::MonotonicRaw } else { ClockId::Monotonic };
        let now = clock_gettime(id);
        let refresh = 1_000_000_000_000 / i64::from(script.announced_mhz);
        for feedback in self.current.feedbacks.drain(..) {
            match script.feedback {
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
        if script.has_callbacks {
            self.current.callbacks.drain(..).for_each(|callback| callback.done(0));
        }
        if let Some(before) = self.shown.replace(buffer)
            && script.releases
        {
            before.release();
        }
    }
}
