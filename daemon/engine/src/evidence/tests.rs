//! What keys show of rungs, through the ladder that asks.

use glam::{DMat4, DVec3};

use super::*;
use crate::key::{Acceleration, Camera, KeyFrame};
use crate::method::Method;
use crate::plane::Rect;
use crate::testing::{plane, pool};
use crate::time::{MonoSpan, MonoTime};
use crate::trajectory::camera_path::between;
use crate::trajectory::flow::Flow;
use crate::trajectory::ladder::Ladder;

const SIZE: [u32; 2] = [120, 88];
const INTERVAL: MonoSpan = MonoSpan::from_ms(25);
const NEAR: u32 = 2_000_000_000;
const FAR: u32 = 1_000_000_000;

/// Key number `index` of a scene whose cells came from `was`.
fn key(
    index: i64,
    depth: impl Fn(u32, u32) -> u32,
    was: impl Fn(u32, u32) -> [f32; 2],
) -> KeyFrame {
    let content_time = MonoTime::ZERO + INTERVAL.scale(index, 1);
    KeyFrame {
        content_time,
        motion_from: Some(content_time - INTERVAL),
        valid: Rect::full(SIZE[0], SIZE[1]),
        depth: plane(SIZE[0], SIZE[1], depth),
        displacement: plane(SIZE[0], SIZE[1], |x, y| {
            let [was_x, was_y] = was(x, y);
            [x as f32 - was_x, y as f32 - was_y]
        }),
        ..KeyFrame::default()
    }
}

/// The ladder of `method` after these keys, and the last of them.
fn climbed(method: Method, keys: impl Iterator<Item = KeyFrame>) -> (Ladder, KeyFrame) {
    let mut ladder = Ladder::new(method, None).unwrap();
    let mut taken: Vec<KeyFrame> = Vec::new();
    for mut key in keys {
        let past = [1, 2, 3].map(|back| taken.len().checked_sub(back).map(|i| &taken[i]));
        let past = past.map(|older| older.filter(|_| !key.is_cut));
        ladder.take_key(&pool(2), None, &mut key, past);
        taken.push(key);
    }
    (ladder, taken.pop().unwrap())
}

/// The rung of the sample that holds a cell.
fn rung(ladder: &Ladder, x: u32, y: u32) -> Rung {
    ladder.evidence().leads().at(x / STRIDE, y / STRIDE).rung
}

fn is_disc(x: u32, y: u32) -> bool {
    let (dx, dy) = (x as f32 - 60.0, y as f32 - 44.0);
    dx * dx + dy * dy < 38.0 * 38.0
}

fn turned(x: u32, y: u32, angle: f32) -> [f32; 2] {
    let (dx, dy) = (x as f32 - 60.0, y as f32 - 44.0);
    let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
    [60.0 + cos * dx - sin * dy, 44.0 + sin * dx + cos * dy]
}

#[test]
fn a_wheel_is_found_to_turn_and_the_wall_behind_it_to_stand() {
    let keys = (0..4).map(|index| {
        let was = |x, y| if is_disc(x, y) { turned(x, y, -0.35) } else { [x as f32, y as f32] };
        key(index, |x, y| if is_disc(x, y) { NEAR } else { FAR }, was)
    });
    let (ladder, last) = climbed(Method::Auto, keys);
    assert_eq!(rung(&ladder, 60, 18), Rung::Affine);
    assert_eq!(rung(&ladder, 80, 44), Rung::Affine);
    assert_eq!(rung(&ladder, 4, 4), Rung::Hold);
    assert_eq!(last.velocity.at(4, 4), Default::default());
    assert_ne!(last.acceleration.at(60, 18), Acceleration::default());
}

#[test]
fn what_turns_close_before_a_wall_does_not_take_the_wall_along() {
    const WALL: u32 = NEAR - NEAR / 11;
    let keys = (0..4).map(|index| {
        let was = |x, y| if is_disc(x, y) { turned(x, y, -0.35) } else { [x as f32, y as f32] };
        key(index, |x, y| if is_disc(x, y) { NEAR } else { WALL }, was)
    });
    let (ladder, last) = climbed(Method::Auto, keys);
    for (x, y) in [(60, 18), (80, 44), (60, 44)] {
        assert_eq!(rung(&ladder, x, y), Rung::Affine, "{x}, {y}");
    }
    // Samples of the wall that see the disc, within two samples of them.
    for (x, y) in [(102, 44), (102, 30), (18, 50), (26, 18)] {
        assert!(!is_disc(x, y) && last.depth.at(x, y) == WALL);
        assert_eq!(rung(&ladder, x, y), Rung::Hold, "{x}, {y}");
    }
}

#[test]
fn what_falls_is_found_to_accelerate() {
    // Fallen for 9 keys already: 4.5, 5.5, 6.5, .. pixels per key.
    let keys = (0..4).map(|index| {
        let fallen = 9.5 + index as f32;
        key(index, |_, _| FAR, move |x, y| [x as f32, y as f32 - fallen])
    });
    let (ladder, last) = climbed(Method::Auto, keys);
    assert_eq!(rung(&ladder, 60, 60), Rung::Quadratic);
    let acceleration = last.acceleration.at(60, 60);
    assert!((f32::from(acceleration.y) / 32.0 - 1.0).abs() < 0.05, "{acceleration:?}");
}

#[test]
fn where_nothing_moves_everything_is_held_and_nothing_accelerates() {
    let keys = (0..3).map(|index| key(index, |_, _| FAR, |x, y| [x as f32, y as f32]));
    let (ladder, last) = climbed(Method::Auto, keys);
    assert_eq!(ladder.evidence().rung_of_all(), Some(Rung::Hold));
    assert!(last.velocity.data().iter().all(|v| *v == Default::default()));
    assert!(last.acceleration.data().is_empty());
}

#[test]
fn what_is_too_thin_for_a_sample_goes_by_its_own_motion_before_a_wall_that_is_held() {
    // Samples lie in columns 2, 6, 10, ..; the bar in 1, 9, 17, ..
    let bar = |index: i64| 1 + 8 * index.unsigned_abs() as u32;
    let keys = (0..6).map(|index| {
        let was = move |x, y: u32| [x as f32 - if x == bar(index) { 8.0 } else { 0.0 }, y as f32];
        key(index, move |x, _| if x == bar(index) { NEAR } else { FAR }, was)
    });
    let (ladder, last) = climbed(Method::Auto, keys);
    assert_eq!(ladder.evidence().rung_of_all(), Some(Rung::Hold), "no sample has seen it");
    assert_eq!(last.velocity.at(bar(5), 40).x, 8 * 32);
    assert_eq!(last.velocity.at(bar(5) + 3, 40), Default::default());
}

#[test]
fn without_a_key_before_that_the_motion_leads_to_nothing_is_known() {
    let first = || key(0, |_, _| FAR, |x, y| [x as f32 - 3.0, y as f32]);
    let cut = KeyFrame { is_cut: true, ..key(1, |_, _| FAR, |x, y| [x as f32 - 3.0, y as f32]) };
    let elsewhere = KeyFrame {
        motion_from: Some(MonoTime::from_ns(5)),
        ..key(1, |_, _| FAR, |x, y| [x as f32 - 3.0, y as f32])
    };
    for second in [cut, elsewhere] {
        let (ladder, _) = climbed(Method::Auto, [first(), second].into_iter());
        let samples = ladder.evidence().samples();
        assert!(samples.data().iter().all(|sample| sample.keys == 0));
        assert_eq!(rung(&ladder, 60, 44), Rung::Affine);
    }
}

/// A camera that turns by `angle` about y and stands at `x`.
fn camera(angle: f64, x: f64) -> Camera {
    let view = DMat4::from_rotation_y(angle) * DMat4::from_translation(DVec3::new(-x, 0.0, 0.0));
    let mut projection = [0.0; 16];
    (projection[0], projection[5]) = (1.2, 1.2 * 120.0 / 88.0);
    (projection[11], projection[14]) = (-1.0, 0.5);
    Camera { view: view.as_mat4().to_cols_array(), projection }
}

/// Keys of a still wall 20 units away, seen by a camera whose angle and place are given.
fn seen(at: impl Fn(i64) -> Camera) -> impl Iterator<Item = KeyFrame> {
    (0..7).map(move |index| {
        let (now, then) = (at(index), at(index - 1));
        let back = between(&now, &then, Rect::full(SIZE[0], SIZE[1])).unwrap();
        let depth = u32::MAX / 40;
        KeyFrame {
            camera: Some(now),
            motion_from_camera: Some(then),
            inverse_distance_per_depth_key: Some(2.0 / u32::MAX as f32),
            ..key(index, |_, _| depth, |x, y| back.place([x as f32, y as f32], 1.0 / 20.0))
        }
    })
}

#[test]
fn the_order_of_the_camera_is_the_one_that_would_have_met_the_keys() {
    let hurrying = |index: i64| camera(0.0, 0.15 * (index * index) as f64);
    let (ladder, _) = climbed(Method::World, seen(hurrying));
    assert_eq!(ladder.evidence().order(), CameraOrder::Accelerated);
    let steady = |index: i64| camera(0.02 * index as f64, 0.5 * index as f64);
    let (ladder, _) = climbed(Method::World, seen(steady));
    assert_eq!(ladder.evidence().order(), CameraOrder::Constant);
    let jerking = |index: i64| camera(0.0, 0.5 * index as f64 + 0.3 * (index % 2) as f64);
    let (ladder, _) = climbed(Method::World, seen(jerking));
    assert_eq!(ladder.evidence().order(), CameraOrder::Constant);
}

/// Keys of a wall that comes straight at a camera which stands still, `distance` away at each key.
fn approaching(distance: fn(i64) -> f32) -> impl Iterator<Item = KeyFrame> {
    (0..7).map(move |index| {
        let (now, then) = (distance(index), distance(index - 1));
        let per_depth_key = 2.0 / u32::MAX as f32;
        let was = |at: u32, axis: usize| {
            let middle = 0.5 * (SIZE[axis] as f32 - 1.0);
            middle + (at as f32 - middle) * now / then
        };
        KeyFrame {
            camera: Some(camera(0.0, 0.0)),
            motion_from_camera: Some(camera(0.0, 0.0)),
            inverse_distance_per_depth_key: Some(per_depth_key),
            ..key(index, |_, _| (1.0 / now / per_depth_key) as u32, |x, y| [was(x, 0), was(y, 1)])
        }
    })
}

#[test]
fn what_comes_nearer_ever_faster_goes_on_to_where_it_will_be() {
    let hurrying = |index: i64| 20.0 - 0.1 * (index * index) as f32;
    let (ladder, last) = climbed(Method::World, approaching(hurrying));
    assert_eq!(ladder.evidence().mover_order(), MoverOrder::Accelerated);
    let (velocity, acceleration) = (last.velocity.at(110, 44), last.acceleration.at(110, 44));
    let goes = (f32::from(velocity.x) + 0.5 * f32::from(acceleration.x)) / 32.0;
    let expected = (110.0 - 59.5) * (hurrying(6) / hurrying(7) - 1.0);
    assert!((goes - expected).abs() < 0.1, "expected {expected} px, found {goes}");

    let steady = |index: i64| 20.0 - 0.7 * index as f32;
    let (ladder, _) = climbed(Method::World, approaching(steady));
    assert_eq!(ladder.evidence().mover_order(), MoverOrder::Constant);
    let faltering = |index: i64| 20.0 - 0.7 * index as f32 - 0.3 * (index % 2) as f32;
    let (ladder, _) = climbed(Method::World, approaching(faltering));
    assert_eq!(ladder.evidence().mover_order(), MoverOrder::Constant);
}

#[test]
fn a_key_without_depth_takes_no_part_in_how_movers_go_on() {
    for without in 0..7 {
        let keys =
            approaching(|index| 20.0 - 0.7 * index as f32).enumerate().map(|(index, key)| {
                let depth =
                    if index == without { plane(0, 0, |_, _| 0) } else { key.depth.clone() };
                KeyFrame { depth, ..key }
            });
        let (_, last) = climbed(Method::World, keys);
        let expected = (110.0 - 59.5) * ((20.0 - 0.7 * 6.0) / (20.0 - 0.7 * 7.0) - 1.0);
        let (velocity, acceleration) = (last.velocity.at(110, 44), last.acceleration.data());
        let bend = acceleration.get(44 * SIZE[0] as usize + 110).map_or(0.0, |a| f32::from(a.x));
        let goes = (f32::from(velocity.x) + 0.5 * bend) / 32.0;
        // Without the depth of one of the last two keys it goes on along its motion vector.
        let bound = if without < 5 { 0.06 } else { 0.3 };
        assert!((goes - expected).abs() < bound, "without {without}: {expected}, found {goes}");
    }
}

#[test]
fn a_late_camera_leads_what_moves_with_the_world_and_the_newest_pose_wins() {
    let steady = |index: i64| camera(0.0, 0.5 * index as f64);
    for method in [Method::World, Method::Auto] {
        let (mut ladder, mut key) = climbed(method, seen(steady));
        let predicted = key.velocity.at(60, 44);
        let at = |ms| MonoTime::ZERO + INTERVAL.scale(6, 1) + MonoSpan::from_ms(ms);
        ladder.late_camera(at(10), camera(0.05, 3.3).view);
        assert!(ladder.catch_up(&pool(1), &mut key, [None; 3]), "{method}");
        let told = key.velocity.at(60, 44);
        assert_ne!(told, predicted, "{method}");
        assert!(!ladder.catch_up(&pool(1), &mut key, [None; 3]), "nothing is new");
        for older in [at(10), at(5), at(-30)] {
            ladder.late_camera(older, camera(-0.2, 9.0).view);
            assert!(!ladder.catch_up(&pool(1), &mut key, [None; 3]), "an older pose is no news");
        }
        ladder.late_camera(at(15), camera(-0.05, 3.6).view);
        assert!(ladder.catch_up(&pool(1), &mut key, [None; 3]));
        assert_ne!(key.velocity.at(60, 44), told);
    }
}

#[test]
fn a_late_pose_is_where_the_picture_goes() {
    let steady = |index: i64| camera(0.0, 0.5 * index as f64);
    let (mut ladder, mut key) = climbed(Method::Auto, seen(steady));
    let late = camera(0.04, 3.9);
    ladder.late_camera(MonoTime::ZERO + INTERVAL.scale(7, 1), late.view);
    assert!(ladder.catch_up(&pool(1), &mut key, [None; 3]));
    let there = between(&steady(6), &late, Rect::full(SIZE[0], SIZE[1])).unwrap();
    for (x, y) in [(60, 44), (20, 70), (100, 12)] {
        let expected = there.place([x as f32, y as f32], 1.0 / 20.0);
        let (v, a) = (key.velocity.at(x, y), key.acceleration.at(x, y));
        let found = [
            x as f32 + f32::from(v.x) / 32.0 + f32::from(a.x) / 64.0,
            y as f32 + f32::from(v.y) / 32.0 + f32::from(a.y) / 64.0,
        ];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 0.1, "expected {expected}, found {found}");
        }
    }
}

#[test]
fn what_the_camera_chases_stays_where_it_is_in_the_picture() {
    // The camera runs ahead and aside; an object keeps its distance from it, the ground does not.
    let advance = |index: i64| {
        let mut camera = camera(0.0, 0.0);
        let s = index as f64;
        let view = DMat4::from_translation(DVec3::new(-0.4 * s, 0.0, 1.5 * s));
        camera.view = view.as_mat4().to_cols_array();
        camera
    };
    let is_chased = |x: u32, y: u32| (90..110).contains(&x) && (60..80).contains(&y);
    let keys = seen(advance).map(|key| KeyFrame {
        displacement: plane(SIZE[0], SIZE[1], |x, y| {
            if is_chased(x, y) { [0.0; 2] } else { key.displacement.at(x, y) }
        }),
        ..key
    });
    let (_, last) = climbed(Method::World, keys);
    let (v, a) = (last.velocity.at(100, 70), last.acceleration.at(100, 70));
    let moved = [f32::from(v.x) + 0.5 * f32::from(a.x), f32::from(v.y) + 0.5 * f32::from(a.y)];
    assert!(moved.iter().all(|steps| steps.abs() < 3.0), "{moved:?} in 1/32 pixel");
    let ground = last.velocity.at(20, 20);
    assert!(ground.x.abs() > 32, "the ground goes by: {ground:?}");
}

#[test]
fn what_jumps_goes_on_as_it_did_before_and_what_begins_to_move_waits_for_a_key() {
    // A board that slides by 3 pixels per key jumps 40 further once; the wall behind it is still.
    let at = |index: i64| 20.0 + 3.0 * index as f32 + if index >= 4 { 40.0 } else { 0.0 };
    let keys = |count: i64| {
        (0..count).map(move |index| {
            let (now, before) = (at(index), at(index - 1));
            let is_board = move |x: u32| (now..now + 24.0).contains(&(x as f32));
            let was = move |x, y| {
                if is_board(x) {
                    [x as f32 - (now - before), y as f32]
                } else {
                    [x as f32, y as f32]
                }
            };
            key(index, move |x, _| if is_board(x) { NEAR } else { FAR }, was)
        })
    };
    let (ladder, jumped) = climbed(Method::Auto, keys(5));
    let x = at(4) as u32 + 12;
    assert!(ladder.evidence().leads().at(x / STRIDE, 10).part(0).is_some());
    let vx = f32::from(jumped.velocity.at(x, 44).x) / 32.0;
    assert!((vx - 3.0).abs() <= 1.5, "it went on by {vx} px");
    let (ladder, after) = climbed(Method::Auto, keys(6));
    let x = at(5) as u32 + 12;
    let vx = f32::from(after.velocity.at(x, 44).x) / 32.0;
    assert!(vx < 3.1, "one key later the jump is no motion: {vx} px, {:?}", rung(&ladder, x, 44));

    // From rest.
    let begins = (0..4).map(|index| {
        let d = if index == 3 { 6.0 } else { 0.0 };
        key(index, |_, _| FAR, move |x, y| [x as f32 - d, y as f32])
    });
    let (_, last) = climbed(Method::Auto, begins);
    assert_eq!(last.velocity.at(60, 44), Default::default());
}

#[test]
fn what_shakes_as_it_drives_by_goes_on_across_by_its_rung_and_is_held_up_and_down() {
    // It gains a pixel per key across, and turns back up and down with every key: most of its
    // motion is news, or along one axis alone.
    for speed in [9.5, 29.5] {
        let keys = (0..6).map(|index| {
            let (across, up) = (speed + index as f32, if index % 2 == 0 { 5.0 } else { -5.0 });
            key(index, |_, _| FAR, move |x, y| [x as f32 - across, y as f32 - up])
        });
        let (ladder, last) = climbed(Method::Auto, keys);
        let lead = ladder.evidence().leads().at(90 / STRIDE, 44 / STRIDE);
        assert_eq!((lead.rung, lead.share), (Rung::Quadratic, [Lead::WHOLE, 0]));
        let (velocity, acceleration) = (last.velocity.at(90, 44), last.acceleration.at(90, 44));
        assert_eq!((velocity.y, acceleration.y), (0, 0));
        let [v, a] = [velocity.x, acceleration.x].map(|part| f32::from(part) / 32.0);
        assert!((v - speed - 5.5).abs() < 0.05 && (a - 1.0).abs() < 0.05, "{v} {a}");
    }
}

#[test]
fn an_axis_along_which_some_rung_is_nearer_than_holding_goes_on_whole() {
    // Up and down it slows and hastens: most of its 5 px was not foreseen, yet some of it was.
    let keys = (0..6).map(|index| {
        let up = if index % 2 == 0 { 2.0 } else { 5.0 };
        key(index, |_, _| FAR, move |x, y| [x as f32 - 12.0, y as f32 - up])
    });
    let (ladder, _) = climbed(Method::Auto, keys);
    assert!(ladder.evidence().leads().at(60 / STRIDE, 44 / STRIDE).is_whole());
}

#[test]
fn a_camera_that_begins_to_move_is_believed_at_once() {
    let begins = |index: i64| camera(0.0, if index == 6 { 2.0 } else { 0.0 });
    let (_, last) = climbed(Method::Auto, seen(begins));
    assert!(last.velocity.at(60, 44).x.abs() > 32, "{:?}", last.velocity.at(60, 44));
}

#[test]
fn what_runs_over_a_still_surface_is_followed_by_its_flow_and_the_rest_is_not() {
    let is_screen = |x: u32, y: u32| (40..88).contains(&x) && (24..64).contains(&y);
    let keys = (0..5).map(|index| {
        let shows = |x: u32, y: u32| {
            // Blocks of noise that run five pixels to the right per key.
            let x = if is_screen(x, y) { x + 100 - 5 * index as u32 } else { x };
            crate::testing::hash(x / 6, y / 6, 1) & 0xff
        };
        KeyFrame {
            color: crate::color::ColorPlane::Rgba8(plane(SIZE[0], SIZE[1], |x, y| {
                crate::color::Rgba8(0x01_01_01 * shows(x, y))
            })),
            ..key(index, |_, _| FAR, |x, y| [x as f32, y as f32])
        }
    });
    let (mut ladder, mut flow) = (Ladder::new(Method::Auto, None).unwrap(), Flow::default());
    let mut taken: Vec<KeyFrame> = Vec::new();
    for mut key in keys {
        let past = [1, 2, 3].map(|back| taken.len().checked_sub(back).map(|i| &taken[i]));
        ladder.take_key(&pool(2), Some(&mut flow), &mut key, past);
        taken.push(key);
    }
    let newest = taken.pop().unwrap();
    let moved = newest.velocity.at(64, 44);
    assert!((moved.x - 160).abs() < 8 && moved.y.abs() < 8, "{moved:?}");
    assert_eq!(rung(&ladder, 64, 44), Rung::Flow);
    for (x, y) in [(8, 8), (110, 44), (64, 80)] {
        assert_ne!(rung(&ladder, x, y), Rung::Flow);
        assert_eq!(newest.velocity.at(x, y), crate::key::Velocity::default());
    }
}
