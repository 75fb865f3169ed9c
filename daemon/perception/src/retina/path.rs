//! The mean of a plane along a straight path, pixel by pixel.

use crate::plane::Plane;

/// Mean of `plane` along the path from `from` to `to`, pixels, walked at even speed: the weight of
/// a pixel is the share of the path inside it (Lee and Didyk 2018, equation 3).
pub(super) fn integral(plane: &Plane, from: [f64; 2], to: [f64; 2]) -> f64 {
    let way = [to[0] - from[0], to[1] - from[1]];
    let mut cell = from.map(f64::floor);
    // Share of the path at which the next border of a cell is crossed, per axis, and between two.
    let mut next = [0.0; 2];
    let mut between = [f64::INFINITY; 2];
    for axis in 0..2 {
        let border = if way[axis] > 0.0 { cell[axis] + 1.0 } else { cell[axis] };
        (next[axis], between[axis]) = if way[axis].abs() > f64::EPSILON {
            ((border - from[axis]) / way[axis], 1.0 / way[axis].abs())
        } else {
            (f64::INFINITY, f64::INFINITY)
        };
    }
    let (mut sum, mut share) = (0.0, 0.0);
    loop {
        let axis = usize::from(next[1] < next[0]);
        let until = next[axis].min(1.0);
        let value = f64::from(plane.at(cell[0] as isize, cell[1] as isize));
        sum += (until - share).max(0.0) * value;
        if next[axis] >= 1.0 {
            return sum;
        }
        share = until.max(share);
        next[axis] += between[axis];
        cell[axis] += way[axis].signum();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_weighs_pixels_by_its_share_inside_them() {
        let row = Plane::from_fn(6, 1, |x, _| libm::powf(10.0, x as f32));
        let along = integral(&row, [1.25, 0.5], [3.5, 0.5]);
        assert!((along - (0.75 * 10.0 + 100.0 + 0.5 * 1000.0) / 2.25).abs() < 1e-9);
        let back = integral(&row, [3.5, 0.5], [1.25, 0.5]);
        assert!((along - back).abs() < 1e-9);
        assert!((integral(&row, [2.5, 0.5], [2.5, 0.5]) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn a_diagonal_path_and_one_beyond_the_border_are_as_the_pixels_there() {
        let plane = Plane::from_fn(3, 3, |x, y| (x + 3 * y) as f32);
        let diagonal = integral(&plane, [0.0, 0.0], [3.0, 3.0]);
        assert!((diagonal - 4.0).abs() < 1e-6, "{diagonal}");
        assert!((integral(&plane, [-5.0, 1.5], [-2.0, 1.5]) - 3.0).abs() < 1e-9);
        assert!((integral(&plane, [-2.0, 1.5], [1.0, 1.5]) - 3.0).abs() < 1e-9);
    }
}
