//! The last N spans of something, with the order statistics that the pacer learns from.
//!
//! N is small (at most 128) and a push happens once per key or frame, so statistics are computed
//! from a sorted copy instead of kept up to date.

use std::collections::VecDeque;

use crate::time::MonoSpan;

/// The newest `N` spans, oldest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Recent<const N: usize> {
    spans: VecDeque<MonoSpan>,
}

impl<const N: usize> Recent<N> {
    pub(super) fn push(&mut self, span: MonoSpan) {
        if self.spans.len() == N {
            self.spans.pop_front();
        }
        self.spans.push_back(span);
    }

    pub(super) fn len(&self) -> usize {
        self.spans.len()
    }

    pub(super) fn clear(&mut self) {
        self.spans.clear();
    }

    /// Forgets all but the newest `count`.
    pub(super) fn keep_newest(&mut self, count: usize) {
        self.spans.drain(..self.spans.len().saturating_sub(count));
    }

    pub(super) fn min(&self) -> Option<MonoSpan> {
        self.spans.iter().min().copied()
    }

    /// The smallest span that at least `percent` (0 to 100) of all spans do not exceed.
    pub(super) fn percentile(&self, percent: usize) -> Option<MonoSpan> {
        let mut sorted: Vec<MonoSpan> = self.spans.iter().copied().collect();
        sorted.sort_unstable();
        let rank = (sorted.len() * percent).div_ceil(100);
        sorted.get(rank.saturating_sub(1)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(spans: impl IntoIterator<Item = i64>) -> Recent<4> {
        let mut recent = Recent::default();
        spans.into_iter().for_each(|ns| recent.push(MonoSpan::from_ns(ns)));
        recent
    }

    #[test]
    fn the_oldest_spans_are_forgotten_first() {
        let mut recent = filled([1, 9, 8, 7, 6]);
        assert_eq!(recent.len(), 4);
        assert_eq!(recent.min(), Some(MonoSpan::from_ns(6)));
        recent.keep_newest(2);
        assert_eq!(recent.percentile(100), Some(MonoSpan::from_ns(7)));
    }

    #[test]
    fn percentiles_are_spans_that_were_pushed() {
        let recent = filled([40, 10, 30, 20]);
        let at = |percent| recent.percentile(percent).map(MonoSpan::as_ns);
        assert_eq!(
            [at(0), at(25), at(26), at(50), at(100)].map(Option::unwrap),
            [10, 10, 20, 20, 40]
        );
        assert_eq!(Recent::<4>::default().percentile(50), None);
    }
}
