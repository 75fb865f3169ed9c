//! The parameters that every kernel's shader shares, and how the field map goes to it.
//!
//! A parameter is computed here once, with the functions that the CPU's kernels use, so that the
//! two cannot differ in it. `common.wgsl` declares the same struct; a test compares the offsets.

use zerocopy::{Immutable, IntoBytes};

use crate::color::ColorFormat;
use crate::field::{FieldAxis, FieldMap};
use crate::finish::shares::Split;
use crate::key::KeyFrame;
use crate::phase::Phase;
use crate::warp::linear::one_cell;
use crate::warp::resolve::smooth_limit;
use crate::warp::scatter::phase_in_cells;
use crate::warp::voxel::OlderPart;

/// What every kernel's shader reads beside planes: `FrameParams` of `common.wgsl`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, IntoBytes, Immutable)]
#[repr(C)]
pub struct FrameParams {
    /// Columns and rows of the colour plane.
    pub size: [u32; 2],
    /// First column and row of the valid rectangle.
    pub valid_start: [u32; 2],
    /// Columns and rows of the valid rectangle.
    pub valid_size: [u32; 2],
    /// Columns and rows of the field grid; 0 without one.
    pub cells: [u32; 2],
    /// The phase in the unit that turns velocities into Q8 cells, per axis.
    pub cell_scale: [i32; 2],
    /// The phase, Q12.
    pub phase: i32,
    /// Largest range of velocities around a smooth cell, 1/32 pixel per span.
    pub smooth_limit: u32,
    /// Mean of a cell's width and height, Q8 pixels.
    pub one_cell: i32,
    /// 1 where the key has depth, else 0.
    pub has_depth: u32,
    /// Columns and rows of the mesh's cells; 0 without one.
    pub mesh_cells: [u32; 2],
    /// Frames that share the light of a key; 0 where nothing is finished.
    pub frames: u32,
    /// 1 where the picture is the key of those frames, 0 where it is one of the others.
    pub is_key: u32,
    /// Levels of a colour channel.
    pub levels: u32,
    /// How far the light of an in-between frame may lie from the original's.
    pub most_step: u32,
    /// 1 where tiles are blurred as far as their weights say, 0 where all of the picture is.
    pub is_selective: u32,
    /// 1 where depths of the newest key and the one before can be compared, else 0.
    pub compares_depth: u32,
    /// First column and row of the valid rectangle of the key before.
    pub older_start: [u32; 2],
    /// Columns and rows of that.
    pub older_size: [u32; 2],
    /// Columns and rows of its field grid; 0 without one.
    pub older_cells: [u32; 2],
    /// From the key before to a frame between the two, Q12.
    pub ahead: i32,
    /// Its share in that frame, 1/256.
    pub older_weight: u32,
    /// Of how many keys fields are held, and which of them in turn is the newest one's.
    pub held_fields: u32,
    /// See there.
    pub newest_field: u32,
}

impl FrameParams {
    /// Of the frame at `phase` after `key`; `map` is the map of its field, if it has one.
    #[must_use]
    pub fn new(key: &KeyFrame, map: &FieldMap, phase: Phase) -> Self {
        let valid = key.valid;
        let mut params = Self {
            size: [key.color.width(), key.color.height()],
            valid_start: [valid.x, valid.y],
            valid_size: [valid.width, valid.height],
            phase: phase.q12(),
            has_depth: u32::from(!key.depth.data().is_empty()),
            ..Self::default()
        };
        if !key.velocity.data().is_empty() {
            params.cells = [map.x.cells(), map.y.cells()];
            params.cell_scale = [phase_in_cells(phase, &map.x), phase_in_cells(phase, &map.y)];
            params.smooth_limit = u32::from(smooth_limit(phase));
            params.one_cell = one_cell(map);
        }
        params
    }

    /// The same of a frame between `older` and `newer`: `part` is the part of `older` in it.
    /// `is_still` says that nothing moves.
    #[must_use]
    pub fn between(self, keys: [&KeyFrame; 2], part: OlderPart, is_still: bool) -> Self {
        let [older, newer] = keys;
        let has_depth = [older, newer].iter().all(|key| !key.depth.data().is_empty());
        Self {
            compares_depth: u32::from(has_depth && !is_still),
            older_start: [older.valid.x, older.valid.y],
            older_size: [older.valid.width, older.valid.height],
            older_cells: [older.depth.width(), older.depth.height()],
            ahead: part.ahead.q12(),
            older_weight: part.weight,
            ..self
        }
    }

    /// The same with what finishing makes of the picture.
    #[must_use]
    pub fn finished(self, split: &Split<'_>) -> Self {
        let [table, ..] = &split.tables.channels;
        Self {
            frames: table.frames(),
            is_key: u32::from(split.is_key),
            levels: u32::from(table.table().last_level()) + 1,
            most_step: table.most_step(),
            is_selective: u32::from(split.weights.is_some()),
            ..self
        }
    }
}

/// The words of `compensate.wgsl`'s lights: by channel and level the light, then by channel and
/// level the light from which on the next level is nearer, `u32::MAX` where there is no next one.
#[must_use]
pub fn light_words(split: &Split<'_>) -> Vec<u32> {
    let tables = split.tables.channels.each_ref().map(|channel| channel.table().words());
    let lights = tables.iter().flat_map(|[lights, _]| lights.iter().copied());
    let borders = tables.iter().flat_map(|[_, borders]| borders.iter().copied().chain([u32::MAX]));
    lights.chain(borders).collect()
}

/// The words of `compensate.wgsl`'s weights, four tiles to a word; one word where there are none.
pub fn weight_words(split: &Split<'_>, words: &mut Vec<u32>) {
    words.clear();
    let weights = split.weights.map_or(&[0; 4][..], |weights| weights.data());
    words.extend(
        weights
            .chunks(4)
            .map(|four| four.iter().rev().fold(0, |word, weight| word << 8 | u32::from(*weight))),
    );
}

/// What shaders call a colour format: the constants of `color.wgsl`.
#[must_use]
pub const fn format_code(format: ColorFormat) -> u32 {
    match format {
        ColorFormat::Rgba8 => 0,
        ColorFormat::Rgb10a2 => 1,
        ColorFormat::Rgba16f => 2,
    }
}

/// The words of `field.wgsl`'s tables: one per column of the valid rectangle, one per row, then the
/// centres of the columns and of the rows of cells, then the first pixels of both with the end.
///
/// A pixel's word holds the cell before it in bits 0 to 15, the way to the next one in bits 16 to
/// 23, and above them what is to be added for the cell that holds the pixel, 0 or 1.
pub fn map_words(map: &FieldMap, words: &mut Vec<u32>) {
    words.clear();
    let axes = [&map.x, &map.y];
    for axis in axes {
        place_words(axis, words);
    }
    for axis in axes {
        words.extend((0..axis.cells()).map(|cell| axis.centre(cell).cast_unsigned()));
    }
    for axis in axes {
        words.extend((0..axis.cells() as usize).map(|cell| axis.pixels_of(cell).start as u32));
        words.push(axis.pixels());
    }
}

/// Adds the words of the pixels of one axis.
pub fn place_words(axis: &FieldAxis, words: &mut Vec<u32>) {
    words.extend((0..axis.pixels()).map(|index| place_word(axis, index)));
}

fn place_word(axis: &FieldAxis, index: u32) -> u32 {
    let ((before, way), cell) = (axis.before(index), axis.cell_of(index));
    before | way << 16 | (cell - before) << 24
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Rect;

    #[test]
    fn the_cell_that_holds_a_pixel_is_the_one_before_it_or_the_next() {
        for (pixels, cells, offset) in [(853, 569, 0), (17, 9, 90), (640, 640, -200), (40, 10, 700)]
        {
            let mut map = FieldMap::default();
            map.update(Rect { x: 3, y: 0, width: pixels, height: 1 }, [cells, 1], [offset, 0]);
            let mut words = Vec::new();
            map_words(&map, &mut words);
            assert_eq!(words.len() as u32, pixels + 1 + cells + 1 + cells + 1 + 2);
            for index in 0..pixels {
                let word = words[index as usize];
                assert!(word >> 24 <= 1, "pixel {index} of {pixels}");
                assert_eq!((word & 0xffff) + (word >> 24), map.x.cell_of(index));
                assert_eq!((word & 0xffff, word >> 16 & 0xff), map.x.before(index));
            }
        }
    }
}
