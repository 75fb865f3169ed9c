//! Pictures through shared memory: a free buffer, the picture in it, and the commit.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use foreframe_engine::{ColorPlane, MonoTime, StreamFormat};
use tracing::{debug, warn};

use super::face::{Face, Globals};
use super::pool::{Buffer, Pool};
use crate::sink::window::placement::MOST;
use crate::sink::window::texels::Texels;

/// A surface that the CPU draws on.
#[derive(Debug)]
pub(in crate::sink::window) struct WaylandSurface {
    texels: Texels,
    pool: Option<Pool>,
    /// Buffers of former sizes that the compositor has not given back.
    retired: Vec<Buffer>,
    /// Pictures for which no buffer was free.
    without_buffer: u64,
    face: Arc<Mutex<Face>>,
}

impl WaylandSurface {
    pub(in crate::sink::window) fn new(face: Arc<Mutex<Face>>, format: &StreamFormat) -> Self {
        let order = face.lock().unwrap_or_else(PoisonError::into_inner).globals.order;
        Self {
            texels: Texels::new(format, order),
            pool: None,
            retired: Vec::new(),
            without_buffer: 0,
            face,
        }
    }

    /// Commits `frame`, if there is a buffer for it.
    pub(in crate::sink::window) fn present(
        &mut self,
        planned: MonoTime,
        frame: &ColorPlane,
    ) -> bool {
        let mut face = self.face.lock().unwrap_or_else(PoisonError::into_inner);
        let size = [frame.width(), frame.height()];
        if !face.is_alive() || !fit(&mut self.pool, &mut self.retired, &face, size) {
            return false;
        }
        let Some(pool) = &mut self.pool else { return false };
        let Some(index) = pool.free() else {
            self.without_buffer += 1;
            return false;
        };
        if let Err(error) = pool.write(index, &mut self.texels, frame) {
            warn!(%error, "a picture did not reach its buffer");
            return false;
        }
        face.before_commit(planned, None);
        let Buffer { proxy, is_busy } = pool.buffer(index);
        is_busy.store(true, Ordering::Relaxed);
        let [width, height] = pool.placement.buffer.map(u32::cast_signed);
        face.surface.attach(Some(proxy), 0, 0);
        face.surface.damage_buffer(0, 0, width, height);
        face.surface.commit();
        face.after_commit()
    }

    /// Makes what was presented last fill the window as it is now, with no buffer more; false where
    /// nothing was.
    pub(super) fn stretch_shown(&mut self) -> bool {
        let mut face = self.face.lock().unwrap_or_else(PoisonError::into_inner);
        face.is_alive() && self.pool.is_some() && face.stretch_shown()
    }
}

/// Makes buffers of the window's shape, if there are none.
fn fit(pool: &mut Option<Pool>, retired: &mut Vec<Buffer>, face: &Face, picture: [u32; 2]) -> bool {
    retired.retain(|buffer| {
        let is_free = buffer.is_free();
        if is_free {
            buffer.proxy.destroy();
        }
        !is_free
    });
    let placement = face.place(picture, MOST);
    if pool.as_ref().is_some_and(|pool| pool.placement == placement) {
        return true;
    }
    let Globals { shm, handle, order, .. } = &face.globals;
    match Pool::allocate(shm, handle, placement, *order) {
        Ok(new) => {
            debug!(?placement, "buffers");
            let former = pool.replace(new);
            retired.extend(former.into_iter().flat_map(Pool::into_buffers));
            true
        }
        Err(error) => {
            warn!(%error, "there are no buffers for the window");
            false
        }
    }
}

impl Drop for WaylandSurface {
    fn drop(&mut self) {
        let buffers = self.pool.take().map(Pool::into_buffers).unwrap_or_default();
        self.retired.drain(..).chain(buffers).for_each(|buffer| buffer.proxy.destroy());
        if self.without_buffer > 0 {
            warn!(
                pictures = self.without_buffer,
                "the compositor kept all buffers for some pictures"
            );
        }
    }
}
