//! What the flow of moving, still, flat and unlike pictures is.

use proptest::prelude::*;

use super::*;
use crate::color::{ColorFormat, ColorPlane, OrderedRgba16, Rgb10a2, Rgba8, half_to_ordered};
use crate::plane::Rect;
use crate::testing::{hash, plane, pool};
use crate::time::MonoSpan;

/// Noise that changes over some eight pixels, 0 to 1.
fn smooth(x: f32, y: f32, seed: u32) -> f32 {
    let (x, y) = (x / 8.0 + 100.0, y / 8.0 + 100.0);
    let (column, row) = (x as u32, y as u32);
    let (fx, fy) = (x - column as f32, y - row as f32);
    let at = |i: u32, j: u32| (hash(column + i, row + j, seed) & 0xff) as f32 / 255.0;
    let across = |j: u32| at(0, j) * (1.0 - fx) + at(1, j) * fx;
    across(0) * (1.0 - fy) + across(1) * fy
}

fn key_of(at_ms: i64, size: [u32; 2], shows: impl Fn(f32, f32) -> f32) -> KeyFrame {
    KeyFrame {
        content_time: MonoTime::ZERO + MonoSpan::from_ms(at_ms),
        valid: Rect::full(size[0], size[1]),
        color: ColorPlane::Rgba8(plane(size[0], size[1], |x, y| {
            Rgba8(0x01_01_01 * (shows(x as f32, y as f32) * 255.0) as u32)
        })),
        ..KeyFrame::default()
    }
}

/// The field between two keys on the flow's own cells; None where nothing is known.
fn found(threads: usize, older: &KeyFrame, newest: &KeyFrame) -> Option<Plane<[f32; 2]>> {
    let (mut flow, mut field) = (Flow::default(), Plane::default());
    flow.find(&pool(threads), newest, older).then(|| {
        flow.fill(flow.cells(), &mut field);
        field
    })
}

/// How far cells at least `inside` of them away from the border are from `d`, pixels, the nearest
/// first.
fn errors(field: &Plane<[f32; 2]>, d: [f32; 2], inside: u32) -> Vec<f32> {
    let columns = inside..field.width() - inside;
    let cells = (inside..field.height() - inside)
        .flat_map(|y| columns.clone().map(move |x| (x, y)))
        .map(|(x, y)| field.at(x, y));
    let mut errors: Vec<_> =
        cells.map(|found| (found[0] - d[0]).abs().max((found[1] - d[1]).abs())).collect();
    errors.sort_by(f32::total_cmp);
    errors
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_picture_that_slides_is_followed_below_a_pixel(
        // A tenth of the picture: of twice that too little is left of both pictures.
        d in prop::array::uniform2(-12.0_f32..12.0),
    ) {
        let size = [160, 120];
        let older = key_of(0, size, |x, y| smooth(x, y, 7));
        let newest = key_of(25, size, |x, y| smooth(x - d[0], y - d[1], 7));
        let field = found(2, &older, &newest).unwrap();
        // Here and there a block has texture along one axis alone.
        let errors = errors(&field, d, 10);
        let (half, most) = (errors[errors.len() / 2], errors[errors.len() * 4 / 5]);
        prop_assert!(half < 0.25 && most < 0.75, "{d:?} is missed by {half} px, {most} px");
    }
}

#[test]
fn what_stands_still_and_what_has_no_texture_does_not_move() {
    let size = [97, 65];
    for shows in [|x, y| smooth(x, y, 3), |_, _| 0.5] {
        let field = found(2, &key_of(0, size, shows), &key_of(25, size, shows)).unwrap();
        assert!(field.data().iter().all(|d| *d == [0.0; 2]));
    }
}

#[test]
fn a_board_before_a_still_wall_moves_alone() {
    let size = [160, 120];
    let at = |board: f32| {
        move |x: f32, y: f32| {
            let is_board = (board..board + 48.0).contains(&x) && (40.0..88.0).contains(&y);
            if is_board { smooth(x - board, y, 5) } else { 0.5 * smooth(x, y, 6) }
        }
    };
    let field = found(2, &key_of(0, size, at(40.0)), &key_of(25, size, at(52.0))).unwrap();
    let is_right = |x: u32, y: u32, d: [f32; 2]| {
        let found = field.at(x, y);
        (found[0] - d[0]).abs() < 0.5 && (found[1] - d[1]).abs() < 0.5
    };
    // Cells of four pixels: the board covers columns 13 to 24 and rows 10 to 21.
    assert!((14..24).all(|x| (11..21).all(|y| is_right(x, y, [12.0, 0.0]))), "the board");
    assert!((28..40).all(|x| (0..30).all(|y| is_right(x, y, [0.0; 2]))), "the wall");
}

#[test]
fn pictures_of_two_places_have_no_flow() {
    let size = [160, 120];
    let [here, there] = [11, 12].map(|seed| key_of(seed, size, |x, y| smooth(x, y, seed as u32)));
    assert_eq!(found(2, &here, &there), None);
    let small = key_of(30, [12, 160], |x, y| smooth(x, y, 1));
    assert_eq!(found(2, &small, &small), None, "too small for blocks");
    assert_eq!(found(2, &here, &key_of(40, [160, 112], |x, y| smooth(x, y, 11))), None);
}

#[test]
fn the_number_of_threads_and_what_was_found_before_change_nothing() {
    let size = [203, 117];
    let keys = [0.0, 3.3, 7.1]
        .map(|at| key_of(at as i64, size, |x, y| smooth(x - at, y - (x - 100.0) * at / 100.0, 9)));
    let [first, second, third] = &keys;
    let alone = found(1, second, third).unwrap();
    assert_eq!(found(3, second, third).unwrap(), alone);
    let (mut flow, mut field) = (Flow::default(), Plane::default());
    assert!(flow.find(&pool(2), second, first) && flow.find(&pool(2), third, second));
    flow.fill(flow.cells(), &mut field);
    assert_eq!(field, alone);
    assert_ne!(found(2, first, third).unwrap(), alone);
}

#[test]
fn every_format_of_color_is_followed() {
    let size = [96, 80];
    for format in [ColorFormat::Rgba8, ColorFormat::Rgb10a2, ColorFormat::Rgba16f] {
        let keys = [0_i64, 5].map(|at| {
            let shows = |x: u32, y: u32| smooth(x as f32 - at as f32, y as f32, 2);
            let [width, height] = size;
            let color = match format {
                ColorFormat::Rgba8 => ColorPlane::Rgba8(plane(width, height, |x, y| {
                    Rgba8(0x01_01_01 * (shows(x, y) * 255.0) as u32)
                })),
                ColorFormat::Rgb10a2 => ColorPlane::Rgb10a2(plane(width, height, |x, y| {
                    Rgb10a2(0x0010_0401 * (shows(x, y) * 1023.0) as u32)
                })),
                ColorFormat::Rgba16f => ColorPlane::Rgba16f(plane(width, height, |x, y| {
                    let bits = half::f16::from_f32(shows(x, y)).to_bits();
                    OrderedRgba16([half_to_ordered(bits); 4])
                })),
            };
            KeyFrame { color, ..key_of(at, size, |_, _| 0.0) }
        });
        let field = found(2, &keys[0], &keys[1]).unwrap();
        let errors = errors(&field, [5.0, 0.0], 5);
        assert!(errors[errors.len() * 4 / 5] < 0.25, "{format:?}");
    }
}

/// The motion of what stands still, but for cells where `moves` says otherwise.
fn with_motion(key: KeyFrame, moves: impl Fn(u32, u32) -> [f32; 2]) -> KeyFrame {
    let displacement = plane(key.valid.width / 2, key.valid.height / 2, moves);
    KeyFrame { displacement, ..key }
}

/// What has failed in the last of three keys in a row, of which each points back to the one before.
fn failed(keys: [&KeyFrame; 3]) -> FailedField {
    let (mut flow, mut found) = (Flow::default(), FailedField::default());
    for [older, newest] in [[keys[0], keys[1]], [keys[1], keys[2]]] {
        flow.find_failed(&pool(2), newest, older, &mut found);
    }
    found
}

/// A screen at 40 to 104 by 40 to 88 whose picture has run `at` pixels to the right, in a still
/// wall.
fn screen(at: f32) -> impl Fn(f32, f32) -> f32 {
    move |x, y| {
        let is_screen = (40.0..104.0).contains(&x) && (40.0..88.0).contains(&y);
        smooth(if is_screen { x - at } else { x }, y, 4)
    }
}

#[test]
fn flow_is_found_where_motion_does_not_explain_the_picture_and_there_alone() {
    let size = [160, 120];
    let still = |_, _| [0.0; 2];
    let of = |ms, at| with_motion(key_of(ms, size, screen(at)), still);
    let keys = [of(0, 0.0), of(25, 6.0), of(50, 12.0)];
    let found = failed([&keys[0], &keys[1], &keys[2]]);
    for (x, y) in [(60.0, 60.0), (80.0, 50.0), (52.0, 76.0)] {
        let [dx, dy] = found.at([x, y]).unwrap();
        assert!((dx - 6.0).abs() < 0.25 && dy.abs() < 0.25, "{dx}, {dy}");
    }
    for (x, y) in [(8.0, 8.0), (130.0, 60.0), (60.0, 110.0), (20.0, 60.0)] {
        assert_eq!(found.at([x, y]), None);
    }
    let calm = of(25, 0.0);
    assert!(failed([&keys[0], &calm, &of(50, 0.0)]).is_empty());
    // What is so for the first time may be over with the next key.
    assert!(failed([&keys[0], &calm, &of(50, 6.0)]).is_empty());
}

#[test]
fn motion_that_explains_the_picture_is_left_alone_in_any_light_and_at_outlines() {
    let size = [160, 120];
    let board = |at: f32, light: f32| {
        move |x: f32, y: f32| {
            let is_board = (34.0 + at..98.0 + at).contains(&x);
            light * smooth(if is_board { x - at } else { x + 300.0 }, y, 4)
        }
    };
    let keys = [(0.0, 1.0), (6.0, 1.0), (12.0, 1.0), (12.0, 0.9)].map(|(at, light)| {
        let first = 17 + (at / 2.0) as u32;
        let is_board = move |x: u32| (first..first + 32).contains(&x);
        let slides = |x, _| if is_board(x) { [6.0, 0.0] } else { [0.0; 2] };
        let depth = |x, _| if is_board(x) { 2_000_000 } else { 1_000_000 };
        KeyFrame {
            depth: plane(size[0] / 2, size[1] / 2, depth),
            ..with_motion(key_of(at as i64, size, board(at, light)), slides)
        }
    });
    let [first, second, third, darker] = &keys;
    assert!(failed([first, second, third]).is_empty());
    let found = failed([first, second, darker]);
    let places = (0..20).flat_map(|x| (0..15).map(move |y| [8 * x + 4, 8 * y + 4]));
    let count = places.filter(|place| found.at(place.map(|i| i as f32)).is_some()).count();
    assert!(count <= 3, "{count} blocks");
    let wrong = [second, third].map(|key| with_motion(key.clone(), |_, _| [-6.0, 0.0]));
    assert!(!failed([first, &wrong[0], &wrong[1]]).is_empty(), "wrong motion does not pass");
}

#[test]
fn a_row_of_blocks_that_begins_to_fail_is_doubted_within_two_keys() {
    for (row, since) in [(4, 2), (4, 3), (5, 2), (5, 3)] {
        let shows = |key: i64| {
            let at = 6.0 * (key - since).max(0) as f32;
            move |x: f32, y: f32| smooth(if y as u32 / BLOCK == row { x - at } else { x }, y, 4)
        };
        let keys: Vec<_> = (0..since + 3)
            .map(|key| with_motion(key_of(25 * key, [160, 120], shows(key)), |_, _| [0.0; 2]))
            .collect();
        let (mut flow, mut found) = (Flow::default(), FailedField::default());
        let is_explained: Vec<_> = keys
            .windows(2)
            .map(|pair| flow.find_failed(&pool(2), &pair[1], &pair[0], &mut found))
            .collect();
        let (before, after) = is_explained.split_at(since as usize);
        assert!(before.iter().all(|it| *it), "{row}, {since}: {before:?}");
        assert!(after.contains(&false), "{row}, {since}");
    }
}

proptest! {
    #[test]
    fn a_block_between_pixels_is_the_samples_of_its_pixels(
        from in prop::array::uniform2(-1024_i32..(72 << 8)),
        seed: u32,
    ) {
        use super::block::sad_between;
        use super::own::{SIDE, in_any_light};
        let pyramids = [0, 1].map(|of| {
            let shows = |x: f32, y: f32| (hash(x as u32, y as u32, seed ^ of) % 255) as f32 / 255.0;
            let mut luma = Pyramid::default();
            luma.update(&pool(1), &key_of(0, [80, 64], shows));
            luma
        });
        let [now, then] = pyramids.each_ref().map(Pyramid::finest);
        let mut r = [[0; SIDE]; SIDE];
        let mut is_inside = true;
        for (y, r) in (0..).zip(&mut r) {
            for (x, r) in (0..).zip(r) {
                let was = then.sample([from[0] + (x << 8), from[1] + (y << 8)]);
                is_inside &= was.is_some();
                let is = now.sample([(16 + x) << 8, (24 + y) << 8]).expect("it lies inside");
                *r = was.unwrap_or(0) - is;
            }
        }
        prop_assume!(is_inside);
        let of_samples = in_any_light(&r, &[[true; SIDE]; SIDE]);
        prop_assert_eq!(sad_between(now, [16, 24], then, from), of_samples);
    }
}
