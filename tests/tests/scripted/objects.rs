//! The objects of the protocol: what is said of globals when they are bound, and what requests do.

use std::fs::File;
use std::io::Write as _;
use std::os::fd::AsFd as _;
use std::sync::Arc;

use foreframe_protocol::memory::create_memfd;
use wayland_protocols::wp::presentation_time::server::wp_presentation::{self, WpPresentation};
use wayland_protocols::wp::presentation_time::server::wp_presentation_feedback::WpPresentationFeedback;
use wayland_protocols::wp::viewporter::server::wp_viewport::{self, WpViewport};
use wayland_protocols::wp::viewporter::server::wp_viewporter::{self, WpViewporter};
use wayland_protocols::xdg::shell::server::xdg_positioner::XdgPositioner;
use wayland_protocols::xdg::shell::server::xdg_surface::{self, XdgSurface};
use wayland_protocols::xdg::shell::server::xdg_toplevel::{self, XdgToplevel};
use wayland_protocols::xdg::shell::server::xdg_wm_base::{self, XdgWmBase};
use wayland_server::protocol::wl_buffer::WlBuffer;
use wayland_server::protocol::wl_callback::WlCallback;
use wayland_server::protocol::wl_compositor::{self, WlCompositor};
use wayland_server::protocol::wl_keyboard::{KeymapFormat, WlKeyboard};
use wayland_server::protocol::wl_output::WlOutput;
use wayland_server::protocol::wl_region::WlRegion;
use wayland_server::protocol::wl_seat::{self, WlSeat};
use wayland_server::protocol::wl_shm::{self, WlShm};
use wayland_server::protocol::wl_shm_pool::{self, WlShmPool};
use wayland_server::protocol::wl_subcompositor::{self, WlSubcompositor};
use wayland_server::protocol::wl_subsurface::{self, WlSubsurface};
use wayland_server::protocol::wl_surface::{self, WlSurface};
use wayland_server::{Client, DataInit, Dispatch, DisplayHandle, GlobalDispatch, New, Resource};

use super::{Buffer, Role, State, Surface};

/// Keys that it has, by what they are called and their number.
pub(super) const KEYS: [(char, u32); 3] = [('f', 33), ('h', 35), ('q', 16)];

const KEYMAP: &str = r#"xkb_keymap {
xkb_keycodes "few" { minimum = 8; maximum = 255; <F> = 41; <H> = 43; <Q> = 24; };
xkb_types "few" { type "ONE_LEVEL" { modifiers = none; level_name[Level1] = "Any"; }; };
xkb_compatibility "few" { };
xkb_symbols "few" { key <F> { [ f ] }; key <H> { [ h ] }; key <Q> { [ q ] }; };
};"#;

/// Globals that are bound and say no more than `on_bind`.
macro_rules! globals {
    ($($interface:ty, $known:ty => |$state:ident, $resource:ident, $data:ident| $on_bind:expr;)*) => {$(
        impl GlobalDispatch<$interface, $known> for State {
            fn bind(
                $state: &mut Self,
                _: &DisplayHandle,
                _: &Client,
                resource: New<$interface>,
                $data: &$known,
                init: &mut DataInit<'_, Self>,
            ) {
                let $resource = init.init(resource, ());
                let () = $on_bind;
            }
        }
    )*};
}

globals! {
    WlCompositor, () => |_state, _resource, _data| ();
    WlSubcompositor, () => |_state, _resource, _data| ();
    WpViewporter, () => |_state, _resource, _data| ();
    WlShm, () => |_state, shm, _data| {
        shm.format(wl_shm::Format::Argb8888);
        shm.format(wl_shm::Format::Xrgb8888);
    };
    WlSeat, () => |_state, seat, _data| seat.capabilities(wl_seat::Capability::Keyboard);
    WlOutput, usize => |state, output, index| {
        state.describe(*index, &output);
        state.outputs.push((*index, output));
    };
    XdgWmBase, () => |_state, _resource, _data| ();
    WpPresentation, () => |state, presentation, _data| {
        presentation.clock_id(if state.script.is_raw { 4 } else { 1 });
    };
}

/// Objects, what they belong to, and what their requests lead to.
macro_rules! objects {
    ($($interface:ty, $known:ty => |$state:ident, $request:ident, $init:ident, $resource:ident, $data:ident| $on_request:expr;)*) => {$(
        impl Dispatch<$interface, $known> for State {
            fn request(
                $state: &mut Self,
                _: &Client,
                $resource: &$interface,
                $request: <$interface as Resource>::Request,
                $data: &$known,
                _: &DisplayHandle,
                $init: &mut DataInit<'_, Self>,
            ) {
                $on_request
            }
        }
    )*};
}

objects! {
    WlCompositor, () => |state, request, init, _resource, _data| match request {
        wl_compositor::Request::CreateSurface { id } => {
            let surface = init.init(id, ());
            state.surfaces.push(Surface::new(surface));
        }
        wl_compositor::Request::CreateRegion { id } => drop(init.init(id, ())),
        _ => {}
    };
    WlSurface, () => |state, request, init, surface, _data| match request {
        wl_surface::Request::Attach { buffer, .. } => state.find(surface).pending.buffer = buffer,
        wl_surface::Request::Frame { callback } => {
            let callback = init.init(callback, ());
            state.find(surface).pending.callbacks.push(callback);
        }
        wl_surface::Request::SetBufferScale { scale } => state.find(surface).seen.scale = scale,
        wl_surface::Request::Commit => state.commit(surface),
        wl_surface::Request::Destroy => state.surfaces.retain(|it| it.surface != *surface),
        _ => {}
    };
    WlSubcompositor, () => |state, request, init, _resource, _data| if let wl_subcompositor::Request::GetSubsurface { id, surface, .. } = request {
        let it = state.find(&surface);
        it.role = Role::Cell;
        it.seen.is_cell = true;
        init.init(id, surface);
    };
    WlSubsurface, WlSurface => |state, request, _init, _resource, surface| if let wl_subsurface::Request::SetPosition { x, y } = request {
        state.find(surface).pending.position = Some([x, y]);
    };
    WpViewporter, () => |_state, request, init, _resource, _data| if let wp_viewporter::Request::GetViewport { id, surface } = request {
        init.init(id, surface);
    };
    WpViewport, WlSurface => |state, request, _init, _resource, surface| if let wp_viewport::Request::SetDestination { width, height } = request {
        state.find(surface).pending.destination = Some([width, height]);
    };
    WlShm, () => |state, request, init, _resource, _data| if let wl_shm::Request::CreatePool { id, fd, .. } = request {
        let pool: WlShmPool = init.init(id, ());
        state.pools.insert(pool.id(), Arc::new(File::from(fd)));
    };
    WlShmPool, () => |state, request, init, pool, _data| if let wl_shm_pool::Request::CreateBuffer { id, offset, width, height, stride, .. } = request {
        let buffer: WlBuffer = init.init(id, ());
        let pool = Arc::clone(&state.pools[&pool.id()]);
        state.buffers.insert(buffer.id(), Buffer { pool, offset, size: [width, height], stride });
    };
    WlSeat, () => |state, request, init, _resource, _data| if let wl_seat::Request::GetKeyboard { id } = request {
        let keyboard: WlKeyboard = init.init(id, ());
        let mut file = File::from(create_memfd("keymap").expect("memory"));
        file.write_all(KEYMAP.as_bytes()).expect("memory");
        file.write_all(&[0]).expect("memory");
        keyboard.keymap(KeymapFormat::XkbV1, file.as_fd(), KEYMAP.len() as u32 + 1);
        keyboard.repeat_info(0, 0);
        state.keyboards.push(keyboard);
    };
    XdgWmBase, () => |state, request, init, _resource, _data| match request {
        xdg_wm_base::Request::GetXdgSurface { id, surface } => {
            let xdg_surface = init.init(id, surface.clone());
            let role = Role::Window { surface: xdg_surface, toplevel: None, is_configured: false };
            state.find(&surface).role = role;
        }
        xdg_wm_base::Request::CreatePositioner { id } => drop(init.init(id, ())),
        _ => {}
    };
    XdgSurface, WlSurface => |state, request, init, _resource, surface| if let xdg_surface::Request::GetToplevel { id } = request {
        let made = init.init(id, surface.clone());
        if let Role::Window { toplevel, .. } = &mut state.find(surface).role {
            *toplevel = Some(made);
        }
    };
    XdgToplevel, WlSurface => |state, request, _init, _resource, surface| {
        let fills = match request {
            xdg_toplevel::Request::SetFullscreen { output } => {
                let named = |output: WlOutput| state.outputs.iter().find(|it| it.1 == output);
                Some(output.and_then(named).map(|it| it.0))
            }
            xdg_toplevel::Request::UnsetFullscreen => None,
            _ => return,
        };
        state.find(surface).seen.fills = fills;
        let index = state.surfaces.iter().position(|it| it.surface == *surface);
        index.into_iter().for_each(|index| state.configure(index));
    };
    WpPresentation, () => |state, request, init, _resource, _data| if let wp_presentation::Request::Feedback { surface, callback } = request {
        let feedback = init.init(callback, ());
        state.find(&surface).pending.feedbacks.push(feedback);
    };
    WlRegion, () => |_state, _request, _init, _resource, _data| ();
    WlBuffer, () => |_state, _request, _init, _resource, _data| ();
    WlCallback, () => |_state, _request, _init, _resource, _data| ();
    WlOutput, () => |_state, _request, _init, _resource, _data| ();
    WlKeyboard, () => |_state, _request, _init, _resource, _data| ();
    XdgPositioner, () => |_state, _request, _init, _resource, _data| ();
    WpPresentationFeedback, () => |_state, _request, _init, _resource, _data| ();
}
