//! What is selected, that it moves with what it was selected on, and that rows are the definition.

use proptest::prelude::*;

use super::*;
use crate::color::ColorFormat;
use crate::key::Velocity;
use crate::plane::Rect;
use crate::testing::{hash, key as key_of, noise, plane, pool, px};

/// A key of `size` pixels whose velocities are `velocity` of its cells, one cell per `ratio`.
fn field(size: u32, ratio: u32, velocity: impl Fn(u32, u32) -> Velocity) -> (KeyFrame, FieldMap) {
    let cells = size / ratio;
    let mut key = key_of(
        noise(ColorFormat::Rgba8, size, size, 1),
        Plane::default(),
        plane(cells, cells, velocity),
    );
    key.valid = Rect::full(size, size);
    let mut map = FieldMap::default();
    map.update(key.valid, [cells; 2], [0; 2]);
    (key, map)
}

fn selected(key: &KeyFrame, map: &FieldMap, phase: f64) -> Plane<u8> {
    let mut selection = Selection::default();
    selection.take_key(&pool(1), key, map, None, None, 0);
    selection.turn_to(Phase::from_f64(phase), 0);
    selection.weights().unwrap().clone()
}

#[test]
fn pans_and_slow_zooms_blur_nothing_and_a_strong_one_does() {
    for ratio in [1, 2] {
        let cells = 128 / ratio;
        let zoom = |share: f32| {
            let from_middle = move |cell: u32| (cell as f32 - cells as f32 / 2.0) * ratio as f32;
            field(128, ratio, move |x, y| px(share * from_middle(x), share * from_middle(y)))
        };
        let most = |(key, map): (KeyFrame, FieldMap)| {
            *selected(&key, &map, 0.0).data().iter().max().unwrap()
        };
        assert_eq!(most(field(128, ratio, |_, _| px(31.0, -7.5))), 0);
        assert_eq!(most(zoom(0.02)), 0);
        let strengths = [0.05, 0.1, 0.15, 0.25, 0.4].map(|share| most(zoom(share)));
        assert!(strengths.is_sorted() && strengths[1] > 0 && strengths[4] == FULL, "{strengths:?}");
    }
}

#[test]
fn all_of_what_an_edge_uncovers_is_blurred_fully_and_what_is_far_from_it_not_at_all() {
    for (speed, ratio) in [(4.0, 1), (12.0, 2), (-20.0, 2), (30.0, 1)] {
        // A patch of 64 columns moves over a still ground.
        let inside = |cell: u32| (64..128).contains(&(cell * ratio));
        let (key, map) =
            field(256, ratio, |x, _| if inside(x) { px(speed, 0.0) } else { px(0.0, 0.0) });
        for phase in [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0] {
            let weights = selected(&key, &map, phase);
            let moved = speed * phase as f32;
            // Behind the trailing edge.
            let edge: f32 = if speed > 0.0 { 64.0 } else { 128.0 };
            let [first, last] = [edge.min(edge + moved), edge.max(edge + moved)];
            for tile in (first / 8.0) as u32..=(last / 8.0) as u32 {
                assert_eq!(weights.at(tile, 10), FULL, "{speed} {phase} {tile}");
            }
            assert_eq!((weights.at(0, 10), weights.at(31, 10)), (0, 0), "{speed} {phase}");
        }
    }
}

#[test]
fn where_no_velocity_is_known_all_is_blurred() {
    let (mut key, map) =
        field(128, 1, |x, y| if (x, y) == (70, 20) { Velocity::UNTRACKABLE } else { px(3.0, 3.0) });
    let weights = selected(&key, &map, 0.0);
    assert_eq!(weights.at(8, 2), FULL);
    assert_eq!((weights.at(1, 2), weights.at(8, 12)), (0, 0));
    key.velocity = Plane::default();
    assert!(selected(&key, &map, 0.5).data().iter().all(|weight| *weight == FULL));
}

#[test]
fn weights_move_with_the_surface() {
    let still = plane(16, 16, |x, y| if (5..9).contains(&x) && y > 6 { FULL } else { 0 });
    let motion = plane(16, 16, |_, _| px(16.0, -8.0));
    let mut out = Plane::default();
    moved(&still, &motion, Phase::from_f64(1.0), &mut out);
    for (y, x) in (0..15).flat_map(|y| (2..16).map(move |x| (y, x))) {
        assert_eq!(out.at(x, y), still.at(x - 2, y + 1));
    }
    moved(&still, &motion, Phase::ZERO, &mut out);
    assert_eq!(out, still);
    moved(&still, &motion, Phase::from_f64(0.25), &mut out);
    assert_eq!(out.at(5, 12), FULL / 2, "half a tile on");
}

#[test]
fn what_an_older_key_paid_for_comes_along_and_is_forgotten_with_a_cut() {
    let (first, map) =
        field(128, 1, |x, _| if (40..56).contains(&x) { px(8.0, 0.0) } else { px(0.0, 0.0) });
    let (second, _) = field(128, 1, |_, _| px(16.0, 0.0));
    let mut selection = Selection::default();
    let pool = pool(1);
    selection.take_key(&pool, &first, &map, None, None, 0);
    let before = selection.by_age[0].clone();
    selection.take_key(&pool, &second, &map, None, Some(Phase::from_f64(1.0)), 1);
    selection.turn_to(Phase::ZERO, 1);
    let after = selection.weights().unwrap();
    assert!((2..16).all(|x| after.at(x, 5) == before.at(x - 2, 5)));
    selection.turn_to(Phase::ZERO, 0);
    assert!(selection.weights().unwrap().data().iter().all(|weight| *weight == 0));
    selection.take_key(&pool, &second, &map, None, Some(Phase::from_f64(1.0)), 0);
    assert_eq!(selection.by_age.len(), 1, "nothing of it is left to be shown");
    for _ in 0..9 {
        selection.take_key(&pool, &second, &map, None, Some(Phase::from_f64(1.0)), 9);
    }
    assert_eq!(selection.by_age.len(), KEPT);
    selection.take_key(&pool, &second, &map, None, None, 9);
    assert_eq!(selection.by_age.len(), 1);
}

proptest! {
    #[test]
    fn rows_are_linear_between_the_middles_of_tiles(
        (width, height) in (1_u32..40, 1_u32..40),
        seed: u32,
    ) {
        let weight = |x, y| (hash(x, y, seed) % 129) as u8 * u8::from(!hash(y, x, seed).is_multiple_of(3));
        let weights = plane(width.div_ceil(TILE), height.div_ceil(TILE), weight);
        let (mut columns, mut row) = (Vec::new(), vec![77; width as usize]);
        for y in 0..height {
            let is_any = row_weights(&weights, y, &mut columns, &mut row);
            prop_assert!(is_any || row.iter().all(|weight| *weight == 0));
            for (x, found) in (0..).zip(&row) {
                let place = |pixel: u32| {
                    let place = 2 * i64::from(pixel) + 1 - 8;
                    (place.div_euclid(16), place.rem_euclid(16))
                };
                let at = |x: i64, y: i64| {
                    let x = x.clamp(0, i64::from(weights.width()) - 1) as u32;
                    i64::from(weights.at(x, y.clamp(0, i64::from(weights.height()) - 1) as u32))
                };
                let ((column, way_x), (line, way_y)) = (place(x), place(y));
                let sum: i64 = [(0, 16 - way_x), (1, way_x)]
                    .into_iter()
                    .flat_map(|(i, of_x)| [(0, 16 - way_y), (1, way_y)].map(|(j, of_y)| (i, j, of_x * of_y)))
                    .map(|(i, j, weight)| weight * at(column + i, line + j))
                    .sum();
                prop_assert_eq!(i64::from(*found), (sum + 128) >> 8);
            }
        }
    }
}
