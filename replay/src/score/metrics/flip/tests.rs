//! Laws of FLIP, and its values against the authors' own program.

use super::super::test_pictures::{from_fn, map, textured};
use super::*;

/// Diagonal ramps and a checkerboard, moved to the left by `shift` pixels. Integer arithmetic, so
/// that the reference run saw the same bytes.
fn patterned(shift: u32) -> Srgb8 {
    from_fn(96, 64, |x, y| {
        let x = x + shift;
        let ramp = (x * 4 + y) % 256;
        let ridge = (128_i32 - ((x * 3 + 2 * y) % 256) as i32).unsigned_abs() * 2;
        let board = (x / 9 + y / 7) % 2 * 180 + 20;
        [ramp, ridge, board].map(|level| level.min(255) as u8)
    })
}

/// Means that `flip_evaluator.evaluate(.., "LDR", parameters={"ppd": 67.0})` of the authors' Python
/// package `flip-evaluator` 1.7 gives for the same pictures.
#[test]
fn it_equals_the_program_of_its_authors() {
    let texture = textured(96, 64, 1);
    let pattern = patterned(0);
    let swapped = {
        let pixels = pattern.data().iter().map(|[r, g, b]| [*b, *g, *r]).collect();
        Plane::from_vec(96, 64, pixels)
    };
    let cases = [
        ("another texture", textured(96, 64, 2), &texture, 0.189_015),
        ("half the level", map(&texture, |v| v / 2), &texture, 0.793_405),
        ("moved by 1", patterned(1), &pattern, 0.195_654),
        ("moved by 3", patterned(3), &pattern, 0.405_013),
        ("moved by 8", patterned(8), &pattern, 0.683_059),
        ("red and blue swapped", swapped, &pattern, 0.577_298),
        ("10 levels brighter", map(&pattern, |v| v.saturating_add(10)), &pattern, 0.210_794),
        (
            "black on white",
            from_fn(16, 16, |_, _| [0; 3]),
            &from_fn(16, 16, |_, _| [255; 3]),
            0.967_392,
        ),
    ];
    for (what, output, truth, expected) in cases {
        let found = flip(&output, truth);
        assert!((found - expected).abs() < 2e-4, "{what}: expected {expected}, found {found}");
    }
}

#[test]
fn equal_pictures_have_none() {
    for (width, height) in [(48, 32), (3, 2), (1, 1)] {
        let truth = textured(width, height, 1);
        assert!(flip(&truth, &truth) < 1e-12, "{width}x{height}");
    }
}

#[test]
fn it_stays_in_range_and_is_symmetric() {
    let (a, b) = (textured(40, 30, 1), from_fn(40, 30, |x, _| [(x % 2 * 255) as u8; 3]));
    let (forwards, backwards) = (flip(&a, &b), flip(&b, &a));
    assert!((0.0..=1.0).contains(&forwards));
    assert!((forwards - backwards).abs() < 1e-6);
}

#[test]
fn it_grows_with_the_difference() {
    let truth = patterned(0);
    let steps = [1, 2, 4, 8].map(|shift| flip(&patterned(shift), &truth));
    assert!(steps.is_sorted(), "{steps:?}");
    assert!(steps[0] > 0.0);
}

#[test]
fn one_wrong_pixel_is_seen() {
    let truth = patterned(0);
    let mut output = truth.clone();
    output.row_mut(20)[20] = [255, 0, 255];
    assert!(flip(&output, &truth) > 1e-4);
}

#[test]
#[should_panic(expected = "one size")]
fn pictures_of_different_sizes_are_refused() {
    std::hint::black_box(flip(&textured(8, 8, 1), &textured(9, 8, 1)));
}
