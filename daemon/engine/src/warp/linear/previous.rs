//! The background memory: where the keys before show what a hole would, (4) of [`super`].
//!
//! A surface that something nearer hides stays remembered in the keys that saw it, for
//! [`kept_keys`] keys. With `D_k` how far the far surface f came since the k-th key before:
//!
//! ```text
//! (a) D_1 = how far f came to the newest key
//! (b) D_k = D_(k-1) + how far the surface came to key k - 1 that this shows where f was, or, as
//!           what made the hole may have hidden it there, as close to that as possible on the side
//!           away from the hole, within 16 cells and within 1/32 of the depth of f; none where
//!           something farther comes first, or that differs from D_1 by more than half a pixel
//! (c) the hole shows key k at q - D_k if that shows there the depth of f as key k - 1 has it, to
//!     1/32, and every key after k something nearer
//! ```
//!
//! So a key counts only where the surface itself led to it, and where those after it hid the place:
//! one that shows something farther there has proved that f does not reach so far. The motion of
//! every interval is the application's own, and nothing is sampled twice. Only holes pay.

use super::cpu::Frame;
use super::fill::{FarSurface, clamp, nearest_pixel};
use crate::key::{KeyFrame, Velocity};
use crate::plane::Plane;

/// Depth keys of the far side in two keys may differ by this fraction (a shift of 5: 1/32). Of
/// three captures one gains 0.4 dB from 1/8 to 1/32 and half of that at 1/64, and one loses 0.1 dB
/// at 1/8 and nothing at 1/32.
pub const DEPTH_SHIFT: u32 = 5;

/// Keys before the newest that holes may show.
pub const MOST_KEYS: usize = 4;

/// Cells that (b) goes to find the surface in sight.
pub const REACH: i32 = 16;

/// How far a surface's motion over one interval may differ from that over the newest, 1/32 pixel.
pub const STEADY: u16 = 16;

/// Bytes that a device may be asked to hold of the fields of all keys, at 8 bytes a cell.
const MOST_BYTES: usize = 1 << 27;

/// How many keys before the newest holes may show, on a field of so many cells: none where two
/// fields would not fit (more than 8 388 608 cells).
#[must_use]
pub const fn kept_keys(cells: usize) -> usize {
    let held = MOST_BYTES / (8 * if cells == 0 { 1 } else { cells });
    if held > MOST_KEYS { MOST_KEYS } else { held.saturating_sub(1) }
}

/// What holes read of one key before the newest, beside its colour.
#[derive(Clone, Copy)]
struct Kept<'a> {
    /// Its depth, on a grid of the same size.
    depth: &'a Plane<u32>,
    /// How far the surfaces of the key after it came since.
    came: &'a Plane<Velocity>,
}

/// The keys that holes after the newest may show, the one before it first.
#[derive(Clone, Copy, Default)]
pub(super) struct Memory<'a> {
    keys: [Option<Kept<'a>>; MOST_KEYS],
}

/// Where a far surface was in the keys before, as far back as holes have asked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    /// The source that the surface shows in the newest key, and its centre.
    source: usize,
    from: [i32; 2],
    /// The step away from the hole, (b).
    away: [i32; 2],
    /// By key: how far it came since, Q8 pixels, and its depth key.
    steps: [([i32; 2], u32); MOST_KEYS],
    count: usize,
    /// Whether it was not found further back.
    is_over: bool,
}

/// Whether holes after `key` may show what `older`, the key before it, shows: its motion points
/// back to it, no cut lies between them, and both have depth, motion and one geometry.
#[must_use]
fn has_previous(key: &KeyFrame, older: &KeyFrame) -> bool {
    let size = |key: &KeyFrame| {
        let (color, depth) = (&key.color, &key.depth);
        [color.width(), color.height(), depth.width(), depth.height()]
    };
    !key.is_found_cut
        && key.motion_from == Some(older.content_time)
        && older.motion_from.is_some()
        && !key.depth.data().is_empty()
        && !key.velocity.data().is_empty()
        && !older.velocity.data().is_empty()
        && size(key) == size(older)
        && key.color.format() == older.color.format()
        && key.valid == older.valid
}

/// Of `past`, the keys before `key` from the newest on, how many holes after `key` may show.
#[must_use]
pub fn linked_keys(key: &KeyFrame, past: &[&KeyFrame]) -> usize {
    let newer = std::iter::once(key).chain(past.iter().copied());
    let links = newer.zip(past).take(kept_keys(key.depth.data().len()));
    links.take_while(|(key, older)| has_previous(key, older)).count()
}

/// How far the surfaces of `key` came since the key before.
#[must_use]
fn came(key: &KeyFrame) -> &Plane<Velocity> {
    if key.came.data().is_empty() { &key.velocity } else { &key.came }
}

impl<'a> Memory<'a> {
    /// The memory of `key`; `past` are the keys before it, from the newest on.
    pub(super) fn of(key: &'a KeyFrame, past: &[&'a KeyFrame]) -> Self {
        let mut memory = Self::default();
        let newer = std::iter::once(key).chain(past.iter().copied());
        let links = newer.zip(past).take(linked_keys(key, past));
        for (kept, (key, older)) in memory.keys.iter_mut().zip(links) {
            *kept = Some(Kept { depth: &older.depth, came: came(key) });
        }
        memory
    }

    /// Adds to `way` where its surface was one key further back, (a) and (b); false if it is not
    /// known.
    fn step_back(&self, frame: &Frame<'_>, way: &mut Way) -> bool {
        if way.is_over {
            return false;
        }
        let found = self.earlier(frame, way);
        match found {
            Some(step) => {
                way.steps[way.count] = step;
                way.count += 1;
            }
            None => way.is_over = true,
        }
        found.is_some()
    }

    fn earlier(&self, frame: &Frame<'_>, way: &Way) -> Option<([i32; 2], u32)> {
        let kept = self.keys.get(way.count).copied().flatten()?;
        let first = self.keys[0]?.came.data()[way.source];
        let (total, depth, came) = match way.count.checked_sub(1) {
            None => ([0; 2], frame.field.source.depth.data()[way.source], first),
            Some(newer) => {
                let (total, depth) = way.steps[newer];
                let newer = self.keys[newer]?.depth;
                let start = [way.from[0] - total[0], way.from[1] - total[1]];
                let seen = in_sight(frame, newer, depth, start, way.away)?;
                let came = kept.came.data()[seen];
                if !is_steady(first, came) {
                    return None;
                }
                (total, newer.data()[seen], came)
            }
        };
        // 1/32 pixels in Q8.
        let further = [total[0] + (i32::from(came.x) << 3), total[1] + (i32::from(came.y) << 3)];
        came.is_trackable().then_some((further, depth))
    }

    /// (c): the key, counted from 0, and the place in it, Q8 pixels, that shows what the surface of
    /// `way` shows at `q` of the newest key, behind something.
    pub(super) fn place(
        &self,
        frame: &Frame<'_>,
        way: &mut Way,
        q: [i32; 2],
    ) -> Option<(u8, [i32; 2])> {
        for (index, kept) in (0..).zip(self.keys.iter().flatten()) {
            // Most holes end with the first key: the way goes on for those that do not.
            if way.count <= usize::from(index) && !self.step_back(frame, way) {
                return None;
            }
            let (total, depth) = way.steps[usize::from(index)];
            let q = [q[0] - total[0], q[1] - total[1]];
            let seen = kept.depth.data()[cell_at(frame, q)?];
            if !is_same(seen, depth) {
                if seen > depth {
                    continue;
                }
                return None;
            }
            let [x, y] = q.map(|q| q & !0xff);
            let corners = [[x, y], [x + 256, y], [x, y + 256], [x + 256, y + 256]];
            let mixes = corners.into_iter().any(|at| !kept.shows(frame, clamp(frame, at), depth));
            return Some((index, if mixes { nearest_pixel(q) } else { q }));
        }
        None
    }
}

impl Way {
    /// Of the surface `far` that the holes in `cell` continue.
    pub(super) fn new(frame: &Frame<'_>, far: &FarSurface, cell: [u32; 2]) -> Self {
        let width = frame.map.x.cells();
        let centre = |[x, y]: [u32; 2]| [frame.map.x.centre(x), frame.map.y.centre(y)];
        let shown = centre([far.cell % width, far.cell / width]);
        Self {
            source: far.source as usize,
            from: centre([far.source % width, far.source / width]),
            away: away(centre(cell), shown, frame.one_cell),
            steps: Default::default(),
            count: 0,
            is_over: false,
        }
    }
}

impl Kept<'_> {
    /// Whether it shows a surface of depth key `depth` at the pixel nearest to `q`.
    fn shows(&self, frame: &Frame<'_>, q: [i32; 2], depth: u32) -> bool {
        cell_at(frame, q).is_some_and(|cell| is_same(self.depth.data()[cell], depth))
    }
}

/// The cell, from `start` on by steps of `away`, where `depths` show a surface of depth key `depth`,
/// and did a step before: the cell beside something nearer has that one's motion, as it is dilated.
/// None where what is farther, or the border, comes first.
fn in_sight(
    frame: &Frame<'_>,
    depths: &Plane<u32>,
    depth: u32,
    start: [i32; 2],
    away: [i32; 2],
) -> Option<usize> {
    let depths = depths.data();
    let at = |i: i32| cell_at(frame, [start[0] + i * away[0], start[1] + i * away[1]]);
    let mut was_same = at(-1).is_some_and(|cell| is_same(depths[cell], depth));
    for i in 0..=REACH {
        let cell = at(i)?;
        let is_its = is_same(depths[cell], depth);
        if is_its && was_same {
            return Some(cell);
        }
        if !is_its && depths[cell] < depth {
            return None;
        }
        was_same = is_its;
    }
    None
}

/// The cell that holds the pixel nearest to `q`; None outside.
fn cell_at(frame: &Frame<'_>, q: [i32; 2]) -> Option<usize> {
    // Left of or above the rectangle the difference wraps and is larger than any size.
    let column = (((q[0] + 128) >> 8) - frame.valid.x.cast_signed()).cast_unsigned();
    let row = (((q[1] + 128) >> 8) - frame.valid.y.cast_signed()).cast_unsigned();
    if column >= frame.valid.width || row >= frame.valid.height {
        return None;
    }
    let (x, y) = (frame.map.x.cell_of(column), frame.map.y.cell_of(row));
    Some(y as usize * frame.map.x.cells() as usize + x as usize)
}

/// Whether depth keys of two keys are of one surface.
fn is_same(was: u32, depth: u32) -> bool {
    was.abs_diff(depth) <= (was.max(depth) >> DEPTH_SHIFT) + 1
}

/// Whether two steps of a surface differ by [`STEADY`] at most.
fn is_steady(a: Velocity, b: Velocity) -> bool {
    a.x.abs_diff(b.x).max(a.y.abs_diff(b.y)) <= STEADY
}

/// A cell's step from `hole` on beyond `far`, along the axis in which they lie farther apart, down
/// among equals.
fn away(hole: [i32; 2], far: [i32; 2], one_cell: i32) -> [i32; 2] {
    let [x, y] = [far[0] - hole[0], far[1] - hole[1]];
    if x.abs() > y.abs() { [x.signum() * one_cell, 0] } else { [0, y.signum() * one_cell] }
}
