//! The identity of Didyk et al. 2010, exact in light, before and after quantisation.

use proptest::prelude::*;

use super::*;
use crate::display::DisplayProfile;

/// Light of all frames minus that of N originals, in units of [`FULL_LIGHT`].
fn excess(compensation: &Compensation, original: u16, split: Split) -> i64 {
    let table = compensation.table();
    let light = |level| i64::from(table.light(level));
    let frames = i64::from(compensation.frames());
    light(split.key) + (frames - 1) * light(split.in_between) - frames * light(original)
}

/// Half a level per output frame.
fn allowed(compensation: &Compensation, split: Split) -> i64 {
    let table = compensation.table();
    let others = i64::from(compensation.frames() - 1);
    // The divisions and the table round by up to half a unit each.
    i64::from(table.half_level(split.key))
        + others * i64::from(table.half_level(split.in_between))
        + i64::from(compensation.frames())
}

#[test]
fn every_pair_of_levels_keeps_its_light_on_every_profile() {
    for profile in DisplayProfile::builtins() {
        let [_, green, _] = LightTable::of_profile(&profile).unwrap();
        for frames in [2, 3, 5] {
            let compensation = Compensation::new(green.clone(), frames).unwrap();
            for original in 0..=255 {
                for blurred in 0..=255 {
                    let split = compensation.split(original, blurred);
                    let excess = excess(&compensation, original, split);
                    assert!(
                        excess.abs() <= allowed(&compensation, split),
                        "{} N {frames}: {original} over {blurred} gives {split:?}, off by {excess}",
                        profile.name()
                    );
                }
            }
        }
    }
}

#[test]
fn a_key_of_another_gamma_would_be_found() {
    let of = |gamma| Compensation::new(LightTable::new(256, |c| libm::pow(c, gamma)).unwrap(), 3);
    let (right, wrong) = (of(2.2).unwrap(), of(1.0).unwrap());
    let split = wrong.split(120, 100);
    assert!(excess(&right, 120, split).abs() > allowed(&right, split));
}

#[test]
fn where_nothing_clips_the_key_is_the_closed_form_of_the_paper() {
    let gamma = 2.2;
    let table = LightTable::new(256, |code| libm::pow(code, gamma)).unwrap();
    let mut unclipped = 0;
    for frames in [2_u32, 3, 4] {
        let compensation = Compensation::new(table.clone(), frames).unwrap();
        let n = f64::from(frames);
        for original in (0..=255_u16).step_by(5) {
            for blurred in (0..=255_u16).step_by(3) {
                let [full, low] = [original, blurred].map(|level| f64::from(level) / 255.0);
                let light = n * libm::pow(full, gamma) - (n - 1.0) * libm::pow(low, gamma);
                if !(0.0..=1.0).contains(&light) {
                    continue;
                }
                unclipped += 1;
                // L plus the modified detail layer.
                let expected = libm::pow(light, 1.0 / gamma) * 255.0;
                let split = compensation.split(original, blurred);
                assert_eq!(split.in_between, blurred);
                assert!((f64::from(split.key) - expected).abs() < 0.51, "{expected} {split:?}");
            }
        }
    }
    assert!(unclipped > 1000, "{unclipped}");
}

#[test]
fn nothing_changes_without_blur_and_detail_that_does_not_fit_goes_to_the_other_frames() {
    let table = LightTable::new(256, |code| libm::pow(code, 2.2)).unwrap();
    let compensation = Compensation::new(table, 3).unwrap();
    for level in 0..=255 {
        assert_eq!(compensation.split(level, level), Split { key: level, in_between: level });
    }
    let bright = compensation.split(250, 100);
    assert!(bright.key == 255 && bright.in_between > 240, "{bright:?}");
    let dark = compensation.split(10, 100);
    assert!(dark.key <= 1 && (10..14).contains(&dark.in_between), "{dark:?}");
    assert_eq!(compensation.split(0, 255), Split { key: 0, in_between: 0 });
    assert_eq!(compensation.split(255, 0), Split { key: 255, in_between: 255 });
    assert_eq!(compensation.split(999, 999), Split { key: 255, in_between: 255 });
}

#[test]
fn the_table_of_bytes_holds_every_split() {
    let table = LightTable::new(256, |code| libm::pow(code, 2.1)).unwrap();
    let compensation = Compensation::new(table, 3).unwrap();
    let bytes = compensation.table_of_bytes().unwrap();
    assert_eq!(bytes.len(), 65_536);
    for (original, blurred) in [(0, 0), (200, 40), (17, 230), (128, 120)] {
        let split = compensation.split(original, blurred);
        let entry = bytes[usize::from(original) * 256 + usize::from(blurred)].map(u16::from);
        assert_eq!(entry, [split.key, split.in_between]);
    }
    let fine = LightTable::new(1024, |code| code).unwrap();
    assert!(Compensation::new(fine, 3).unwrap().table_of_bytes().is_none());
}

#[test]
fn frames_that_may_not_differ_by_more_keep_to_it_and_to_their_light() {
    let table = LightTable::new(256, |code| libm::pow(code, 2.2)).unwrap();
    for frames in [2, 3, 5] {
        let free = Compensation::new(table.clone(), frames).unwrap();
        for most in [FULL_LIGHT / 1000, FULL_LIGHT / 20, FULL_LIGHT / 3] {
            let kept = free.clone().within(most);
            let mut held_back = 0;
            for original in 0..=255 {
                for blurred in 0..=255 {
                    let split = kept.split(original, blurred);
                    let light = |level| i64::from(table.light(level));
                    let apart = (light(split.key) - light(split.in_between)).abs();
                    assert!(apart <= i64::from(most) + allowed(&kept, split) * i64::from(frames));
                    assert!(excess(&kept, original, split).abs() <= allowed(&kept, split));
                    held_back += u32::from(split != free.split(original, blurred));
                }
            }
            assert!(held_back > 5000, "{held_back} of pairs for {most}");
        }
        assert_eq!(free.clone().within(FULL_LIGHT * 16).split(3, 200), free.split(3, 200));
        let none = free.clone().within(0);
        assert_eq!(none.split(40, 200), Split { key: 40, in_between: 40 });
    }
}

#[test]
fn other_numbers_of_frames_are_refused() {
    let table = LightTable::new(256, |code| code).unwrap();
    assert!(Compensation::new(table.clone(), 1).is_err());
    assert!(Compensation::new(table.clone(), 17).is_err());
    assert!(Compensation::new(table, 16).is_ok());
}

proptest! {
    #[test]
    fn real_light_adds_up_exactly_and_no_frame_is_brighter_than_the_display(
        original in 0.0_f64..=1.0,
        blurred in 0.0_f64..=1.0,
        frames in 2_u32..=16,
    ) {
        let [key, other] = split_light(original, blurred, frames);
        let n = f64::from(frames);
        prop_assert!((key + (n - 1.0) * other - n * original).abs() < 1e-12);
        prop_assert!((0.0..=1.0).contains(&key));
        prop_assert!((-1e-12..=1.0 + 1e-12).contains(&other));
        let is_unclipped = (0.0..=1.0).contains(&(n * original - (n - 1.0) * blurred));
        prop_assert!(!is_unclipped || (other - blurred).abs() < 1e-12);
    }

    #[test]
    fn levels_keep_their_light_for_any_gamma_number_of_frames_and_depth(
        gamma in 1.0_f64..2.8,
        frames in 2_u32..=8,
        depth in prop::sample::select(vec![64_u32, 256, 1024]),
        original in 0.0_f64..=1.0,
        blurred in 0.0_f64..=1.0,
    ) {
        let table = LightTable::new(depth, |code| libm::pow(code, gamma)).unwrap();
        let level = |share: f64| (share * f64::from(depth - 1)).round() as u16;
        let compensation = Compensation::new(table, frames).unwrap();
        let split = compensation.split(level(original), level(blurred));
        let excess = excess(&compensation, level(original), split);
        prop_assert!(excess.abs() <= allowed(&compensation, split), "{split:?}: {excess}");
    }
}
