//! Pictures kept for flipping through: a truth, and what each method showed instead.

use foreframe_engine::Plane;

use super::picture::Srgb8;

/// Widest picture that is kept, px. Wider ones are made smaller by a whole factor.
pub const WIDEST: u32 = 400;

/// One frame.
#[derive(Clone, PartialEq, Debug)]
pub struct FlipFrame {
    /// Its number in the recording.
    pub frame: usize,
    /// The truth, made smaller by [`scale_of`].
    pub truth: Srgb8,
    /// What each method showed, in the order of the report, as much smaller.
    pub shown: Vec<Srgb8>,
}

/// By what a picture so wide is divided, per axis.
#[must_use]
pub fn scale_of(width: u32) -> u32 {
    width.div_ceil(WIDEST).max(1)
}

impl FlipFrame {
    /// Keeps the pictures of one frame.
    pub fn new(frame: usize, truth: &Srgb8, shown: impl Iterator<Item = Srgb8>) -> Self {
        Self {
            frame,
            truth: smaller(truth),
            shown: shown.map(|picture| smaller(&picture)).collect(),
        }
    }
}

/// The picture divided by [`scale_of`]: each pixel is the mean of those that it stands for.
fn smaller(picture: &Srgb8) -> Srgb8 {
    let scale = scale_of(picture.width());
    if scale == 1 {
        return picture.clone();
    }
    let (width, height) = (picture.width() / scale, (picture.height() / scale).max(1));
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x * scale, y * scale)));
    let mean = |(left, top): (u32, u32)| {
        let mut sum = [0_u32; 3];
        let rows = top..(top + scale).min(picture.height());
        let count = rows.len() as u32 * scale;
        for row in rows {
            for pixel in &picture.row(row)[left as usize..(left + scale) as usize] {
                sum = std::array::from_fn(|channel| sum[channel] + u32::from(pixel[channel]));
            }
        }
        sum.map(|sum| u8::try_from((sum + count / 2) / count).expect("a mean of bytes"))
    };
    Plane::from_vec(width, height, places.map(mean).collect())
}

#[cfg(test)]
mod tests {
    use super::super::metrics::test_pictures::from_fn;
    use super::*;

    #[test]
    fn wide_pictures_are_made_smaller_by_a_whole_factor_and_stay_as_bright() {
        assert_eq!([1, 400, 401, 800, 1920].map(scale_of), [1, 1, 2, 2, 5]);
        let picture = from_fn(801, 3, |x, _| if x % 3 == 0 { [90, 0, 30] } else { [0, 60, 30] });
        let small = smaller(&picture);
        assert_eq!((small.width(), small.height()), (267, 1));
        assert!(small.data().iter().all(|&pixel| pixel == [30, 40, 30]), "{:?}", small.at(0, 0));
    }
}
