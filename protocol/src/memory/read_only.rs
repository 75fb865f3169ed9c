//! The reader's side of a pool.

use std::os::fd::OwnedFd;

use rustix::mm::ProtFlags;

use super::mapping::Mapping;
use super::seals::verify;
use crate::error::{Error, Result};

/// A verified pool, mapped read-only, once. Its bytes can change at any time, so they can only be
/// copied out. Dropping it unmaps, which takes milliseconds for a large pool.
#[derive(Debug)]
pub struct ReadOnlyPool {
    mapping: Mapping,
}

impl ReadOnlyPool {
    /// Verifies and maps a pool that the peer says to have `bytes` bytes. `quota` is what it may
    /// still use.
    ///
    /// # Errors
    /// [`Error::Memory`] when the quota, a seal, the size or the allocation does not fit.
    pub fn accept(fd: OwnedFd, bytes: u64, quota: u64) -> Result<Self> {
        use std::os::fd::AsFd;
        if bytes > quota {
            return Err(Error::memory("quota", format!("at most {quota} bytes"), bytes));
        }
        verify(fd.as_fd(), bytes)?;
        Ok(Self { mapping: Mapping::new(fd.as_fd(), bytes, ProtFlags::READ)? })
    }

    /// Bytes of the pool.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.mapping.len() as u64
    }

    /// Always false: an empty pool is refused.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.mapping.len() == 0
    }

    /// Checks that `len` bytes from `offset` on lie in the pool, as they then always will.
    ///
    /// # Errors
    /// [`Error::Memory`] if they do not.
    pub fn check_range(&self, offset: u64, len: u64) -> Result<()> {
        let len = usize::try_from(len).unwrap_or(usize::MAX);
        self.range(offset, len).map(|_| ())
    }

    /// Copies `out.len()` bytes from `offset` on. What the writer changes meanwhile arrives in
    /// part, and harms nothing but the picture.
    ///
    /// # Errors
    /// [`Error::Memory`] if the range leaves the pool; nothing is copied then.
    pub fn copy_to(&self, offset: u64, out: &mut [u8]) -> Result<()> {
        let start = self.range(offset, out.len())?;
        // SAFETY: `range` has put `start..start + out.len()` inside the mapping, which is
        // readable, lives as long as `self` and cannot shrink or lose pages (`verify`). `out` is
        // ordinary memory of this process, so the two do not overlap. No reference to the shared
        // bytes is formed.
        unsafe { std::ptr::copy_nonoverlapping(start, out.as_mut_ptr(), out.len()) };
        Ok(())
    }

    /// As [`copy_to`](Self::copy_to), into a vector that is emptied first and keeps its memory.
    ///
    /// # Errors
    /// [`Error::Memory`] if the range leaves the pool; the vector is empty then.
    pub fn copy_to_vec(&self, offset: u64, len: usize, out: &mut Vec<u8>) -> Result<()> {
        out.clear();
        let start = self.range(offset, len)?;
        out.reserve(len);
        // SAFETY: as in `copy_to`; `out` has room for `len` bytes, and all of them are written
        // before its length says so.
        unsafe {
            std::ptr::copy_nonoverlapping(start, out.as_mut_ptr(), len);
            out.set_len(len);
        }
        Ok(())
    }

    /// Copies `rows` rows of `row_bytes` bytes that start `stride` bytes apart, and leaves the
    /// bytes between them out. `out` is emptied first and keeps its memory.
    ///
    /// # Errors
    /// [`Error::Memory`] if a row leaves the pool, or if rows overlap.
    pub fn copy_rows_to_vec(
        &self,
        offset: u64,
        stride: u32,
        row_bytes: u32,
        rows: u32,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        out.clear();
        if stride < row_bytes {
            return Err(Error::memory("stride", format!("at least {row_bytes}"), stride));
        }
        let row_len = row_bytes as usize;
        let whole = row_len.checked_mul(rows as usize);
        let Some(whole) = whole.filter(|&whole| whole <= self.mapping.len()) else {
            return Err(Error::memory("rows", "no more than the pool holds", rows));
        };
        if stride == row_bytes {
            return self.copy_to_vec(offset, whole, out);
        }
        out.reserve(whole);
        for y in 0..rows {
            let row = offset.saturating_add(u64::from(y) * u64::from(stride));
            let start = self.range(row, row_len)?;
            let done = out.len();
            // SAFETY: as in `copy_to_vec`; `done + row_len` stays within the reserved `whole`.
            unsafe {
                std::ptr::copy_nonoverlapping(start, out.as_mut_ptr().add(done), row_len);
                out.set_len(done + row_len);
            }
        }
        Ok(())
    }

    /// Where `offset..offset + len` starts, if all of it lies in the mapping.
    fn range(&self, offset: u64, len: usize) -> Result<*const u8> {
        let end = offset.checked_add(len as u64);
        match (usize::try_from(offset), end) {
            (Ok(offset), Some(end)) if end <= self.len() => {
                // SAFETY: `offset <= end <= len`, so the result stays inside the mapping or one
                // past its end.
                Ok(unsafe { self.mapping.start().as_ptr().add(offset) })
            }
            _ => {
                let found = format!("{len} bytes at {offset}");
                Err(Error::memory("range", format!("inside {} bytes", self.len()), found))
            }
        }
    }
}
