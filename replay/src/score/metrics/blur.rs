//! Separable convolution of float planes, the inner loop of SSIM and FLIP.
//!
//! Taps are centred and their number is odd; pixels beyond the border repeat the border pixel.
//! Sixteen outputs are summed up at a time, so that the sums stay in registers.

use foreframe_engine::Plane;

/// Outputs per block.
const BLOCK: usize = 16;

/// Correlates each row with `taps`.
pub(super) fn along_x(source: &Plane<f32>, taps: &[f32]) -> Plane<f32> {
    let (width, radius) = (source.width() as usize, taps.len() / 2);
    let mut out = Plane::new(source.width(), source.height());
    let mut padded = vec![0.0; width.next_multiple_of(BLOCK) + 2 * radius];
    for y in 0..source.height() {
        let row = source.row(y);
        padded[..radius].fill(row[0]);
        padded[radius..radius + width].copy_from_slice(row);
        padded[radius + width..].fill(row[width - 1]);
        for (block, out) in out.row_mut(y).chunks_mut(BLOCK).enumerate() {
            let mut sums = [0.0_f32; BLOCK];
            for (tap, weight) in taps.iter().enumerate() {
                let values = &padded[block * BLOCK + tap..][..BLOCK];
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += weight * value;
                }
            }
            out.copy_from_slice(&sums[..out.len()]);
        }
    }
    out
}

/// Correlates each column with `taps`.
pub(super) fn along_y(source: &Plane<f32>, taps: &[f32]) -> Plane<f32> {
    let (width, height) = (source.width() as usize, source.height() as usize);
    let radius = taps.len() / 2;
    let mut out = Plane::new(source.width(), source.height());
    for (y, out) in out.data_mut().chunks_exact_mut(width).enumerate() {
        let row_of_tap = |tap: usize| (y + tap).saturating_sub(radius).min(height - 1);
        for (block, out) in out.chunks_mut(BLOCK).enumerate() {
            let mut sums = [0.0_f32; BLOCK];
            for (tap, weight) in taps.iter().enumerate() {
                let from = row_of_tap(tap) * width + block * BLOCK;
                let values = &source.data()[from..from + out.len()];
                if let Ok(values) = <&[f32; BLOCK]>::try_from(values) {
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += weight * value;
                    }
                } else {
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += weight * value;
                    }
                }
            }
            out.copy_from_slice(&sums[..out.len()]);
        }
    }
    out
}

/// `2 * radius + 1` taps of a function of the distance from the centre in pixels.
pub(super) fn taps(radius: usize, weight: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=2 * radius).map(|tap| weight(tap as f64 - radius as f64)).collect()
}

/// Divides the taps by their sum.
pub(super) fn normalised(taps: &[f64]) -> Vec<f32> {
    let sum: f64 = taps.iter().sum();
    taps.iter().map(|tap| (tap / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn plain(source: &Plane<f32>, taps: &[f32], dx: i64, dy: i64) -> Plane<f32> {
        let (width, height) = (i64::from(source.width()), i64::from(source.height()));
        let mut out = Plane::new(source.width(), source.height());
        for y in 0..height {
            for x in 0..width {
                let sum: f32 = taps.iter().enumerate().fold(0.0, |sum, (tap, weight)| {
                    let offset = tap as i64 - taps.len() as i64 / 2;
                    let from_x = (x + dx * offset).clamp(0, width - 1) as u32;
                    let from_y = (y + dy * offset).clamp(0, height - 1) as u32;
                    sum + weight * source.at(from_x, from_y)
                });
                out.row_mut(y as u32)[x as usize] = sum;
            }
        }
        out
    }

    proptest! {
        #[test]
        fn blocks_change_nothing_against_the_plain_sum(
            width in 1_u32..40, height in 1_u32..20, radius in 0_usize..12, seed in 0_u32..9,
        ) {
            let value = |i: u32| ((i + seed).wrapping_mul(2_654_435_761) >> 20) as f32;
            let source = Plane::from_vec(width, height, (0..width * height).map(value).collect());
            let taps: Vec<f32> = (0..2 * radius + 1).map(|tap| tap as f32 - 3.0).collect();
            prop_assert_eq!(along_x(&source, &taps), plain(&source, &taps, 1, 0));
            prop_assert_eq!(along_y(&source, &taps), plain(&source, &taps, 0, 1));
        }
    }
}
