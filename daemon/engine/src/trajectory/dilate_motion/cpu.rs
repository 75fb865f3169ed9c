//! The reference of [`super`].

use foreframe_perception::tracking::tracked_share;
use rayon::ThreadPool;

use super::{DilateParams, MAX_DISPLACEMENT_PX};
use crate::bands::for_each_row;
use crate::key::Velocity;
use crate::plane::Plane;

/// Dilates and quantises `displacement`. `depth` has its size or is empty.
pub fn dilate_motion(
    pool: &ThreadPool,
    params: &DilateParams,
    depth: &Plane<u32>,
    displacement: &Plane<[f32; 2]>,
    velocity: &mut Plane<Velocity>,
) {
    velocity.resize(displacement.width(), displacement.height());
    let has_depth = !depth.data().is_empty();
    #[expect(clippy::cast_possible_truncation, reason = "seconds need no more than an f32")]
    let px_per_span = params
        .pixels_per_degree
        .map(|pixels_per_degree| pixels_per_degree * params.span.as_secs_f64() as f32);
    for_each_row(pool, velocity, |y, row| {
        for (x, velocity) in (0..).zip(row) {
            let source = if has_depth { nearest_in_3x3(depth, x, y).0 } else { (x, y) };
            *velocity = quantise(displacement.at(source.0, source.1), px_per_span);
        }
    });
}

/// (1) and (2): the column, row and depth key of the cell whose motion cell (`x`, `y`) takes.
#[must_use]
pub fn nearest_in_3x3(depth: &Plane<u32>, x: u32, y: u32) -> ((u32, u32), u32) {
    let centre = depth.at(x, y);
    let columns = x.saturating_sub(1)..=(x + 1).min(depth.width() - 1);
    let rows = y.saturating_sub(1)..=(y + 1).min(depth.height() - 1);
    let mut max = centre;
    for row in rows.clone() {
        let cells = &depth.row(row)[*columns.start() as usize..=*columns.end() as usize];
        max = cells.iter().fold(max, |max, cell| max.max(*cell));
    }
    if max - centre <= max >> 8 {
        return ((x, y), centre);
    }
    let mut cells = rows.flat_map(|row| columns.clone().map(move |column| (column, row)));
    let nearest = cells.find(|(column, row)| depth.at(*column, *row) == max);
    (nearest.expect("the maximum is one of the cells"), max)
}

/// (3) and (4). `px_per_span` is pixels per span of a speed of one degree per second.
#[expect(clippy::cast_possible_truncation, reason = "at most 1023 * 32, which fits an i16")]
fn quantise([dx, dy]: [f32; 2], px_per_span: Option<f32>) -> Velocity {
    // Written so that NaN fails it.
    if !(dx.abs() <= MAX_DISPLACEMENT_PX && dy.abs() <= MAX_DISPLACEMENT_PX) {
        return Velocity::UNTRACKABLE;
    }
    let share = px_per_span
        .map_or(1.0, |px_per_span| tracked_share(libm::sqrtf(dx * dx + dy * dy) / px_per_span));
    let steps = |d: f32| {
        let scaled = d * share * 32.0;
        let magnitude = (scaled.abs() + 0.5) as i32;
        (if scaled < 0.0 { -magnitude } else { magnitude }) as i16
    };
    Velocity { x: steps(dx), y: steps(dy) }
}
