//! Sweeps of colour that no motion vector tells of.

use foreframe_fixtures::probes;

use super::Point;
use super::case::Case;

const SPEEDS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

pub(super) fn shadow() -> Vec<Point> {
    SPEEDS.map(|speed| Point::new(speed, Case::steady(move || probes::shadow(speed)))).into()
}

pub(super) fn mirror() -> Vec<Point> {
    SPEEDS.map(|speed| Point::new(speed, Case::steady(move || probes::mirror(speed)))).into()
}

pub(super) fn scrolling() -> Vec<Point> {
    SPEEDS.map(|speed| Point::new(speed, Case::steady(move || probes::scrolling(speed)))).into()
}

/// The points of another sweep, with a mask that says what is special.
fn masked(points: Vec<Point>) -> Vec<Point> {
    let masked = |point: Point| Point { case: point.case.masked(), ..point };
    points.into_iter().map(masked).collect()
}

pub(super) fn shadow_mask() -> Vec<Point> {
    masked(shadow())
}

pub(super) fn mirror_mask() -> Vec<Point> {
    masked(mirror())
}

pub(super) fn scrolling_mask() -> Vec<Point> {
    masked(scrolling())
}

pub(super) fn glass_mask() -> Vec<Point> {
    masked(glass())
}

pub(super) fn particles_mask() -> Vec<Point> {
    masked(particles())
}

pub(super) fn glass() -> Vec<Point> {
    let at = |opacity: f64| Point::new(opacity, Case::steady(move || probes::glass(opacity)));
    [0.1, 0.25, 0.5, 0.75, 1.0].map(at).into()
}

pub(super) fn particles() -> Vec<Point> {
    let at = |count: u32| Point::new(count, Case::steady(move || probes::particles(count)));
    [10, 30, 100, 300].map(at).into()
}
