//! The method of Falchetto, Barone, Pau 2007, *Adaptive frame rate up-conversion with motion
//! extraction from 3D space* (section 3.3): a frame between two keys, filtered from both.
//!
//! The paper's motion buffer gives for every pixel of the frame the surface that it shows, from
//! geometry. Here the newest key's field is scattered back to the frame's time: there its motion,
//! from one key to the other, is exact at both ends. With `w` the displacement of the surface that
//! comes to pixel p, newer minus older position over the whole key interval, and `s` the share of
//! the interval from the frame to the newest key:
//!
//! ```text
//! (1) q1 = p + s w                 q0 = p - (1 - s) w
//! (2) out(p) = sum of w_i c_i over the pixels around q1 in the newer and around q0 in the older key
//!     w_i = area of pixel i that a pixel at q covers, times (1 - s) in the newer, s in the older
//! (3) the older key takes part where it shows at q0 the same surface: depths within 1/8
//! (4) a hole, which the newest key shows nowhere: w of its far side, colour of the older key at q0
//!     where that shows nothing nearer, else of the newest key at q1
//! ```
//!
//! (2) is their (1.0) and (1.1) with the weights that the text below them describes: proportional
//! to the area of intersection, falling with the distance of the voxel. The two areas are bilinear
//! weights. (3) and (4) are ours: the paper does not say what a surface is made from that one key
//! hides. Of the surfaces that come to one cell the nearest is shown; a cell whose neighbours do
//! not move alike asks the newest key which of them it would show, as the linear method does.
//!
//! Their choice of the frame rate from global motion is not a matter of this kernel.
//!
//! At the keys' own times the keys are shown. Without a motion field it is the mean of both keys.
//! The shaders make it in two steps: the part of the newest key, then that of the older one over it.
//! Exactness: `Exact`.

mod cpu;
mod gpu;
mod scratch;

pub use cpu::{Between, OlderPart, SAME_SURFACE_SHIFT, older_part, warp_voxel};
pub use gpu::{SURFACES, VOXEL, VOXEL_OLDER, VoxelWords};
pub use scratch::{VoxelScratch, turn};

#[cfg(test)]
mod tests;
