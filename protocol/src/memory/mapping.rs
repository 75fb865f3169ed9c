//! One mapping of a whole memfd, unmapped when dropped.

use std::os::fd::BorrowedFd;
use std::ptr::NonNull;

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::error::{Error, Result};

/// Address and length of a mapping that this value owns.
#[derive(Debug)]
pub(super) struct Mapping {
    start: NonNull<u8>,
    len: usize,
}

// SAFETY: a mapping belongs to the process, not to a thread; the two types that hold one decide
// who may access its bytes.
unsafe impl Send for Mapping {}
// SAFETY: as above; a shared reference gives nothing but address and length.
unsafe impl Sync for Mapping {}

impl Mapping {
    /// Maps `len` bytes of `fd` from its start.
    pub(super) fn new(fd: BorrowedFd<'_>, len: u64, prot: ProtFlags) -> Result<Self> {
        let Ok(len) = usize::try_from(len) else {
            return Err(Error::memory("size", "at most the address space", len));
        };
        if len == 0 {
            return Err(Error::memory("size", "at least one byte", 0));
        }
        // SAFETY: no address is asked for, so no other mapping is replaced, and nothing of the
        // language's own memory is affected.
        let start = unsafe { mmap(std::ptr::null_mut(), len, prot, MapFlags::SHARED, fd, 0) }
            .map_err(Error::os("map shared memory"))?;
        let start = NonNull::new(start.cast()).expect("mmap never maps address 0 unasked");
        Ok(Self { start, len })
    }

    pub(super) fn start(&self) -> NonNull<u8> {
        self.start
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: address and length are those of the mapping that `new` made, and whoever could
        // reach its bytes held a reference to `self`.
        let unmapped = unsafe { munmap(self.start.as_ptr().cast(), self.len) };
        debug_assert!(unmapped.is_ok(), "a whole mapping can always be unmapped");
    }
}
