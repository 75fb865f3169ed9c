//! Pacers to compare ours with, written anew from what is public about how others pace frames.
//!
//! Each is the rule by which it chooses instants, and nothing more: what they do beside that (how
//! they compose, talk to drivers, or make pictures) is left out. None of them has a content clock,
//! so each gets the plain rule that frame generators follow: content time starts at each key anew
//! ([`KeyContent`]). They hand over whatever they have made, late or not.

mod fsr3;
mod gamescope;
mod monado;
mod naive;

pub(super) use fsr3::Fsr3Style;
pub(super) use gamescope::GamescopeStyle;
pub(super) use monado::MonadoStyle;
pub(super) use naive::NaiveTimer;

use crate::time::{MonoSpan, MonoTime};

/// Content time that starts at the first picture of a key and runs at the speed of the clock.
#[derive(Clone, Debug, Default)]
struct KeyContent {
    newest: Option<MonoTime>,
    first_present: Option<MonoTime>,
}

impl KeyContent {
    fn on_key(&mut self, content_time: MonoTime) {
        *self = Self { newest: Some(content_time), first_present: None };
    }

    fn at(&self, present_at: MonoTime) -> Option<MonoTime> {
        let first = self.first_present.unwrap_or(present_at);
        Some(self.newest? + (present_at - first))
    }

    fn on_start(&mut self, present_at: MonoTime) {
        if self.newest.is_some() {
            self.first_present.get_or_insert(present_at);
        }
    }
}

/// The first instant `last + n * interval` at or after `time`.
fn next_multiple(last: MonoTime, interval: MonoSpan, time: MonoTime) -> MonoTime {
    let interval = interval.as_ns().max(1);
    let refreshes = ((time - last).as_ns() + interval - 1).div_euclid(interval);
    last + MonoSpan::from_ns(refreshes.saturating_mul(interval))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pacing::Plan;
    use crate::pacing::sim::policy::Planner;

    const INTERVAL: MonoSpan = MonoSpan::from_ms(10);

    fn at(us: i64) -> MonoTime {
        MonoTime::ZERO + MonoSpan::from_us(us)
    }

    #[test]
    fn the_next_multiple_is_at_or_after_the_time() {
        assert_eq!(next_multiple(at(5), INTERVAL, at(20_005)), at(20_005));
        assert_eq!(next_multiple(at(5), INTERVAL, at(20_006)), at(30_005));
    }

    #[test]
    fn gamescope_jumps_to_a_long_draw_and_comes_down_slowly() {
        let mut pacer = GamescopeStyle::new(INTERVAL);
        pacer.on_key(at(0), at(0));
        pacer.on_presented(at(100_000), at(100_000), at(100_000));
        let lead = |pacer: &mut GamescopeStyle| {
            let plan = pacer.plan(at(100_000));
            plan.present_at - plan.wake_at
        };
        let before = lead(&mut pacer);
        pacer.on_work(MonoSpan::from_ms(6));
        assert_eq!(lead(&mut pacer), MonoSpan::from_us(6_000 + 1_650));
        pacer.on_work(MonoSpan::from_ms(2));
        assert_eq!(lead(&mut pacer), MonoSpan::from_us(5_920 + 1_650));
        assert!(before < lead(&mut pacer));
    }

    #[test]
    fn monado_widens_by_4_percent_on_a_miss_up_to_30_percent() {
        let mut pacer = MonadoStyle::new(INTERVAL);
        pacer.on_key(at(0), at(0));
        let lead = |pacer: &mut MonadoStyle| {
            let plan = pacer.plan(at(0));
            plan.present_at - plan.wake_at
        };
        assert_eq!(lead(&mut pacer), MonoSpan::from_us(1_000));
        pacer.on_presented(at(0), at(10_000), at(10_000));
        assert_eq!(lead(&mut pacer), MonoSpan::from_us(1_400));
        (1..20).for_each(|n| pacer.on_presented(at(n), at(20_000 * n), at(20_000 * n)));
        assert_eq!(lead(&mut pacer), MonoSpan::from_us(3_000));
    }

    #[test]
    fn fsr3_is_unpaced_until_it_has_ten_intervals_and_then_evenly_spaced() {
        let mut pacer = Fsr3Style::new(INTERVAL);
        let mut spans = vec![];
        for key in 0..12 {
            let arrival = at(key * 30_000);
            pacer.on_key(arrival, arrival);
            let mut last: Option<Plan> = None;
            loop {
                let now = last.map_or(arrival, |plan| plan.present_at);
                let plan = pacer.plan(now);
                if plan.wake_at > at(key * 30_000 + 30_000) {
                    break; // all frames of this key are made
                }
                pacer.start(&plan);
                spans.extend(last.map(|before| (plan.present_at - before.present_at).as_ns()));
                last = Some(plan);
            }
        }
        // Two of each of the first ten keys, with nothing between them.
        assert_eq!(spans[..10], [0; 10]);
        // A third of the mean interval, less 0.1 ms.
        assert_eq!(spans[10..], [9_900_000; 4]);
    }
}
