//! Pictures kept for flipping through: a truth, what each method showed instead, and by which
//! models it went on.

use foreframe_engine::Plane;
use foreframe_engine::inspect::Inspection;
use foreframe_engine::trajectory::rung::Rung;
use foreframe_engine::trajectory::world::MoverOrder;

use super::picture::Srgb8;

/// Widest picture that is kept, px. Wider ones are made smaller by a whole factor.
pub const WIDEST: u32 = 400;

/// The models, as maps of them count: the order in which things move makes no other model.
pub const RUNGS: [Rung; 7] = [
    Rung::Hold,
    Rung::Global,
    Rung::Linear,
    Rung::Affine,
    Rung::Quadratic,
    Rung::World(MoverOrder::Constant),
    Rung::Flow,
];

/// One frame.
#[derive(Clone, PartialEq, Debug)]
pub struct FlipFrame {
    /// Its number in the recording.
    pub frame: usize,
    /// The truth, made smaller by [`scale_of`].
    pub truth: Srgb8,
    /// What each method showed, in the order of the report, as much smaller.
    pub shown: Vec<Srgb8>,
    /// Where the key lay by each method, as [`rung_map`] has it.
    pub rungs: Vec<Plane<u8>>,
}

/// By what a picture so wide is divided, per axis.
#[must_use]
pub fn scale_of(width: u32) -> u32 {
    width.div_ceil(WIDEST).max(1)
}

impl FlipFrame {
    /// Keeps the pictures of one frame: the truth, and for each method what it showed and its map.
    pub fn new(
        frame: usize,
        truth: &Srgb8,
        shown: impl Iterator<Item = (Srgb8, Plane<u8>)>,
    ) -> Self {
        let (shown, rungs) = shown.map(|(picture, map)| (smaller(&picture), map)).unzip();
        Self { frame, truth: smaller(truth), shown, rungs }
    }
}

/// By which of [`RUNGS`] each pixel of the newest key goes on, as much smaller as the pictures: the
/// model in the middle of what a pixel stands for. `[width, height]` is the size of the key.
#[must_use]
pub fn rung_map(inspection: &Inspection<'_>, [width, height]: [u32; 2]) -> Plane<u8> {
    let scale = scale_of(width);
    let [columns, rows] = smaller_size([width, height]);
    let middle = |index: u32| index * scale + scale / 2;
    let at = |(x, y): (u32, u32)| {
        let name = inspection.rung_at(middle(x), middle(y).min(height - 1)).name();
        let index = RUNGS.iter().position(|rung| rung.name() == name);
        index.expect("every rung is listed") as u8
    };
    let places = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
    Plane::from_vec(columns, rows, places.map(at).collect())
}

/// Size of a picture divided by [`scale_of`].
fn smaller_size([width, height]: [u32; 2]) -> [u32; 2] {
    let scale = scale_of(width);
    [width / scale, (height / scale).max(1)]
}

/// The picture divided by [`scale_of`]: each pixel is the mean of those that it stands for.
fn smaller(picture: &Srgb8) -> Srgb8 {
    let scale = scale_of(picture.width());
    if scale == 1 {
        return picture.clone();
    }
    let [width, height] = smaller_size([picture.width(), picture.height()]);
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
