//! Memory that the compositor reads pictures from: one file in memory, cut into buffers.
//!
//! A picture is written with `pwrite`, not through a mapping: the compositor has the file as well
//! and could write to it, so no slice of it is formed, and the engine cannot draw in it. A seal
//! that keeps others from writing would keep most compositors from mapping it at all. So one copy
//! remains, and what is to be converted is converted on the way. What lies around the picture is
//! zero from the start.

use std::fs::File;
use std::io;
use std::os::fd::AsFd as _;
use std::os::unix::fs::FileExt as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use foreframe_engine::{ColorPlane, Rect};
use foreframe_protocol::memory::create_memfd;
use wayland_client::QueueHandle;
use wayland_client::protocol::wl_buffer::WlBuffer;
use wayland_client::protocol::wl_shm::{Format, WlShm};

use super::listener::Listener;
use crate::sink::window::placement::Placement;
use crate::sink::window::texels::{ByteOrder, Picture, Texels};

/// Buffers of a window: one on the screen, one waiting for its refresh, one being written, and one
/// that the compositor is slow to give back.
pub(super) const BUFFERS: usize = 4;
/// Bytes that are converted at once: they are still in the nearest cache when they are written.
const BAND_BYTES: usize = 128 * 1024;

/// The buffers of one size.
#[derive(Debug)]
pub(super) struct Pool {
    file: File,
    pub(super) placement: Placement,
    buffers: Vec<Buffer>,
    band: Band,
}

/// Rows of a buffer that are converted at once. What is beside the picture is zero and stays so.
#[derive(Debug)]
struct Band(Vec<u8>);

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
        Ok(Self { file, placement, buffers, band: Band::new(&placement) })
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
        &mut self,
        index: usize,
        texels: &mut Texels,
        frame: &ColorPlane,
    ) -> io::Result<()> {
        let start = (index * self.placement.byte_len()) as u64;
        let picture = texels.picture(frame, &self.placement);
        self.band.write(&self.file, start, &self.placement, &picture)
    }

    /// Its buffers, for when another pool takes its place: the compositor may still have some.
    pub(super) fn into_buffers(self) -> Vec<Buffer> {
        self.buffers
    }
}

impl Band {
    fn new(placement: &Placement) -> Self {
        let row = placement.row_len();
        let rows = (BAND_BYTES / row).clamp(1, placement.picture.height.max(1) as usize);
        Self(vec![0; rows * row])
    }

    /// Writes a picture to its place in the buffer that begins at `start`.
    fn write(
        &mut self,
        file: &File,
        start: u64,
        placement: &Placement,
        picture: &Picture<'_>,
    ) -> io::Result<()> {
        let Rect { x, y, width, height } = placement.picture;
        let row_len = placement.row_len();
        let at = |row: u32| start + (u64::from(y) + u64::from(row)) * row_len as u64;
        if let Some(bytes) = picture.as_it_is().filter(|_| width == placement.buffer[0]) {
            return file.write_all_at(bytes, at(0));
        }
        let mut first = 0;
        while first < height {
            let rows = self.0.chunks_exact_mut(row_len).zip(first..height);
            let mut next = first;
            for (row, y) in rows {
                picture.draw_row(y, &mut row[x as usize * 4..][..width as usize * 4]);
                next = y + 1;
            }
            file.write_all_at(&self.0[..(next - first) as usize * row_len], at(first))?;
            first = next;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use foreframe_engine::StreamFormat;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_buffer_has_the_picture_in_its_place_and_black_around_it(
            size in [1_u32..300, 1_u32..300],
            window in [1_u32..900, 1_u32..900],
            is_scaled: bool,
            is_bgr: bool,
            first in 0_u64..2,
        ) {
            let placement = match is_scaled {
                true => Placement::scaled(size, window),
                false => Placement::padded(size, window),
            };
            let order = if is_bgr { ByteOrder::Bgrx } else { ByteOrder::Rgbx };
            let mut texels = Texels::new(&StreamFormat::rgba8(size[0], size[1]), order);
            let mut file = File::from(create_memfd("test").expect("memory"));
            let bytes = placement.byte_len();
            file.set_len(2 * bytes as u64).expect("memory");
            let mut expected = vec![0; 2 * bytes];
            let mut band = Band::new(&placement);
            // Different in every byte, one after the other into the two buffers.
            for (index, offset) in [(first, 1), (1 - first, 2)] {
                let mut frame = ColorPlane::new(StreamFormat::rgba8(1, 1).color, size[0], size[1]);
                for (at, byte) in frame.as_mut_bytes().iter_mut().enumerate() {
                    *byte = u8::try_from(at % 251 + offset).expect("at most 252");
                }
                let picture = texels.picture(&frame, &placement);
                let start = index * bytes as u64;
                band.write(&file, start, &placement, &picture).expect("memory");
                let row_len = placement.row_len();
                let Rect { x, y, width, height } = placement.picture;
                for row in 0..height {
                    let from = start as usize + (y + row) as usize * row_len + x as usize * 4;
                    picture.draw_row(row, &mut expected[from..][..width as usize * 4]);
                }
            }
            let mut written = Vec::new();
            file.read_to_end(&mut written).expect("memory");
            prop_assert!(written == expected, "{placement:?}");
        }
    }
}
