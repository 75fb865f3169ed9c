//! (1) of [`super`]: how the light of each tile has changed since the key before.
//!
//! Four pixels of a tile, four apart, are followed back along the motion of their cells, and
//! compared where both keys show one surface (depth agrees) inside the picture.

use rayon::ThreadPool;

use super::TILE;
use crate::bands::for_each_row;
use crate::color::{ColorFormat, ColorPlane, Texel};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::plane::Plane;
use crate::trajectory::surface::was_same_surface;
use crate::warp::sample::sample;

/// Pixels from one sample to the next, per axis.
const SPACING: u32 = 4;
/// Samples of which a tile's light is judged at least.
const FEWEST: u32 = 2;
/// How far velocities of a tile may differ, 1/32 pixel per motion span: further apart are those of
/// two surfaces, along whose outline pixels show both.
const TORN: u16 = 24;
/// Octaves of change of a tile that count, and those that neighbours of a row have to have in sum so
/// that light may have changed: noise has a few percent here and there, a shadow far more, a lamp
/// the same in many.
const NOTICED: f32 = 0.03;
const NOTICED_TOGETHER: f32 = 0.5;
/// How far what a tile is shown to do may be from what it did, pixels per motion span.
const OTHERWISE_PX: f32 = 1.0;
/// Added to luma of integer formats, per sample: noise in the dark is no change of light.
const DARK: u32 = 4;
/// Steps of a half float's luma per octave.
const LUMA_STEPS: f32 = 8.0;
/// The least luma of half floats that counts, that of 1/256 of white: its codes are a logarithm, in
/// which noise in the dark would be the most of all.
const DARKEST_HALF: u8 = 56;

/// What is known of the light of a tile.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Change {
    /// (1); 0 where nothing is known.
    pub octaves: f32,
    /// How far the middle of the tile came in one motion span; none where that is unknown.
    pub motion: Velocity,
}

/// Two keys that can be compared.
#[derive(Debug)]
pub struct Comparison<'a> {
    key: &'a KeyFrame,
    older: &'a KeyFrame,
    map: &'a FieldMap,
}

impl<'a> Comparison<'a> {
    /// Of `key` and the key `older` that its motion points back to, with fields that lie as `map`
    /// says. None where it points elsewhere, their shapes differ or depth is unknown.
    #[must_use]
    pub fn new(key: &'a KeyFrame, older: &'a KeyFrame, map: &'a FieldMap) -> Option<Self> {
        let cells = [map.x.cells(), map.y.cells()];
        let is_on = |width: u32, height: u32| [width, height] == cells;
        let is_alike = key.motion_from == Some(older.content_time)
            && key.valid == older.valid
            && key.compared().format() == older.compared().format()
            && [key, older].iter().all(|key| {
                key.valid.fits(key.color.width(), key.color.height())
                    && is_on(key.depth.width(), key.depth.height())
            })
            && is_on(key.velocity.width(), key.velocity.height());
        is_alike.then_some(Self { key, older, map })
    }

    /// How far each cell came.
    fn came(&self) -> &'a Plane<Velocity> {
        if self.key.came.data().is_empty() { &self.key.velocity } else { &self.key.came }
    }
}

/// Measures `changes`, one per tile, of the rows that are to be `measured`. Of the others nothing is
/// known but how they move.
pub fn measure(
    pool: &ThreadPool,
    comparison: &Comparison<'_>,
    measured: &[bool],
    changes: &mut Plane<Change>,
) {
    match (comparison.key.compared(), comparison.older.compared()) {
        (ColorPlane::Rgba8(now), ColorPlane::Rgba8(then)) => {
            measure_in(pool, comparison, [now, then], measured, changes);
        }
        (ColorPlane::Rgb10a2(now), ColorPlane::Rgb10a2(then)) => {
            measure_in(pool, comparison, [now, then], measured, changes);
        }
        (ColorPlane::Rgba16f(now), ColorPlane::Rgba16f(then)) => {
            measure_in(pool, comparison, [now, then], measured, changes);
        }
        _ => unreachable!("keys that can be compared have one format"),
    }
}

fn measure_in<T: Texel>(
    pool: &ThreadPool,
    comparison: &Comparison<'_>,
    planes: [&Plane<T>; 2],
    measured: &[bool],
    changes: &mut Plane<Change>,
) {
    let format = comparison.key.compared().format();
    for_each_row(
        pool,
        changes,
        #[inline(always)]
        |row, changes| {
            for (column, change) in (0..).zip(changes) {
                let octaves = if measured[row as usize] {
                    octaves(format, comparison.sums(planes, column, row))
                } else {
                    0.0
                };
                *change = Change { octaves, motion: comparison.motion(column, row) };
            }
        },
    );
}

/// Samples of a tile per axis.
const SAMPLES: usize = (TILE / SPACING) as usize;

/// Luma of the samples of a tile that can be compared, now and then, and their number.
#[derive(Default)]
struct Sums {
    luma: [u32; 2],
    count: u32,
}

impl Comparison<'_> {
    #[inline(always)]
    fn sums<T: Texel>(&self, planes: [&Plane<T>; 2], column: u32, row: u32) -> Sums {
        let mut sums = Sums::default();
        let samples = |tile: u32, side: u32| {
            let at = |i: usize| (tile * TILE + SPACING / 2 + SPACING * i as u32).min(side - 1);
            std::array::from_fn::<_, SAMPLES, _>(at)
        };
        let valid = self.key.valid;
        let (rows, columns) = (samples(row, valid.height), samples(column, valid.width));
        let lines = rows.map(|y| self.map.y.cell_of(y));
        let cells = columns.map(|x| self.map.x.cell_of(x));
        let velocities =
            lines.map(|y| self.came().row(y)).map(|line| cells.map(|x| line[x as usize]));
        let first = [cells[0], lines[0]];
        if is_torn(velocities.as_flattened()) || self.goes_otherwise(first, velocities[0][0]) {
            return sums;
        }
        for (y, velocities) in rows.into_iter().zip(velocities) {
            for (x, v) in columns.into_iter().zip(velocities) {
                if let Some([shown, was]) = self.luma(planes, [x, y], v) {
                    sums.luma[0] += u32::from(shown);
                    sums.luma[1] += u32::from(was);
                    sums.count += 1;
                }
            }
        }
        sums
    }

    /// Whether what is at a cell, which `came` so far, is not shown to go on so, or did not come so:
    /// it is held, along one axis or both, as nothing explains its motion, or damped as no eye can
    /// follow it.
    #[inline(always)]
    fn goes_otherwise(&self, [x, y]: [u32; 2], came: Velocity) -> bool {
        let came_px = [came.x, came.y].map(|v| f32::from(v) / Velocity::PER_PX as f32);
        let is_far = |[dx, dy]: [f32; 2]| dx.abs().max(dy.abs()) > OTHERWISE_PX;
        let goes = self.key.velocity.at(x, y);
        let is_held_along = |goes: i16, came_px: f32| goes == 0 && came_px.abs() > OTHERWISE_PX;
        let is_held = is_held_along(goes.x, came_px[0]) || is_held_along(goes.y, came_px[1]);
        let displacement = &self.key.displacement;
        let is_damped = !displacement.data().is_empty() && {
            let [dx, dy] = displacement.at(x, y);
            is_far([dx - came_px[0], dy - came_px[1]])
        };
        is_held || is_damped
    }

    /// Luma of a pixel that came by `v`, and of where it was; None where that cannot be seen.
    #[inline(always)]
    fn luma<T: Texel>(
        &self,
        [now, then]: [&Plane<T>; 2],
        [x, y]: [u32; 2],
        v: Velocity,
    ) -> Option<[u8; 2]> {
        let Self { key, older, map } = self;
        let valid = key.valid;
        let (from_x, from_y) = (from(x, v.x, valid.width)?, from(y, v.y, valid.height)?);
        let depth = key.depth.at(map.x.cell_of(x), map.y.cell_of(y));
        let was = older.depth.at(map.x.cell_of(from_x), map.y.cell_of(from_y));
        if !was_same_surface(depth, was) {
            return None;
        }
        let (x, y) = (valid.x + x, valid.y + y);
        let place =
            |at: u32, v: i16| at.cast_signed() * 256 - i32::from(v) * (256 / Velocity::PER_PX);
        let then = sample(then, valid, place(x, v.x), place(y, v.y));
        let darkest = if key.color.format() == ColorFormat::Rgba16f { DARKEST_HALF } else { 0 };
        Some([now.at(x, y), then].map(|texel| texel.luma8().max(darkest)))
    }

    /// How far the middle of a tile came.
    fn motion(&self, column: u32, row: u32) -> Velocity {
        let valid = self.key.valid;
        let middle = |tile: u32, side: u32| (tile * TILE + TILE / 2).min(side - 1);
        let (x, y) = (middle(column, valid.width), middle(row, valid.height));
        let came = self.came().at(self.map.x.cell_of(x), self.map.y.cell_of(y));
        if came.is_trackable() { came } else { Velocity::default() }
    }
}

/// Whether light may have changed in a row of tiles: those side by side that changed alike did so by
/// enough together.
pub(super) fn is_noticed(row: &[Change]) -> bool {
    let mut together = 0.0_f32;
    row.iter().any(|Change { octaves, .. }| {
        let goes_on = octaves.abs() > NOTICED && together * octaves > 0.0;
        together = if goes_on { together + octaves } else { *octaves };
        together.abs() > NOTICED_TOGETHER
    })
}

/// The pixel that one, which came by `v` along an axis, was nearest to; None outside the picture.
#[inline(always)]
fn from(at: u32, v: i16, side: u32) -> Option<u32> {
    let whole = (i32::from(v) + Velocity::PER_PX / 2).div_euclid(Velocity::PER_PX);
    u32::try_from(at.cast_signed() - whole).ok().filter(|at| *at < side)
}

/// Whether the samples of a tile go apart, or their motion is unknown.
#[inline(always)]
fn is_torn(velocities: &[Velocity]) -> bool {
    let goes_apart = |axis: fn(&Velocity) -> i16| {
        let of = velocities.iter().map(axis);
        let (least, most) =
            of.fold((i16::MAX, i16::MIN), |(least, most), v| (least.min(v), most.max(v)));
        most.abs_diff(least) > TORN
    };
    goes_apart(|v| v.x) || goes_apart(|v| v.y) || !velocities[0].is_trackable()
}

/// (1).
fn octaves(format: ColorFormat, Sums { luma: [now, then], count }: Sums) -> f32 {
    if count < FEWEST || now == then {
        return 0.0;
    }
    if format == ColorFormat::Rgba16f {
        return (now as f32 - then as f32) / (LUMA_STEPS * count as f32);
    }
    let dark = DARK * count;
    libm::log2f((now + dark) as f32 / (then + dark) as f32)
}
