//! The writer's side of a pool: allocate, map, touch, seal, and hand out its slots.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;

use rustix::fs::{FallocateFlags, MemfdFlags, fallocate, fcntl_add_seals, ftruncate, memfd_create};
use rustix::io::Errno;
use rustix::mm::ProtFlags;

use super::mapping::Mapping;
use super::seals::REQUIRED_SEALS;
use crate::error::{Error, Result};
use crate::limits::{MAX_POOL_BYTES, SLOT_ALIGN};

/// A sealed pool that this process may write.
#[derive(Debug)]
pub struct WritablePool {
    fd: OwnedFd,
    mapping: Arc<Mapping>,
    slots: u32,
    slot_bytes: u64,
}

/// The bytes of one slot. It owns them: no other value gives access to them, so that slots can be
/// filled on several threads at once. The pool stays mapped as long as one of its slots lives.
#[derive(Debug)]
pub struct SlotMemory {
    mapping: Arc<Mapping>,
    index: u32,
    slot_bytes: usize,
}

impl WritablePool {
    /// Allocates `slots` slots of `slot_bytes` bytes (a multiple of 4096) and seals them. All
    /// bytes are 0 and all pages are in memory: this takes about half a millisecond per megabyte.
    ///
    /// # Errors
    /// If there is not enough memory, or the kernel is older than 5.1.
    pub fn allocate(name: &str, slots: u32, slot_bytes: u64) -> Result<(Self, Vec<SlotMemory>)> {
        let bytes = slot_bytes.saturating_mul(u64::from(slots));
        if bytes == 0 || bytes > MAX_POOL_BYTES || !slot_bytes.is_multiple_of(SLOT_ALIGN) {
            let expected =
                format!("slots of a multiple of {SLOT_ALIGN} bytes, {MAX_POOL_BYTES} in all");
            return Err(Error::memory("size", expected, format!("{slots} of {slot_bytes}")));
        }
        let fd = create_memfd(name)?;
        ftruncate(&fd, bytes).map_err(Error::os("size shared memory"))?;
        fallocate(&fd, FallocateFlags::empty(), 0, bytes)
            .map_err(Error::os("allocate shared memory"))?;
        let mapping = Mapping::new(fd.as_fd(), bytes, ProtFlags::READ | ProtFlags::WRITE)?;
        // SAFETY: the mapping is writable, has this length, and nobody else knows of it yet.
        // Writing each page here makes it present, so that no frame pays for the first touch.
        unsafe { mapping.start().write_bytes(0, mapping.len()) };
        fcntl_add_seals(&fd, REQUIRED_SEALS).map_err(Error::os("seal shared memory"))?;

        let mapping = Arc::new(mapping);
        let slot_len = usize::try_from(slot_bytes).expect("the whole pool was mapped");
        let memory = (0..slots)
            .map(|index| SlotMemory { mapping: Arc::clone(&mapping), index, slot_bytes: slot_len })
            .collect();
        Ok((Self { fd, mapping, slots, slot_bytes }, memory))
    }

    /// The descriptor to pass to the reader.
    #[must_use]
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }

    /// How many slots it has.
    #[must_use]
    pub fn slots(&self) -> u32 {
        self.slots
    }

    /// Bytes of one slot.
    #[must_use]
    pub fn slot_bytes(&self) -> u64 {
        self.slot_bytes
    }

    /// Bytes of all slots.
    #[must_use]
    pub fn pool_bytes(&self) -> u64 {
        self.mapping.len() as u64
    }
}

impl SlotMemory {
    /// Number of the slot in its pool.
    #[must_use]
    pub fn index(&self) -> u32 {
        self.index
    }
}

impl std::ops::Deref for SlotMemory {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        let offset = self.index as usize * self.slot_bytes;
        // SAFETY: slot `index` lies inside the mapping, which lives as long as `self`, and its
        // bytes belong to this value alone: `allocate` makes one per index, it cannot be cloned,
        // and the seals let no other process map them for writing.
        unsafe {
            std::slice::from_raw_parts(self.mapping.start().as_ptr().add(offset), self.slot_bytes)
        }
    }
}

impl std::ops::DerefMut for SlotMemory {
    fn deref_mut(&mut self) -> &mut [u8] {
        let offset = self.index as usize * self.slot_bytes;
        // SAFETY: as in `deref`, and `self` is borrowed mutably.
        unsafe {
            std::slice::from_raw_parts_mut(
                self.mapping.start().as_ptr().add(offset),
                self.slot_bytes,
            )
        }
    }
}

/// An empty memfd that may be sealed and is never executable. The name shows in
/// `/proc/PID/maps`.
///
/// # Errors
/// If the process has no descriptor left.
pub fn create_memfd(name: &str) -> Result<OwnedFd> {
    let name: String = name.chars().filter(|&c| c != '\0').take(100).collect();
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    match memfd_create(name.as_str(), flags | MemfdFlags::NOEXEC_SEAL) {
        // Kernels before 6.3 do not know NOEXEC_SEAL.
        Err(Errno::INVAL) => memfd_create(name.as_str(), flags),
        created => created,
    }
    .map_err(Error::os("create shared memory"))
}
