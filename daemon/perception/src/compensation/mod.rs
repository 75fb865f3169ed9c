//! Blur in in-between frames, made up for in the key, so that N frames give the light of N originals.
//!
//! Didyk et al. 2010, sections 5.1 and 6. The paper prints the compensation for a gamma; what it
//! rests on is that light adds up over the fusion window, so here the identity is held in light, for
//! any display: `N l(original) = l(key) + (N - 1) l(in-between)`. [`LightTable`] holds the light of
//! each level as integers and [`Compensation`] splits with them: one input gives one output.
//!
//! What the key cannot show goes back to the in-between frames, both ways. The paper keeps the
//! original in the in-between frames where it is darker than its blur; giving them exactly what the
//! key cannot take is less sharp there and loses no light.

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
}

impl Compensation {
    /// For `frames` frames per key: the key and `frames - 1` in-between frames.
    ///
    /// # Errors
    /// If `frames` is not 2 to 16.
    pub fn new(table: LightTable, frames: u32) -> Result<Self, PerceptionError> {
        let is_inside = (2..=MOST_FRAMES).contains(&frames);
        PerceptionError::check("frames per key", "2 to 16", frames.into(), is_inside)?;
        Ok(Self { table, frames })
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

    /// The levels that stand for `original` where the in-between frames show `blurred` if they can.
    /// Levels beyond the last count as the last.
    ///
    /// The light of all frames is that of N originals to within half a level per frame.
    #[must_use]
    pub fn split(&self, original: u16, blurred: u16) -> Split {
        let others = u64::from(self.frames - 1);
        let full = u64::from(FULL_LIGHT);
        let total = u64::from(self.frames) * u64::from(self.table.light(original));
        let wanted = others * u64::from(self.table.light(blurred));
        let in_between = if wanted > total {
            // Undershoot: the key would have to be darker than black.
            self.table.level(rounded(total, others))
        } else if total - wanted > full {
            // Overshoot: the key would have to be brighter than white.
            self.table.level(rounded(total - full, others))
        } else {
            blurred.min(self.table.last_level())
        };
        let left = total.saturating_sub(others * u64::from(self.table.light(in_between)));
        Split { key: self.table.level(left.min(full)), in_between }
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

fn rounded(dividend: u64, divisor: u64) -> u64 {
    (dividend + divisor / 2) / divisor
}

/// The same in real numbers: light of the key and of each in-between frame, shares of full light of
/// 0 to 1, for `frames` frames of `original` light where the in-between frames get `blurred` if they
/// can. The sum is exact.
#[must_use]
pub fn split_light(original: f64, blurred: f64, frames: u32) -> [f64; 2] {
    let others = f64::from(frames) - 1.0;
    let total = f64::from(frames) * original;
    let key = (total - others * blurred).clamp(0.0, 1.0);
    [key, (total - key) / others]
}

#[cfg(test)]
mod tests;
