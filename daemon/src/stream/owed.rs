//! A key that was taken in is owed a picture, until that is made or a newer key supersedes it.
//!
//! The picture shows the newest of the keys that come before it. Live and replay ask here until
//! when that is, each with its own clock. A newer key can need a picture that takes longer than
//! the one that was planned; that costs one refresh at most, and then no key is waited for.

use foreframe_engine::pacing::Plan;
use foreframe_engine::{MonoSpan, MonoTime};

/// By how much a wake may come late when a key is to be taken in just before a picture.
const LATE_WAKE: MonoSpan = MonoSpan::from_us(250);

/// Whether a picture is owed, and which refresh it was planned for.
#[derive(Clone, Copy, Debug, Default)]
pub struct OwedPicture {
    is_owed: bool,
    /// The refresh that it was planned for first. None until it is planned, and where none is owed.
    first_planned_for: Option<MonoTime>,
}

impl OwedPicture {
    /// A key was taken in. Returns whether it supersedes one of which no picture was made.
    pub fn on_key(&mut self) -> bool {
        std::mem::replace(&mut self.is_owed, true)
    }

    /// A picture is being made.
    pub fn on_picture(&mut self) {
        *self = Self::default();
    }

    /// Whether no picture was made since the newest key was taken in.
    #[must_use]
    pub fn is_owed(&self) -> bool {
        self.is_owed
    }

    /// Until when a newer key may come that the owed picture, which is to be made by `plan`, shows
    /// instead. `key_work` is what taking it in takes. None where no picture is owed, and where
    /// keys have put it off from the refresh that it was planned for first: those that cost more
    /// and more would do so for ever.
    pub fn hears_until(&mut self, plan: &Plan, key_work: MonoSpan) -> Option<MonoTime> {
        if !self.is_owed {
            return None;
        }
        let first = *self.first_planned_for.get_or_insert(plan.present_at);
        (plan.present_at <= first).then(|| plan.wake_at - key_work - LATE_WAKE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(wake_at_ms: i64, present_at_ms: i64) -> Plan {
        let ms = |ms| MonoTime::ZERO + MonoSpan::from_ms(ms);
        Plan {
            wake_at: ms(wake_at_ms),
            wake_by: ms(wake_at_ms),
            submit_from: ms(present_at_ms),
            submit_by: ms(present_at_ms),
            present_at: ms(present_at_ms),
            content_time: Some(ms(0)),
        }
    }

    #[test]
    fn an_owed_picture_leaves_room_for_a_key_and_a_late_wake() {
        let mut owed = OwedPicture::default();
        assert_eq!(owed.hears_until(&plan(10, 14), MonoSpan::ZERO), None, "none is owed");
        assert!(!owed.on_key(), "the first");
        let hears_until = owed.hears_until(&plan(10, 14), MonoSpan::from_ms(2));
        assert_eq!(hears_until, Some(MonoTime::ZERO + MonoSpan::from_us(7_750)));
        owed.on_picture();
        assert!(!owed.is_owed());
    }

    #[test]
    fn a_key_that_puts_the_picture_off_is_the_last_that_it_waits_for() {
        let mut owed = OwedPicture::default();
        owed.on_key();
        assert!(owed.hears_until(&plan(10, 14), MonoSpan::ZERO).is_some());
        assert!(owed.on_key(), "in place of the first");
        assert!(owed.hears_until(&plan(9, 14), MonoSpan::ZERO).is_some(), "the same refresh");
        assert_eq!(owed.hears_until(&plan(18, 22), MonoSpan::ZERO), None, "put off");
        owed.on_picture();
        assert!(!owed.on_key(), "the one before has its picture");
        assert!(owed.hears_until(&plan(26, 30), MonoSpan::ZERO).is_some(), "the next one anew");
    }
}
