//! Laws of the affine rung.

use super::power::{Matrix, Power};
use super::*;
use crate::key::KeyFrame;
use crate::plane::Rect;
use crate::testing::{plane, pool};
use crate::trajectory::grid::Grid;
use crate::trajectory::lattice::Lattice;

/// The place after turning by `angle` about (60, 44) and growing by `zoom`.
fn turned(at: [f32; 2], angle: f32, zoom: f32) -> [f32; 2] {
    let (x, y) = (at[0] - 60.0, at[1] - 44.0);
    let (sin, cos) = (libm::sinf(angle) * zoom, libm::cosf(angle) * zoom);
    [60.0 + cos * x - sin * y, 44.0 + sin * x + cos * y]
}

/// A disc of radius 36 that turns and grows before a wall that does not.
fn disc(angle: f32, zoom: f32) -> KeyFrame {
    let is_disc = |x: u32, y: u32| {
        let (dx, dy) = (x as f32 - 60.0, y as f32 - 44.0);
        dx * dx + dy * dy < 36.0 * 36.0
    };
    KeyFrame {
        valid: Rect::full(120, 88),
        depth: plane(120, 88, |x, y| if is_disc(x, y) { 2_000_000 } else { 1_000_000 }),
        displacement: plane(120, 88, |x, y| {
            let at = [x as f32, y as f32];
            let was = if is_disc(x, y) { turned(at, -angle, 1.0 / zoom) } else { at };
            [at[0] - was[0], at[1] - was[1]]
        }),
        ..KeyFrame::default()
    }
}

/// The fits of all of a key's field.
fn fitted(threads: usize, key: &KeyFrame, grid: &Grid) -> AffineField {
    let (mut lattice, mut field) = (Lattice::default(), AffineField::default());
    lattice.update(&pool(threads), key, grid);
    field.clear(lattice.points());
    field.fit(&pool(threads), &lattice, grid, |_, _| true);
    field
}

#[test]
fn a_turning_and_growing_disc_goes_on_turning_and_growing() {
    for (angle, zoom) in [(0.1, 1.0), (0.6, 1.0), (-0.4, 1.1), (0.0, 0.8)] {
        let key = disc(angle, zoom);
        let grid = Grid::of(&key);
        let field = fitted(2, &key, &grid);
        for (x, y) in [(60, 44), (80, 40), (40, 60), (60, 12)] {
            let at = [x as f32, y as f32];
            let curve = field.curve(&key, &grid, x, y).unwrap();
            let places = [
                (curve.half, turned(at, 0.5 * angle, zoom.sqrt())),
                (curve.one, turned(at, angle, zoom)),
            ];
            for (found, expected) in places {
                for axis in 0..2 {
                    let error = at[axis] + found[axis] - expected[axis];
                    assert!(error.abs() < 0.2, "({x}, {y}), {angle} rad, {zoom}: {error} px");
                }
            }
        }
        let still = field.curve(&key, &grid, 6, 80).unwrap();
        assert!(still.one.iter().all(|d| d.abs() < 0.05), "the wall is drawn along: {still:?}");
    }
}

#[test]
fn a_uniform_motion_stays_a_straight_line() {
    let key = KeyFrame {
        valid: Rect::full(32, 32),
        displacement: plane(32, 32, |_, _| [5.0, -2.0]),
        ..KeyFrame::default()
    };
    let grid = Grid::of(&key);
    let field = fitted(1, &key, &grid);
    let curve = field.curve(&key, &grid, 15, 9).unwrap();
    let expected = [2.5, -1.0, 5.0, -2.0];
    for (found, expected) in curve.half.into_iter().chain(curve.one).zip(expected) {
        assert!((found - expected).abs() < 1e-4, "{curve:?}");
    }
}

#[test]
fn a_mirror_a_collapse_and_half_a_turn_have_no_power() {
    let power = |j: Matrix| Power::of(&j);
    assert!(power([[0.0, 0.0], [0.0, 0.0]]).is_some());
    assert_eq!(power([[2.0, 0.0], [0.0, 0.0]]), None, "a mirror");
    assert_eq!(power([[1.0, 0.0], [0.0, 1.0]]), None, "a collapse");
    assert_eq!(power([[2.0, 0.0], [0.0, 2.0]]), None, "half a turn");
    assert_eq!(power([[f32::NAN; 2]; 2]), None);
}

#[test]
fn a_patch_too_small_for_a_fit_has_none() {
    let mut key = disc(0.3, 1.0);
    key.displacement =
        plane(120, 88, |x, y| if (x, y) == (62, 46) { [3.0, 0.0] } else { [f32::NAN; 2] });
    let grid = Grid::of(&key);
    let field = fitted(1, &key, &grid);
    assert_eq!(field.curve(&key, &grid, 62, 46), None);
}
