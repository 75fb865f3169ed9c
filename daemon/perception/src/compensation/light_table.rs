//! Light of each level of a channel as an integer, and back.

use crate::PerceptionError;
use crate::display::{DisplayProfile, GainOffsetGamma};

/// The light of the last level. 24 bits: a level of 10 bits near black still has light of its own
/// up to a gamma of 2.4.
pub const FULL_LIGHT: u32 = 1 << 24;

/// Bits of light that [`LightTable::level`] leaves to its search.
const START_SHIFT: u32 = 16;

/// One channel of a display: levels to light above black, and the level nearest to a light.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LightTable {
    light: Vec<u32>,
    /// Light of the codes half-way between levels, which is where the nearest level changes. Levels
    /// that give full light as the one before them does are never the nearest: `u32::MAX`.
    borders: Vec<u32>,
    /// How many borders are at or below each multiple of `1 << START_SHIFT`, and then all.
    starts: Vec<u16>,
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
        let most = table[table.len() - 1];
        let border = |level: u32| {
            let is_above = table[level as usize - 1] < most;
            if is_above { quantised(f64::from(level) - 0.5) } else { u32::MAX }
        };
        let borders: Vec<u32> = (1..levels).map(border).collect();
        let rises = table.is_sorted() && table[0] < table[table.len() - 1];
        let last = f64::from(table[table.len() - 1]);
        PerceptionError::check("light of the last level", "more than of those below", last, rises)?;
        let below = |light: u32| borders.partition_point(|&border| border <= light);
        let starts = (0..FULL_LIGHT >> START_SHIFT).map(|start| below(start << START_SHIFT));
        let all = borders.len() - borders.iter().rev().take_while(|&&b| b > FULL_LIGHT).count();
        let starts = starts.chain([all, all]).map(|count| count as u16).collect();
        Ok(Self { light: table, borders, starts })
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
        let light = u32::try_from(light).map_or(FULL_LIGHT, |light| light.min(FULL_LIGHT));
        let start = (light >> START_SHIFT) as usize;
        let [first, end] = [self.starts[start], self.starts[start + 1]].map(usize::from);
        let further = self.borders[first..end].partition_point(|&border| border <= light);
        u16::try_from(first + further).expect("at most 65535 borders")
    }

    /// The light of each level, and the light from which on each level but the first is the
    /// nearest: what [`Self::light`] and [`Self::level`] look up. For shaders.
    #[must_use]
    pub fn words(&self) -> [&[u32]; 2] {
        [&self.light, &self.borders]
    }

    /// The largest error of light that rounding to a level makes at `level`: half a level up or
    /// down, whichever is more.
    #[must_use]
    pub fn half_level(&self, level: u16) -> u32 {
        let level = level.min(self.last_level());
        let here = self.light(level);
        let border = self.borders.get(usize::from(level)).filter(|&&border| border <= FULL_LIGHT);
        let above = border.map_or(0, |border| border - here);
        let border = usize::from(level).checked_sub(1).map(|index| self.borders[index]);
        let below = border.filter(|&border| border <= here).map_or(0, |border| here - border);
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
    fn light_is_found_as_if_every_border_were_looked_at() {
        for levels in [2, 17, 256, 1024, 65_536] {
            for exponent in [1.0, 2.2, 7.0] {
                let table = LightTable::new(levels, |code| libm::pow(code, exponent)).unwrap();
                for step in 0..=5000_u32 {
                    let light = (u64::from(step) * u64::from(FULL_LIGHT) / 5000) as u32;
                    let expected = table.borders.iter().filter(|&&border| border <= light).count();
                    assert_eq!(usize::from(table.level(light.into())), expected, "{light}");
                }
            }
        }
    }

    #[test]
    fn of_levels_that_all_give_full_light_the_first_is_taken() {
        let table = LightTable::new(256, |code| (code * 2.0).min(1.0)).unwrap();
        assert_eq!(table.level(u64::MAX), 128);
        assert_eq!(table.level(FULL_LIGHT.into()), 128);
        assert_eq!(table.half_level(255), 0);
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
