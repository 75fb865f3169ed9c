//! What matrices say: the meaning of a depth buffer, and the motion that a moving camera causes.
//!
//! Matrices are column-major, clip = projection * view * p, and clip z runs from 0 to w, as in
//! Vulkan, Direct3D, Metal and WebGPU. With w the distance along the view axis, a perspective
//! depth buffer holds
//!
//! ```text
//! (1) d = a + b / w      a = P[2][2] / P[3][2], b = P[2][3]
//! ```
//!
//! `b < 0` is a standard buffer, `b > 0` a reversed one; the far plane may be at infinity (a = 1
//! standard, a = 0 reversed). The image point of a still world point in the older frame is
//!
//! ```text
//! (2) older = P' V' V^-1 P^-1 (x_ndc, y_ndc, a + b / w, 1)
//! ```
//!
//! which is homogeneous, so that w = infinity (the sky) needs no special case.

use glam::{DMat4, Mat4, Vec4};

use super::error::DecodeError;
use crate::format::DepthMeaning;
use crate::key::{Camera, KeyFrame};
use crate::plane::Rect;

/// What a perspective projection does to depth (1).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ProjectionDepth {
    /// `Standard` or `Reversed`.
    pub(super) meaning: DepthMeaning,
    /// `a` of (1).
    pub(super) a: f64,
    /// `b` of (1).
    pub(super) b: f64,
}

impl ProjectionDepth {
    /// Reads a projection. None for one without perspective, where `d` is linear in the distance
    /// and the matrix alone does not tell which way it runs.
    pub(super) fn from_projection(projection: &[f32; 16]) -> Option<Self> {
        let [z_from_z, w_from_z, z_from_one] =
            [projection[10], projection[11], projection[14]].map(f64::from);
        let a = z_from_z / w_from_z;
        let meaning = if z_from_one < 0.0 && a > 0.0 {
            DepthMeaning::Standard
        } else if z_from_one > 0.0 && a < 1.0 {
            DepthMeaning::Reversed
        } else {
            return None;
        };
        (a.is_finite()).then_some(Self { meaning, a, b: z_from_one })
    }

    /// Inverse distance to the near plane.
    pub(super) fn inverse_near(&self) -> f64 {
        match self.meaning {
            DepthMeaning::Reversed => (1.0 - self.a) / self.b,
            DepthMeaning::Standard | DepthMeaning::LinearView => -self.a / self.b,
        }
    }
}

/// Refuses NaN and infinity.
pub(super) fn check_camera(camera: &Camera) -> Result<(), DecodeError> {
    for (matrix, elements) in [("view", &camera.view), ("projection", &camera.projection)] {
        if let Some(&found) = elements.iter().find(|element| !element.is_finite()) {
            return Err(DecodeError::Matrix { matrix, expected: "finite elements", found });
        }
    }
    Ok(())
}

/// Displacement of still world points between two cameras.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraMotion {
    older_from_newer: Mat4,
    size: [f32; 2],
}

impl CameraMotion {
    /// Between `older` and `newer`, both checked, over an image of `size` pixels.
    pub(super) fn between(
        older: &Camera,
        newer: &Camera,
        size: [f32; 2],
    ) -> Result<Self, DecodeError> {
        let clip = |camera: &Camera| {
            Mat4::from_cols_array(&camera.projection).as_dmat4()
                * Mat4::from_cols_array(&camera.view).as_dmat4()
        };
        let newer_clip: DMat4 = clip(newer);
        let inverse = newer_clip.inverse();
        if !inverse.is_finite() {
            return Err(DecodeError::Matrix {
                matrix: "projection * view",
                expected: "one that can be inverted, so that the camera's motion can be added",
                found: 0.0,
            });
        }
        Ok(Self { older_from_newer: (clip(older) * inverse).as_mat4(), size })
    }

    /// Newer minus older position in pixels, y down, of the still point seen at (`u`, `v`), 0 to 1
    /// across the image with v down, whose clip z / w is `z`. NaN where it was not in front of the
    /// older camera.
    pub(super) fn displacement(&self, u: f32, v: f32, z: f32) -> [f32; 2] {
        let ndc = [2.0 * u - 1.0, 1.0 - 2.0 * v];
        let older = self.older_from_newer * Vec4::new(ndc[0], ndc[1], z, 1.0);
        if older.w.is_nan() || older.w <= 0.0 {
            return [f32::NAN; 2];
        }
        let moved = [ndc[0] - older.x / older.w, older.y / older.w - ndc[1]];
        [moved[0] * 0.5 * self.size[0], moved[1] * 0.5 * self.size[1]]
    }
}

/// The same of a key as it was decoded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StillWorld {
    motion: CameraMotion,
    depth: ProjectionDepth,
    inverse_distance_per_depth_key: f32,
}

impl StillWorld {
    /// Between what `key`'s motion points back to, which is `older`, and `key`. None unless cameras
    /// and depth say where the world is.
    pub(crate) fn between(older: &KeyFrame, key: &KeyFrame) -> Option<Self> {
        let newer = key.camera?;
        let size = super::size(key.valid);
        let motion = CameraMotion::between(&key.motion_from_camera.or(older.camera)?, &newer, size);
        Some(Self {
            motion: motion.ok()?,
            depth: ProjectionDepth::from_projection(&newer.projection)?,
            inverse_distance_per_depth_key: key.inverse_distance_per_depth_key?,
        })
    }

    /// Newer minus older position, pixels, of the still point at pixel `x`, `y` of the image
    /// `valid`.
    #[expect(clippy::cast_precision_loss, reason = "sizes up to 8192 are exact")]
    #[expect(clippy::cast_possible_truncation, reason = "depth as the buffer holds it")]
    pub(crate) fn displacement(&self, valid: Rect, [x, y]: [f32; 2], depth_key: u32) -> [f32; 2] {
        let [width, height] = super::size(valid);
        let (u, v) = (x + 0.5 - valid.x as f32, y + 0.5 - valid.y as f32);
        let inverse_distance =
            f64::from(self.inverse_distance_per_depth_key) * f64::from(depth_key);
        let z = self.depth.a + self.depth.b * inverse_distance;
        self.motion.displacement(u / width, v / height, z as f32)
    }
}
