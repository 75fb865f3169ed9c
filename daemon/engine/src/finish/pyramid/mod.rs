//! The blur of a picture: down twice by a binomial filter, and smoothly up again.
//!
//! Over the valid rectangle of w x h pixels, per channel, beyond a border the pixel at the border
//! again, with levels of ceil(w / 2) x ceil(h / 2) and of half of that:
//!
//! ```text
//! (1) half(i, j)    = (sum of [1 2 1] x [1 2 1] * picture(2i + -1..1, 2j + -1..1) + 8) >> 4
//! (2) quarter(i, j) = the same of half
//! (3) up(x, y)      = (sum over the weights of both axes * coarse + 32) >> 6
//!                     even x: [1 6 1] around x / 2;  odd x: [4 4] of x / 2 and the next
//! (4) smooth        = up(quarter), of the size of half
//! ```
//!
//! The blur is up(smooth), which [`super::compensate`] makes as it goes. (1) is the 3-tap binomial
//! pyramid of Didyk et al. 2010, section 6; (3) is the subdivision of the cubic B-spline (Lane and
//! Riesenfeld 1980), which takes the place of a tri-cubic read. The whole has the standard
//! deviation of [`SIGMA_PX`]: 0.5 + 2 px^2 on the way down, 4 + 1 on the way up. Weights add up to
//! a power of two, so that a flat picture comes back. Exactness: `Exact`.

mod cpu;
mod gpu;

pub use cpu::pyramid;
pub(super) use cpu::up_row;
pub use gpu::PYRAMID;

use crate::color::ColorPlane;

/// Standard deviation of the blur in pixels, the root of 7.5. Denes 2020, section 5.2.3, uses 2.5.
pub const SIGMA_PX: f64 = 2.738_612_787_525_831;

/// The levels of one picture, of its format.
#[derive(Debug, Default)]
pub struct Pyramid {
    half: ColorPlane,
    quarter: ColorPlane,
    /// (4).
    pub(super) smooth: ColorPlane,
}
