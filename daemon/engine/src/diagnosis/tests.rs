use super::*;
use crate::color::Rgba8;
use crate::format::{
    DepthConvention, DepthFormat, DepthMeaning, MotionConvention, MotionDirection, MotionFormat,
    MotionUnit,
};
use crate::key::Camera;
use crate::testing::{hash, plane};

const SIZE: [u32; 2] = [160, 96];
const STEP: [i32; 2] = [5, 3];
const DEPTH: u32 = u32::MAX / 4;

fn format(camera_motion: CameraMotion) -> StreamFormat {
    StreamFormat {
        depth: Some(DepthConvention { format: DepthFormat::F32, meaning: DepthMeaning::Reversed }),
        motion: Some(MotionConvention {
            format: MotionFormat::Rg32f,
            direction: MotionDirection::PreviousToCurrent,
            unit: MotionUnit::Pixels,
            scale: [1.0, 1.0],
            camera_motion,
        }),
        ..StreamFormat::rgba8(SIZE[0], SIZE[1])
    }
}

/// Blobs of a few pixels, and detail that no wrong vector finds again.
fn texture(x: i32, y: i32) -> u32 {
    let at = |size: i32| {
        let cell = |v: i32| v.div_euclid(size).cast_unsigned();
        hash(cell(x), cell(y), size.cast_unsigned()) % 100
    };
    at(2) / 2 + at(9) + at(31) / 2
}

/// Key `n` of a picture that moves by `STEP` from key to key, whose plane says that it moves by
/// `d`.
fn key(n: i32, d: [f32; 2]) -> (KeyFrame, Plane<[f32; 2]>) {
    let [width, height] = SIZE;
    let shows = |x: u32, y: u32| {
        let [x, y] = [x.cast_signed() - n * STEP[0], y.cast_signed() - n * STEP[1]];
        Rgba8(0x01_01_01 * texture(x, y))
    };
    let at = |n: i32| MonoTime::from_ns(1_000_000 * u64::from((n + 1).cast_unsigned()));
    let key = KeyFrame {
        content_time: at(n),
        motion_from: Some(at(n - 1)),
        valid: Rect::full(width, height),
        color: ColorPlane::Rgba8(plane(width, height, shows)),
        depth: plane(width, height, |_, _| DEPTH),
        ..KeyFrame::default()
    };
    (key, plane(width, height, |_, _| d))
}

/// What is found of six keys that say `d`, `change`d.
fn found_of(
    camera_motion: CameraMotion,
    d: [f32; 2],
    change: impl Fn(i32, &mut KeyFrame),
) -> Diagnosis {
    let format = format(camera_motion);
    let mut check = MotionCheck::new(&format, 6);
    let mut older: Option<KeyFrame> = None;
    for n in 0..12 {
        let (mut newest, displacement) = key(n, d);
        change(n, &mut newest);
        if let Some(older) = &older {
            check.look(&format, &newest, &displacement, older);
        }
        older = Some(newest);
    }
    check.diagnosis()
}

fn found(d: [f32; 2]) -> Diagnosis {
    found_of(CameraMotion::Included, d, |_, _| ())
}

const RIGHT: [f32; 2] = [STEP[0] as f32, STEP[1] as f32];

#[test]
fn nothing_is_wrong_with_motion_that_is_right() {
    let right = found(RIGHT);
    assert_eq!((right.verdict, right.keys), (None, 6), "{:?}", right.errors);
    assert!(right.samples > 6 * 1000, "{}", right.samples);
    assert!(right.errors[0].1 < right.errors[1].1 / 4.0, "{:?}", right.errors);
}

#[test]
fn signs_scales_and_units_that_are_wrong_are_told_by_name_and_number() {
    let [x, y] = RIGHT;
    let [width, height] = SIZE.map(|cells| cells as f32);
    for (declared, told) in [
        ([-x, y], "x-flipped"),
        ([x, -y], "y-flipped"),
        ([-x, -y], "reversed"),
        ([2.0 * x, 2.0 * y], "twice as long"),
        ([0.5 * x, 0.5 * y], "half as long"),
        ([x / width, y / height], "like uv"),
        ([x * width, y * height], "like pixels"),
    ] {
        let verdict = found(declared).verdict.unwrap_or_default();
        let names = verdict.starts_with("motion looks ") && verdict.contains(told);
        assert!(names && verdict.contains("falls from"), "{declared:?}: {verdict}");
    }
    let verdict = found([-2.0 * x, 1.7 * y]).verdict.unwrap_or_default();
    assert!(verdict.starts_with("motion explains nothing"), "{verdict}");
}

/// Cameras whose world at `DEPTH` moves as the picture does.
fn cameras(n: i32, key: &mut KeyFrame) {
    // Reversed, infinite far plane, near 1: d = 1 / w, and the depth key is 2^32 d.
    let mut projection = [0.0; 16];
    (projection[0], projection[5], projection[11], projection[14]) = (1.0, 1.0, -1.0, 1.0);
    let view = |n: i32| {
        let mut view = [0.0; 16];
        (view[0], view[5], view[10], view[15]) = (1.0, 1.0, 1.0, 1.0);
        // A pixel is 2 / size of the picture wide at distance 1, and four times that at 4.
        view[12] = 8.0 * (n * STEP[0]) as f32 / SIZE[0] as f32;
        view[13] = -8.0 * (n * STEP[1]) as f32 / SIZE[1] as f32;
        view
    };
    key.camera = Some(Camera { view: view(n), projection });
    key.motion_from_camera = Some(Camera { view: view(n - 1), projection });
    key.inverse_distance_per_depth_key = Some(1.0 / u32::MAX as f32);
}

#[test]
fn the_cameras_part_is_missed_and_found_twice() {
    let right = found_of(CameraMotion::Included, RIGHT, cameras);
    assert_eq!(right.verdict, None, "{:?}", right.errors);
    let missing = found_of(CameraMotion::Included, [0.0; 2], cameras).verdict.unwrap_or_default();
    assert!(missing.contains("camera's motion were not in it"), "{missing}");
    // As decoded: the plane's own vectors and the camera's.
    let twice = [2.0 * RIGHT[0], 2.0 * RIGHT[1]];
    let twice = found_of(CameraMotion::Missing, twice, cameras).verdict.unwrap_or_default();
    assert!(twice.contains("camera's motion were in it already"), "{twice}");
    let right = found_of(CameraMotion::Missing, RIGHT, cameras);
    assert_eq!(right.verdict, None, "{:?}", right.errors);
}

#[test]
fn jitter_left_in_the_vectors_is_told_with_its_sign() {
    // Half a pixel to either side in turn: from the older key to the newer by one pixel.
    let sway = |n: i32| if n % 2 == 0 { -0.5 } else { 0.5 };
    for (sign, told) in [(1.0, "the jitter of the projection:"), (-1.0, "reversed")] {
        let format = format(CameraMotion::Included);
        let mut check = MotionCheck::new(&format, 6);
        let mut older: Option<KeyFrame> = None;
        for n in 0..12 {
            let moved_on = sway(n) - sway(n - 1);
            let (mut newest, displacement) =
                key(n, [RIGHT[0] + sign * moved_on, RIGHT[1] + sign * moved_on]);
            newest.field_offset = [(sway(n) * 256.0) as i32; 2];
            if let Some(older) = &older {
                check.look(&format, &newest, &displacement, older);
            }
            older = Some(newest);
        }
        let verdict = check.diagnosis().verdict.unwrap_or_default();
        assert!(verdict.contains("jitter") && verdict.contains(told), "{sign}: {verdict}");
    }
}

#[test]
fn grain_on_a_picture_that_stands_still_under_a_jittered_camera_is_no_fault() {
    let format = format(CameraMotion::Included);
    let mut check = MotionCheck::new(&format, 6);
    let mut older: Option<KeyFrame> = None;
    let mut look = |n: i32, d: [f32; 2]| {
        let (mut newest, displacement) = key(0, d);
        let at = MonoTime::from_ns(1_000_000 * u64::from((n + 1).cast_unsigned()));
        (newest.content_time, newest.motion_from) = (at, Some(at - MonoSpan::from_ms(1)));
        newest.color = ColorPlane::Rgba8(plane(SIZE[0], SIZE[1], |x, y| {
            Rgba8(0x01_01_01 * (90 + hash(x, y, n.cast_unsigned()) % 40))
        }));
        newest.field_offset = [if n % 2 == 0 { 128 } else { -128 }; 2];
        if let Some(older) = &older {
            check.look(&format, &newest, &displacement, older);
        }
        older = Some(newest);
    };
    (0..20).for_each(|n| look(n, [0.0; 2]));
    // A camera that sways by less than grain lets anybody see.
    (20..40).for_each(|n| look(n, [0.3, 0.0]));
    assert_eq!(check.diagnosis().verdict, None, "{:?}", check.diagnosis());
}

#[test]
fn keys_that_tell_nothing_are_not_looked_at() {
    let elsewhere = found_of(CameraMotion::Included, RIGHT, |_, key| {
        key.motion_from = key.motion_from.map(|from| from - MonoSpan::from_ms(1));
    });
    let without = found_of(CameraMotion::Included, RIGHT, |_, key| key.motion_from = None);
    let still = found([0.0; 2]);
    for diagnosis in [elsewhere, without, still] {
        assert_eq!((diagnosis.keys, diagnosis.samples, diagnosis.verdict), (0, 0, None));
    }
}
