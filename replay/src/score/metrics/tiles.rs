//! Local artefacts: `PSNR_Y` per 4x4 tile and its classes (Falchetto et al. 2007, section 4).
//!
//! A tile's `PSNR_Y` (1.3) is clipped to 0..50 dB as the published list of classes is; tiles at
//! the right and bottom border of a picture whose size is no multiple of 4 are smaller.

use serde::Serialize;

use super::psnr::{squared_errors, weighted_psnr_db};
use super::{Srgb8, assert_same_size};

/// Edge of a tile in pixels.
pub const TILE_PX: u32 = 4;

/// Lowest and highest value of a tile in dB.
const TILE_RANGE_DB: (f64, f64) = (0.0, 50.0);

/// Upper bounds in dB, inclusive, of all classes but the best.
const CLASS_BOUNDS_DB: [f64; 5] = [20.0, 25.0, 30.0, 35.0, 40.0];

/// Share of the tiles in each class, in percent. The shares sum up to 100.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct TileClasses {
    /// 0 to 20 dB.
    pub verybad: f64,
    /// Over 20, up to 25 dB.
    pub bad: f64,
    /// Over 25, up to 30 dB.
    pub quitegood: f64,
    /// Over 30, up to 35 dB.
    pub good: f64,
    /// Over 35, up to 40 dB.
    pub verygood: f64,
    /// Over 40, up to 50 dB.
    pub excellent: f64,
}

/// Counts tiles over any number of pictures.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct TileTally {
    counts: [u64; 6],
    worst_db: Option<f64>,
}

impl TileTally {
    /// The tiles of one picture.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn of(output: &Srgb8, truth: &Srgb8) -> Self {
        assert_same_size(output, truth);
        let mut tally = Self::default();
        for top in (0..truth.height()).step_by(TILE_PX as usize) {
            let rows = top..(top + TILE_PX).min(truth.height());
            for left in (0..truth.width()).step_by(TILE_PX as usize) {
                let right = (left + TILE_PX).min(truth.width());
                let columns = left as usize..right as usize;
                let pairs = rows.clone().flat_map(|y| {
                    output.row(y)[columns.clone()].iter().zip(&truth.row(y)[columns.clone()])
                });
                tally.count(weighted_psnr_db(squared_errors(pairs), rows.len() * columns.len()));
            }
        }
        tally
    }

    /// Adds the tiles of `other`.
    pub fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(other.counts) {
            *count += more;
        }
        self.worst_db = match (self.worst_db, other.worst_db) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
    }

    /// The share of each class; all 0 where no tile was counted.
    #[must_use]
    pub fn classes_percent(&self) -> Option<TileClasses> {
        let total: u64 = self.counts.iter().sum();
        let percent = |class: usize| self.counts[class] as f64 * 100.0 / total as f64;
        (total > 0).then(|| TileClasses {
            verybad: percent(0),
            bad: percent(1),
            quitegood: percent(2),
            good: percent(3),
            verygood: percent(4),
            excellent: percent(5),
        })
    }

    /// The lowest value of all tiles in dB, 0 to 50; None where no tile was counted.
    #[must_use]
    pub fn worst_db(&self) -> Option<f64> {
        self.worst_db
    }

    fn count(&mut self, psnr_y_db: f64) {
        let clipped = psnr_y_db.clamp(TILE_RANGE_DB.0, TILE_RANGE_DB.1);
        self.counts[CLASS_BOUNDS_DB.partition_point(|bound| *bound < clipped)] += 1;
        self.worst_db = Some(self.worst_db.map_or(clipped, |worst| worst.min(clipped)));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::test_pictures::{from_fn, map, textured};
    use super::*;

    fn shares(tally: &TileTally) -> [f64; 6] {
        let c = tally.classes_percent().unwrap();
        [c.verybad, c.bad, c.quitegood, c.good, c.verygood, c.excellent]
    }

    fn tally_of(values: &[f64]) -> TileTally {
        let mut tally = TileTally::default();
        values.iter().for_each(|value| tally.count(*value));
        tally
    }

    #[test]
    fn each_bound_belongs_to_the_worse_class() {
        for (class, bound) in CLASS_BOUNDS_DB.into_iter().enumerate() {
            assert_eq!(tally_of(&[bound]).counts[class], 1, "{bound} dB");
            assert_eq!(tally_of(&[bound + 1e-6]).counts[class + 1], 1, "above {bound} dB");
        }
    }

    #[test]
    fn values_are_clipped_to_the_published_range() {
        assert_eq!(tally_of(&[100.0]).worst_db(), Some(50.0));
        assert_eq!(tally_of(&[-3.0]).worst_db(), Some(0.0));
        assert_eq!(tally_of(&[-3.0, 100.0]).counts, [1, 0, 0, 0, 0, 1]);
    }

    #[test]
    fn one_spoilt_tile_of_a_perfect_picture_is_found_where_it_is() {
        let truth = from_fn(16, 8, |_, _| [90, 90, 90]);
        let spoilt =
            from_fn(16, 8, |x, y| if x / 4 == 2 && y / 4 == 1 { [190; 3] } else { [90; 3] });
        let tally = TileTally::of(&spoilt, &truth);
        assert_eq!(tally.counts, [1, 0, 0, 0, 0, 7]);
        let expected = 20.0 * 2.55_f64.log10();
        assert!((tally.worst_db().unwrap() - expected).abs() < 1e-9);
    }

    #[test]
    fn tiles_cut_by_the_border_are_measured_over_the_pixels_they_have() {
        let truth = from_fn(5, 5, |_, _| [90, 90, 90]);
        let mut output = truth.clone();
        output.row_mut(4)[4] = [100; 3];
        let tally = TileTally::of(&output, &truth);
        assert_eq!(tally.counts.iter().sum::<u64>(), 4);
        let of_one_pixel = 20.0 * 25.5_f64.log10();
        assert!((tally.worst_db().unwrap() - of_one_pixel).abs() < 1e-9);
    }

    #[test]
    fn an_empty_tally_has_no_worst_tile_and_no_shares() {
        assert_eq!(TileTally::default().worst_db(), None);
        assert_eq!(TileTally::default().classes_percent(), None);
    }

    proptest! {
        #[test]
        fn shares_sum_to_100_and_merging_equals_counting_together(
            width in 1_u32..30, height in 1_u32..30, seed in 0_u32..50, offset in 0_u8..60,
        ) {
            let truth = textured(width, height, seed);
            let output = map(&truth, |v| if v % 7 == 0 { v.saturating_add(offset) } else { v });
            let first = TileTally::of(&output, &truth);
            let second = TileTally::of(&truth, &truth);
            let mut both = first;
            both.merge(&second);
            prop_assert!((shares(&both).iter().sum::<f64>() - 100.0).abs() < 1e-9);
            prop_assert!(both.worst_db() <= first.worst_db());
            prop_assert!(both.worst_db() == first.worst_db() || both.worst_db() == Some(50.0));
            let counted: u64 = both.counts.iter().sum();
            let tiles = width.div_ceil(4) * height.div_ceil(4);
            prop_assert_eq!(counted, u64::from(tiles) * 2);
        }
    }
}
