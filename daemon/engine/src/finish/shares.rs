//! How the light of each level is shared: tables, made once per number of frames and display.

use foreframe_perception::compensation::{Compensation, FULL_LIGHT, LightTable, MOST_FRAMES};
use foreframe_perception::display::transfer::{pq_to_luminance, srgb_to_linear};
use foreframe_perception::flicker::FlickerModel;
use half::f16;

use super::pyramid::SIGMA_PX;
use super::{FinishConfig, FinishMode, Part};
use crate::color::{ColorFormat, half_to_ordered, ordered_to_half};
use crate::format::{StreamFormat, Transfer};
use crate::plane::Plane;

/// White of a display of which nothing is known, cd/m2: of a bright desktop display, since flicker
/// is seen the more the brighter it is.
const UNKNOWN_PEAK: f64 = 300.0;

/// The tables of one stream.
#[derive(Debug)]
pub struct Shares {
    format: ColorFormat,
    channels: [LightTable; 3],
    limit: Limit,
    /// By number of frames; made when it is first asked for.
    by_frames: [Option<Box<Tables>>; MOST_FRAMES as usize + 1],
}

/// How far key and in-between frames may differ.
#[derive(Clone, Copy, Debug)]
enum Limit {
    /// As far as they like.
    None,
    /// As far as nobody sees on a display of this white, cd/m2.
    Unseen { refresh_hz: f64, ppd: Option<f64>, peak_cd_m2: f64 },
}

/// What a picture is made with.
#[derive(Clone, Copy, Debug)]
pub struct Split<'a> {
    /// Whether it is the key, or one of the in-between frames.
    pub is_key: bool,
    /// For as many frames as share the light.
    pub tables: &'a Tables,
    /// How far each tile is blurred ([`super::selection`]); None where all of the picture is,
    /// fully.
    pub weights: Option<&'a Plane<u8>>,
}

/// The tables for one number of frames.
#[derive(Debug)]
pub struct Tables {
    /// Red, green, blue.
    pub channels: [Compensation; 3],
    /// The same for pixels of four bytes; None for others.
    pub bytes: Option<ByteTables>,
}

/// Every split of 8-bit levels. Red, green, blue.
#[derive(Debug)]
pub struct ByteTables {
    /// The key's level by original * 256 + blurred, and three bytes more, so that a wide read of
    /// the last one stays inside.
    pub key: [Box<[u8]>; 3],
    /// By original: the lowest level of an in-between frame, and in the upper byte the highest.
    pub within: [Box<[u32; 256]>; 3],
    /// By a sixteenth of the original: how far an in-between frame may lie above and below any
    /// original of that sixteenth, in any channel.
    pub room: [[u8; 16]; 2],
}

impl Shares {
    /// For a stream; None where finishing is off. `ppd` is the angular size of a pixel.
    #[must_use]
    pub fn new(format: &StreamFormat, config: &FinishConfig, ppd: Option<f32>) -> Option<Self> {
        let peak = config.peak_cd_m2.unwrap_or(UNKNOWN_PEAK);
        let limit = match config.mode {
            FinishMode::Off => return None,
            FinishMode::On => Limit::None,
            FinishMode::Auto => Limit::Unseen {
                refresh_hz: 1e9 / config.refresh_interval.as_ns() as f64,
                ppd: ppd.map(f64::from),
                peak_cd_m2: peak,
            },
        };
        let channels = light_tables(format, config)?;
        Some(Self { format: format.color, channels, limit, by_frames: Default::default() })
    }

    /// What `part` is made with; None if it stays as it is.
    pub fn of(&mut self, part: Part) -> Option<Split<'_>> {
        let (is_key, frames) = match part {
            Part::Plain => return None,
            Part::Key { frames } => (true, frames),
            Part::InBetween { frames } => (false, frames),
        };
        let Self { format, channels, limit, by_frames } = self;
        let place = by_frames.get_mut(frames as usize)?;
        if place.is_none() {
            *place = Tables::new(*format, channels, *limit, frames).map(Box::new);
        }
        place.as_deref().map(|tables| Split { is_key, tables, weights: None })
    }
}

/// The light that the display makes of each level of red, green and blue; None where codes give no
/// light at any level, which makes no display.
#[must_use]
pub fn light_tables(format: &StreamFormat, config: &FinishConfig) -> Option<[LightTable; 3]> {
    let gamma = |channel: usize| config.gamma.map(|gamma| gamma[channel]);
    let white = match f64::from(format.white_cd_m2) {
        white if white > 0.0 => white,
        _ => config.peak_cd_m2.unwrap_or(UNKNOWN_PEAK),
    };
    let light = |channel: usize, code: f64| match (format.transfer, gamma(channel)) {
        (Transfer::Srgb, Some(gamma)) => libm::pow(code.max(0.0), gamma),
        (Transfer::Srgb, None) => srgb_to_linear(code),
        (Transfer::Pq, _) => pq_to_luminance(code) / white,
        (Transfer::Linear, _) => code,
    };
    let table = |channel| match format.color {
        ColorFormat::Rgba8 => LightTable::new(256, |code| light(channel, code)),
        ColorFormat::Rgb10a2 => LightTable::new(1024, |code| light(channel, code)),
        ColorFormat::Rgba16f => {
            LightTable::new(1 << 16, |code| light(channel, half_of(code).clamp(0.0, 1.0)))
        }
    };
    let [red, green, blue] = [0, 1, 2].map(table);
    Some([red.ok()?, green.ok()?, blue.ok()?])
}

/// The number that a code of 0 to 1 over all ordered halves stands for; what comes before the
/// finite ones and behind them counts as the next of them. Between two halves, the number between.
fn half_of(code: f64) -> f64 {
    let place = code * f64::from(u16::MAX);
    let finite = [f16::MIN, f16::MAX].map(|end| half_to_ordered(end.to_bits()));
    let value = |place: f64| {
        let ordered = (place as u16).clamp(finite[0], finite[1]);
        f16::from_bits(ordered_to_half(ordered)).to_f64()
    };
    let (low, high) = (value(place.floor()), value(place.ceil()));
    low + (high - low) * (place - place.floor())
}

impl Limit {
    /// The largest difference of light, of [`FULL_LIGHT`], between a key and `frames - 1` others.
    fn difference(self, frames: u32) -> u32 {
        let Self::Unseen { refresh_hz, ppd, peak_cd_m2 } = self else { return FULL_LIGHT };
        let model = FlickerModel::new(refresh_hz, ppd.unwrap_or(1.0));
        let Ok(model) = model.and_then(|model| model.repeating_after(frames)) else { return 0 };
        let unseen = match ppd {
            Some(ppd) => model.unseen_difference(|cpd| detail_gain(cpd / ppd)),
            // The coarsest detail is seen best, and without a size all detail may be coarse.
            None => model.unseen_difference_of(0.0),
        };
        let share = (unseen / peak_cd_m2).clamp(0.0, 1.0);
        (share * f64::from(FULL_LIGHT)) as u32
    }
}

/// How much of a grating of `frequency` cycles per pixel the blur takes away.
fn detail_gain(frequency: f64) -> f64 {
    let turns = core::f64::consts::TAU * frequency * SIGMA_PX;
    1.0 - libm::exp(-0.5 * turns * turns)
}

impl Tables {
    fn new(
        format: ColorFormat,
        channels: &[LightTable; 3],
        limit: Limit,
        frames: u32,
    ) -> Option<Self> {
        let most = limit.difference(frames);
        let of = |channel: usize| {
            let made = Compensation::new(channels[channel].clone(), frames);
            made.ok().map(|made| made.within(most))
        };
        let channels = [of(0)?, of(1)?, of(2)?];
        let bytes = (format == ColorFormat::Rgba8).then(|| ByteTables::new(&channels));
        Some(Self { channels, bytes })
    }
}

impl ByteTables {
    fn new(channels: &[Compensation; 3]) -> Self {
        let mut room = [[u8::MAX; 16]; 2];
        let within = channels.each_ref().map(|channel| {
            let mut within = Box::new([0; 256]);
            for (original, entry) in (0..=255_u8).zip(within.iter_mut()) {
                let [low, high] =
                    [0, 255].map(|blurred| channel.in_between(original.into(), blurred) as u8);
                *entry = u32::from(low) | u32::from(high) << 8;
                let sixteenth = usize::from(original >> 4);
                for (room, ends) in room.iter_mut().zip([(high, original), (original, low)]) {
                    room[sixteenth] = room[sixteenth].min(ends.0 - ends.1);
                }
            }
            within
        });
        let key = [0, 1, 2].map(|index| {
            let channel = &channels[index];
            let mut key = vec![0; 256 * 256 + 3];
            for (original, row) in (0..=255_u8).zip(key.chunks_exact_mut(256)) {
                let [low, high, ..] = within[index][usize::from(original)].to_le_bytes();
                for (blurred, level) in (0..=255_u8).zip(row) {
                    let between = blurred.clamp(low, high);
                    *level = channel.key(original.into(), between.into()) as u8;
                }
            }
            key.into_boxed_slice()
        });
        Self { key, within, room }
    }
}
