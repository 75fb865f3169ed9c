//! How long something may fail before more is done about it: a pure function of time.

use foreframe_engine::{MonoSpan, MonoTime};

/// Since when something fails without having worked in between.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    limit: MonoSpan,
    since: Option<MonoTime>,
}

impl Patience {
    /// For what may fail for less than `limit`.
    pub(super) const fn new(limit: MonoSpan) -> Self {
        Self { limit, since: None }
    }

    /// It works.
    pub(super) fn renew(&mut self) {
        self.since = None;
    }

    /// It has failed for the first time since it worked.
    pub(super) fn is_new(&self) -> bool {
        self.since.is_none()
    }

    /// It fails at `now`; true if it has done so for the limit.
    pub(super) fn is_over(&mut self, now: MonoTime) -> bool {
        now - *self.since.get_or_insert(now) >= self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patience_ends_when_nothing_has_worked_for_the_limit() {
        let at = |ms| MonoTime::ZERO + MonoSpan::from_ms(ms);
        let mut patience = Patience::new(MonoSpan::from_ms(1000));
        assert!(patience.is_new());
        assert!(!patience.is_over(at(5000)) && !patience.is_over(at(5999)));
        assert!(!patience.is_new());
        assert!(patience.is_over(at(6000)) && patience.is_over(at(7000)));
        patience.renew();
        assert!(!patience.is_over(at(7500)) && !patience.is_over(at(8499)));
        assert!(patience.is_over(at(8500)));
    }
}
