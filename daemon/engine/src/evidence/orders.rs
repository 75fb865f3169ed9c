//! The orders that belong to the whole image: of how the camera goes on, and of how movers do.
//!
//! Each key shows of some samples how far every order was off, (2) of [`super`]. The mean over them
//! counts as much as all keys before together, and another order is taken where it was clearly
//! better than the one in use.

/// Part of its error by which another order has to be better than the one in use.
const HYSTERESIS: f32 = 0.1;
/// And the least difference of (2) that counts: that of a twentieth of a pixel.
const TOLERANCE: f32 = 0.000_6;

/// Errors (2) of `N` orders over some samples.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct OrderErrors<const N: usize> {
    sums: [f32; N],
    count: f32,
}

impl<const N: usize> Default for OrderErrors<N> {
    fn default() -> Self {
        Self { sums: [0.0; N], count: 0.0 }
    }
}

impl<const N: usize> OrderErrors<N> {
    /// Takes in one sample.
    pub(super) fn add(&mut self, errors: [f32; N]) {
        self.merge(&Self { sums: errors, count: 1.0 });
    }

    /// Takes in other samples.
    pub(super) fn merge(&mut self, other: &Self) {
        for (sum, other) in self.sums.iter_mut().zip(other.sums) {
            *sum += other;
        }
        self.count += other.count;
    }
}

/// The order in use of `N`, simplest first, and what the keys so far have shown.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct OrderChoice<const N: usize> {
    in_use: usize,
    /// Averaged over keys; None before the first.
    errors: Option<[f32; N]>,
}

impl<const N: usize> Default for OrderChoice<N> {
    fn default() -> Self {
        Self { in_use: 0, errors: None }
    }
}

impl<const N: usize> OrderChoice<N> {
    /// The number of the order in use.
    pub(super) fn in_use(&self) -> usize {
        self.in_use
    }

    /// Takes in what a key has shown, if it has shown anything.
    pub(super) fn take_in(&mut self, key: &OrderErrors<N>) {
        if key.count == 0.0 {
            return;
        }
        let now = key.sums.map(|sum| sum / key.count);
        let errors = match self.errors {
            Some(before) => std::array::from_fn(|order| 0.5 * (before[order] + now[order])),
            None => now,
        };
        self.errors = Some(errors);
        for (order, error) in errors.into_iter().enumerate() {
            if error < errors[self.in_use] * (1.0 - HYSTERESIS) - TOLERANCE {
                self.in_use = order;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(errors: [f32; 2]) -> OrderErrors<2> {
        let mut key = OrderErrors::default();
        key.add(errors);
        key
    }

    #[test]
    fn the_order_changes_where_another_was_clearly_better_and_by_more_than_one_key() {
        let mut order = OrderChoice::default();
        order.take_in(&OrderErrors::default());
        assert_eq!((order.in_use(), order.errors), (0, None), "nothing was seen");
        order.take_in(&key([0.4, 0.39]));
        assert_eq!(order.in_use(), 0, "hardly better");
        order.take_in(&key([0.4, 0.1]));
        assert_eq!(order.in_use(), 1);
        order.take_in(&key([0.2, 0.3]));
        assert_eq!(order.in_use(), 1, "one key does not turn it back");
        order.take_in(&key([0.0, 0.4]));
        assert_eq!(order.in_use(), 0);
    }

    #[test]
    fn a_sample_counts_as_much_wherever_it_was_summed() {
        let (mut whole, mut parts) = (OrderErrors::default(), [OrderErrors::default(); 2]);
        for i in 0..10_u8 {
            let errors = [f32::from(i), f32::from(10 - i)];
            whole.add(errors);
            parts[usize::from(i > 6)].add(errors);
        }
        let [mut first, second] = parts;
        first.merge(&second);
        assert_eq!(first, whole);
    }
}
