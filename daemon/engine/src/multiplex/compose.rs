//! Light of two pictures in a row: (2) to (5) of [`super`], pixel by pixel.
//!
//! Alpha is that of the picture itself.

use foreframe_perception::compensation::{Compensation, FULL_LIGHT};
use foreframe_perception::multiplex::motion_weight;
use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::color::{ColorFormat, Texel};
use crate::finish::FinishConfig;
use crate::finish::shares::light_tables;
use crate::format::StreamFormat;
use crate::plane::Plane;

/// Steps of contrast that (5) is tabled by, and the weight of 1.
const CONTRAST_STEPS: u64 = 1024;
const WEIGHT_ONE: f32 = 256.0;

/// What a display makes of the levels of a stream.
#[derive(Debug)]
pub(super) struct Light {
    /// Red, green, blue: how a channel splits among two frames.
    channels: [Compensation; 3],
    /// (2) by original * 256 + blurred, for channels of 8 bits.
    bytes: Option<[Box<[u8]>; 3]>,
    /// (5) by contrast.
    weights: Box<[u16]>,
}

impl Light {
    /// None where codes give no light.
    pub(super) fn new(format: &StreamFormat, config: &FinishConfig) -> Option<Self> {
        let [red, green, blue] =
            light_tables(format, config)?.map(|table| Compensation::new(table, 2).ok());
        let channels = [red?, green?, blue?];
        let all_bytes = |channel: &Compensation| -> Box<[u8]> {
            let pairs = (0..=255).flat_map(|full| (0..=255).map(move |low| (full, low)));
            pairs.map(|(full, low)| channel.key(full, low) as u8).collect()
        };
        let bytes =
            (format.color == ColorFormat::Rgba8).then(|| channels.each_ref().map(all_bytes));
        // Of lights whose sum is 2, half of the difference is the contrast.
        let weight = |step: u64| {
            let contrast = step as f32 / CONTRAST_STEPS as f32;
            (motion_weight(1.0 + contrast, 1.0 - contrast) * WEIGHT_ONE).round() as u16
        };
        let weights = (0..=CONTRAST_STEPS).map(weight).collect();
        Some(Self { channels, bytes, weights })
    }

    /// (2) of a full picture and what is left of it at the reduced size, into `to`.
    pub(super) fn make_up<T: Texel>(
        &self,
        pool: &ThreadPool,
        pictures: [&Plane<T>; 2],
        to: &mut Plane<T>,
    ) {
        for_each_texel(
            pool,
            pictures,
            to,
            #[inline(always)]
            |texel, full, low| {
                let (mut levels, low) = (full.channels(), low.channels());
                for channel in 0..3 {
                    levels[channel] = self.level(channel, levels[channel], low[channel]);
                }
                *texel = T::of_channels(levels);
            },
        );
    }

    #[inline(always)]
    fn level(&self, channel: usize, full: u16, low: u16) -> u16 {
        match &self.bytes {
            Some(bytes) => bytes[channel][usize::from(full) << 8 | usize::from(low)].into(),
            None => self.channels[channel].key(full, low),
        }
    }

    /// (4): adds to `to`, a restored picture, what the display could not show of the full picture
    /// before it and what is left of that at the reduced size.
    pub(super) fn add_rest<T: Texel>(
        &self,
        pool: &ThreadPool,
        pictures: [&Plane<T>; 2],
        to: &mut Plane<T>,
    ) {
        let tables = self.channels.each_ref().map(Compensation::table);
        let lights = tables.map(|table| table.words()[0]);
        for_each_texel(
            pool,
            pictures,
            to,
            #[inline(always)]
            |texel, full, low| {
                if full == low {
                    return;
                }
                let (mut levels, full, low) = (texel.channels(), full.channels(), low.channels());
                for (channel, lights) in lights.into_iter().enumerate() {
                    let light = |level: u16| lights[usize::from(level)];
                    let rest = rest([full[channel], low[channel]].map(light));
                    if rest != 0 {
                        let around = [low[channel], levels[channel]].map(light);
                        levels[channel] = tables[channel].level(self.with_rest(around, rest));
                    }
                }
                *texel = T::of_channels(levels);
            },
        );
    }

    /// (4) of one channel: the light of the picture before and of this one, and of the rest.
    #[inline(always)]
    fn with_rest(&self, [before, now]: [u32; 2], rest: i64) -> u64 {
        let difference = u64::from(before.abs_diff(now)) * CONTRAST_STEPS;
        // Of no light at all: 0, which is no motion.
        let contrast = difference.checked_div(u64::from(before) + u64::from(now)).unwrap_or(0);
        let weight = i64::from(self.weights[contrast as usize]);
        let light = i64::from(now) + ((rest * weight) >> 8);
        light.clamp(0, FULL_LIGHT.into()).cast_unsigned()
    }
}

/// Calls `work` with each texel of `to`, and those of a full picture and of what is left of it that
/// lie there.
fn for_each_texel<T: Texel>(
    pool: &ThreadPool,
    [full, low]: [&Plane<T>; 2],
    to: &mut Plane<T>,
    work: impl Fn(&mut T, T, T) + Sync,
) {
    for_each_row(
        pool,
        to,
        #[inline(always)]
        |y, row| {
            for (texel, (full, low)) in row.iter_mut().zip(full.row(y).iter().zip(low.row(y))) {
                work(texel, *full, *low);
            }
        },
    );
}

/// (3) of the light of a full picture and of what is left of it, of [`FULL_LIGHT`].
#[inline(always)]
fn rest([full, low]: [u32; 2]) -> i64 {
    let wanted = 2 * i64::from(full) - i64::from(low);
    wanted - wanted.clamp(0, FULL_LIGHT.into())
}
