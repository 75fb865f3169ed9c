//! The snapped grid: a coarse mesh over the key, pulled onto motion discontinuities, then warped.
//!
//! Source: Didyk et al. 2010, "Perceptually-motivated real-time temporal upsampling of 3D content
//! for high-refresh-rate displays", sections 5.1 and 6.
//!
//! Steps, one file each:
//! 1. [`pyramid`]: per neighbourhood of about 8x8 pixels, the largest gradient of the motion field
//!    and where it was;
//! 2. [`mesh`]: one vertex per neighbourhood, put where its maximum was, a fixed frame of vertices
//!    on the border, and two triangles per cell;
//! 3. [`triangle`]: edge functions and texture gradients of one moved triangle;
//! 4. [`raster`]: triangles into bands of target rows, fold-overs by depth, colour by
//!    [`super::sample`].
//!
//! Maths. A vertex at `s` (1/16 px) with velocity `v` goes to
//! `m = s + round((v * p + 256) >> 9)` (1) with `p` the phase in Q12. Inside a triangle the source
//! position is the affine map that takes its three `m` to its three `s` (2). A pixel whose centre
//! lies in several triangles takes, of those with depth `d >= D - (D >> 8)`, `D` being the largest
//! (nearest) of them, the one with the smallest cell id (3).
//!
//! **No pixel stays empty.** The mesh is closed and its border stays where it is, so the warp maps
//! the rectangle onto itself with winding number 1: at every point, triangles that kept their
//! orientation outnumber those that were turned over by exactly one (4). Turned-over triangles are
//! therefore not drawn at all, disocclusions are stretched by construction, and where no
//! triangle is turned over each pixel has exactly one candidate and (3) needs no depth.
//!
//! Exactness: `Exact`. Integers only, and (3) does not depend on the order of drawing. Phase 0 and
//! zero motion give the key's bytes. Every quantity but one fits 32 bits: the texture gradient is
//! one 64-bit quotient per triangle and axis, which a shader gets by shift and subtract.
//!
//! Departures from the paper:
//! - the border vertices are a frame of their own around one free vertex per neighbourhood,
//!   instead of the outermost free vertices: what is pinned is half as wide;
//! - turned-over triangles are culled, see (4), and depth is constant in a triangle;
//! - the gradient counts only on the nearer side of a discontinuity, see [`pyramid`];
//! - of the two diagonals of a cell, the one along which motion differs less is cut;
//! - a vertex moves at most 504 px, which keeps the edge functions inside 32 bits;
//! - blur and its compensation are not part of the warp.

mod gpu;
mod mesh;
mod pyramid;
mod raster;
#[cfg(test)]
mod tests;
mod triangle;

pub use gpu::{GRID, LANES, MeshWords, TRIANGLE_BYTES};
pub use mesh::FARTHEST;

use crate::color::{ColorPlane, Texel};
use crate::key::KeyFrame;
use crate::phase::Phase;
use crate::plane::Plane;
use mesh::Mesh;
use raster::Bands;

/// Buffers that [`warp_grid`] reuses, and the mesh of one key: it is snapped with the first frame
/// after [`GridScratch::forget_key`] and serves the frames that follow. Allocates only when a key
/// is larger than all before it.
#[derive(Debug, Default)]
pub struct GridScratch {
    mesh: Mesh,
    is_snapped: bool,
    bands: Bands,
}

impl GridScratch {
    /// The next frame is of another key. To be called whenever the key changes.
    pub fn forget_key(&mut self) {
        self.is_snapped = false;
    }
}

/// Makes the in-between frame at `phase` after `key` into `out`.
///
/// Without usable motion the key is copied. Pixels outside `key.valid` are always copied. A key
/// without depth has the same depth everywhere. `scratch` has been told of each change of key. The
/// result does not depend on the threads of `pool`.
///
/// # Panics
/// If `out` does not have the size and format of the key's colour, or a non-empty depth does not
/// have the size of the velocity.
pub fn warp_grid(
    key: &KeyFrame,
    phase: Phase,
    out: &mut ColorPlane,
    scratch: &mut GridScratch,
    pool: &rayon::ThreadPool,
) {
    match (&key.color, out) {
        (ColorPlane::Rgba8(color), ColorPlane::Rgba8(out)) => {
            warp_texels(key, color, phase, out, scratch, pool);
        }
        (ColorPlane::Rgb10a2(color), ColorPlane::Rgb10a2(out)) => {
            warp_texels(key, color, phase, out, scratch, pool);
        }
        (ColorPlane::Rgba16f(color), ColorPlane::Rgba16f(out)) => {
            warp_texels(key, color, phase, out, scratch, pool);
        }
        (color, out) => {
            panic!("expected an output of {:?}, found {:?}", color.format(), out.format())
        }
    }
}

fn warp_texels<T: Texel>(
    key: &KeyFrame,
    color: &Plane<T>,
    phase: Phase,
    out: &mut Plane<T>,
    scratch: &mut GridScratch,
    pool: &rayon::ThreadPool,
) {
    assert_eq!((out.width(), out.height()), (color.width(), color.height()), "size of the output");
    if key.motion_from.is_none() || key.velocity.data().is_empty() || phase == Phase::ZERO {
        out.data_mut().copy_from_slice(color.data());
        return;
    }
    pool.install(|| {
        if !scratch.is_snapped {
            scratch.mesh.snap(key);
            scratch.is_snapped = true;
        }
        scratch.mesh.advance(phase);
        scratch.bands.draw(&scratch.mesh, color, key.valid, out);
    });
}
