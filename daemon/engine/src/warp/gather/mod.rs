//! Backward warp, the plain baseline: each pixel reads the key against its own motion.
//!
//! ```text
//! (1) out(x) = key(x - v(x) phase)
//! ```
//!
//! with v of the field cell that holds pixel x. It is wrong by construction wherever motion
//! changes within its own length (the motion of what *was* here, not of what comes here), which
//! is what the scatter of the linear method repairs.
//!
//! Edges: positions outside the valid rectangle read its border. Phase 0 gives the key. Without a
//! motion field the key is held. Exactness: `Exact`.

mod cpu;
mod gpu;

pub use cpu::warp_gather;
pub use gpu::GATHER;
