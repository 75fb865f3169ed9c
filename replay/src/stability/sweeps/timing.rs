//! Sweeps of when keys come, how they are sampled, and of what follows what.

use foreframe_fixtures::probes;

use super::Point;
use super::case::{Calm, Case, even_keys};
use crate::stability::shoot::KeyRecipe;
use crate::stability::spoil::Random;

/// Keys of a sequence of which so few are dropped as 1 %.
const MANY: usize = 101;
const SEED: u64 = 4;

pub(super) fn dropped() -> Vec<Point> {
    [1_u8, 2, 5, 10, 20].map(|percent| Point::new(percent, with_dropped(percent))).into()
}

fn with_dropped(percent: u8) -> Case {
    let mut random = Random::new(SEED);
    let mut dropped = Vec::new();
    // Neither the first keys nor the last are dropped, and no two in a row: each gap is one event.
    while dropped.len() < usize::from(percent) {
        let key = 3 + (random.unit() * (MANY - 7) as f64) as usize;
        if (key - 1..=key + 1).all(|near| !dropped.contains(&near)) {
            dropped.push(key);
        }
    }
    dropped.sort_unstable();
    Case {
        keys: even_keys(MANY),
        measured: 2..MANY - 1,
        sound_again: dropped.iter().map(|key| key + 1).collect(),
        calm: Some(Calm { probe: None, keys: even_keys(MANY) }),
        dropped,
        ..Case::steady(probes::mixed)
    }
}

pub(super) fn jitter() -> Vec<Point> {
    let at = |percent: u8| {
        let mut case = Case::steady(probes::mixed);
        let mut random = Random::new(SEED);
        let mut before = -1.0;
        for key in &mut case.keys {
            let off = f64::from(percent) / 100.0 * (2.0 * random.unit() - 1.0);
            *key = KeyRecipe::new(key.time + off, before);
            before = key.time;
        }
        Point::new(percent, case)
    };
    [0, 5, 10, 20, 40].map(at).into()
}

pub(super) fn taa() -> Vec<Point> {
    [0, 1, 2, 3].map(|sevenths| Point::new(sevenths, with_jitter(sevenths, true))).into()
}

pub(super) fn taa_undeclared() -> Vec<Point> {
    [0, 1, 2, 3].map(|sevenths| Point::new(sevenths, with_jitter(sevenths, false))).into()
}

/// Corners of a square in turn: every key has the whole amplitude.
fn with_jitter(sevenths: i32, declares_jitter: bool) -> Case {
    const CORNERS: [[i32; 2]; 4] = [[-1, -1], [1, 1], [1, -1], [-1, 1]];
    let mut case = Case::steady(probes::mixed);
    for (key, corner) in case.keys.iter_mut().zip(CORNERS.into_iter().cycle()) {
        key.jitter = corner.map(|side| side * sevenths);
        key.declares_jitter = declares_jitter;
    }
    case
}

pub(super) fn resolution() -> Vec<Point> {
    let at = |percent: u8| {
        let shrink = move |key: &mut KeyRecipe| key.scale = f64::from(percent) / 100.0;
        Point::new(percent, Case::with_bad_keys(probes::mixed, shrink, None))
    };
    [100, 90, 75, 50].map(at).into()
}

pub(super) fn cut() -> Vec<Point> {
    let at = |(label, is_cut): (&str, bool)| {
        let mut case = Case::with_event(|| probes::cut(false), || probes::cut(true), 6, 6..7);
        case.keys[6].is_cut = is_cut;
        Point::new(label, case)
    };
    [("a cut", true), ("nothing", false)].map(at).into()
}
