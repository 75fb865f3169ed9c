//! The scatter against its definition, cell by cell over all sources.

use proptest::prelude::*;

use super::*;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::testing::{hash, map_of, plane, pool};

/// (1) to (4), looking at every source for every target.
fn by_definition(source: &SourceField, scale: [i32; 2]) -> Plane<u32> {
    let (width, height) = (source.velocity.width(), source.velocity.height());
    plane(width, height, |column, row| {
        let mut landing = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let v = source.velocity.at(x, y);
                let at = |i: u32, v: i16, scale| {
                    i64::from(i) * 256 + ((i64::from(v) * i64::from(scale) + 256) >> 9)
                };
                let away = (at(x, v.x, scale[0]) - i64::from(column) * 256).abs()
                    + (at(y, v.y, scale[1]) - i64::from(row) * 256).abs();
                let inside = (at(x, v.x, scale[0]) - i64::from(column) * 256).abs() < 256
                    && (at(y, v.y, scale[1]) - i64::from(row) * 256).abs() < 256;
                if inside {
                    let splat = (away as u32 >> 2) << 25 | (y * width + x);
                    landing.push((source.depth.at(x, y), splat));
                }
            }
        }
        let top = landing.iter().map(|(depth, _)| *depth).max().unwrap_or(0);
        let nearest = landing.iter().filter(|(depth, _)| *depth >= top - (top >> 8));
        nearest.map(|(_, splat)| *splat).min().unwrap_or(NO_SOURCE)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_cell_shows_what_the_definition_says_and_holes_are_where_nothing_lands(
        (width, height) in (1_u32..24, 1_u32..20),
        reach in 0_u32..8,
        patch in 1_u32..20,
        levels in 1_u32..5,
        seed: u32,
        phase in 0.0..4.0,
        threads in 1_usize..5,
    ) {
        let steps = reach * 64 + 1;
        // Patches of one velocity, some of them wider than a tile.
        let v = |x, y, axis| (hash(x / patch, y, seed.wrapping_add(axis)) % steps) as i16 - (reach * 32) as i16;
        // Few depths, some within the tolerance of each other.
        let depth = plane(width, height, |x, y| 100_000 + 300 * (hash(x, y, seed) % levels));
        let velocity = plane(width, height, |x, y| Velocity { x: v(x, y, 1), y: v(x, y, 2) });
        let valid = Rect::full(width, height);
        let key = KeyFrame { valid, depth, velocity, ..KeyFrame::default() };
        let (pool, map, phase) = (pool(threads), map_of(&key), Phase::from_f64(phase));
        let mut source = SourceField::default();
        source.update(&pool, &key);
        let mut splat = Plane::default();
        scatter(&pool, &source, &map, phase, &mut ScatterScratch::default(), &mut splat);
        prop_assert_eq!(splat, by_definition(&source, [phase.q12(); 2]));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn tiles_are_splatted_like_cells_one_by_one(
        (width, height) in (1_u32..700, 1_u32..6),
        (shear, patch) in (0_i32..40, 1_u32..300),
        levels in 1_u32..4,
        seed: u32,
        phase in 0.0..4.0,
    ) {
        // Patches that shear slowly, as a slanted ground does, and jump between each other.
        let v = |x: u32, y: u32, axis| {
            let jump = (hash(x / patch, y, seed.wrapping_add(axis)) % 512) as i32 - 256;
            (jump + x as i32 * shear / 16) as i16
        };
        let depth = plane(width, height, |x, y| 100_000 + 300 * (hash(x / 3, y, seed) % levels));
        let velocity = plane(width, height, |x, y| Velocity { x: v(x, y, 1), y: v(x, y, 2) / 8 });
        let valid = Rect::full(width, height);
        let key = KeyFrame { valid, depth, velocity, ..KeyFrame::default() };
        let (pool, map, phase) = (pool(2), map_of(&key), Phase::from_f64(phase));
        let mut source = SourceField::default();
        source.update(&pool, &key);
        let [mut top, mut splat, mut expected] = [(); 3].map(|()| Plane::default());
        scatter_one_by_one(&source, &map, phase, &mut top, &mut expected);
        scatter(&pool, &source, &map, phase, &mut ScatterScratch::default(), &mut splat);
        prop_assert_eq!(splat, expected);
    }
}

/// A key of noise, in patches that move by up to `reach` pixels each way.
fn patches(size: [u32; 2], patch: u32, reach: u32) -> KeyFrame {
    let v = |x: u32, y: u32, axis| {
        let steps = hash(x / patch, y / patch, axis) % (reach * 64 + 1);
        (steps.cast_signed() - (reach * 32).cast_signed()) as i16
    };
    let depth = plane(size[0], size[1], |x, y| 100_000 + 300 * (hash(x, y, 5) % 4));
    let velocity = plane(size[0], size[1], |x, y| Velocity { x: v(x, y, 1), y: v(x, y, 2) });
    KeyFrame { valid: Rect::full(size[0], size[1]), depth, velocity, ..KeyFrame::default() }
}

#[test]
fn near_and_far_movers_are_splatted_like_cells_one_by_one_whichever_way_is_taken() {
    for (reach, looks) in [(1, true), (20, false), (1000, false)] {
        let key = patches([800, 300], 24, reach);
        let (pool, map) = (pool(2), map_of(&key));
        let mut source = SourceField::default();
        source.update(&pool, &key);
        let mut scratch = ScatterScratch::default();
        let scale = [Phase::ONE.q12(); 2];
        assert_eq!(scratch.find_windows(&source, scale), looks, "up to {reach} pixels");
        let [mut top, mut splat, mut expected] = [(); 3].map(|()| Plane::default());
        scatter_one_by_one(&source, &map, Phase::ONE, &mut top, &mut expected);
        scatter(&pool, &source, &map, Phase::ONE, &mut scratch, &mut splat);
        assert!(splat == expected, "patches that move by up to {reach} pixels");
    }
}

#[test]
fn one_fast_mover_widens_the_windows_around_it_and_no_others() {
    let mut key = patches([800, 300], 24, 1);
    for y in 100..120 {
        key.velocity.row_mut(y)[300..330].fill(Velocity { x: 12 * 32, y: -6 * 32 });
    }
    let (pool, map) = (pool(2), map_of(&key));
    let mut source = SourceField::default();
    source.update(&pool, &key);
    let mut scratch = ScatterScratch::default();
    assert!(scratch.find_windows(&source, [Phase::ONE.q12(); 2]));
    let [mut top, mut splat, mut expected] = [(); 3].map(|()| Plane::default());
    scatter_one_by_one(&source, &map, Phase::ONE, &mut top, &mut expected);
    scatter(&pool, &source, &map, Phase::ONE, &mut scratch, &mut splat);
    assert!(splat == expected);
}

#[test]
fn a_cell_between_columns_reaches_both_and_one_on_a_column_reaches_one() {
    let velocity = plane(8, 1, |x, _| Velocity { x: if x == 2 { 48 } else { -3200 }, y: 0 });
    let valid = Rect::full(8, 1);
    let key = KeyFrame { valid, velocity, ..KeyFrame::default() };
    let (pool, map) = (pool(1), map_of(&key));
    let mut source = SourceField::default();
    source.update(&pool, &key);
    let (mut scratch, mut splat) = (ScatterScratch::default(), Plane::default());
    let landed = |splat: &Plane<u32>| -> Vec<usize> {
        (0..8).filter(|x| splat.data()[*x] != NO_SOURCE).collect()
    };
    scatter(&pool, &source, &map, Phase::ONE, &mut scratch, &mut splat);
    assert_eq!(landed(&splat), [3, 4], "one and a half cells on");
    scatter(&pool, &source, &map, Phase::from_f64(2.0), &mut scratch, &mut splat);
    assert_eq!(landed(&splat), [5], "three cells on");
    assert_eq!(source_of(splat.data()[5]), 2);
}
