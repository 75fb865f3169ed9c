//! (1) to (4) of [`super`]: the weights of a key.

use rayon::ThreadPool;

use super::{FULL, TILE};
use crate::bands::for_each_row;
use crate::evidence::{Evidence, STRIDE, index_of};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::plane::Plane;

/// Range of velocities at which a tile begins to be blurred, 1/32 pixel: a sixteenth of its side,
/// as a zoom of 6 % per key has it, which the warps follow.
const LOW: u32 = 16;
/// Where it is blurred fully, 1/32 pixel: a quarter of its side. What is
/// uncovered there is two pixels wide, nearly the standard deviation of the blur.
const HIGH: u32 = 64;
/// Share of contrast that errors cost from which on a rung is doubted, and is not believed at all.
const COST: [f32; 2] = [0.25, 0.75];
/// Tiles beyond its own that a torn tile reaches at most: 32 pixels.
const MOST_REACH: u32 = 4;

/// What is worked out of a tile before it reaches others.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Tile {
    weight: u8,
    /// Tiles that it reaches beyond itself, right and left, up and down.
    reach: [u8; 2],
}

#[derive(Debug, Default)]
pub(super) struct Scratch {
    tiles: Plane<Tile>,
    spread: Plane<u8>,
}

/// The velocity in the middle of each tile; none where the key has none.
pub(super) fn motion(key: &KeyFrame, map: &FieldMap, size: [u32; 2], out: &mut Plane<Velocity>) {
    out.resize(size[0], size[1]);
    if key.velocity.data().is_empty() {
        out.data_mut().fill(Velocity::default());
        return;
    }
    let middle = |tile: u32, pixels: u32| (tile * TILE + TILE / 2).min(pixels - 1);
    for y in 0..size[1] {
        let cells = key.velocity.row(map.y.cell_of(middle(y, key.valid.height)));
        for (x, out) in (0..).zip(out.row_mut(y)) {
            *out = cells[map.x.cell_of(middle(x, key.valid.width)) as usize];
        }
    }
}

/// The weights of `key`, per tile.
pub(super) fn weights(
    pool: &ThreadPool,
    key: &KeyFrame,
    map: &FieldMap,
    evidence: Option<&Evidence>,
    scratch: &mut Scratch,
    [width, height]: [u32; 2],
    out: &mut Plane<u8>,
) {
    out.resize(width, height);
    if key.velocity.data().is_empty() {
        out.data_mut().fill(FULL);
        return;
    }
    let Scratch { tiles, spread } = scratch;
    tiles.resize(width, height);
    for_each_row(
        pool,
        tiles,
        #[inline(always)]
        |y, row| row_of(key, map, evidence, y, row),
    );
    spread.resize(width, height);
    spread.data_mut().fill(0);
    for y in 0..height {
        for (x, tile) in (0..).zip(tiles.row(y)) {
            if tile.weight > 0 {
                reach(tile, [x, y], spread);
            }
        }
    }
    soften(spread, out);
}

/// (1) to (3) of a row of tiles.
#[inline(always)]
fn row_of(key: &KeyFrame, map: &FieldMap, evidence: Option<&Evidence>, y: u32, row: &mut [Tile]) {
    let [columns, rows] = [map.x.cells(), map.y.cells()];
    let around = |axis: &crate::field::FieldAxis, tile: u32, cells: u32| {
        let last = (tile * TILE + TILE).min(axis.pixels()) - 1;
        let first = axis.cell_of(tile * TILE);
        [first.saturating_sub(1), (axis.cell_of(last) + 1).min(cells - 1)].map(|it| it as usize)
    };
    let [top, bottom] = around(&map.y, y, rows);
    // Least and most of each column of cells.
    let first = key.velocity.row(top as u32);
    let mut ends: Vec<[Velocity; 2]> = first.iter().map(|v| [*v; 2]).collect();
    for cells in top + 1..=bottom {
        for ([least, most], v) in ends.iter_mut().zip(key.velocity.row(cells as u32)) {
            (least.x, least.y) = (least.x.min(v.x), least.y.min(v.y));
            (most.x, most.y) = (most.x.max(v.x), most.y.max(v.y));
        }
    }
    for (x, tile) in (0..).zip(row) {
        let [left, right] = around(&map.x, x, columns);
        let [mut least, mut most] = ends[left];
        for [low, high] in &ends[left + 1..=right] {
            (least.x, least.y) = (least.x.min(low.x), least.y.min(low.y));
            (most.x, most.y) = (most.x.max(high.x), most.y.max(high.y));
        }
        let is_known = least.is_trackable();
        let ranges = [(most.x, least.x), (most.y, least.y)]
            .map(|(most, least)| (i32::from(most) - i32::from(least)).cast_unsigned());
        let torn = smooth_step(ranges[0].max(ranges[1]).saturating_sub(LOW), HIGH - LOW);
        let cost = evidence.map_or(0, |evidence| cost(evidence, [left, right], [top, bottom]));
        tile.weight = if is_known { torn.max(cost) } else { FULL };
        // Cells of no velocity have no range that says how far anything moves.
        let per_tile = TILE * Velocity::PER_PX.cast_unsigned();
        tile.reach = match is_known && torn > 0 {
            true => ranges.map(|range| range.div_ceil(per_tile).min(MOST_REACH) as u8),
            false => [0; 2],
        };
    }
}

/// `3 t^2 - 2 t^3` of t = `value` / `range`, in 1/[`FULL`]; 0 at 0 and [`FULL`] from `range` on.
#[inline(always)]
fn smooth_step(value: u32, range: u32) -> u8 {
    let full = u32::from(FULL);
    let t = value.min(range) * full / range;
    ((t * t * (3 * full - 2 * t)) / (full * full)) as u8
}

/// (3) of the samples that lie on these cells.
#[inline(always)]
fn cost(evidence: &Evidence, columns: [usize; 2], rows: [usize; 2]) -> u8 {
    let (samples, leads) = (evidence.samples(), evidence.leads());
    let within = |ends: [usize; 2], count: u32| {
        let [first, last] = ends.map(|cell| cell as u32 / STRIDE);
        first..=last.min(count - 1)
    };
    let has_none = leads.data().is_empty() || samples.data().len() != leads.data().len();
    if has_none || evidence.is_at_rest() {
        return 0;
    }
    let mut most = 0;
    for row in within(rows, leads.height()) {
        for column in within(columns, leads.width()) {
            let (sample, lead) = (samples.at(column, row), leads.at(column, row));
            if !lead.is_whole() {
                return FULL;
            }
            if sample.keys > 0 {
                let above = (sample.mean[index_of(lead.rung)] - COST[0]) / (COST[1] - COST[0]);
                let steps = (above.clamp(0.0, 1.0) * f32::from(FULL)) as u32;
                most = most.max(smooth_step(steps, FULL.into()));
            }
        }
    }
    most
}

/// The first half of (4): a tile gives its weight to all that it reaches, and to those beside them.
fn reach(tile: &Tile, at: [u32; 2], spread: &mut Plane<u8>) {
    let size = [spread.width(), spread.height()];
    let [columns, rows] = [0, 1].map(|axis| {
        let reach = u32::from(tile.reach[axis]) + 1;
        at[axis].saturating_sub(reach) as usize..(at[axis] + reach + 1).min(size[axis]) as usize
    });
    for y in rows {
        for place in &mut spread.row_mut(y as u32)[columns.clone()] {
            *place = tile.weight.max(*place);
        }
    }
}

/// The second half of (4); beyond a border the tile at the border again.
fn soften(from: &Plane<u8>, out: &mut Plane<u8>) {
    let last = [from.width() - 1, from.height() - 1];
    for y in 0..from.height() {
        let rows = [y.saturating_sub(1), y, (y + 1).min(last[1])].map(|y| from.row(y));
        let column = |x: u32| {
            let [above, here, below] = rows.map(|row| u32::from(row[x as usize]));
            above + 2 * here + below
        };
        for (x, out) in (0..).zip(out.row_mut(y)) {
            let sum =
                column(u32::saturating_sub(x, 1)) + 2 * column(x) + column((x + 1).min(last[0]));
            *out = ((sum + 8) >> 4) as u8;
        }
    }
}
