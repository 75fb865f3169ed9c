//! Colour spaces of FLIP: linear Rec. 709, the opponent space YCxCz, CIELAB with chroma after Hunt.
//!
//! XYZ is scaled so that white is (1, 1, 1) before it goes anywhere, which folds the reference
//! white into the matrix.

/// CIELAB: lightness 0 to 100 and two chroma axes.
pub(super) type Lab = [f32; 3];

/// Linear Rec. 709 to XYZ over the XYZ of white: rows of the sRGB matrix, each divided by its sum.
const WHITE_XYZ_FROM_RGB: [[f32; 3]; 3] = {
    let rows = [
        [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
        [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
        [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
    ];
    let mut scaled = [[0.0; 3]; 3];
    let mut row = 0;
    while row < 3 {
        let sum: f64 = rows[row][0] + rows[row][1] + rows[row][2];
        let mut column = 0;
        while column < 3 {
            scaled[row][column] = (rows[row][column] / sum) as f32;
            column += 1;
        }
        row += 1;
    }
    scaled
};

/// Inverse of [`WHITE_XYZ_FROM_RGB`].
const RGB_FROM_WHITE_XYZ: [[f32; 3]; 3] = inverse(WHITE_XYZ_FROM_RGB);

const fn inverse(m: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
    let mut wide = [[0.0_f64; 3]; 3];
    let mut row = 0;
    while row < 3 {
        let mut column = 0;
        while column < 3 {
            // Cofactor of the transposed element; cyclic indices carry the sign.
            let (a, b) = ((column + 1) % 3, (column + 2) % 3);
            let (c, d) = ((row + 1) % 3, (row + 2) % 3);
            wide[row][column] = m[a][c] as f64 * m[b][d] as f64 - m[a][d] as f64 * m[b][c] as f64;
            column += 1;
        }
        row += 1;
    }
    let determinant =
        m[0][0] as f64 * wide[0][0] + m[0][1] as f64 * wide[1][0] + m[0][2] as f64 * wide[2][0];
    let mut result = [[0.0; 3]; 3];
    let mut row = 0;
    while row < 3 {
        let mut column = 0;
        while column < 3 {
            result[row][column] = (wide[row][column] / determinant) as f32;
            column += 1;
        }
        row += 1;
    }
    result
}

fn multiply(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Linear RGB to YCxCz: Y as CIELAB's lightness without its root, Cx red-green, Cz blue-yellow.
pub(super) fn opponent_of(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = multiply(&WHITE_XYZ_FROM_RGB, rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Inverse of [`opponent_of`].
pub(super) fn linear_rgb_of([lightness, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (lightness + 16.0) / 116.0;
    multiply(&RGB_FROM_WHITE_XYZ, [y + cx / 500.0, y, y - cz / 200.0])
}

/// CIELAB of linear RGB, with both chroma axes scaled by a hundredth of the lightness: colour
/// differences show less in the dark (Hunt).
pub(super) fn hunt_lab(rgb: [f32; 3]) -> Lab {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = multiply(&WHITE_XYZ_FROM_RGB, rgb).map(|v| {
        if v > DELTA * DELTA * DELTA { v.cbrt() } else { v / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    let lightness = 116.0 * y - 16.0;
    let chroma = 0.01 * lightness;
    [lightness, chroma * 500.0 * (x - y), chroma * 200.0 * (y - z)]
}

/// HyAB: city-block in lightness, Euclidean in chroma (Abasi et al. 2020).
pub(super) fn hyab(a: Lab, b: Lab) -> f32 {
    let [lightness, first, second] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    lightness.abs() + (first * first + second * second).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: [f32; 3], expected: [f32; 3], tolerance: f32) {
        let off = found.into_iter().zip(expected).any(|(f, e)| (f - e).abs() > tolerance);
        assert!(!off, "expected {expected:?}, found {found:?}");
    }

    #[test]
    fn white_and_greys_have_no_chroma() {
        for grey in [0.0, 0.01, 0.2, 1.0] {
            let [_, a, b] = hunt_lab([grey; 3]);
            assert!(a.abs() < 1e-3 && b.abs() < 1e-3);
            near(opponent_of([grey; 3]), [116.0 * grey - 16.0, 0.0, 0.0], 1e-3);
        }
        near(hunt_lab([1.0; 3]), [100.0, 0.0, 0.0], 1e-3);
    }

    #[test]
    fn the_opponent_space_can_be_undone() {
        for rgb in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.7, 0.05], [0.0, 0.0, 1.0]] {
            near(linear_rgb_of(opponent_of(rgb)), rgb, 1e-5);
        }
    }

    #[test]
    fn srgb_red_has_its_published_cielab_coordinates() {
        // L 53.24, a 80.09, b 67.20 (D65); chroma here is scaled by 0.5324.
        near(hunt_lab([1.0, 0.0, 0.0]), [53.24, 80.09 * 0.5324, 67.20 * 0.5324], 0.05);
    }
}
