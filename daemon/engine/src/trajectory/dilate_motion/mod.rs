//! Dilation: each cell takes the motion of the nearest surface in its 3x3 neighbourhood.
//!
//! Colour is anti-aliased and depth is not: a pixel whose centre misses a surface by a fraction
//! still shows some of it. Letting the nearest surface's motion reach one cell beyond it carries
//! such pixels along, instead of leaving a ghost of the outline behind.
//!
//! ```text
//! (1) nearest = the cell of the largest depth key in 3x3, the first in reading order among equals
//! (2) source  = nearest if depth(nearest) - depth(centre) > depth(nearest) >> 8, else centre
//! (3) speed   = |d(source)| / pixels_per_degree / span      in degrees per second
//! (4) v       = 32 d(source) tracked_share(speed), rounded half away from zero
//! ```
//!
//! (2) keeps a slanted surface its own motion: there a neighbour is nearer too, but no edge.
//! (3) and (4) with a share of 1 where `pixels_per_degree` is None. Damping: Didyk, Eisemann,
//! Ritschel, Myszkowski, Seidel 2010, "Perceptually-motivated real-time temporal upsampling of 3D
//! content for high-refresh-rate displays", section 6.
//!
//! Domain: any floats. NaN, infinity and more than 1023 pixels become
//! [`crate::key::Velocity::UNTRACKABLE`]. Without depth (an empty plane) the source is the centre.
//! Edges: cells outside the grid do not take part. Exactness: f32 until (4), the same operations in
//! the same order on every machine; (1) and (2) are integers.

mod cpu;

use crate::time::MonoSpan;

pub use cpu::{dilate_cells, dilate_depth_row, dilate_motion, quantise_row};

/// Largest displacement that a velocity holds, pixels per span.
pub const MAX_DISPLACEMENT_PX: f32 = 1023.0;

/// What the kernel needs beside the planes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DilateParams {
    /// Output pixels per degree of visual angle; None leaves motion undamped.
    pub pixels_per_degree: Option<f32>,
    /// Time that the displacements span, positive.
    pub span: MonoSpan,
}
