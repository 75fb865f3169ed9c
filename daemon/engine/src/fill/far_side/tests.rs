//! Which side a hole continues.

use super::*;
use crate::key::{KeyFrame, Velocity};
use crate::plane::{Plane, Rect};
use crate::testing::{plane, pool};
use crate::warp::scatter::{NO_SOURCE, SourceField};

const HOLE: char = '.';

/// A grid of `N`ear, `F`ar and hole cells where every cell is its own source; the column and row
/// that each hole continues.
fn far_of(picture: &[&str], x: u32, y: u32) -> Option<(u32, u32)> {
    let (width, height) = (picture[0].len() as u32, picture.len() as u32);
    let letter = |x: u32, y: u32| picture[y as usize].as_bytes()[x as usize] as char;
    let depth = plane(width, height, |x, y| if letter(x, y) == 'N' { 1_000_000 } else { 1000 });
    let splat =
        plane(width, height, |x, y| if letter(x, y) == HOLE { NO_SOURCE } else { y * width + x });
    let velocity = plane(width, height, |_, _| Velocity::default());
    let valid = Rect::full(width, height);
    let key = KeyFrame { valid, velocity, ..KeyFrame::default() };
    let (pool, mut source) = (pool(2), SourceField::default());
    source.update(&pool, &key);
    source.depth = depth;
    let mut far = Plane::default();
    far_side(&pool, &source, &splat, &mut FarScratch::default(), &mut far);
    assert_eq!(letter(x, y), HOLE, "asked about a hole");
    let cell = far.at(x, y);
    (cell != NO_CELL).then(|| (cell % width, cell / width))
}

#[test]
fn a_hole_continues_the_far_side_wherever_it_lies() {
    assert_eq!(far_of(&["FF...NN"], 4, 0), Some((1, 0)), "far on the left");
    assert_eq!(far_of(&["NN...FF"], 2, 0), Some((5, 0)), "far on the right");
    assert_eq!(far_of(&["N", ".", ".", "F"], 0, 1), Some((0, 3)), "far below");
    assert_eq!(far_of(&["F", ".", ".", "N"], 0, 2), Some((0, 0)), "far above");
}

#[test]
fn the_shorter_way_through_the_hole_decides_between_axes() {
    // Across: 3 cells from far to near. Down: 5, between two near ones.
    let tall = ["NNNNNN", "F..NNN", "F..NNN", "F..NNN", "F..NNN", "NNNNNN"];
    assert_eq!(far_of(&tall, 1, 3), Some((0, 3)));
    let wide = ["FFFFFF", "N....N", "N....N", "NNNNNN"];
    assert_eq!(far_of(&wide, 2, 2), Some((2, 0)));
}

#[test]
fn equal_depths_give_the_closer_side_and_the_border_its_only_one() {
    assert_eq!(far_of(&["F...F"], 1, 0), Some((0, 0)));
    assert_eq!(far_of(&["F...F"], 3, 0), Some((4, 0)));
    assert_eq!(far_of(&["F...F"], 2, 0), Some((0, 0)), "the left one of two as close");
    assert_eq!(far_of(&["..FN"], 0, 0), Some((2, 0)));
    assert_eq!(far_of(&["...."], 2, 0), None, "nothing landed anywhere");
}
