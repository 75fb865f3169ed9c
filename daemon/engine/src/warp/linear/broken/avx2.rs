//! Looks at eight broken pixels of a row at a time.
//!
//! Whether a candidate is good is as random as the edges that broken cells lie on, so that nothing
//! branches on it. Candidates beyond the grid are those of its edge again, which changes nothing.
//! The caller asks the processor whether it has AVX2.

use std::arch::x86_64::{
    __m256i, _mm_cvtsi32_si128, _mm256_abs_epi32, _mm256_add_epi32, _mm256_and_si256,
    _mm256_andnot_si256, _mm256_cmpeq_epi32, _mm256_cmpgt_epi32, _mm256_i32gather_epi32,
    _mm256_loadu_si256, _mm256_madd_epi16, _mm256_max_epi32, _mm256_max_epu32, _mm256_min_epi32,
    _mm256_min_epu32, _mm256_movemask_epi8, _mm256_mullo_epi32, _mm256_or_si256, _mm256_set1_epi32,
    _mm256_setzero_si256, _mm256_slli_epi16, _mm256_slli_epi32, _mm256_sra_epi32,
    _mm256_srai_epi32, _mm256_srli_epi32, _mm256_sub_epi32,
};

use super::{CLASSES, Holes, NEIGHBOURS, OlderPixel};
use crate::field::FieldAxis;
use crate::key::Velocity;
use crate::plane::Plane;
use crate::warp::linear::cpu::Frame;
use crate::warp::resolve::{CellClass, HOLE};

/// Pixels of one step.
const LANES: usize = 8;

/// Eight numbers in memory.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
union Eight {
    vector: __m256i,
    lanes: [i32; LANES],
}

/// What the key says about one candidate of each pixel.
#[derive(Clone, Copy)]
struct Judged {
    /// Of the surface that the key shows there; 0 where that does not come to the pixel.
    depth: __m256i,
    /// The error, with the number of the candidate below it. All ones where it does not come.
    rank: __m256i,
}

/// [`super::broken_among`].
#[target_feature(enable = "avx2")]
pub(super) fn broken_among(classes: &[CellClass; CLASSES]) -> u32 {
    const { assert!(CellClass::Smooth as u8 == 0 && CellClass::Broken as u8 == 1) };
    // SAFETY: there are 32 classes of 8 bits, and the load needs no alignment.
    let classes = unsafe { _mm256_loadu_si256(classes.as_ptr().cast()) };
    _mm256_movemask_epi8(_mm256_slli_epi16(classes, 7)).cast_unsigned()
}

/// Where `pixels` (column and cell) of row `index_y` are read, appended to `places`.
#[target_feature(enable = "avx2")]
pub(super) fn places(
    frame: &Frame<'_>,
    index_y: u32,
    pixels: &[[u16; 2]],
    [place_xs, place_ys]: &mut [Vec<i32>; 2],
    older: &mut Vec<OlderPixel>,
) {
    let mut holes = Holes::new(frame, index_y);
    let cell_y = holes.cell_y;
    let last_row = frame.field.carried.height() - 1;
    let rows = [cell_y.saturating_sub(1), cell_y, (cell_y + 1).min(last_row)];
    for pixels in pixels.chunks(LANES) {
        // Places that are left over take the first pixel once more.
        let mut eight = [pixels[0]; LANES];
        eight[..pixels.len()].copy_from_slice(pixels);
        let (xs, ys, found) = eight_places(frame, index_y, rows, &eight);
        for (i, pixel) in pixels.iter().enumerate() {
            // SAFETY: both members are 32 bytes that any value may have.
            let (place, found) =
                unsafe { ([xs.lanes[i], ys.lanes[i]], found.lanes[i].cast_unsigned()) };
            let place = if found == u32::MAX { holes.place(*pixel, older) } else { place };
            place_xs.push(place[0]);
            place_ys.push(place[1]);
        }
    }
}

/// Where eight pixels are read, x and y, and the smallest rank of each, all ones where no
/// candidate comes to it.
#[inline]
#[target_feature(enable = "avx2")]
fn eight_places(
    frame: &Frame<'_>,
    index_y: u32,
    rows: [u32; 3],
    pixels: &[[u16; 2]; LANES],
) -> (Eight, Eight, Eight) {
    // SAFETY: there are 8 times two values of 16 bits, and the load needs no alignment.
    let pixels = unsafe { _mm256_loadu_si256(pixels.as_ptr().cast()) };
    let column = _mm256_and_si256(pixels, _mm256_set1_epi32(0xffff));
    let cell = _mm256_srli_epi32(pixels, 16);
    let [first_x, p_y] = frame.centre([0, index_y]);
    let p = [
        _mm256_add_epi32(_mm256_slli_epi32(column, 8), _mm256_set1_epi32(first_x)),
        _mm256_set1_epi32(p_y),
    ];
    let last = _mm256_set1_epi32(frame.field.carried.width().cast_signed() - 1);
    let one = _mm256_set1_epi32(1);
    let columns = [
        _mm256_max_epi32(_mm256_sub_epi32(cell, one), _mm256_setzero_si256()),
        cell,
        _mm256_min_epi32(_mm256_add_epi32(cell, one), last),
    ];
    let mut moved = [[_mm256_setzero_si256(); 2]; NEIGHBOURS];
    let mut judged = [Judged { depth: moved[0][0], rank: moved[0][0] }; NEIGHBOURS];
    let mut nearest = _mm256_setzero_si256();
    for (i, (moved, judged)) in moved.iter_mut().zip(&mut judged).enumerate() {
        let velocity = gather(&frame.field.carried, rows[i / 3], columns[i % 3]);
        *moved = displacement(velocity, frame.phase.q12());
        *judged = judge(frame, p, velocity, *moved, i as i32);
        nearest = _mm256_max_epu32(nearest, judged.depth);
    }
    let limit = _mm256_sub_epi32(nearest, _mm256_srli_epi32(nearest, 8));
    let mut best = [_mm256_set1_epi32(-1), p[0], p[1]];
    for (judged, [dx, dy]) in judged.into_iter().zip(moved) {
        let is_near = _mm256_cmpeq_epi32(_mm256_max_epu32(judged.depth, limit), judged.depth);
        let rank = or_ones(judged.rank, is_near);
        // Ranks differ, but where both are all ones.
        let smallest = _mm256_min_epu32(best[0], rank);
        let is_better =
            _mm256_andnot_si256(_mm256_cmpeq_epi32(smallest, best[0]), _mm256_set1_epi32(-1));
        let pick = |a: __m256i, b: __m256i| {
            _mm256_or_si256(_mm256_and_si256(is_better, a), _mm256_andnot_si256(is_better, b))
        };
        best = [
            smallest,
            pick(_mm256_sub_epi32(p[0], dx), best[1]),
            pick(_mm256_sub_epi32(p[1], dy), best[2]),
        ];
    }
    let [rank, xs, ys] = best.map(|vector| Eight { vector });
    (xs, ys, rank)
}

/// Displacements of eight velocities at `phase`, Q12.
#[inline]
#[target_feature(enable = "avx2")]
fn displacement(velocity: __m256i, phase: i32) -> [__m256i; 2] {
    // A phase is at most 16384: products of 16 bits hold it.
    let axis = |v: __m256i| {
        let product = _mm256_madd_epi16(v, _mm256_set1_epi32(phase | phase << 16));
        _mm256_srai_epi32(_mm256_add_epi32(product, _mm256_set1_epi32(256)), 9)
    };
    let low = _mm256_set1_epi32(0xffff);
    [axis(_mm256_and_si256(velocity, low)), axis(_mm256_andnot_si256(low, velocity))]
}

#[inline]
#[target_feature(enable = "avx2")]
fn judge(
    frame: &Frame<'_>,
    p: [__m256i; 2],
    velocity: __m256i,
    [dx, dy]: [__m256i; 2],
    number: i32,
) -> Judged {
    let (map, valid, source) = (frame.map, frame.valid, &frame.field.source);
    let (column, in_columns) = pixel(&map.x, valid.x, _mm256_sub_epi32(p[0], dx));
    let (row, in_rows) = pixel(&map.y, valid.y, _mm256_sub_epi32(p[1], dy));
    let cells = _mm256_set1_epi32(source.depth.width().cast_signed());
    let cell =
        _mm256_add_epi32(_mm256_mullo_epi32(cell_of(&map.y, row), cells), cell_of(&map.x, column));
    // SAFETY: both coordinates are cells of the grid, of which both planes have the size
    // (`Frame::new`); a depth key has 4 bytes, and so has a velocity.
    let (depth, near) = unsafe {
        (
            _mm256_i32gather_epi32::<4>(source.depth.data().as_ptr().cast(), cell),
            _mm256_i32gather_epi32::<4>(source.velocity.data().as_ptr().cast(), cell),
        )
    };
    let [near_dx, near_dy] = displacement(near, frame.phase.q12());
    let error = _mm256_add_epi32(
        _mm256_abs_epi32(_mm256_sub_epi32(near_dx, dx)),
        _mm256_abs_epi32(_mm256_sub_epi32(near_dy, dy)),
    );
    let hole = _mm256_set1_epi32(
        i32::from(HOLE.x.cast_unsigned()) | i32::from(HOLE.y.cast_unsigned()) << 16,
    );
    let is_far = _mm256_cmpgt_epi32(error, _mm256_set1_epi32(frame.one_cell));
    let comes = _mm256_andnot_si256(
        _mm256_or_si256(is_far, _mm256_cmpeq_epi32(velocity, hole)),
        _mm256_and_si256(in_columns, in_rows),
    );
    let rank = _mm256_or_si256(_mm256_slli_epi32(error, 4), _mm256_set1_epi32(number));
    Judged { depth: _mm256_and_si256(depth, comes), rank: or_ones(rank, comes) }
}

/// The pixels nearest to `q` along an axis, counted from `start` and clamped to it, and which of
/// them were inside.
#[inline]
#[target_feature(enable = "avx2")]
fn pixel(axis: &FieldAxis, start: u32, q: __m256i) -> (__m256i, __m256i) {
    let nearest = _mm256_srai_epi32(_mm256_add_epi32(q, _mm256_set1_epi32(128)), 8);
    let pixel = _mm256_sub_epi32(nearest, _mm256_set1_epi32(start.cast_signed()));
    let last = _mm256_set1_epi32(axis.pixels().cast_signed() - 1);
    let clamped = _mm256_min_epi32(_mm256_max_epi32(pixel, _mm256_setzero_si256()), last);
    (clamped, _mm256_cmpeq_epi32(clamped, pixel))
}

/// The cells that hold pixels of an axis, which were clamped to it.
#[inline]
#[target_feature(enable = "avx2")]
fn cell_of(axis: &FieldAxis, pixel: __m256i) -> __m256i {
    if let Some((addend, shift)) = axis.cell_by_shift() {
        let place = _mm256_add_epi32(_mm256_slli_epi32(pixel, 8), _mm256_set1_epi32(addend));
        let cell = _mm256_sra_epi32(place, _mm_cvtsi32_si128(shift.cast_signed()));
        let last = _mm256_set1_epi32(axis.cells().cast_signed() - 1);
        return _mm256_min_epi32(_mm256_max_epi32(cell, _mm256_setzero_si256()), last);
    }
    let table = axis.cell_of_all();
    assert!(table.len() > axis.pixels() as usize, "one entry more than pixels");
    // SAFETY: pixels were clamped to the axis. The table has an entry of 2 bytes for each of them
    // and one more, so that 4 bytes can be read at every one.
    let two = unsafe { _mm256_i32gather_epi32::<2>(table.as_ptr().cast(), pixel) };
    _mm256_and_si256(two, _mm256_set1_epi32(0xffff))
}

/// Eight velocities of row `y`, in columns of the plane.
#[inline]
#[target_feature(enable = "avx2")]
fn gather(plane: &Plane<[i16; 2]>, y: u32, columns: __m256i) -> __m256i {
    // SAFETY: the columns are those of broken cells, which `Frame::new` found to be as many as the
    // row has, and their neighbours, clamped to it; its elements have 4 bytes.
    unsafe { _mm256_i32gather_epi32::<4>(plane.row(y).as_ptr().cast(), columns) }
}

/// `value` where `mask` is set, else all ones.
#[inline]
#[target_feature(enable = "avx2")]
fn or_ones(value: __m256i, mask: __m256i) -> __m256i {
    _mm256_or_si256(value, _mm256_andnot_si256(mask, _mm256_set1_epi32(-1)))
}

const _: () = assert!(size_of::<Velocity>() == 4, "a gather reads a velocity as one word");
