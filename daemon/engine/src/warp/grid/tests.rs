//! Laws of the grid warp, and a reference drawer that tests every triangle at every pixel.

use proptest::prelude::*;

use super::mesh::{Layout, Mesh, MeshTriangle};
use super::pyramid::{Entry, Field, LARGEST, difference, magnitude_code, maximum};
use super::triangle::{Point, SourceMap, cross};
use super::{GridScratch, warp_grid};
use crate::color::{ColorFormat, ColorPlane, OrderedRgba16, Rgb10a2, Rgba8};
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::time::MonoTime;
use crate::warp::sample::sample;

/// A 32-bit permutation, for colours and fields without a pattern.
fn scramble(index: u32) -> u32 {
    let mixed = (index ^ 0x9e37_79b9).wrapping_mul(0x85eb_ca6b);
    (mixed ^ mixed >> 15).wrapping_mul(0xc2b2_ae35)
}

/// A still key of noise over its whole picture, with a field of this size and no depth.
fn still_key(width: u32, height: u32, field: [u32; 2]) -> KeyFrame {
    let texels = (0..width * height).map(|i| Rgba8(scramble(i))).collect();
    KeyFrame {
        content_time: MonoTime::from_ns(1),
        motion_from: Some(MonoTime::ZERO),
        color: ColorPlane::Rgba8(Plane::from_vec(width, height, texels)),
        valid: Rect::full(width, height),
        velocity: Plane::new(field[0], field[1]),
        ..KeyFrame::default()
    }
}

fn set_field(key: &mut KeyFrame, cell: impl Fn(u32, u32) -> ([i16; 2], u32)) {
    let (width, height) = (key.velocity.width(), key.velocity.height());
    key.depth = Plane::new(width, height);
    for y in 0..height {
        for x in 0..width {
            let ([vx, vy], depth) = cell(x, y);
            key.velocity.row_mut(y)[x as usize] = Velocity { x: vx, y: vy };
            key.depth.row_mut(y)[x as usize] = depth;
        }
    }
}

/// Gives each cell the motion of the nearest surface in 3x3, as the engine does with every key.
fn dilate(key: &mut KeyFrame) {
    let (width, height) = (key.velocity.width(), key.velocity.height());
    let sharp = key.velocity.clone();
    for y in 0..height {
        for x in 0..width {
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            let around = (y.saturating_sub(1)..(y + 2).min(height))
                .flat_map(|row| columns.clone().map(move |column| (column, row)));
            let nearest = around.max_by_key(|&(column, row)| key.depth.at(column, row)).unwrap();
            key.velocity.row_mut(y)[x as usize] = sharp.at(nearest.0, nearest.1);
        }
    }
}

fn warp(key: &KeyFrame, phase: Phase, threads: usize) -> ColorPlane {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut out = ColorPlane::new(key.color.format(), key.color.width(), key.color.height());
    warp_grid(key, phase, &mut out, &mut GridScratch::default(), &pool);
    out
}

fn texels(color: &ColorPlane) -> &Plane<Rgba8> {
    match color {
        ColorPlane::Rgba8(plane) => plane,
        _ => unreachable!("keys of these tests are rgba8"),
    }
}

/// All triangles of the warped mesh, ascending by cell id.
fn triangles(key: &KeyFrame, phase: Phase) -> Vec<MeshTriangle> {
    let mut mesh = Mesh::default();
    mesh.snap(key);
    mesh.advance(phase);
    let rows: Vec<usize> = mesh.cell_rows().map(|(row, _)| row).collect();
    rows.into_iter().flat_map(|row| mesh.triangles(row)).collect()
}

/// Whether a clockwise triangle has the centre of pixel (`x`, `y`) inside, by the top-left rule.
fn covers(corners: [Point; 3], x: u32, y: u32) -> bool {
    let center = [i64::from(x) * 16, i64::from(y) * 16];
    let wide = corners.map(|point| point.map(i64::from));
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(from, to)| {
        let (a, b) = (wide[from], wide[to]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let edge = dx * (center[1] - a[1]) - dy * (center[0] - a[0]);
        edge > 0 || (edge == 0 && (dy < 0 || (dy == 0 && dx > 0)))
    })
}

/// Triangles over a pixel that kept their orientation, minus those turned over.
fn winding(triangles: &[MeshTriangle], x: u32, y: u32) -> i32 {
    let count = |triangle: &MeshTriangle| {
        let [a, b, c] = triangle.moved;
        match cross(a, b, c) {
            0 => 0,
            positive if positive > 0 => i32::from(covers([a, b, c], x, y)),
            _ => -i32::from(covers([a, c, b], x, y)),
        }
    };
    triangles.iter().map(count).sum()
}

/// What equations (2) and (3) say, pixel by pixel.
fn reference(key: &KeyFrame, phase: Phase) -> Plane<Rgba8> {
    let triangles = triangles(key, phase);
    let color = texels(&key.color);
    let mut out = color.clone();
    for y in key.valid.y..key.valid.y + key.valid.height {
        for x in key.valid.x..key.valid.x + key.valid.width {
            let over: Vec<_> = triangles.iter().filter(|it| covers(it.moved, x, y)).collect();
            let nearest = over.iter().map(|it| it.depth >> 1).max().expect("no pixel stays empty");
            let winner = over
                .into_iter()
                .find(|it| it.depth >> 1 >= nearest - (nearest >> 8))
                .expect("the nearest is within tolerance of itself");
            let source = SourceMap::new(winner).at(x.cast_signed(), y.cast_signed());
            out.row_mut(y)[x as usize] = sample(color, key.valid, source[0], source[1]);
        }
    }
    out
}

/// Code and place, relative to `regular`, of the largest one-sided gradient in `cells`; of equal
/// ones the nearest to `regular`, then topmost, then leftmost.
fn search(field: &Field<'_>, cells: Rect, regular: [u32; 2]) -> (u16, [i32; 2]) {
    let speed = |v: Velocity| i32::from(v.x).abs() + i32::from(v.y).abs();
    let gradient = |x: u32, y: u32| {
        let steps = [(-1, 0), (1, 0), (0, -1), (0, 1)];
        let around = steps.into_iter().filter_map(|(dx, dy)| {
            let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
            (x < field.velocity.width() && y < field.velocity.height()).then_some((x, y))
        });
        let (here, depth) = (field.velocity(x, y), field.depth(x, y));
        let behind = around.filter(|&(x, y)| {
            depth > field.depth(x, y)
                || (depth == field.depth(x, y) && speed(here) >= speed(field.velocity(x, y)))
        });
        behind
            .map(|(x, y)| magnitude_code(difference(here, field.velocity(x, y))))
            .max()
            .unwrap_or(0)
    };
    (cells.y..cells.y + cells.height)
        .flat_map(|y| (cells.x..cells.x + cells.width).map(move |x| [x, y]))
        .map(|[x, y]| {
            let offset =
                [0, 1].map(|axis| [x, y][axis].cast_signed() - regular[axis].cast_signed());
            (gradient(x, y), offset)
        })
        .min_by_key(|&(code, [x, y])| (std::cmp::Reverse(code), x.abs() + y.abs(), y, x))
        .expect("a neighbourhood has cells")
}

prop_compose! {
    /// Blocks of motion and depth on a field of any ratio from 1 to 4 to the picture.
    fn any_key()(
        width in 1..90_u32,
        height in 1..70_u32,
        ratio in (4..=16_u32, 4..=16_u32),
        block in 1..12_u32,
        limit in prop_oneof![Just(40_i32), Just(700), Just(32767)],
        has_depth: bool,
        jitter in prop_oneof![Just([0, 0]), [-600..600_i32, -600..600_i32]],
        seed: u32,
    ) -> KeyFrame {
        let field = [(width * 4 / ratio.0).max(1), (height * 4 / ratio.1).max(1)];
        let mut key = still_key(width, height, field);
        key.field_offset = jitter;
        set_field(&mut key, |x, y| {
            let noise = scramble(seed ^ (x / block) ^ (y / block) << 10);
            let axis = |bits: u32| {
                let signed = i32::from(bits as u16 as i16);
                i16::try_from(signed * limit / 32768).unwrap()
            };
            ([axis(noise), axis(noise >> 16)], scramble(noise) & 0xf0f0_0000)
        });
        if !has_depth {
            key.depth = Plane::default();
        }
        key
    }
}

fn any_phase() -> impl Strategy<Value = Phase> {
    (0.0..=4.0).prop_map(Phase::from_f64)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_pixel_is_what_the_reference_says_for_any_number_of_threads(
        key in any_key(),
        phase in any_phase(),
    ) {
        prop_assume!(phase != Phase::ZERO);
        let expected = reference(&key, phase);
        for threads in [1, 2, 5] {
            prop_assert!(texels(&warp(&key, phase, threads)) == &expected, "{threads} threads");
        }
    }

    #[test]
    fn the_mesh_covers_every_pixel_once_more_upright_than_turned_over(
        key in any_key(),
        phase in any_phase(),
    ) {
        let triangles = triangles(&key, phase);
        for y in 0..key.valid.height {
            for x in 0..key.valid.width {
                prop_assert_eq!(winding(&triangles, x, y), 1, "at {}, {}", x, y);
            }
        }
    }

    #[test]
    fn before_the_warp_no_triangle_is_turned_over(key in any_key()) {
        for MeshTriangle { source: [a, b, c], .. } in triangles(&key, Phase::ZERO) {
            prop_assert!(cross(a, b, c) >= 0, "{:?}", [a, b, c]);
        }
    }

    #[test]
    fn a_snapped_vertex_stays_in_its_neighbourhood_and_the_frame_on_the_border(key in any_key()) {
        let mut mesh = Mesh::default();
        mesh.snap(&key);
        let field = [key.velocity.width(), key.velocity.height()];
        let layout = Layout::new(key.valid, field[0], field[1]);
        let (vertices, columns) = mesh.vertices();
        let mut covered = 0;
        for (row, line) in (0..).zip(vertices.chunks(columns)) {
            for (column, vertex) in (0..).zip(line) {
                let is_free = (1..layout.columns() - 1).contains(&column)
                    && (1..layout.rows() - 1).contains(&row);
                let [x, y] = vertex.source;
                if !is_free {
                    let edges = [key.valid.width, key.valid.height].map(|n| (n * 16).cast_signed() - 8);
                    prop_assert!(x == -8 || x == edges[0] || y == -8 || y == edges[1]);
                    prop_assert_eq!(vertex.velocity, Velocity::default());
                    continue;
                }
                let cells = layout.neighbourhood(column, row);
                covered += cells.width * cells.height;
                // Within rounding to 1/16 px; jitter carries neighbourhoods along, up to the frame.
                let inside = |at: i32, axis: usize, first: u32, count: u32, of: u32, pixels: u32| {
                    let edge = |cell: u32| i64::from(cell) * i64::from(pixels) * 16 / i64::from(of) - 8;
                    let jitter = i64::from(key.field_offset[axis]) / 16;
                    let frame = [-8, i64::from(pixels) * 16 - 8];
                    let [low, high] = [edge(first) + jitter - 1, edge(first + count) + jitter + 1]
                        .map(|place| place.clamp(frame[0], frame[1]));
                    (low..=high).contains(&i64::from(at))
                };
                prop_assert!(inside(x, 0, cells.x, cells.width, field[0], key.valid.width));
                prop_assert!(inside(y, 1, cells.y, cells.height, field[1], key.valid.height));
            }
        }
        prop_assert_eq!(covered, field[0] * field[1], "neighbourhoods cover the field once");
    }

    #[test]
    fn the_pyramid_finds_what_a_search_of_all_cells_finds(
        codes in prop::collection::vec(prop_oneof![Just(0_u16), Just(7), 0..64_u16], 64),
        present in (1..=LARGEST, 1..=LARGEST),
    ) {
        let mut level = [[Entry::ABSENT; LARGEST]; LARGEST];
        let mut cells = Vec::new();
        for y in 0..present.1 {
            for x in 0..present.0 {
                let offset = [x as i32 - 4, y as i32 - 4];
                level[y][x] = Entry::new(codes[y * LARGEST + x], offset);
                cells.push((codes[y * LARGEST + x], offset));
            }
        }
        // Largest, then nearest to the regular place, then topmost, then leftmost.
        let order = |&(code, [x, y]): &(u16, [i32; 2])| (std::cmp::Reverse(code), x.abs() + y.abs(), y, x);
        let expected = cells.into_iter().min_by_key(order).unwrap();
        let found = maximum(level);
        prop_assert_eq!((found.magnitude(), found.offset()), expected);
    }

    #[test]
    fn a_vertex_stands_where_a_search_of_every_cell_finds_the_largest_gradient(key in any_key()) {
        let field = Field { velocity: &key.velocity, depth: &key.depth };
        let layout = Layout::new(key.valid, key.velocity.width(), key.velocity.height());
        for row in 1..layout.rows() - 1 {
            for column in 1..layout.columns() - 1 {
                let cells = layout.neighbourhood(column, row);
                let regular = [cells.x + cells.width / 2, cells.y + cells.height / 2];
                let found = field.snap(cells, regular);
                prop_assert_eq!((found.magnitude(), found.offset()), search(&field, cells, regular));
            }
        }
    }

    #[test]
    fn magnitude_codes_rise_with_the_difference_and_fit_six_bits(a in 0..=65535_i32, b in 0..=65535_i32) {
        let (low, high) = (a.min(b), a.max(b));
        prop_assert!(magnitude_code(low) <= magnitude_code(high));
        prop_assert!(magnitude_code(high) < 64);
        prop_assert!(high < 2 * low.max(8) || magnitude_code(high) > magnitude_code(low));
    }
}

#[test]
fn a_frame_that_is_not_pinned_leaves_pixels_empty() {
    // Control for the law of winding: it fails as soon as the border moves.
    let mut key = still_key(40, 40, [40, 40]);
    set_field(&mut key, |_, _| ([64, 0], 1));
    let mut triangles = triangles(&key, Phase::ONE);
    for corner in triangles.iter_mut().flat_map(|it| &mut it.moved).filter(|it| it[0] == -8) {
        corner[0] += 32;
    }
    assert_eq!(winding(&triangles, 0, 20), 0);
}

#[test]
fn phase_zero_and_zero_motion_give_the_bytes_of_the_key() {
    let mut key = still_key(67, 45, [33, 45]);
    assert!(warp(&key, Phase::MAX, 2) == key.color, "zero motion");
    set_field(&mut key, |x, y| ([scramble(x) as i16, scramble(y) as i16], x));
    assert!(warp(&key, Phase::ZERO, 2) == key.color, "phase 0");
    assert!(warp(&key, Phase::ONE, 2) != key.color, "this motion shows at other phases");
}

#[test]
fn zero_motion_gives_the_bytes_of_every_format() {
    let mut key = still_key(31, 23, [31, 23]);
    let words: Vec<u32> = (0..31 * 23).map(scramble).collect();
    let tens = words.iter().map(|&word| Rgb10a2(word)).collect();
    let halves = words.iter().map(|&word| {
        let channel = |shift: u32| (word.rotate_left(shift) & 0xffff) as u16;
        OrderedRgba16([0, 5, 11, 17].map(channel))
    });
    for color in [
        ColorPlane::Rgb10a2(Plane::from_vec(31, 23, tens)),
        ColorPlane::Rgba16f(Plane::from_vec(31, 23, halves.collect())),
    ] {
        key.color = color;
        assert!(warp(&key, Phase::ONE, 1) == key.color);
    }
}

#[test]
fn a_key_without_usable_motion_is_copied() {
    let mut key = still_key(40, 30, [40, 30]);
    set_field(&mut key, |_, _| ([320, 0], 1));
    assert!(warp(&key, Phase::ONE, 1) != key.color);
    key.motion_from = None;
    assert!(warp(&key, Phase::ONE, 1) == key.color);
}

#[test]
fn what_cannot_be_tracked_is_held() {
    let mut key = still_key(40, 30, [40, 30]);
    set_field(&mut key, |_, _| ([Velocity::UNTRACKABLE.x, Velocity::UNTRACKABLE.y], 1));
    assert!(warp(&key, Phase::ONE, 1) == key.color);
}

#[test]
fn a_constant_picture_stays_constant() {
    let mut key = still_key(80, 60, [40, 30]);
    key.color = ColorPlane::Rgba8(Plane::from_vec(80, 60, vec![Rgba8(0x80ff_1307); 80 * 60]));
    set_field(&mut key, |x, y| ([(scramble(x + 99 * y) as i16) / 30, 77], scramble(y)));
    assert!(warp(&key, Phase::ONE, 2) == key.color);
}

#[test]
fn translation_is_a_shift_wherever_the_border_does_not_reach() {
    for (field, ratio) in [([96, 72], 1), ([48, 36], 2), ([56, 42], 2), ([24, 18], 4)] {
        let mut key = still_key(96, 72, field);
        // 10 px right and 6 px up at phase 1/2.
        set_field(&mut key, |_, _| ([20 * 32, -12 * 32], 5));
        let out = warp(&key, Phase::from_f64(0.5), 2);
        let (out, source) = (texels(&out), texels(&key.color));
        let pinned = 8 + ratio;
        let (columns, rows) = (10 + pinned..96 - pinned, pinned..72 - 6 - pinned);
        for y in rows {
            for x in columns.clone() {
                assert_eq!(out.at(x, y), source.at(x - 10, y + 6), "ratio {ratio} at {x}, {y}");
            }
        }
    }
}

/// A square of one colour, 32 px a side, that moves 16 px right over a still ground of another.
fn square_over_ground(square_depth: u32, ground_depth: u32) -> KeyFrame {
    let mut key = still_key(128, 96, [128, 96]);
    let is_square = |x: u32, y: u32| (32..64).contains(&x) && (32..64).contains(&y);
    let colors = (0..128 * 96).map(|i| Rgba8(if is_square(i % 128, i / 128) { 255 } else { 0 }));
    key.color = ColorPlane::Rgba8(Plane::from_vec(128, 96, colors.collect()));
    set_field(&mut key, |x, y| {
        if is_square(x, y) { ([16 * 32, 0], square_depth) } else { ([0, 0], ground_depth) }
    });
    dilate(&mut key);
    key
}

#[test]
fn the_nearer_surface_wins_where_the_mesh_folds() {
    let out = warp(&square_over_ground(2_000_000, 1_000_000), Phase::ONE, 2);
    for y in 34..62 {
        for x in 50..78 {
            assert_eq!(texels(&out).at(x, y), Rgba8(255), "the square covers {x}, {y}");
        }
    }
    // Control: with the depths exchanged the ground covers what the square moved over.
    let out = warp(&square_over_ground(1_000_000, 2_000_000), Phase::ONE, 2);
    let hidden = (72..78).filter(|&x| texels(&out).at(x, 48) == Rgba8(0)).count();
    assert_eq!(hidden, 6);
}

#[test]
fn a_disocclusion_is_stretched_from_both_of_its_sides() {
    let out = warp(&square_over_ground(2_000_000, 1_000_000), Phase::ONE, 2);
    let row: Vec<Rgba8> = (20..47).map(|x| texels(&out).at(x, 48)).collect();
    assert!(row.iter().all(|&texel| texel == Rgba8(0)), "ground where the square was: {row:?}");
}

#[test]
fn at_a_discontinuity_the_vertex_stands_on_the_nearer_side() {
    for (left_depth, expected) in [(9, [96, 0]), (1, [-32, 0])] {
        let mut key = still_key(64, 64, [64, 64]);
        // The edge crosses the neighbourhood of columns 24..32.
        set_field(&mut key, |x, _| if x < 28 { ([96, 0], left_depth) } else { ([-32, 0], 5) });
        dilate(&mut key);
        let mut mesh = Mesh::default();
        mesh.snap(&key);
        let (vertices, columns) = mesh.vertices();
        let vertex = vertices[4 * columns + 4];
        assert_eq!([vertex.velocity.x, vertex.velocity.y], expected);
        // Dilation carried the nearer motion one cell beyond its outline at column 28.
        let column = if left_depth == 9 { 28 } else { 27 };
        assert_eq!(vertex.source[0], 16 * column);
    }
}

#[test]
fn pixels_outside_the_valid_rectangle_are_copied() {
    let mut key = still_key(100, 80, [70, 50]);
    key.valid = Rect { x: 10, y: 12, width: 70, height: 50 };
    set_field(&mut key, |_, _| ([10 * 32, 4 * 32], 1));
    let out = warp(&key, Phase::ONE, 2);
    let (out, source) = (texels(&out), texels(&key.color));
    assert!(out == &reference(&key, Phase::ONE));
    assert_eq!(out.at(50, 40), source.at(40, 36), "inside it moves");
    for y in 0..80 {
        for x in 0..100 {
            if !((10..80).contains(&x) && (12..62).contains(&y)) {
                assert_eq!(out.at(x, y), source.at(x, y), "at {x}, {y}");
            }
        }
    }
}

#[test]
fn scratch_that_was_told_of_each_key_gives_what_a_new_one_gives() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let mut scratch = GridScratch::default();
    for key in [square_over_ground(2, 1), still_key(30, 20, [15, 10]), square_over_ground(9, 3)] {
        let mut out = ColorPlane::new(ColorFormat::Rgba8, key.color.width(), key.color.height());
        scratch.forget_key();
        warp_grid(&key, Phase::ONE, &mut out, &mut scratch, &pool);
        assert!(out == warp(&key, Phase::ONE, 1));
    }
}

#[test]
#[should_panic(expected = "expected an output of Rgba8, found Rgb10a2")]
fn an_output_of_another_format_is_refused() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut out = ColorPlane::new(ColorFormat::Rgb10a2, 8, 8);
    warp_grid(&still_key(8, 8, [8, 8]), Phase::ONE, &mut out, &mut GridScratch::default(), &pool);
}
