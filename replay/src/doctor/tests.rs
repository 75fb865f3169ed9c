use foreframe_engine::Plane;
use foreframe_engine::format::MotionConvention;
use foreframe_perception::display::DisplayProfile;

use super::*;
use crate::recording::memory::MemoryRecording;

fn profile() -> DisplayProfile {
    DisplayProfile::builtin("asus-pg279q").unwrap()
}

/// What is found of a patch that moves, whose motion is declared as `declare` makes it.
fn found(declare: impl Fn(&mut MotionConvention)) -> Report {
    let mut recording = MemoryRecording::moving_patch(12, [3, 2], &[1]);
    recording.declare_motion(declare);
    let profile = profile();
    examine(&mut recording, &Examination { keys: 6, ppd: 52.0, profile: &profile }).unwrap()
}

#[test]
fn motion_that_is_right_is_called_so_and_a_flipped_axis_is_named() {
    let right = found(|_| ()).motion;
    assert_eq!((right.verdict, right.keys), (None, 6), "{:?}", right.hypotheses);
    let flipped = found(|motion| motion.scale[1] = -1.0).motion;
    assert!(flipped.verdict.as_ref().unwrap().contains("y-flipped"), "{flipped:?}");
    let named = flipped.hypotheses.iter().find(|finding| finding.name == "y_flipped").unwrap();
    assert!(named.rms_levels < 0.5 * flipped.hypotheses[0].rms_levels, "{flipped:?}");
}

/// A picture of 128 x 128 whose red, green and blue `levels` gives.
fn picture(levels: impl Fn(u32, u32) -> [u8; 3]) -> Srgb8 {
    let pixels = (0..128 * 128).map(|i| levels(i % 128, i / 128));
    Plane::from_vec(128, 128, pixels.collect())
}

fn bits(levels: impl Fn(u32, u32) -> [u8; 3]) -> ColourReport {
    let profile = profile();
    let examination = Examination { keys: 1, ppd: 52.0, profile: &profile };
    needed_bits(&picture(levels), &examination).unwrap()
}

#[test]
fn a_slow_dark_gradient_needs_more_bits_than_texture_does() {
    let sky = bits(|x, _| [20 + (x / 16) as u8; 3]);
    assert!(sky.gradients > 0 && sky.min_bits.is_none_or(|bits| bits > 8), "{sky:?}");
    assert_ne!(sky.format, "rgba8", "{sky:?}");
    let texture = bits(|x, y| [(x * 37 + y * 101) as u8, 0, 0]);
    assert_eq!((texture.gradients, texture.format), (0, "rgba8"), "{texture:?}");
    let flat = bits(|_, _| [90; 3]);
    assert_eq!((flat.gradients, flat.format), (0, "rgba8"), "{flat:?}");
}
