//! Finds the smooth gradients of a picture: runs of pixels along which every channel follows a
//! line.

use foreframe_perception::banding::{BandWidth, Gradient};

use crate::score::picture::Srgb8;

/// Pixels of a run: a degree or more on most displays, so that several steps of 8 bits fit in.
const RUN: u32 = 64;
/// Off its line by more than this, in levels, a run is texture: rounding alone is half a level.
const MOST_OFF: f64 = 1.0;
/// A run that changes by less has no step to see, in levels.
const LEAST_CHANGE: f64 = 2.0;

/// A run from one colour to another.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct SmoothRun {
    from: [f64; 3],
    to: [f64; 3],
}

impl SmoothRun {
    /// The fewest bits that hide its steps; None if 16 do not.
    pub(super) fn least_bits(
        &self,
        ppd: f64,
        xyz: impl Fn([f64; 3]) -> [f64; 3],
    ) -> anyhow::Result<Option<u8>> {
        let gradient = Gradient::new(self.from, self.to)?;
        Ok(gradient.least_bits(BandWidth::Over(f64::from(RUN)), ppd, xyz)?)
    }
}

/// Those of `picture`, along rows and along columns.
pub(super) fn smooth_gradients(picture: &Srgb8) -> Vec<SmoothRun> {
    let (width, height) = (picture.width(), picture.height());
    let starts = |length: u32| (0..=length.saturating_sub(RUN)).step_by(RUN as usize);
    let across = |length: u32| (RUN / 4..length).step_by(RUN as usize / 2);
    let mut found = Vec::new();
    if width >= RUN {
        for y in across(height) {
            let rows = starts(width).map(|x| smooth(|i| picture.at(x + i, y)));
            found.extend(rows.flatten());
        }
    }
    if height >= RUN {
        for x in across(width) {
            let columns = starts(height).map(|y| smooth(|i| picture.at(x, y + i)));
            found.extend(columns.flatten());
        }
    }
    found
}

/// The line that `RUN` pixels lie on, by least squares, if they do.
fn smooth(pixel: impl Fn(u32) -> [u8; 3]) -> Option<SmoothRun> {
    let middle = f64::from(RUN - 1) / 2.0;
    let places = f64::from(RUN * (RUN * RUN - 1)) / 12.0;
    let mut ends = [[0.0; 3]; 2];
    let mut change = 0.0_f64;
    for channel in 0..3 {
        let level = |i: u32| f64::from(pixel(i)[channel]);
        let mean = (0..RUN).map(level).sum::<f64>() / f64::from(RUN);
        let slope = (0..RUN).map(|i| (f64::from(i) - middle) * level(i)).sum::<f64>() / places;
        let line = |i: f64| mean + slope * (i - middle);
        if (0..RUN).any(|i| (level(i) - line(f64::from(i))).abs() > MOST_OFF) {
            return None;
        }
        for (end, at) in ends.iter_mut().zip([0.0, f64::from(RUN - 1)]) {
            end[channel] = (line(at) / 255.0).clamp(0.0, 1.0);
        }
        change = change.max((slope * f64::from(RUN - 1)).abs());
    }
    (change >= LEAST_CHANGE).then_some(SmoothRun { from: ends[0], to: ends[1] })
}
