//! When to show in-between frames on a display that refreshes when it is given a picture.
//!
//! Such a display has no grid to meet, but after each picture it is blind for its shortest
//! interval. So a key goes out at once, and in-between frames are armed where they leave it room:
//! evenly between two keys, as many as fit even before a key that comes as early as keys usually
//! do, and at least one, midway, if two shortest intervals fit into a key interval. When the next
//! key is overdue, frames go on at the same pace, so that motion can come to rest.

use super::recent::Recent;
use crate::time::{MonoSpan, MonoTime};

/// Arrivals that the usual span between two looks back on.
const WINDOW: usize = 32;
/// Key interval before the second key, as in [`cadence`](super::cadence).
const FIRST_INTERVAL: MonoSpan = MonoSpan::from_ms(25);
/// After the latest usual arrival a key may still come within shortest interval / this.
const GRACE_DIVISOR: i64 = 2;

/// The schedule of a variable display.
#[derive(Clone, Debug)]
pub(super) struct VariableRefresh {
    shortest: MonoSpan,
    newest_arrival: Option<MonoTime>,
    spans: Recent<WINDOW>,
    /// First picture of the newest key. None until it is started.
    key_shown_at: Option<MonoTime>,
    last_presented: Option<MonoTime>,
}

impl VariableRefresh {
    pub(super) fn new(shortest: MonoSpan) -> Self {
        Self {
            shortest: shortest.max(MonoSpan::from_us(100)),
            newest_arrival: None,
            spans: Recent::default(),
            key_shown_at: None,
            last_presented: None,
        }
    }

    pub(super) fn shortest(&self) -> MonoSpan {
        self.shortest
    }

    pub(super) fn on_key(&mut self, arrived_at: MonoTime) {
        if let Some(before) = self.newest_arrival {
            self.spans.push(arrived_at - before);
        }
        self.newest_arrival = Some(arrived_at);
        self.key_shown_at = None;
    }

    pub(super) fn on_start(&mut self, present_at: MonoTime) {
        self.key_shown_at.get_or_insert(present_at);
    }

    pub(super) fn on_presented(&mut self, presented_at: MonoTime) {
        self.last_presented = self.last_presented.max(Some(presented_at));
    }

    /// The first instant at which the display can show another picture after the one at
    /// `last_target`.
    pub(super) fn free_from(&self, last_target: Option<MonoTime>) -> MonoTime {
        let last = last_target.max(self.last_presented);
        last.map_or(MonoTime::ZERO, |last| last + self.shortest)
    }

    /// When to show the in-between frame after the picture at `last_target`. None while the newest
    /// key has no picture: it goes first.
    pub(super) fn next_in_between(
        &self,
        last_target: MonoTime,
        key_interval: Option<MonoSpan>,
    ) -> Option<MonoTime> {
        let key_shown_at = self.key_shown_at?;
        let key_interval = key_interval.unwrap_or(FIRST_INTERVAL);
        let count = self.in_betweens(key_interval);
        let spacing = key_interval.scale(1, count + 1).max(self.shortest);
        let shown = (last_target - key_shown_at + spacing.scale(1, 2)).as_ns() / spacing.as_ns();
        if shown < count {
            return Some(key_shown_at + spacing.scale(shown + 1, 1));
        }
        let latest = self.spans.percentile(95).unwrap_or(key_interval).max(key_interval);
        let overdue = key_shown_at + latest + self.shortest.scale(1, GRACE_DIVISOR);
        Some(overdue.max(last_target + spacing))
    }

    /// In-between frames from one key to the next.
    fn in_betweens(&self, key_interval: MonoSpan) -> i64 {
        let earliest = self.spans.percentile(5).unwrap_or(key_interval);
        let early = (key_interval - earliest).max(MonoSpan::ZERO);
        // Half a percent of rounding and drift does not cost an in-between frame.
        let whole = key_interval.scale(201, 200);
        let safe = whole.as_ns() / (self.shortest + early).as_ns() - 1;
        let fits_midway = i64::from(whole >= self.shortest.scale(2, 1));
        safe.max(fits_midway)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORTEST: MonoSpan = MonoSpan::from_ms(8);

    fn at(ms: i64) -> MonoTime {
        MonoTime::ZERO + MonoSpan::from_ms(ms)
    }

    /// What is shown after the last of `arrivals`, which is shown at once, until `until`.
    fn shown(arrivals: &[i64], key_ms: i64, until: i64) -> Vec<i64> {
        let mut variable = VariableRefresh::new(SHORTEST);
        arrivals.iter().for_each(|&ms| variable.on_key(at(ms)));
        let mut last = at(*arrivals.last().unwrap());
        assert_eq!(variable.next_in_between(last, None), None, "the key goes first");
        variable.on_start(last);
        let mut shown = vec![];
        loop {
            last = variable.next_in_between(last, Some(MonoSpan::from_ms(key_ms))).unwrap();
            if last > at(until) {
                return shown;
            }
            variable.on_start(last);
            shown.push((last - MonoTime::ZERO).as_ns() / 1_000_000);
        }
    }

    #[test]
    fn in_betweens_are_spread_evenly_and_leave_room_for_the_next_key() {
        assert_eq!(shown(&[0, 24, 48], 24, 72), [56, 64]);
        assert_eq!(shown(&[0, 20, 40], 20, 60), [50], "midway");
        assert_eq!(shown(&[0, 15, 30], 15, 45), Vec::<i64>::new(), "no room");
    }

    #[test]
    fn keys_that_may_come_early_get_more_room() {
        assert_eq!(shown(&[0, 24, 44, 72], 24, 96), [84]);
    }

    #[test]
    fn when_the_key_is_overdue_frames_go_on_at_the_same_pace() {
        assert_eq!(shown(&[0, 24, 48], 24, 100), [56, 64, 76, 84, 92, 100]);
    }

    #[test]
    fn after_a_picture_the_display_is_blind_for_its_shortest_interval() {
        let mut variable = VariableRefresh::new(SHORTEST);
        assert_eq!(variable.free_from(None), MonoTime::ZERO);
        assert_eq!(variable.free_from(Some(at(10))), at(18));
        variable.on_presented(at(12));
        variable.on_presented(at(11));
        assert_eq!(variable.free_from(Some(at(10))), at(20));
    }
}
