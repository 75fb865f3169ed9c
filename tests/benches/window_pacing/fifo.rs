//! A plain Wayland client: it draws the next frame when the compositor asks for one, as a swapchain
//! in FIFO mode does, and takes down when each was shown.

use std::fs::File;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::path::Path;

use foreframe_engine::MonoSpan;
use foreframe_protocol::memory::create_memfd;
use foreframed::clock;
use wayland_client::globals::{GlobalListContents, registry_queue_init};
use wayland_client::protocol::wl_buffer::{self, WlBuffer};
use wayland_client::protocol::wl_callback::{self, WlCallback};
use wayland_client::protocol::wl_compositor::WlCompositor;
use wayland_client::protocol::wl_registry::{self, WlRegistry};
use wayland_client::protocol::wl_shm::{Format, WlShm};
use wayland_client::protocol::wl_shm_pool::WlShmPool;
use wayland_client::protocol::wl_surface::WlSurface;
use wayland_client::{Connection, Dispatch, QueueHandle, delegate_noop};
use wayland_protocols::wp::presentation_time::client::wp_presentation::{self, WpPresentation};
use wayland_protocols::wp::presentation_time::client::wp_presentation_feedback::{
    self, WpPresentationFeedback,
};
use wayland_protocols::xdg::shell::client::xdg_surface::{self, XdgSurface};
use wayland_protocols::xdg::shell::client::xdg_toplevel::XdgToplevel;
use wayland_protocols::xdg::shell::client::xdg_wm_base::{self, XdgWmBase};

use crate::record::{Frame, Record};

const BUFFERS: usize = 3;

struct State {
    clock: u32,
    is_configured: bool,
    is_asked: bool,
    is_busy: [bool; BUFFERS],
    record: Record,
}

/// Draws for so many seconds, each frame `delay` after it was asked for.
pub(crate) fn run(
    socket: &Path,
    [width, height]: [u32; 2],
    seconds: i64,
    delay: MonoSpan,
) -> Record {
    let stream = UnixStream::connect(socket).expect("the compositor listens");
    let connection = Connection::from_socket(stream).expect("a Wayland connection");
    let (globals, mut queue) = registry_queue_init::<State>(&connection).expect("globals");
    let handle = queue.handle();
    let compositor: WlCompositor = globals.bind(&handle, 4..=4, ()).expect("wl_compositor");
    let shm: WlShm = globals.bind(&handle, 1..=1, ()).expect("wl_shm");
    let base: XdgWmBase = globals.bind(&handle, 1..=1, ()).expect("xdg_wm_base");
    let presentation: WpPresentation = globals.bind(&handle, 1..=1, ()).expect("wp_presentation");
    let surface = compositor.create_surface(&handle, ());
    let xdg_surface = base.get_xdg_surface(&surface, &handle, ());
    let toplevel = xdg_surface.get_toplevel(&handle, ());
    toplevel.set_fullscreen(None);
    surface.commit();

    let [width, height] = [width, height].map(u32::cast_signed);
    let bytes = width * height * 4;
    let file = File::from(create_memfd("plain").expect("memory"));
    file.set_len(u64::from(bytes.unsigned_abs()) * BUFFERS as u64).expect("memory");
    let pool = shm.create_pool(file.as_fd(), bytes * BUFFERS as i32, &handle, ());
    let buffers: Vec<WlBuffer> = (0..BUFFERS)
        .map(|index| {
            let offset = bytes * index as i32;
            pool.create_buffer(offset, width, height, width * 4, Format::Xrgb8888, &handle, index)
        })
        .collect();
    let mut state = State {
        clock: 1,
        is_configured: false,
        is_asked: true,
        is_busy: [false; BUFFERS],
        record: Record::default(),
    };
    let end = clock::now() + MonoSpan::from_ms(seconds * 1_000);
    while clock::now() < end {
        queue.blocking_dispatch(&mut state).expect("the compositor goes on");
        let free = state.is_busy.iter().position(|is_busy| !is_busy);
        let (true, true, Some(free)) = (state.is_configured, state.is_asked, free) else {
            continue;
        };
        clock::sleep_until(clock::now() + delay);
        state.is_asked = false;
        state.is_busy[free] = true;
        surface.frame(&handle, ());
        presentation.feedback(&surface, &handle, state.record.frames.len());
        surface.attach(Some(&buffers[free]), 0, 0);
        surface.damage_buffer(0, 0, width, height);
        surface.commit();
        let handed_over_at = clock::now().as_ns();
        state.record.frames.push(Frame { handed_over_at, ..Frame::default() });
    }
    toplevel.destroy();
    xdg_surface.destroy();
    surface.destroy();
    queue.roundtrip(&mut state).expect("the compositor goes on");
    state.record
}

impl Dispatch<WpPresentationFeedback, usize> for State {
    fn event(
        state: &mut Self,
        _: &WpPresentationFeedback,
        event: wp_presentation_feedback::Event,
        &index: &usize,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        let frame = &mut state.record.frames[index];
        match event {
            wp_presentation_feedback::Event::Presented { tv_sec_lo, tv_nsec, .. } => {
                let time_ns = u64::from(tv_sec_lo) * 1_000_000_000 + u64::from(tv_nsec);
                let shown_at = clock::from_other_clock(state.clock, time_ns);
                frame.shown_at = shown_at.map_or(0, |at| at.as_ns());
            }
            wp_presentation_feedback::Event::Discarded => frame.is_discarded = true,
            _ => {}
        }
    }
}

impl Dispatch<WpPresentation, ()> for State {
    fn event(
        state: &mut Self,
        _: &WpPresentation,
        event: wp_presentation::Event,
        (): &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let wp_presentation::Event::ClockId { clk_id } = event {
            state.clock = clk_id;
        }
    }
}

impl Dispatch<WlCallback, ()> for State {
    fn event(
        state: &mut Self,
        _: &WlCallback,
        event: wl_callback::Event,
        (): &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        state.is_asked |= matches!(event, wl_callback::Event::Done { .. });
    }
}

impl Dispatch<WlBuffer, usize> for State {
    fn event(
        state: &mut Self,
        _: &WlBuffer,
        event: wl_buffer::Event,
        &index: &usize,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        state.is_busy[index] &= !matches!(event, wl_buffer::Event::Release);
    }
}

impl Dispatch<XdgWmBase, ()> for State {
    fn event(
        _: &mut Self,
        base: &XdgWmBase,
        event: xdg_wm_base::Event,
        (): &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let xdg_wm_base::Event::Ping { serial } = event {
            base.pong(serial);
        }
    }
}

impl Dispatch<XdgSurface, ()> for State {
    fn event(
        state: &mut Self,
        surface: &XdgSurface,
        event: xdg_surface::Event,
        (): &(),
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
        if let xdg_surface::Event::Configure { serial } = event {
            surface.ack_configure(serial);
            state.is_configured = true;
        }
    }
}

impl Dispatch<WlRegistry, GlobalListContents> for State {
    fn event(
        _: &mut Self,
        _: &WlRegistry,
        _: wl_registry::Event,
        _: &GlobalListContents,
        _: &Connection,
        _: &QueueHandle<Self>,
    ) {
    }
}

delegate_noop!(State: ignore WlCompositor);
delegate_noop!(State: ignore WlShm);
delegate_noop!(State: ignore WlShmPool);
delegate_noop!(State: ignore WlSurface);
delegate_noop!(State: ignore XdgToplevel);
