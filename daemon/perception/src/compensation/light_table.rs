//! Light of each level of a channel as an integer, and back.

use crate::PerceptionError;
use crate::display::{DisplayProfile, GainOffsetGamma};

/// The light of the last level. 24 bits: a level of 10 bits near black still has light of its own
/// up to a gamma of 2.4.
pub const FULL_LIGHT: u32 = 1 << 24;

/// One channel of a display: levels to light above black, and the level nearest to a light.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LightTable {
    light: Vec<u32>,
    /// Light of the codes half-way between levels, which is where the nearest level changes.
    borders: Vec<u32>,
}

impl LightTable {
    /// A channel of `levels` levels with `light(code)` of 0 to 1 for codes of 0 to 1, rising.
    ///
    /// # Errors
    /// If there are not 2 to 65536 levels, or more code is less light somewhere.
    pub fn new(levels: u32, light: impl Fn(f64) -> f64) -> Result<Self, PerceptionError> {
        let is_inside = (2..=65_536).contains(&levels);
        PerceptionError::check("levels", "2 to 65536", levels.into(), is_inside)?;
        let steps = f64::from(levels - 1);
        let quantised = |level: f64| {
            let share = light(level / steps).clamp(0.0, 1.0);
            (share * f64::from(FULL_LIGHT)).round() as u32
        };
        let table: Vec<u32> = (0..levels).map(|level| quantised(f64::from(level))).collect();
        let borders = (1..levels).map(|level| quantised(f64::from(level) - 0.5)).collect();
        let rises = table.is_sorted() && table[0] < table[table.len() - 1];
        let last = f64::from(table[table.len() - 1]);
        PerceptionError::check("light of the last level", "more than of those below", last, rises)?;
        Ok(Self { light: table, borders })
    }

    /// Red, green and blue of a measured display, `levels` levels each.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_display(model: &GainOffsetGamma, levels: u32) -> Result<[Self; 3], PerceptionError> {
        let [red, green, blue] =
            model.gamma().map(|gamma| Self::new(levels, |code| libm::pow(code.max(0.0), gamma)));
        Ok([red?, green?, blue?])
    }

    /// Red, green and blue of a profile at 8 bits.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_profile(profile: &DisplayProfile) -> Result<[Self; 3], PerceptionError> {
        Self::of_display(profile.model(), 256)
    }

    /// The highest level.
    #[must_use]
    pub fn last_level(&self) -> u16 {
        u16::try_from(self.light.len() - 1).expect("at most 65536 levels")
    }

    /// Light of a level, 0 to [`FULL_LIGHT`]. Levels beyond the last count as the last.
    #[must_use]
    pub fn light(&self, level: u16) -> u32 {
        self.light[usize::from(level.min(self.last_level()))]
    }

    /// The level whose code is nearest to that of a light.
    #[must_use]
    pub fn level(&self, light: u64) -> u16 {
        let below = self.borders.partition_point(|&border| u64::from(border) <= light);
        u16::try_from(below).expect("at most 65535 borders")
    }

    /// The largest error of light that rounding to a level makes at `level`: half a level up or
    /// down, whichever is more.
    #[must_use]
    pub fn half_level(&self, level: u16) -> u32 {
        let level = level.min(self.last_level());
        let here = self.light(level);
        let above = self.borders.get(usize::from(level)).map_or(0, |border| border - here);
        let below = usize::from(level).checked_sub(1).map_or(0, |index| here - self.borders[index]);
        above.max(below)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_of_every_profile_is_found_again_from_its_light() {
        for profile in DisplayProfile::builtins() {
            for (channel, table) in LightTable::of_profile(&profile).unwrap().iter().enumerate() {
                for level in 0..=255 {
                    let found = table.level(table.light(level).into());
                    assert_eq!(found, level, "{} channel {channel}", profile.name());
                }
            }
        }
    }

    #[test]
    fn light_between_levels_goes_to_the_nearest_code() {
        let table = LightTable::new(256, |code| code * code).unwrap();
        let light = |code: f64| {
            let share = code / 255.0;
            (share * share * f64::from(FULL_LIGHT)) as u64
        };
        assert_eq!(table.level(light(100.49)), 100);
        assert_eq!(table.level(light(100.51)), 101);
        assert_eq!(table.level(u64::MAX), 255);
        assert_eq!((table.light(255), table.light(9999)), (FULL_LIGHT, FULL_LIGHT));
        assert!(table.half_level(100) >= table.light(100) - light(99.5) as u32 - 1);
    }

    #[test]
    fn what_is_no_channel_is_refused() {
        assert!(LightTable::new(1, |code| code).is_err());
        assert!(LightTable::new(65_537, |code| code).is_err());
        assert!(LightTable::new(256, |code| 1.0 - code).is_err());
        assert!(LightTable::new(256, |_| 0.5).is_err());
        assert!(LightTable::new(65_536, |code| code).is_ok());
    }
}
