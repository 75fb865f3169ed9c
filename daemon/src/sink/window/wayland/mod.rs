//! Pictures on Wayland, with feedback: in shared memory of our own, or as a graphics driver draws.
//!
//! - [`guest`]: the way onto the surface; all `unsafe` of windows
//! - [`face`]: the surface, and what is asked for with each commit, whoever draws
//! - [`surface`]: a surface that the CPU draws on
//! - [`pool`]: memory that the compositor reads
//! - [`cell`]: a surface inside the window's, where streams share one
//! - [`backdrop`]: what is behind those
//! - [`answers`]: what to ask for, by how it answered so far
//! - [`listener`]: what the compositor says, on a thread of its own

mod answers;
mod backdrop;
mod cell;
mod face;
mod guest;
mod listener;
mod pool;
mod surface;

pub(super) use backdrop::Backdrop;
pub(super) use cell::Role;
pub(super) use face::Face;
pub(super) use guest::Guest;
pub(super) use listener::Gate;
pub(super) use surface::WaylandSurface;
