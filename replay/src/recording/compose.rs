//! Motion from one key to the next, composed from the motion fields of the frames between.
//!
//! A point of the newest field is followed from frame to frame: its position in the frame before
//! is its own minus its displacement, and there the next displacement is read. It is read between
//! samples, from those of the four around the position that lie on the same surface; where none
//! does, the point was hidden or outside the picture, and its motion is unknown (NaN).

use foreframe_engine::{Plane, Rect};

/// Depth of one surface may change by this fraction (a shift of 3: one eighth) from one frame to
/// the next, and from one sample to its neighbour. A surface that comes nearer by more reaches the
/// eye within eight frames; with less, ground seen at a low angle fails its own neighbours.
const DEPTH_TOLERANCE_SHIFT: u32 = 3;

/// Depth and motion of one frame on one grid, in the convention of the engine.
#[derive(Clone, PartialEq, Debug)]
pub struct Field {
    /// Depth key per cell, larger is nearer; empty where the frame has no depth.
    pub depth: Plane<u32>,
    /// Displacement per cell since the frame before, newer minus older position, output pixels.
    pub displacement: Plane<[f32; 2]>,
    /// The part of the output that the grid covers evenly.
    pub valid: Rect,
    /// How far right and down of its even place each cell lies, output pixels.
    pub offset: [f32; 2],
}

impl Field {
    /// Pixels per cell.
    fn cell_px(&self) -> [f32; 2] {
        let cells = [self.displacement.width(), self.displacement.height()];
        [self.valid.width as f32 / cells[0] as f32, self.valid.height as f32 / cells[1] as f32]
    }

    /// Centre of a cell in output pixels.
    fn centre_px(&self, x: u32, y: u32) -> [f32; 2] {
        let cell = self.cell_px();
        let start = [self.valid.x as f32 + self.offset[0], self.valid.y as f32 + self.offset[1]];
        [start[0] + (x as f32 + 0.5) * cell[0], start[1] + (y as f32 + 0.5) * cell[1]]
    }

    /// Displacement and depth at a position, from the samples that lie on a surface of `depth`.
    fn at_surface(&self, position_px: [f32; 2], depth: Option<u32>) -> Option<Sample> {
        let cell = self.cell_px();
        let first = self.centre_px(0, 0);
        let (width, height) = (self.displacement.width(), self.displacement.height());
        let x = grid_place(position_px[0], first[0], cell[0], width)?;
        let y = grid_place(position_px[1], first[1], cell[1], height)?;
        let (mut weights, mut sum, mut depths) = (0.0, [0.0; 2], 0.0);
        for (row, weight_y) in y {
            for (column, weight_x) in x {
                let weight = weight_x * weight_y;
                let displacement = self.displacement.at(column, row);
                let here = self.depth_at(column, row);
                let is_known = displacement.iter().all(|d| d.is_finite());
                if weight <= 0.0 || !is_known || !is_same_surface(depth, here) {
                    continue;
                }
                weights += weight;
                sum[0] += weight * displacement[0];
                sum[1] += weight * displacement[1];
                depths += f64::from(weight) * f64::from(here.unwrap_or(0));
            }
        }
        if weights <= 0.0 {
            return None;
        }
        let depth = (depths / f64::from(weights)) as u32;
        let displacement = [sum[0] / weights, sum[1] / weights];
        Some(Sample { displacement, depth: self.has_depth().then_some(depth) })
    }

    fn has_depth(&self) -> bool {
        self.depth.width() > 0
    }

    fn depth_at(&self, x: u32, y: u32) -> Option<u32> {
        self.has_depth().then(|| self.depth.at(x, y))
    }
}

struct Sample {
    displacement: [f32; 2],
    depth: Option<u32>,
}

/// The two cells around a position along one axis, with their weights. None outside the picture.
fn grid_place(position: f32, first: f32, cell: f32, cells: u32) -> Option<[(u32, f32); 2]> {
    let place = (position - first) / cell;
    // Half a cell beyond the outer centres is the border of the picture; NaN is nowhere.
    if !(-0.5..=cells as f32 - 0.5).contains(&place) {
        return None;
    }
    let last = cells - 1;
    let clamped = place.clamp(0.0, last as f32);
    let low = clamped.floor();
    let way = clamped - low;
    let low = low as u32;
    Some([(low, 1.0 - way), ((low + 1).min(last), way)])
}

/// Whether two depth keys may be of one surface. Unknown depth is never told apart.
fn is_same_surface(a: Option<u32>, b: Option<u32>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.abs_diff(b) <= (a.max(b) >> DEPTH_TOLERANCE_SHIFT) + 1,
        _ => true,
    }
}

/// Displacement over the whole path, on the grid of its first field, newer minus older position in
/// output pixels; NaN where it is not known. `path` goes back in time, newest first, and each
/// field's displacement ends where the next one's begins.
///
/// # Panics
/// If `path` is empty.
#[must_use]
pub fn compose(path: &[Field]) -> Plane<[f32; 2]> {
    let (newest, older) = path.split_first().expect("a path has at least one field");
    let (width, height) = (newest.displacement.width(), newest.displacement.height());
    let mut composed = Plane::new(width, height);
    for y in 0..height {
        for x in 0..width {
            let start =
                Sample { displacement: newest.displacement.at(x, y), depth: newest.depth_at(x, y) };
            let total = follow(newest.centre_px(x, y), start, older);
            composed.row_mut(y)[x as usize] = total.unwrap_or([f32::NAN; 2]);
        }
    }
    composed
}

/// Follows one point through `older` and returns how far it came in all.
fn follow(position_px: [f32; 2], start: Sample, older: &[Field]) -> Option<[f32; 2]> {
    let mut total = start.displacement;
    let mut depth = start.depth;
    for field in older {
        let before = [position_px[0] - total[0], position_px[1] - total[1]];
        let sample = field.at_surface(before, depth)?;
        total[0] += sample.displacement[0];
        total[1] += sample.displacement[1];
        depth = sample.depth.or(depth);
    }
    total.iter().all(|d| d.is_finite()).then_some(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(
        size: (u32, u32),
        displacement: impl Fn(u32, u32) -> [f32; 2],
        depth: impl Fn(u32, u32) -> u32,
    ) -> Field {
        let cells = || (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
        Field {
            depth: Plane::from_vec(size.0, size.1, cells().map(|(x, y)| depth(x, y)).collect()),
            displacement: Plane::from_vec(
                size.0,
                size.1,
                cells().map(|(x, y)| displacement(x, y)).collect(),
            ),
            valid: Rect::full(size.0, size.1),
            offset: [0.0; 2],
        }
    }

    fn near(found: [f32; 2], expected: [f32; 2]) {
        let is_near = found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-4);
        assert!(is_near, "expected {expected:?}, found {found:?}");
    }

    #[test]
    fn a_steady_pan_adds_up_and_what_came_in_over_the_border_is_unknown() {
        let steps = [[2.0, 0.5], [2.25, 0.5], [1.5, 0.25], [2.0, 0.0]];
        let path = steps.map(|step| field((40, 20), |_, _| step, |_, _| 1000));
        let composed = compose(&path);
        for y in 2..20 {
            for x in 6..40 {
                near(composed.at(x, y), [7.75, 1.25]);
            }
        }
        assert!(composed.at(1, 10)[0].is_nan(), "it was outside the picture one step before");
        assert!(composed.at(20, 0)[1].is_nan());
    }

    #[test]
    fn a_rotation_composes_to_the_rotation_by_the_sum_of_angles() {
        let turned_by = |angle: f32, x: u32, y: u32| {
            let from_centre = [x as f32 + 0.5 - 32.0, y as f32 + 0.5 - 32.0];
            let (sin, cos) = angle.sin_cos();
            let before = [
                cos * from_centre[0] + sin * from_centre[1],
                cos * from_centre[1] - sin * from_centre[0],
            ];
            [from_centre[0] - before[0], from_centre[1] - before[1]]
        };
        let angle = 0.03;
        let one = field((64, 64), |x, y| turned_by(angle, x, y), |_, _| 7);
        let composed = compose(&[one.clone(), one.clone(), one]);
        for (x, y) in [(32, 32), (45, 20), (20, 40), (50, 32)] {
            near(composed.at(x, y), turned_by(3.0 * angle, x, y));
        }
    }

    #[test]
    fn a_point_that_was_hidden_is_unknown_and_a_surface_beside_it_does_not_lend_its_motion() {
        // A near block (columns 12 to 19 of the older frame) moves right by 4 over a still wall.
        let block = |left: u32| move |x: u32| (left..left + 8).contains(&x);
        let frame = |left: u32| {
            let is_block = block(left);
            field(
                (40, 8),
                move |x, _| if is_block(x) { [4.0, 0.0] } else { [0.0; 2] },
                move |x, _| if is_block(x) { 8000 } else { 1000 },
            )
        };
        let composed = compose(&[frame(16), frame(12), frame(8)]);
        for x in 16..24 {
            near(composed.at(x, 4), [12.0, 0.0]);
        }
        for x in 12..16 {
            assert!(composed.at(x, 4)[0].is_nan(), "column {x} lay behind the block");
        }
        for x in (0..8).chain(24..40) {
            near(composed.at(x, 4), [0.0; 2]);
        }
    }

    #[test]
    fn a_surface_may_come_nearer_step_by_step() {
        let path = [1000, 920, 850, 790].map(|key| field((8, 8), |_, _| [0.0; 2], move |_, _| key));
        near(compose(&path).at(4, 4), [0.0; 2]);
        let leap = [1000, 790].map(|key| field((8, 8), |_, _| [0.0; 2], move |_, _| key));
        assert!(compose(&leap).at(4, 4)[0].is_nan());
    }

    #[test]
    fn unknown_motion_anywhere_on_the_way_stays_unknown() {
        let known = field((8, 8), |_, _| [1.0, 0.0], |_, _| 5);
        let hole = field((8, 8), |x, _| if x < 4 { [f32::NAN; 2] } else { [1.0, 0.0] }, |_, _| 5);
        assert!(compose(&[hole.clone(), known.clone()]).at(2, 2)[0].is_nan());
        assert!(compose(&[known, hole]).at(3, 2)[0].is_nan());
    }

    #[test]
    fn grids_of_other_resolutions_are_read_at_the_same_place() {
        // The coarse grid has cells of 2 x 2 pixels; its motion grows by 1/8 per pixel.
        let slope = |x_px: f32| [x_px / 8.0, 0.0];
        let fine = field((32, 8), |_, _| [2.0, 0.0], |_, _| 9);
        let mut coarse = field((16, 4), |x, _| slope(2.0 * x as f32 + 1.0), |_, _| 9);
        coarse.valid = Rect::full(32, 8);
        for x in [6, 11, 20] {
            let before = x as f32 + 0.5 - 2.0;
            near(compose(&[fine.clone(), coarse.clone()]).at(x, 4), [2.0 + before / 8.0, 0.0]);
        }
    }

    #[test]
    fn without_depth_motion_is_followed_all_the_same() {
        let mut plain = field((16, 4), |_, _| [1.0, 0.0], |_, _| 0);
        plain.depth = Plane::default();
        near(compose(&[plain.clone(), plain]).at(8, 2), [2.0, 0.0]);
    }
}
