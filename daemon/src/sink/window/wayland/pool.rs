//! Memory that the compositor reads pictures from: one file in memory, cut into buffers.
//!
//! A picture is written with `pwrite`, not through a mapping: the compositor has the file as well
//! and could write to it, so no slice of it is formed. What lies around the picture is zero from
//! the start and is never written.

use std::fs::File;
use std::io;
use std::os::fd::AsFd as _;
use std::os::unix::fs::FileExt as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use foreframe_engine::ColorPlane;
use foreframe_protocol::memory::create_memfd;
use wayland_client::QueueHandle;
use wayland_client::protocol::wl_buffer::WlBuffer;
use wayland_client::protocol::wl_shm::{Format, WlShm};

use super::listener::Listener;
use crate::sink::window::placement::Placement;
use crate::sink::window::texels::{ByteOrder, Texels};

/// Buffers of a window: one on the screen, one waiting for its refresh, one being written, and one
/// that the compositor is slow to give back.
pub(super) const BUFFERS: usize = 4;

/// The buffers of one size.
#[derive(Debug)]
pub(super) struct Pool {
    file: File,
    pub(super) placement: Placement,
    buffers: Vec<Buffer>,
}

/// One of them.
#[derive(Debug)]
pub(super) struct Buffer {
    pub(super) proxy: WlBuffer,
    /// Whether the compositor has it.
    pub(super) is_busy: Arc<AtomicBool>,
}

impl Buffer {
    pub(super) fn is_free(&self) -> bool {
        !self.is_busy.load(Ordering::Acquire) // SYNC buffer-released
    }
}

impl Pool {
    pub(super) fn allocate(
        shm: &WlShm,
        handle: &QueueHandle<Listener>,
        placement: Placement,
        order: ByteOrder,
    ) -> io::Result<Self> {
        let [width, height] = placement.buffer.map(u32::cast_signed);
        let too_large = || io::Error::other("a window too large for shared memory");
        let bytes = i32::try_from(placement.byte_len()).map_err(|_| too_large())?;
        let count = i32::try_from(BUFFERS).expect("a handful");
        let pool_bytes = bytes.checked_mul(count).ok_or_else(too_large)?;
        let file = File::from(create_memfd("foreframe-window").map_err(io::Error::other)?);
        file.set_len(pool_bytes.unsigned_abs().into())?;
        let format = match order {
            ByteOrder::Rgbx => Format::Xbgr8888,
            ByteOrder::Bgrx => Format::Xrgb8888,
        };
        let pool = shm.create_pool(file.as_fd(), pool_bytes, handle, ());
        let buffer = |index| {
            let is_busy = Arc::new(AtomicBool::new(false));
            let released = Arc::clone(&is_busy);
            let proxy = pool.create_buffer(
                bytes * index,
                width,
                height,
                width * 4,
                format,
                handle,
                released,
            );
            Buffer { proxy, is_busy }
        };
        let buffers = (0..count).map(buffer).collect();
        pool.destroy();
        Ok(Self { file, placement, buffers })
    }

    /// A buffer that the compositor has given back, or never had, by its number.
    pub(super) fn free(&self) -> Option<usize> {
        self.buffers.iter().position(Buffer::is_free)
    }

    pub(super) fn buffer(&self, index: usize) -> &Buffer {
        &self.buffers[index]
    }

    /// Writes a picture into a buffer that is free.
    pub(super) fn write(
        &self,
        index: usize,
        texels: &mut Texels,
        frame: &ColorPlane,
    ) -> io::Result<()> {
        let start = (index * self.placement.byte_len()) as u64;
        let picture = self.placement.picture;
        let has_whole_rows = picture.width == self.placement.buffer[0];
        let is_unscaled = [picture.width, picture.height] == [frame.width(), frame.height()];
        match texels.as_they_are(frame).filter(|_| has_whole_rows && is_unscaled) {
            Some(bytes) => {
                let above = u64::from(picture.y) * u64::from(picture.width) * 4;
                self.file.write_all_at(bytes, start + above)
            }
            None => self.file.write_all_at(texels.draw(frame, &self.placement), start),
        }
    }

    /// Its buffers, for when another pool takes its place: the compositor may still have some.
    pub(super) fn into_buffers(self) -> Vec<Buffer> {
        self.buffers
    }
}
