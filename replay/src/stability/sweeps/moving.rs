//! Sweeps of how things move.

use foreframe_fixtures::probes;

use super::Point;
use super::case::{Case, Frames};

pub(super) fn distance() -> Vec<Point> {
    let at = |after| {
        let case = Case { frames: Frames::After(after), ..Case::steady(probes::mixed) };
        Point::new(after, case)
    };
    [0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0].map(at).into()
}

pub(super) fn speed() -> Vec<Point> {
    let at = |speed: f64| Point::new(speed, Case::steady(move || probes::sliding(speed)));
    [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0].map(at).into()
}

pub(super) fn rotation() -> Vec<Point> {
    let at = |degrees: f64| Point::new(degrees, Case::steady(move || probes::rotating(degrees)));
    [2.0, 5.0, 10.0, 20.0, 45.0, 90.0].map(at).into()
}

pub(super) fn acceleration() -> Vec<Point> {
    let at = |gain: f64| Point::new(gain, Case::steady(move || probes::accelerating(gain)));
    [0.0, 0.5, 1.0, 2.0, 4.0, 8.0].map(at).into()
}

pub(super) fn bounce() -> Vec<Point> {
    let at = |speed: f64| {
        let probe = move |calm| move || probes::bouncing(speed, calm);
        // It turns in the middle of interval 6; the motion of key 7 is of neither way.
        Point::new(speed, Case::with_event(probe(false), probe(true), 7, 6..8))
    };
    [2.0, 4.0, 8.0, 16.0, 32.0].map(at).into()
}

pub(super) fn teleport() -> Vec<Point> {
    let at = |jump: f64| {
        let probe = move |calm| move || probes::teleporting(jump, calm);
        Point::new(jump, Case::with_event(probe(false), probe(true), 6, 6..7))
    };
    [4.0, 8.0, 16.0, 32.0, 64.0].map(at).into()
}

pub(super) fn thin_bars() -> Vec<Point> {
    let at = |width: f64| Point::new(width, Case::steady(move || probes::bars(width)));
    [4.0, 3.0, 2.0, 1.5, 1.0, 0.5].map(at).into()
}

pub(super) fn disocclusion() -> Vec<Point> {
    let at = |width: f64| Point::new(width, Case::steady(move || probes::disocclusion(width)));
    [1.0, 2.0, 4.0, 8.0, 16.0, 32.0].map(at).into()
}
