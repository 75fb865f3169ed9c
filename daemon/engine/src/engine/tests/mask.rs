//! Keys with a mask: whose motion their pixels take.

use super::*;
use crate::testing::hash;

/// Columns and rows of the pictures.
const SIDE: u32 = 96;
/// The patch that the mask is about: columns and rows from, to.
const PATCH: std::ops::Range<u32> = 24..72;

fn is_in_patch(x: u32, y: u32) -> bool {
    PATCH.contains(&x) && PATCH.contains(&y)
}

/// Blocks of grey that lie still, and in the patch others that have moved `moved` to the right.
fn picture(moved: u32) -> Vec<u8> {
    let grey = |x: u32, y: u32| {
        let (x, seed) = if is_in_patch(x, y) { (x + 960 - moved, 2) } else { (x + 960, 1) };
        (hash(x / 3, y / 3, seed) % 200) as u8
    };
    (0..SIDE * SIDE).flat_map(|i| [grey(i % SIDE, i / SIDE); 4]).collect()
}

/// A mask of `size`, of which the patch is of class `code`.
fn mask(code: u8, size: u32) -> Vec<u8> {
    let scale = SIDE / size;
    let at = |i: u32| is_in_patch(i % size * scale, i / size * scale);
    (0..size * size).map(|i| if at(i) { code } else { 0 }).collect()
}

/// What `method` shows half a key interval after keys whose patch moves 4 pixels each, with vectors
/// of `vector` there and none elsewhere; `mask` has its size.
fn shown(method: Method, vector: f32, mask: Option<(&[u8], u32)>) -> Vec<u8> {
    let format = StreamFormat { width: SIDE, height: SIDE, ..format() };
    let mut engine = Engine::new(format, EngineConfig::new(method, NonZeroUsize::MIN));
    let at = |ms| MonoTime::ZERO + MonoSpan::from_ms(ms);
    for key in 0..3 {
        let color = picture(4 * key);
        let vector = |i: u32| [if is_in_patch(i % SIDE, i / SIDE) { vector } else { 0.0 }, 0.0];
        let motion: Vec<u8> =
            (0..SIDE * SIDE).flat_map(vector).flat_map(f32::to_le_bytes).collect();
        let plane = |bytes, pixel| PlaneInput::packed(bytes, [SIDE, SIDE], pixel);
        let content_time = at(100 + 20 * i64::from(key));
        engine
            .push_key(&KeyInput {
                index: u64::from(key),
                content_time,
                motion_from: Some(content_time - MonoSpan::from_ms(20)),
                is_cut: false,
                color: plane(&color, 4),
                depth: None,
                motion: Some(plane(&motion, 8)),
                mask: mask.map(|(bytes, size)| PlaneInput::packed(bytes, [size, size], 1)),
                camera: None,
                motion_from_camera: None,
            })
            .unwrap();
    }
    let (mut out, mut bytes) = (ColorPlane::default(), Vec::new());
    engine.synthesise(at(150), &mut out).unwrap();
    out.write_bytes(&mut bytes);
    bytes
}

/// Mean difference within the patch, but for its outline, levels.
fn difference(a: &[u8], b: &[u8]) -> f64 {
    let inside = |i: &u32| {
        let within = PATCH.start + 8..PATCH.end - 8;
        within.contains(&(i % SIDE)) && within.contains(&(i / SIDE))
    };
    let places: Vec<_> = (0..SIDE * SIDE).filter(inside).map(|i| 4 * i as usize).collect();
    let sum: u32 = places.iter().map(|&i| u32::from(a[i].abs_diff(b[i]))).sum();
    f64::from(sum) / places.len() as f64
}

#[test]
fn what_moves_otherwise_than_its_surface_goes_by_the_picture_and_only_there() {
    let (truth, held) = (picture(4 * 2 + 2), picture(4 * 2));
    let apart = difference(&held, &truth);
    for method in [Method::Gather, Method::Linear, Method::Affine, Method::Auto] {
        for code in [1, 3, 4, 5] {
            for size in [SIDE, SIDE / 2, SIDE / 4] {
                let found = shown(method, 0.0, Some((&mask(code, size), size)));
                let left = difference(&found, &truth);
                assert!(left < 0.4 * apart, "{method}, class {code}: {left} of {apart}");
            }
        }
    }
    // Of the comparison: without a mask, or with classes that keep their vectors, it stands still.
    assert_eq!(shown(Method::Linear, 0.0, None), held);
    for code in [0, 2, 7, 255] {
        let mask = mask(code, SIDE);
        assert_eq!(shown(Method::Linear, 0.0, Some((&mask, SIDE))), held, "class {code}");
    }
}

#[test]
fn motion_that_is_invalid_moves_nothing() {
    let truth = picture(4 * 2 + 2);
    for method in [Method::Gather, Method::Linear, Method::Quadratic, Method::Auto] {
        let wrong = difference(&shown(method, -40.0, None), &truth);
        let by_picture = shown(method, -40.0, Some((&mask(6, SIDE), SIDE)));
        let left = difference(&by_picture, &truth);
        assert!(left < 0.4 * wrong || method == Method::Auto, "{method}: {left} of {wrong}");
        assert!(left < 0.4 * difference(&picture(8), &truth), "{method}: {left}");
    }
    // Nothing is known but the vectors: of the first key no pixel moves.
    let format = StreamFormat { width: SIDE, height: SIDE, ..format() };
    for (code, moves) in [(6, false), (0, true)] {
        let mut engine = Engine::new(format, EngineConfig::new(Method::Linear, NonZeroUsize::MIN));
        let (color, classes) = (picture(0), vec![code; (SIDE * SIDE) as usize]);
        let motion = [9.0_f32, 0.0].repeat((SIDE * SIDE) as usize);
        let motion: Vec<u8> = motion.into_iter().flat_map(f32::to_le_bytes).collect();
        let plane = |bytes, pixel| PlaneInput::packed(bytes, [SIDE, SIDE], pixel);
        let at = |ms| MonoTime::ZERO + MonoSpan::from_ms(ms);
        let input = KeyInput {
            index: 0,
            content_time: at(100),
            motion_from: Some(at(80)),
            is_cut: false,
            color: plane(&color, 4),
            depth: None,
            motion: Some(plane(&motion, 8)),
            mask: Some(plane(&classes, 1)),
            camera: None,
            motion_from_camera: None,
        };
        engine.push_key(&input).unwrap();
        let (mut out, mut bytes) = (ColorPlane::default(), Vec::new());
        engine.synthesise(at(110), &mut out).unwrap();
        out.write_bytes(&mut bytes);
        assert_eq!(bytes != color, moves, "class {code}");
    }
}

#[test]
fn a_mask_that_does_not_fit_is_refused_by_name() {
    let mut engine = engine(Method::Linear);
    let color = vec![0; (4 * SIZE * SIZE) as usize];
    let input = KeyInput {
        index: 0,
        content_time: MonoTime::ZERO + MonoSpan::from_ms(100),
        motion_from: None,
        is_cut: false,
        color: PlaneInput::packed(&color, [SIZE, SIZE], 4),
        depth: None,
        motion: None,
        mask: Some(PlaneInput::packed(&[0; 9], [3, 3], 1)),
        camera: None,
        motion_from_camera: None,
    };
    let error = engine.push_key(&input).unwrap_err().to_string();
    assert!(error.contains("mask"), "{error}");
}
