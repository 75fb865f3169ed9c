//! Brings motion to rest when the next key is overdue.
//!
//! With x the lead of content time over the newest key, F the lead up to which velocity stays
//! full, and E the span within which it falls to zero, linearly:
//!
//! ```text
//! eased(x) = x                          x <= F
//!            F + u - u*u / (2 E)        u = x - F, 0 < u < E
//!            F + E/2                    beyond
//! ```
//!
//! Its slope is between 0 and 1. So for a fixed key content time never runs backwards, and neither
//! does `key + eased(line - key)` when a later key takes over: an object that was extrapolated
//! past where it should have stopped never snaps back.

use crate::time::MonoSpan;

/// The longest time that motion takes to come to rest: beyond it a stop looks like a drift.
const LONGEST: MonoSpan = MonoSpan::from_ms(50);

/// How far content time runs ahead of a key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Easing {
    /// Lead up to which velocity stays full.
    pub(super) full_until: MonoSpan,
    /// Span after it within which velocity falls to zero. Positive.
    pub(super) within: MonoSpan,
}

impl Easing {
    /// Full velocity for a lead of `full_until`, then to rest by min(2 key intervals, 50 ms).
    pub(super) fn after(full_until: MonoSpan, key_interval: MonoSpan) -> Self {
        Self { full_until, within: (key_interval + key_interval).min(LONGEST) }
    }

    /// The lead to show where uniform content time asks for `lead`.
    pub(super) fn eased(self, lead: MonoSpan) -> MonoSpan {
        let over = lead - self.full_until;
        if over <= MonoSpan::ZERO {
            return lead;
        }
        let over = over.min(self.within);
        self.full_until + over - over.scale(over.as_ns(), 2 * self.within.as_ns())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn ms(ms: i64) -> MonoSpan {
        MonoSpan::from_ms(ms)
    }

    #[test]
    fn velocity_is_full_until_the_key_is_overdue_and_zero_after_the_span() {
        let easing = Easing::after(ms(25), ms(25));
        assert_eq!(easing.eased(ms(25)), ms(25));
        assert_eq!(easing.eased(ms(75)), ms(50));
        assert_eq!(easing.eased(ms(500)), ms(50));
        assert_eq!(Easing::after(ms(10), ms(10)).eased(ms(500)), ms(20));
    }

    proptest! {
        #[test]
        fn the_slope_stays_between_zero_and_one(
            full_us in 0_i64..60_000, interval_us in 1_i64..60_000,
            lead_ns in 0_i64..300_000_000, step_ns in 0_i64..20_000_000,
        ) {
            let easing = Easing::after(MonoSpan::from_us(full_us), MonoSpan::from_us(interval_us));
            let lead = MonoSpan::from_ns(lead_ns);
            let step = MonoSpan::from_ns(step_ns);
            let advance = easing.eased(lead + step) - easing.eased(lead);
            prop_assert!(advance >= MonoSpan::from_ns(-1), "went back by {advance:?}");
            prop_assert!(advance <= step + MonoSpan::from_ns(1), "overtook by {:?}", advance - step);
        }
    }
}
