//! A linear axis from milliseconds to pixels, with round ticks.

/// Values `low..=high` over the pixels from `from` to `to`, which may run backwards.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    from: f32,
    to: f32,
}

impl Axis {
    /// An axis that holds all `values`, which are finite, with a little room on each side. None
    /// without values.
    pub(crate) fn over(values: impl Iterator<Item = f64>, [from, to]: [f32; 2]) -> Option<Self> {
        let (low, high) = values.fold(None, |range: Option<(f64, f64)>, value| {
            Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
        })?;
        let room = ((high - low) * 0.02).max(0.5);
        Some(Self { low: low - room, high: high + room, from, to })
    }

    /// Pixel of `value`.
    pub(crate) fn at(&self, value: f64) -> f32 {
        let way = (value - self.low) / (self.high - self.low);
        self.from + (self.to - self.from) * way as f32
    }

    /// Round values inside, at most 15, with their labels.
    pub(crate) fn ticks(&self) -> impl Iterator<Item = (f64, String)> + use<> {
        let step = round_step((self.high - self.low) / 14.0);
        let decimals = if step < 1.0 { 1 } else { 0 };
        let (first, last) = ((self.low / step).ceil(), (self.high / step).floor());
        let count = (last - first).clamp(0.0, 20.0) as u32;
        (0..=count).map(move |index| {
            let value = (first + f64::from(index)) * step;
            (value, format!("{value:.decimals$}"))
        })
    }
}

/// The smallest of 1, 2 and 5 times a power of ten that is not less than `least`, from 0.1 up.
fn round_step(least: f64) -> f64 {
    let mut decade = 0.1;
    loop {
        for factor in [1.0, 2.0, 5.0] {
            if decade * factor >= least {
                return decade * factor;
            }
        }
        decade *= 10.0;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn values_and_ticks_lie_on_the_axis(
            values in prop::collection::vec(-1e7..1e7_f64, 1..20),
            backwards: bool,
        ) {
            let pixels = if backwards { [900.0, 100.0] } else { [100.0, 900.0] };
            let axis = Axis::over(values.iter().copied(), pixels).unwrap();
            let ticks: Vec<f64> = axis.ticks().map(|(value, _)| value).collect();
            prop_assert!(!ticks.is_empty() && ticks.len() <= 15, "{} ticks", ticks.len());
            for value in values.into_iter().chain(ticks) {
                prop_assert!((100.0..=900.0).contains(&axis.at(value)), "{value}");
            }
        }
    }

    #[test]
    fn steps_are_one_two_or_five() {
        for (least, expected) in [(0.01, 0.1), (0.3, 0.5), (1.1, 2.0), (3.0, 5.0), (6.0, 10.0)] {
            assert!((round_step(least) - expected).abs() < 1e-9, "{least}");
        }
    }
}
