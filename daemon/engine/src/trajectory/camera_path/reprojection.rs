//! Where a still world point that one camera sees at a pixel lies in the picture of another.
//!
//! With (x, y) the pixel, q = 1 / w the inverse of the distance along the view axis, and K the rows
//! of the projection that make clip x, y and w of a view-space point p:
//!
//! ```text
//! (1) w (ndc_x, ndc_y, 1) = K (p, 1)         so p / w = K3^-1 ((ndc_x, ndc_y, 1) - q k)
//! (2) (X, Y, W) = K' M (p / w, q)            M = view' view^-1, K' of the other camera
//! (3) x' = X / W, y' = Y / W                 after scaling from ndc to pixels
//! ```
//!
//! K3 is the left 3x3 of K and k its last column. All of it is one 3x4 matrix on (x, y, 1, q), so
//! the sky, q = 0, needs no special case. Clip z takes no part: its range does not matter.

use glam::{DMat3, DMat4, DVec3, DVec4, Vec4};

use crate::key::Camera;
use crate::plane::Rect;

/// (1) to (3) as one matrix.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reprojection {
    /// Rows of X, Y and W.
    rows: [Vec4; 3],
}

/// What unprojects pixels of one camera: (1).
#[derive(Clone, Copy, Debug)]
pub(super) struct Unprojection {
    /// Takes (x, y, 1, q) to (p / w, q).
    from_pixel: [DVec4; 4],
}

impl Unprojection {
    /// Of `camera`, whose picture is `valid`. None where its projection cannot be inverted.
    pub(super) fn new(camera: &Camera, valid: Rect) -> Option<Self> {
        let (k3, k) = rows_of(camera);
        let inverse = k3.inverse();
        if k3.determinant() == 0.0 || !inverse.is_finite() {
            return None;
        }
        let [sx, sy, ox, oy] = ndc_from_pixel(valid);
        let column = |v: DVec3| (inverse * v).extend(0.0);
        let from_q = (inverse * -k).extend(1.0);
        Some(Self {
            from_pixel: [
                column(DVec3::new(sx, 0.0, 0.0)),
                column(DVec3::new(0.0, sy, 0.0)),
                column(DVec3::new(ox, oy, 1.0)),
                from_q,
            ],
        })
    }
}

impl Reprojection {
    /// From the pixels of `from` to those of `camera`'s projection after `motion`, view to view.
    pub(super) fn new(
        from: &Unprojection,
        motion: &DMat4,
        camera: &Camera,
        valid: Rect,
    ) -> Option<Self> {
        let (k3, k) = rows_of(camera);
        let [sx, sy, ox, oy] = ndc_from_pixel(valid);
        // Pixels from ndc, homogeneous.
        let scale = DMat3::from_cols(
            DVec3::new(1.0 / sx, 0.0, 0.0),
            DVec3::new(0.0, 1.0 / sy, 0.0),
            DVec3::new(-ox / sx, -oy / sy, 1.0),
        );
        let columns = from.from_pixel.map(|p| {
            let moved = *motion * p;
            scale * (k3 * moved.truncate() + k * moved.w)
        });
        let row = |pick: fn(DVec3) -> f64| {
            DVec4::new(pick(columns[0]), pick(columns[1]), pick(columns[2]), pick(columns[3]))
                .as_vec4()
        };
        let rows = [row(|c| c.x), row(|c| c.y), row(|c| c.z)];
        rows.iter().all(|row| row.is_finite()).then_some(Self { rows })
    }

    /// Where the point seen at pixel (`x`, `y`) at inverse distance `q` lies; NaN where it is not
    /// in front of the camera.
    #[must_use]
    #[inline(always)]
    pub fn place(&self, at: [f32; 2], q: f32) -> [f32; 2] {
        let [to_x, to_y, to_w] = self.homogeneous(at, q);
        // Written so that NaN fails it, and without a branch.
        let w = if to_w > 1e-6 { to_w } else { f32::NAN };
        [to_x / w, to_y / w]
    }

    /// w' (x', y', 1) of the point seen at a pixel at inverse distance `q`, which is not 0, with w'
    /// its distance from the other camera: linear in where the point is.
    #[must_use]
    #[inline(always)]
    pub fn scaled(&self, at: [f32; 2], q: f32) -> [f32; 3] {
        let [x, y, w] = self.homogeneous(at, q);
        [x / q, y / q, w / q]
    }

    #[inline(always)]
    fn homogeneous(&self, [x, y]: [f32; 2], q: f32) -> [f32; 3] {
        let part = |row: &Vec4| row.x * x + row.y * y + row.z + row.w * q;
        [part(&self.rows[0]), part(&self.rows[1]), part(&self.rows[2])]
    }
}

/// K3 and k of (1).
fn rows_of(camera: &Camera) -> (DMat3, DVec3) {
    let p = camera.projection.map(f64::from);
    let column = |c: usize| DVec3::new(p[4 * c], p[4 * c + 1], p[4 * c + 3]);
    (DMat3::from_cols(column(0), column(1), column(2)), column(3))
}

/// Scale and offset, x and y, from pixel to ndc, whose y points up.
fn ndc_from_pixel(valid: Rect) -> [f64; 4] {
    let [x, y, width, height] = [valid.x, valid.y, valid.width, valid.height].map(f64::from);
    let (sx, sy) = (2.0 / width, -2.0 / height);
    [sx, sy, (0.5 - x) * sx - 1.0, (0.5 - y) * sy + 1.0]
}
