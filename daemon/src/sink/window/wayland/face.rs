//! The surface on the desktop, and what goes with each commit, whoever draws on it.
//!
//! Buffers come from [`super::pool`] by way of [`super::surface`], or from a graphics driver by way
//! of [`crate::sink::window::surface`]. Either says when it is about to commit, so that feedback is
//! asked for with that very commit, and when it has.

use std::io::ErrorKind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use foreframe_engine::MonoTime;
use tracing::{debug, warn};
use wayland_client::backend::WaylandError;
use wayland_client::globals::registry_queue_init;
use wayland_client::protocol::wl_shm::WlShm;
use wayland_client::protocol::wl_surface::WlSurface;
use wayland_client::{Connection, EventQueue, Proxy as _, QueueHandle};
use wayland_protocols::wp::presentation_time::client::wp_presentation::WpPresentation;
use wayland_protocols::wp::viewporter::client::wp_viewport::WpViewport;
use wayland_protocols::wp::viewporter::client::wp_viewporter::WpViewporter;

use super::answers::Answers;
use super::cell::{Cell, Role};
use super::guest::{Anchor, Guest, Target};
use super::listener::{Gate, Listener};
use crate::sink::window::placement::Placement;
use crate::sink::window::shared::Shared;
use crate::sink::window::texels::ByteOrder;
use crate::sink::window::{Closed, Feedback, WindowError};

/// Time that a compositor has to say what it offers.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// Where a compositor has this, winit makes the surface's viewport, and there can be but one.
const FRACTIONAL_SCALE: &str = "wp_fractional_scale_manager_v1";
/// What streams need to share a window.
const FOR_SEVERAL: [&str; 2] = ["wp_viewporter", "wl_subcompositor"];

/// A window's surface, or a part of one.
#[derive(Debug)]
pub(in crate::sink::window) struct Face {
    shared: Arc<Shared>,
    answers: Arc<Mutex<Answers>>,
    is_ending: Arc<AtomicBool>,
    listener: Option<JoinHandle<()>>,
    pub(super) globals: Globals,
    logical_size: [u32; 2],
    pub(super) surface: WlSurface,
    /// Where that is inside the window's.
    cell: Option<Cell>,
    connection: Connection,
    /// After everything that is on the connection.
    anchor: Arc<Anchor>,
}

/// What the compositor offers.
#[derive(Debug)]
pub(super) struct Globals {
    pub(super) handle: QueueHandle<Listener>,
    pub(super) shm: WlShm,
    presentation: Option<WpPresentation>,
    pub(super) order: ByteOrder,
    stretch: Stretch,
}

/// Who makes a buffer fill the window.
#[derive(Debug)]
enum Stretch {
    /// The compositor, as winit tells it to.
    ByWinit,
    /// The compositor, as we tell it to.
    ByUs(WpViewport),
    /// Nobody: a buffer has the window's size.
    No,
}

impl Face {
    /// # Errors
    /// If the compositor does not answer, or lacks what `role` needs.
    pub(in crate::sink::window) fn new(
        guest: Guest,
        shared: Arc<Shared>,
        role: Role,
    ) -> Result<Self, WindowError> {
        let Guest { surface, connection, anchor } = guest;
        let anchor = Arc::new(anchor);
        let answers = Arc::new(Mutex::new(Answers::new(true)));
        let is_ending = Arc::new(AtomicBool::new(false));
        let (tell, told) = sync_channel(1);
        let thread = {
            // The queue that the thread makes needs the anchor for as long as it is there.
            let (anchor, connection) = (Arc::clone(&anchor), connection.clone());
            let (surface, is_ending) = (surface.clone(), Arc::clone(&is_ending));
            let listener = Listener::new(Arc::clone(&shared), Arc::clone(&answers));
            thread::Builder::new().name("foreframe-listener".to_owned()).spawn(move || {
                let _anchor = anchor;
                if let Some((queue, listener)) = bind(connection, &surface, role, listener, &tell) {
                    drop((surface, tell));
                    listener.listen(queue, &is_ending);
                }
            })?
        };
        let (globals, cell) = match told.recv_timeout(ANSWER_WITHIN) {
            Ok(found) => found?,
            Err(RecvTimeoutError::Timeout) => {
                is_ending.store(true, Ordering::Relaxed);
                return Err(WindowError::NoAnswer("none in 5 s"));
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(WindowError::NoAnswer("one that is gone"));
            }
        };
        *answers.lock().unwrap_or_else(PoisonError::into_inner) =
            Answers::new(globals.presentation.is_some());
        let surface = cell.as_ref().map_or(surface, |cell| cell.surface.clone());
        debug!(order = ?globals.order, stretch = ?globals.stretch, "surface");
        Ok(Self {
            shared,
            answers,
            is_ending,
            listener: Some(thread),
            globals,
            logical_size: [0; 2],
            surface,
            cell,
            connection,
            anchor,
        })
    }

    pub(in crate::sink::window) fn feedback(&self) -> Feedback {
        self.answers.lock().unwrap_or_else(PoisonError::into_inner).mode()
    }

    pub(super) fn is_alive(&self) -> bool {
        self.surface.is_alive()
    }

    /// What a graphics driver draws on it with.
    pub(in crate::sink::window) fn target(&self) -> Target {
        Target::new(&self.surface, &self.anchor)
    }

    /// Where a picture of this size lies in a buffer for the window as it is now, which has at most
    /// `most` columns and rows.
    pub(in crate::sink::window) fn place(&self, picture: [u32; 2], most: u32) -> Placement {
        let window = self.shared.size();
        match self.globals.stretch {
            Stretch::No => Placement::limited(picture, window, most),
            Stretch::ByWinit | Stretch::ByUs(_) => Placement::stretched(picture, window, most),
        }
    }

    /// The next commit shows the picture that was planned for `planned`. With a `gate`, that is
    /// shut until the compositor wants another.
    pub(in crate::sink::window) fn before_commit(
        &mut self,
        planned: MonoTime,
        gate: Option<&Gate>,
    ) {
        self.ask(planned);
        if let Some(gate) = gate {
            gate.shut();
            self.surface.frame(&self.globals.handle, gate.clone());
        }
        self.stretch();
    }

    /// A picture was committed; false if the compositor takes nothing any more.
    pub(in crate::sink::window) fn after_commit(&mut self) -> bool {
        if let Some(cell) = &mut self.cell {
            cell.put(self.shared.left());
        }
        self.flush()
    }

    /// Commits what waits for a commit, and nothing if nothing does: when a driver took a frame and
    /// did not commit it, word of that frame is still to be asked for.
    pub(in crate::sink::window) fn commit_rest(&self) -> bool {
        self.surface.commit();
        self.flush()
    }

    /// Makes what was presented last fill the window as it is now.
    pub(super) fn stretch_shown(&mut self) -> bool {
        self.stretch();
        self.surface.commit();
        self.flush()
    }

    /// Makes the next commit fill the window.
    fn stretch(&mut self) {
        let Stretch::ByUs(viewport) = &self.globals.stretch else { return };
        // winit sets the scale of a surface that it makes no viewport for; ours makes up for it.
        self.surface.set_buffer_scale(1);
        let logical_size = self.shared.logical_size();
        if logical_size != self.logical_size && logical_size.iter().all(|&length| length > 0) {
            let [width, height] = logical_size.map(u32::cast_signed);
            viewport.set_destination(width, height);
            self.logical_size = logical_size;
        }
    }

    /// For word of the next commit.
    fn ask(&self, planned: MonoTime) {
        let handle = &self.globals.handle;
        let (ask, change) = self.answers.lock().unwrap_or_else(PoisonError::into_inner).on_frame();
        change.into_iter().for_each(|change| self.shared.tell(change.into()));
        if let Some(presentation) = self.globals.presentation.as_ref().filter(|_| ask.feedback) {
            presentation.feedback(&self.surface, handle, planned);
        }
        if ask.callback {
            self.surface.frame(handle, planned);
        }
    }

    fn flush(&self) -> bool {
        match self.connection.flush() {
            Ok(()) => true,
            // The rest goes out with the next frame.
            Err(WaylandError::Io(error)) if error.kind() == ErrorKind::WouldBlock => true,
            Err(error) => {
                debug!(%error, "the compositor takes nothing");
                self.shared.close(Closed::WithDisplay);
                false
            }
        }
    }
}

impl Drop for Face {
    fn drop(&mut self) {
        self.is_ending.store(true, Ordering::Relaxed);
        if let Some(listener) = self.listener.take()
            && listener.join().is_err()
        {
            warn!("the thread that listens to the compositor has panicked");
        }
        if let Stretch::ByUs(viewport) = &self.globals.stretch {
            viewport.destroy();
        }
        drop(self.cell.take());
        if let Some(presentation) = &self.globals.presentation {
            presentation.destroy();
        }
        // Without a compositor there is nothing left to destroy.
        drop(self.connection.flush());
    }
}

type Bound = (EventQueue<Listener>, Listener);
/// What the compositor offers, and the surface inside the window's where one was asked for.
type Found = (Globals, Option<Cell>);

/// Binds what the surface needs, tells it, and gives back what goes on listening.
fn bind(
    connection: Connection,
    window: &WlSurface,
    role: Role,
    mut listener: Listener,
    tell: &SyncSender<Result<Found, WindowError>>,
) -> Option<Bound> {
    let found = registry_queue_init::<Listener>(&connection)
        .map_err(|error| WindowError::NoDisplay(error.to_string()))
        .and_then(|(list, mut queue)| {
            let handle = queue.handle();
            let shm: WlShm =
                list.bind(&handle, 1..=1, ()).map_err(|_| WindowError::Lacks("wl_shm"))?;
            let has = |name: &str| {
                list.contents().with_list(|all| all.iter().any(|one| one.interface == name))
            };
            if role != Role::Whole
                && let Some(lacking) = FOR_SEVERAL.into_iter().find(|name| !has(name))
            {
                return Err(WindowError::Lacks(lacking));
            }
            let presentation: Option<WpPresentation> = list.bind(&handle, 1..=1, ()).ok();
            let viewporter: Option<WpViewporter> = list.bind(&handle, 1..=1, ()).ok();
            let cell = match role {
                Role::Whole | Role::Behind => None,
                Role::Part => Some(Cell::new(&list, &handle, window)?),
            };
            let surface = cell.as_ref().map_or(window, |cell| &cell.surface);
            let stretch = match viewporter {
                Some(_) if cell.is_none() && has(FRACTIONAL_SCALE) => Stretch::ByWinit,
                Some(viewporter) => Stretch::ByUs(viewporter.get_viewport(surface, &handle, ())),
                None => Stretch::No,
            };
            // Formats and the clock have come when this returns.
            queue
                .roundtrip(&mut listener)
                .map_err(|error| WindowError::NoDisplay(error.to_string()))?;
            let order = if listener.knows_rgbx { ByteOrder::Rgbx } else { ByteOrder::Bgrx };
            Ok((queue, (Globals { handle, shm, presentation, order, stretch }, cell)))
        });
    match found {
        Ok((queue, found)) => {
            tell.send(Ok(found)).ok()?;
            Some((queue, listener))
        }
        Err(error) => {
            // Whoever asked may have given up.
            drop(tell.send(Err(error)));
            None
        }
    }
}
