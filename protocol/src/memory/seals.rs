//! What has to be true of a file descriptor before its memory may be read.

use std::os::fd::BorrowedFd;

use rustix::fs::{SealFlags, SeekFrom, fcntl_get_seals, fstat, fstatfs, seek};
use rustix::io::Errno;

use crate::error::{Error, Result};

/// All four, or the pool is refused. With `SHRINK` alone the writer could punch holes that the
/// reader's accesses fill again, at the reader's cost; `FUTURE_WRITE` forbids that too.
pub const REQUIRED_SEALS: SealFlags =
    SealFlags::SEAL.union(SealFlags::SHRINK).union(SealFlags::GROW).union(SealFlags::FUTURE_WRITE);

/// `f_type` of the file system behind `memfd_create`, from `linux/magic.h`.
const TMPFS_MAGIC: u64 = 0x0102_1994;
/// Unit of `st_blocks`, whatever the file system.
const STAT_BLOCK_BYTES: u64 = 512;

/// Checks that `fd` is a sealed memfd of exactly `bytes` bytes without a single hole.
///
/// The order matters: once the seals are known to be there, nothing that is looked at afterwards
/// can change. The number of blocks alone proves nothing, because blocks may have been allocated
/// behind the end of the file; so the file is searched for a hole too, which a page that was never
/// written counts as.
///
/// # Errors
/// [`Error::Memory`] with the first property that is missing.
pub fn verify(fd: BorrowedFd<'_>, bytes: u64) -> Result<()> {
    let seals = match fcntl_get_seals(fd) {
        Ok(seals) => seals,
        Err(Errno::INVAL | Errno::BADF) => {
            return Err(Error::memory("type", "a memfd", "a descriptor that cannot be sealed"));
        }
        Err(errno) => return Err(Error::os("read the seals of shared memory")(errno)),
    };
    if !seals.contains(REQUIRED_SEALS) {
        let missing = REQUIRED_SEALS.difference(seals);
        return Err(Error::memory(
            "seals",
            names(REQUIRED_SEALS),
            format!("no {}", names(missing)),
        ));
    }
    let file_system = fstatfs(fd).map_err(Error::os("look at shared memory"))?;
    let magic = u64::try_from(file_system.f_type).unwrap_or_default();
    if magic != TMPFS_MAGIC {
        // A read of huge pages can fail with SIGBUS when the reader's machine has none left.
        let found = format!("file system {magic:#x}");
        return Err(Error::memory("type", "a memfd of ordinary pages", found));
    }
    let stat = fstat(fd).map_err(Error::os("look at shared memory"))?;
    let size = u64::try_from(stat.st_size).unwrap_or_default();
    if size != bytes {
        return Err(Error::memory("size", format!("{bytes} bytes"), size));
    }
    let allocated = u64::try_from(stat.st_blocks).unwrap_or_default() * STAT_BLOCK_BYTES;
    if allocated < size {
        return Err(Error::memory("allocation", format!("{size} bytes"), allocated));
    }
    match seek(fd, SeekFrom::Hole(0)) {
        Ok(hole) if hole >= size => Ok(()),
        Ok(hole) => {
            let found = format!("a page at {hole} that was never written");
            Err(Error::memory("allocation", "every page written", found))
        }
        Err(errno) => Err(Error::os("search shared memory for holes")(errno)),
    }
}

fn names(seals: SealFlags) -> String {
    let all = [
        (SealFlags::GROW, "GROW"),
        (SealFlags::SHRINK, "SHRINK"),
        (SealFlags::FUTURE_WRITE, "FUTURE_WRITE"),
        (SealFlags::SEAL, "SEAL"),
    ];
    let named: Vec<&str> =
        all.iter().filter(|(flag, _)| seals.contains(*flag)).map(|(_, name)| *name).collect();
    named.join(", ")
}
