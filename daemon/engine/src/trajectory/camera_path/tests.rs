//! Laws of the camera's path and of reprojection.

use glam::{DVec3, DVec4};

use super::*;

const VALID: Rect = Rect { x: 8, y: 4, width: 320, height: 180 };
const INTERVAL: MonoSpan = MonoSpan::from_ms(25);

fn projection() -> [f32; 16] {
    let (near, focal) = (0.1, 1.3);
    let mut p = [0.0; 16];
    (p[0], p[5]) = (focal / (16.0 / 9.0), focal);
    // Reversed, infinite far plane; a little off centre.
    (p[8], p[9], p[11], p[14]) = (0.1, -0.05, -1.0, near);
    p
}

fn camera(view: DMat4) -> Camera {
    Camera { view: view.as_mat4().to_cols_array(), projection: projection() }
}

/// A pose of a camera that slides and turns, each as a polynomial of time.
fn pose(index: i64, twist: &Twist, change: &Twist) -> Pose {
    let s = INTERVAL.as_secs_f64() * index as f64;
    let start = DMat4::from_translation(DVec3::new(1.0, -2.0, 3.0));
    let motion = twist.scale(s).plus(&change.scale(0.5 * s * s)).exp();
    Pose { time: MonoTime::ZERO + INTERVAL.scale(index, 1), camera: camera(motion * start) }
}

/// Pixel and inverse distance of a world point, by hand.
fn seen(camera: &Camera, point: DVec3) -> ([f32; 2], f32) {
    let view = Mat4::from_cols_array(&camera.view).as_dmat4();
    let clip = Mat4::from_cols_array(&camera.projection).as_dmat4() * view * point.extend(1.0);
    let DVec4 { x, y, w, .. } = clip;
    let px = [8.0 + (x / w + 1.0) * 160.0 - 0.5, 4.0 + (1.0 - y / w) * 90.0 - 0.5];
    (px.map(|p| p as f32), (1.0 / w) as f32)
}

const POINTS: [DVec3; 3] =
    [DVec3::new(0.5, 2.5, -9.0), DVec3::new(-3.0, 1.0, -20.0), DVec3::new(2.0, 3.0, -6.0)];

/// Largest distance in pixels between where `onward` says that points are after one interval, and
/// where `truth` sees them.
fn error(onward: &Onward, newest: &Camera, truth: &Camera) -> f32 {
    let reprojection = onward.reprojection(VALID, INTERVAL).unwrap();
    let errors = POINTS.map(|point| {
        let (pixel, q) = seen(newest, point);
        let (expected, _) = seen(truth, point);
        let found = reprojection.place(pixel, q);
        (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs())
    });
    errors.into_iter().fold(0.0, f32::max)
}

fn twist(turn: [f64; 3], drift: [f64; 3]) -> Twist {
    Twist { turn: DVec3::from_array(turn), drift: DVec3::from_array(drift) }
}

#[test]
fn a_reprojection_puts_a_point_where_the_other_camera_sees_it() {
    let (a, b) = (pose(0, &Twist::default(), &Twist::default()), {
        pose(4, &twist([0.3, -0.2, 0.1], [1.0, 0.3, -2.0]), &Twist::default())
    });
    let reprojection = between(&a.camera, &b.camera, VALID).unwrap();
    for point in POINTS {
        let (pixel, q) = seen(&a.camera, point);
        let (expected, _) = seen(&b.camera, point);
        let found = reprojection.place(pixel, q);
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 2e-3, "expected {expected}, found {found}");
        }
    }
    let beyond = pose(4, &twist([0.0; 3], [0.0, 0.0, 200.0]), &Twist::default());
    let reprojection = between(&a.camera, &beyond.camera, VALID).unwrap();
    let (pixel, q) = seen(&a.camera, POINTS[0]);
    assert!(reprojection.place(pixel, q)[0].is_nan(), "the camera has passed the point");
}

#[test]
fn a_constant_twist_is_continued_exactly_by_every_order() {
    let steady = twist([0.4, 1.0, -0.2], [0.5, -1.0, 3.0]);
    let mut path = CameraPath::default();
    (0..4).for_each(|i| path.push(pose(i, &steady, &Twist::default())));
    let truth = pose(4, &steady, &Twist::default()).camera;
    for order in CameraOrder::ALL {
        let onward = path.onward(order).unwrap();
        let error = error(&onward, &path.newest().unwrap().camera, &truth);
        assert!(error < 0.01, "{order:?}: {error} px");
    }
}

#[test]
fn a_turn_that_speeds_up_needs_the_second_order() {
    let (start, change) = (twist([0.0, 0.3, 0.0], [0.0; 3]), twist([0.0, 8.0, 0.0], [0.0; 3]));
    let mut path = CameraPath::default();
    (0..3).for_each(|i| path.push(pose(i, &start, &change)));
    let truth = pose(3, &start, &change).camera;
    let errors = CameraOrder::ALL
        .map(|order| error(&path.onward(order).unwrap(), &path.newest().unwrap().camera, &truth));
    assert!(errors[0] > 1.0, "{errors:?}");
    assert!(errors[2] < 0.02, "{errors:?}");
    assert!((errors[1] - errors[0] / 2.0).abs() < 0.1, "{errors:?}");
}

#[test]
fn a_path_goes_on_from_two_poses_and_forgets_what_a_cut_parts() {
    let steady = twist([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let mut path = CameraPath::default();
    path.push(pose(0, &steady, &Twist::default()));
    assert_eq!(path.onward(CameraOrder::Constant), None);
    path.push(pose(1, &steady, &Twist::default()));
    path.push(pose(1, &twist([1.0; 3], [1.0; 3]), &Twist::default()));
    assert!(path.onward(CameraOrder::Accelerated).is_some());
    assert!(path.at(MonoTime::ZERO).is_some(), "a pose that is no news takes no place");
    path.cut();
    assert_eq!(path.onward(CameraOrder::Constant), None);
}

#[test]
fn a_late_pose_is_met_exactly() {
    let steady = twist([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let mut path = CameraPath::default();
    path.push(pose(0, &steady, &Twist::default()));
    let late = pose(1, &twist([0.5, -1.0, 0.2], [2.0, 1.0, -3.0]), &Twist::default());
    let onward = path.towards(&late).unwrap();
    assert!(error(&onward, &path.newest().unwrap().camera, &late.camera) < 0.01);
}

#[test]
fn a_late_pose_at_the_newest_ones_time_is_not_a_velocity() {
    let mut path = CameraPath::default();
    path.push(pose(0, &twist([0.0; 3], [0.0; 3]), &Twist::default()));
    let newest = *path.newest().unwrap();
    let mut late = newest;
    late.camera.view[1] += 6e-8;
    late.time = newest.time + MonoSpan::from_us(10);
    assert!(path.towards(&late).is_none());
    late.time = newest.time + MonoSpan::from_ms(5);
    assert!(path.towards(&late).is_some());
}
