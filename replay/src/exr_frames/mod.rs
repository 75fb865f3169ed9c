//! Frames as OpenEXR images with JSON side-cars: how captures come from and go to other programs.
//!
//! [`import`] reads two kinds of folders: what Blender's multi-layer output looks like
//! ([`blender`]), and what [`export`] writes ([`exported`]). In both, every frame has a
//! `frame_NNNN.json` ([`sidecar`]) that names its image files, its time and its camera; a frame may
//! lack any plane but colour. Nothing is resampled: what can be stored bit for bit is.

pub mod blender;
pub mod export;
pub mod exported;
pub mod image;
pub mod import;
pub mod sidecar;
pub mod sky;
pub mod srgb;

#[cfg(test)]
mod tests;
