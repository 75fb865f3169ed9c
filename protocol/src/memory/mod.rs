//! Pools of shared pixels: sealed memfds that one side writes and the other only reads.
//!
//! The writer ([`WritablePool`]) allocates, touches and maps every page and then seals `GROW`,
//! `SHRINK`, `FUTURE_WRITE` and `SEAL`, so that nobody, not even itself, can ever change the size,
//! punch a hole or map it for writing again. The reader ([`ReadOnlyPool`]) verifies all of that
//! before it maps. Hence
//!
//! - no read of a pool can fail or fault, so nobody needs a handler for SIGBUS;
//! - no read of a pool can allocate memory at the reader's cost;
//! - only the writer's own mapping can change a byte, so it may form `&mut [u8]`; the reader never
//!   forms a slice and copies by raw pointer.
//!
//! This is the only module of the crate with unsafe code. Unmapping a large pool takes
//! milliseconds and happens when its owner is dropped: drop it where that does no harm.

mod mapping;
mod read_only;
mod seals;
mod writable;

pub use read_only::ReadOnlyPool;
pub use seals::{REQUIRED_SEALS, verify};
pub use writable::{SlotMemory, WritablePool, create_memfd};
