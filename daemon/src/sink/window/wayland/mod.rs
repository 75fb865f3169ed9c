//! Pictures on Wayland: own shared memory on the desktop window's surface, with feedback.
//!
//! - [`guest`]: the way onto the surface; all `unsafe` of windows
//! - [`surface`]: buffers, commits, and what is asked for with each
//! - [`pool`]: memory that the compositor reads
//! - [`cell`]: a surface inside the window's, where streams share one
//! - [`backdrop`]: what is behind those
//! - [`answers`]: what to ask for, by how it answered so far
//! - [`listener`]: what the compositor says, on a thread of its own

mod answers;
mod backdrop;
mod cell;
mod guest;
mod listener;
mod pool;
mod surface;

pub(super) use backdrop::Backdrop;
pub(super) use cell::Role;
pub(super) use guest::Guest;
pub(super) use surface::WaylandSurface;
