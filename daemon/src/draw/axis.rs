//! Axes: from values to pixels, with ticks at round numbers.

/// A linear axis. Its pixels may run backwards.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LinearAxis {
    range: [f64; 2],
    pixels: [f32; 2],
}

impl LinearAxis {
    /// An axis from one value to another.
    #[must_use]
    pub fn new(range: [f64; 2], pixels: [f32; 2]) -> Self {
        Self { range, pixels }
    }

    /// An axis that holds all `values`, which are finite, with a little room on each side. None
    /// without values.
    pub fn over(values: impl Iterator<Item = f64>, pixels: [f32; 2]) -> Option<Self> {
        let (low, high) = span(values)?;
        let room = if high > low { (high - low) * 0.03 } else { low.abs().max(1.0) * 0.5 };
        Some(Self::new([low - room, high + room], pixels))
    }

    /// Pixel of `value`.
    #[must_use]
    pub fn at(&self, value: f64) -> f32 {
        let way = (value - self.range[0]) / (self.range[1] - self.range[0]);
        self.pixels[0] + (self.pixels[1] - self.pixels[0]) * way as f32
    }

    /// Round values inside, at most `most` and one, with their labels.
    pub fn ticks(&self, most: u32) -> impl Iterator<Item = (f64, String)> + use<> {
        let least = (self.range[1] - self.range[0]) / f64::from(most);
        let decade = 10_f64.powf(least.log10().floor());
        let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * decade >= least);
        let step = factor.unwrap_or(10.0) * decade;
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let (first, last) = ((self.range[0] / step).ceil(), (self.range[1] / step).floor());
        let count = (last - first).clamp(0.0, f64::from(most)) as u32;
        (0..=count).map(move |index| {
            // Adding 0 turns a negative zero into one without a sign.
            let value = (first + f64::from(index)) * step + 0.0;
            (value, format!("{value:.decimals$}"))
        })
    }
}

/// A logarithmic axis over positive values. Its pixels may run backwards.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LogAxis {
    low: f64,
    high: f64,
    from: f32,
    to: f32,
}

impl LogAxis {
    /// An axis that holds all `values`, which are finite and positive, with a little room on each
    /// side. None without values.
    pub fn over(values: impl Iterator<Item = f64>, [from, to]: [f32; 2]) -> Option<Self> {
        let (low, high) = span(values.map(libm::log10))?;
        let room = ((high - low) * 0.04).max(0.05);
        Some(Self { low: low - room, high: high + room, from, to })
    }

    /// Pixel of `value`.
    #[must_use]
    pub fn at(&self, value: f64) -> f32 {
        let way = (libm::log10(value) - self.low) / (self.high - self.low);
        self.from + (self.to - self.from) * way as f32
    }

    /// 1, 2 and 5 times powers of ten, with their labels.
    pub fn ticks(&self) -> impl Iterator<Item = (f64, String)> + use<> {
        let Self { low, high, .. } = *self;
        let decades = low.floor() as i32..=high.ceil() as i32;
        let values = decades.flat_map(|decade| {
            [1.0, 2.0, 5.0].map(|factor| (factor * libm::pow(10.0, f64::from(decade)), decade))
        });
        let inside = values.filter(move |(value, _)| (low..=high).contains(&libm::log10(*value)));
        inside.map(|(value, decade)| {
            let decimals = usize::try_from(-decade).unwrap_or(0);
            (value, format!("{value:.decimals$}"))
        })
    }
}

/// Least and greatest. None of nothing.
fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range: Option<(f64, f64)>, value| {
        Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn ticks_lie_inside_and_are_few(
            low in -1e6..1e6_f64, span in 1e-3..1e6_f64, most in 3_u32..12,
        ) {
            let axis = LinearAxis::over([low, low + span].into_iter(), [0.0, 100.0]).unwrap();
            let ticks: Vec<f64> = axis.ticks(most).map(|(value, _)| value).collect();
            prop_assert!((1..=most as usize + 1).contains(&ticks.len()), "{ticks:?}");
            prop_assert!(ticks.iter().all(|&value| (-0.1..=100.1).contains(&axis.at(value))));
        }
    }

    #[test]
    fn what_takes_longer_is_higher_and_ten_times_longer_always_by_as_much() {
        let axis = LogAxis::over([0.01, 250.0].into_iter(), [600.0, 100.0]).unwrap();
        let rise = |from: f64| axis.at(from) - axis.at(10.0 * from);
        assert!(rise(0.1) > 1.0);
        assert!((rise(0.1) - rise(7.0)).abs() < 1e-3);
        let labels: Vec<_> = axis.ticks().map(|(_, label)| label).collect();
        let expected = [
            "0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10", "20", "50", "100",
            "200",
        ];
        assert_eq!(labels, expected);
    }
}
