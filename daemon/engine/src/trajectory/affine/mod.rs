//! The `affine` rung: the local affine map of the motion field, continued as its own power.
//!
//! Around a point x of a surface the field is D(x + e) = D + J e. It takes where the surface was
//! one span ago to where it is; relative to x,
//!
//! ```text
//! (1) G(z) = A z + A D             A = (I - J)^-1
//! ```
//!
//! and G again leads one span on, G^(1/2) half a span. With s = sqrt(det A):
//!
//! ```text
//! (2) S = A^(1/2) = (A + s I) / sqrt(tr A + 2 s)
//! (3) d(1) = G(0) = A D,  d(1/2) = G^(1/2)(0) = (S + I)^-1 A D
//! ```
//!
//! A turn stays a turn, a zoom a zoom and a shear a shear, whatever the phase; a point of a turning
//! wheel keeps to its circle. (2): the square root of a 2x2 matrix, by Cayley and Hamilton; it
//! needs nothing but square roots, which IEEE 754 fixes to the bit.
//!
//! Both are linear in D, so that what J makes of it is worked out once per lattice point: [`fit`]
//! finds J there, eight points at a time and only where it is wanted; each cell takes the mean of
//! those around it that predict its own motion ([`field`]).

mod field;
mod fit;
mod power;
#[cfg(test)]
mod tests;

pub use field::AffineField;
