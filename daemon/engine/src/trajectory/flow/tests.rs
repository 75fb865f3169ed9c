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

/// How far cells at least `inside` of them away from the border are from `d`, pixels, the nearest first.
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
    fn a_picture_that_slides_is_followed_to_a_quarter_of_a_pixel(
        d in prop::array::uniform2(-24.0_f32..24.0),
    ) {
        let size = [160, 120];
        let older = key_of(0, size, |x, y| smooth(x, y, 7));
        let newest = key_of(25, size, |x, y| smooth(x - d[0], y - d[1], 7));
        let field = found(2, &older, &newest).unwrap();
        // Here and there a block has texture along one axis alone.
        let errors = errors(&field, d, 10);
        let (most, all) = (errors[errors.len() * 9 / 10], errors[errors.len() - 1]);
        prop_assert!(most < 0.25 && all < 2.0, "{d:?} is missed by {most} px, at worst {all} px");
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
        assert!(errors[errors.len() * 9 / 10] < 0.25, "{format:?}");
    }
}
