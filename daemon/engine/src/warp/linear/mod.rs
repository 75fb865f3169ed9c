//! The linear method: the motion field scaled by the phase, forward.
//!
//! Scatter ([`super::scatter`]) and resolve ([`super::resolve`]) tell for each cell of the field
//! grid which surface comes there; this kernel reads the colour at full resolution. With `p` an
//! output pixel, `d(v)` the displacement of a velocity, and `near(q)` the surface that the key
//! shows at pixel q (the dilated one, so that outlines belong to what they outline):
//!
//! ```text
//! (1) smooth cell:  out(p) = key(p - d), d interpolated between the four cells around p
//! (2) broken cell:  for each cell n of 3x3 around p: q = p - d(v_n), e = |d(near(q)) - d(v_n)|
//!                   of those with e <= one cell, the ones within 1/256 of the nearest near(q);
//!                   of these the one of the smallest e, the first in reading order among equals;
//!                   out(p) = key(q) of that one
//! (3) no such n:    a hole. f = the far side. q = p - d(v_f), clamped to the valid rectangle
//!                   out(p) = key(q) where near(q) is not nearer than f
//! (4) else          out(p) = before(q - D_f) of the newest key before that has the depth of f there;
//!                   D_f how far f came since (`previous.rs`, the background memory)
//! (5) else          out(p) = key's pixel where the pixel of f closest to p came from
//! ```
//!
//! (2) asks the key itself whether the surface of a candidate is what p would show: a field coarser
//! than colour, the 2x2 footprint and dilation all reach farther than surfaces do. (3) continues
//! the far surface under what used to hide it; where it is still hidden in the key, (4) shows what
//! the keys before saw of it, and where those saw nothing either, (5) stretches its last visible
//! pixel. None reads between two pixels unless both are far, so a hole never shows the nearer
//! surface.
//!
//! Edges: reads are clamped to the valid rectangle; what comes in over the border is a hole.
//! Phase 0 gives the key. Exactness: `Exact`.

mod between;
mod broken;
mod cpu;
mod fill;
mod gpu;
mod previous;
mod scratch;
#[cfg(test)]
mod tests;

pub use cpu::{one_cell, warp_linear};
pub use gpu::{HOLES, LEVELS, LINEAR, OLDER_COLORS, PREVIOUS};
pub use previous::{DEPTH_SHIFT, MOST_KEYS, REACH, STEADY, kept_keys, linked_keys};
pub use scratch::LinearScratch;
