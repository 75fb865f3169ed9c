//! Pictures on Wayland: own shared memory on the desktop window's surface, with feedback.
//!
//! - [`guest`]: the way onto the surface; all `unsafe` of windows
//! - [`surface`]: buffers, commits, and what is asked for with each
//! - [`pool`]: memory that the compositor reads
//! - [`answers`]: what to ask for, by how it answered so far
//! - [`listener`]: what the compositor says, on a thread of its own

mod answers;
mod guest;
mod listener;
mod pool;
mod surface;

pub(super) use guest::Guest;
pub(super) use surface::WaylandSurface;
