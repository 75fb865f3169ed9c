//! Blur in in-between frames, made up for in the key, so that N frames give the light of N
//! originals.
//!
//! Didyk et al. 2010, sections 5.1 and 6. The paper prints the compensation for a gamma; what it
//! rests on is that light adds up over the fusion window, so here the identity is held in light,
//! for any display: `N l(original) = l(key) + (N - 1) l(in-between)`. [`LightTable`] holds the
//! light of each level as integers and [`Compensation`] splits with them: one input gives one
//! output.
//!
//! What the key cannot show goes back to the in-between frames, both ways. The paper keeps the
//! original in the in-between frames where it is darker than its blur; giving them exactly what the
//! key cannot take is less sharp there and loses no light.
//!
//! Key and in-between frames may be kept from differing by more than a given light: then the blur
//! is what gives way, and the light of all frames stays as it is.

mod light_table;

pub use light_table::{FULL_LIGHT, LightTable};

use crate::PerceptionError;

/// The most frames per key: 24 Hz to 384.
pub const MOST_FRAMES: u32 = 16;

/// Levels of one channel of one pixel.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Split {
    /// In the key frame.
    pub key: u16,
    /// In each of the in-between frames.
    pub in_between: u16,
}

/// How one channel of a display splits a pixel among N frames.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Compensation {
    table: LightTable,
    frames: u32,
    most_step: u32,
}

impl Compensation {
    /// For `frames` frames per key: the key and `frames - 1` in-between frames.
    ///
    /// # Errors
    /// If `frames` is not 2 to 16.
    pub fn new(table: LightTable, frames: u32) -> Result<Self, PerceptionError> {
        let is_inside = (2..=MOST_FRAMES).contains(&frames);
        PerceptionError::check("frames per key", "2 to 16", frames.into(), is_inside)?;
        Ok(Self { table, frames, most_step: FULL_LIGHT })
    }

    /// The same, where key and in-between frames differ by at most `difference` of [`FULL_LIGHT`].
    #[must_use]
    pub fn within(self, difference: u32) -> Self {
        // The key is off by N - 1 times as much as each in-between frame, the other way.
        Self { most_step: difference / self.frames, ..self }
    }

    /// The light of each level.
    #[must_use]
    pub fn table(&self) -> &LightTable {
        &self.table
    }

    /// Frames per key.
    #[must_use]
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// How far the light of an in-between frame may lie from the original's, of [`FULL_LIGHT`].
    #[must_use]
    pub fn most_step(&self) -> u32 {
        self.most_step
    }

    /// The levels that stand for `original` where the in-between frames show `blurred` if they can.
    /// Levels beyond the last count as the last.
    ///
    /// The light of all frames is that of N originals to within half a level per frame.
    #[must_use]
    pub fn split(&self, original: u16, blurred: u16) -> Split {
        let [original, blurred] =
            [original, blurred].map(|level| level.min(self.table.last_level()));
        let in_between = self.in_between(original, blurred);
        Split { key: self.key(original, in_between), in_between }
    }

    /// The least and the most light of in-between frames over `original`.
    ///
    /// Less would need a key brighter than white, more one darker than black.
    #[must_use]
    pub fn lights(&self, original: u16) -> [u32; 2] {
        let light = self.table.light(original);
        let others = self.frames - 1;
        let total = self.frames * light;
        let least = rounded(total.saturating_sub(FULL_LIGHT), others);
        let most = rounded(total, others).min(FULL_LIGHT);
        [least.max(light.saturating_sub(self.most_step)), most.min(light + self.most_step)]
    }

    /// The level of in-between frames: `blurred`, or the end of what [`Self::lights`] allows.
    #[must_use]
    pub fn in_between(&self, original: u16, blurred: u16) -> u16 {
        let [least, most] = self.lights(original);
        let wanted = self.table.light(blurred);
        if wanted > most {
            self.table.level(most.into())
        } else if wanted < least {
            self.table.level(least.into())
        } else {
            blurred
        }
    }

    /// The level of the key whose in-between frames show `in_between`: itself where they do.
    #[must_use]
    pub fn key(&self, original: u16, in_between: u16) -> u16 {
        if in_between == original {
            return original;
        }
        let total = self.frames * self.table.light(original);
        let left = total.saturating_sub((self.frames - 1) * self.table.light(in_between));
        self.table.level(left.min(FULL_LIGHT).into())
    }

    /// All splits of 8-bit levels: entry `original * 256 + blurred` is the key's and the in-between
    /// frames' level. None if the table has not 256 levels.
    #[must_use]
    pub fn table_of_bytes(&self) -> Option<Vec<[u8; 2]>> {
        if self.table.last_level() != 255 {
            return None;
        }
        let byte = |level: u16| u8::try_from(level).expect("a level of 256");
        let pairs =
            (0..=255).flat_map(|original| (0..=255).map(move |blurred| (original, blurred)));
        let split = |(original, blurred)| {
            let split = self.split(original, blurred);
            [byte(split.key), byte(split.in_between)]
        };
        Some(pairs.map(split).collect())
    }
}

fn rounded(dividend: u32, divisor: u32) -> u32 {
    (dividend + divisor / 2) / divisor
}

/// The same in real numbers: light of the key and of each in-between frame, shares of full light of
/// 0 to 1, for `frames` frames of `original` light where the in-between frames get `blurred` if
/// they can. The sum is exact.
#[must_use]
pub fn split_light(original: f64, blurred: f64, frames: u32) -> [f64; 2] {
    let others = f64::from(frames) - 1.0;
    let total = f64::from(frames) * original;
    let key = (total - others * blurred).clamp(0.0, 1.0);
    [key, (total - key) / others]
}

#[cfg(test)]
mod tests;
