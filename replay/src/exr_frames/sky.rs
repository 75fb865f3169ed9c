//! True motion of the background: what is infinitely far moves as the camera turns.
//!
//! Renderers write zero vectors where no geometry is, even when the camera moves; taken at face
//! value, the sky would stick to the screen. Where both cameras are known, the motion follows:
//!
//! (1) ray = ((ndc.x + P02) / P00, (ndc.y + P12) / P11, -1), the pixel's ray in camera space;
//! (2) ray' = R' R^-1 ray, with R, R' the rotations of the view matrices now and then;
//! (3) ndc' = (P'00 ray'.x + P'02 ray'.z, P'11 ray'.y + P'12 ray'.z) / -ray'.z.
//!
//! Translation does not enter: the point is at infinity. Only multiplications and divisions in
//! `f64`, so every machine computes the same bits.

use foreframe_protocol::Camera;

/// Element of a column-major matrix.
fn at(matrix: &[f32; 16], row: usize, column: usize) -> f64 {
    f64::from(matrix[column * 4 + row])
}

/// Where the background of one frame was at the time of another.
#[derive(Clone, Copy, Debug)]
pub struct SkyMotion {
    now: [f32; 16],
    then: [f32; 16],
    /// R' R^-1.
    turn: [[f64; 3]; 3],
    size: [f64; 2],
}

impl SkyMotion {
    /// From the camera of the frame, `now`, to that of an earlier one, both perspective, for an
    /// image of `width` x `height` pixels.
    #[must_use]
    pub fn new(now: &Camera, then: &Camera, width: u32, height: u32) -> Self {
        // The inverse of a rotation is its transpose: rows of R' times rows of R.
        let turn = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                (0..3).map(|k| at(&then.view, row, k) * at(&now.view, column, k)).sum()
            })
        });
        let size = [f64::from(width), f64::from(height)];
        Self { now: now.projection, then: then.projection, turn, size }
    }

    /// Earlier position minus position of pixel (`column`, `row`), in pixels, x right, y down.
    /// None where it was behind the camera.
    #[must_use]
    pub fn displacement(&self, column: u32, row: u32) -> Option<[f64; 2]> {
        let [width, height] = self.size;
        let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
        let ndc = [2.0 * x / width - 1.0, 1.0 - 2.0 * y / height];
        let ray = [
            (ndc[0] + at(&self.now, 0, 2)) / at(&self.now, 0, 0),
            (ndc[1] + at(&self.now, 1, 2)) / at(&self.now, 1, 1),
            -1.0,
        ];
        let turned = self.turn.map(|row| row[0] * ray[0] + row[1] * ray[1] + row[2] * ray[2]);
        if turned[2] >= 0.0 {
            return None;
        }
        let ndc_then = [0, 1].map(|axis| {
            let across = at(&self.then, axis, axis) * turned[axis];
            (across + at(&self.then, axis, 2) * turned[2]) / -turned[2]
        });
        let then = [(ndc_then[0] + 1.0) / 2.0 * width, (1.0 - ndc_then[1]) / 2.0 * height];
        Some([then[0] - x, then[1] - y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera at the origin, turned by `angle` about its vertical axis (to the left for a
    /// positive angle), with a field of view of 90 degrees across, for a square image.
    fn camera(angle: f64) -> Camera {
        let (sin, cos) = (libm::sin(angle) as f32, libm::cos(angle) as f32);
        let view =
            [cos, 0.0, sin, 0.0, 0.0, 1.0, 0.0, 0.0, -sin, 0.0, cos, 0.0, 0.0, 0.0, 0.0, 1.0];
        let projection =
            [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0, -0.2, 0.0];
        Camera { view, projection }
    }

    #[test]
    fn a_camera_that_only_moves_leaves_the_sky_alone() {
        let mut moved = camera(0.3);
        moved.view[12..15].copy_from_slice(&[5.0, -2.0, 9.0]);
        let sky = SkyMotion::new(&camera(0.3), &moved, 200, 200);
        for (column, row) in [(0, 0), (100, 50), (199, 199)] {
            let [x, y] = sky.displacement(column, row).unwrap();
            assert!(x.abs() < 1e-4 && y.abs() < 1e-4, "{x}, {y} at {column}, {row}");
        }
    }

    #[test]
    fn when_the_camera_turned_left_the_sky_was_further_left_before() {
        // Turning left moves the picture to the right: earlier minus now is negative. At the
        // centre of a field of 90 degrees, 200 pixels across, it moves 100 tan(angle).
        let sky = SkyMotion::new(&camera(0.1), &camera(0.0), 200, 200);
        let [x, y] = sky.displacement(100, 100).unwrap();
        assert!((x + 100.0 * libm::tan(0.1)).abs() < 0.02, "x {x}");
        assert!(y.abs() < 0.1, "y {y}");
    }

    #[test]
    fn what_was_behind_the_camera_has_no_motion() {
        let sky = SkyMotion::new(&camera(0.0), &camera(3.0), 200, 200);
        assert_eq!(sky.displacement(100, 100), None);
    }

    #[test]
    fn an_off_axis_projection_is_undone_and_done_again() {
        let mut shifted = camera(0.2);
        shifted.projection[8] = 0.25;
        shifted.projection[9] = -0.4;
        let sky = SkyMotion::new(&shifted, &shifted, 64, 32);
        let [x, y] = sky.displacement(3, 30).unwrap();
        assert!(x.abs() < 1e-4 && y.abs() < 1e-4, "{x}, {y}");
    }
}
