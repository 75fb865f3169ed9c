//! Sweeps of damage to depth and motion.

use foreframe_fixtures::probes;

use super::Point;
use super::case::Case;
use crate::stability::spoil::Spoil;

fn spoilt(label: impl ToString, spoil: Option<Spoil>) -> Point {
    Point::new(label, Case::with_bad_keys(probes::mixed, |_| (), spoil))
}

pub(super) fn depth_noise() -> Vec<Point> {
    let at = |percent: f64| spoilt(percent, Some(Spoil::DepthNoise(percent / 100.0)));
    [0.0, 0.1, 0.5, 2.0, 10.0, 50.0].map(at).into()
}

pub(super) fn depth_bits() -> Vec<Point> {
    [32, 24, 16, 12, 8].map(|bits| spoilt(bits, Some(Spoil::DepthBits(bits)))).into()
}

pub(super) fn motion_noise() -> Vec<Point> {
    [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0].map(|px| spoilt(px, Some(Spoil::MotionNoise(px)))).into()
}

pub(super) fn motion_step() -> Vec<Point> {
    [0.0625, 0.25, 1.0, 2.0, 4.0, 8.0].map(|px| spoilt(px, Some(Spoil::MotionStep(px)))).into()
}

pub(super) fn motion_sign() -> Vec<Point> {
    let axes = [("none", [1.0, 1.0]), ("y", [1.0, -1.0]), ("x", [-1.0, 1.0]), ("both", [-1.0; 2])];
    axes.map(|(axis, factors)| spoilt(axis, Some(Spoil::MotionScale(factors)))).into()
}

pub(super) fn motion_scale() -> Vec<Point> {
    let at = |factor: f64| spoilt(factor, Some(Spoil::MotionScale([factor; 2])));
    [0.0, 0.5, 0.9, 1.0, 1.1, 1.5, 2.0, 4.0].map(at).into()
}

pub(super) fn motion_nan() -> Vec<Point> {
    let at = |percent: f64| spoilt(percent, Some(Spoil::MotionNan(percent / 100.0)));
    [0.0, 1.0, 5.0, 20.0, 50.0, 100.0].map(at).into()
}

pub(super) fn missing() -> Vec<Point> {
    vec![
        spoilt("none", None),
        spoilt("motion", Some(Spoil::MotionMissing)),
        spoilt("both", Some(Spoil::FieldsMissing)),
    ]
}
