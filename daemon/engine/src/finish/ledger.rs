//! Which picture is a key, which is blurred, and who has paid for whom.
//!
//! A key that is sharpened for n in-between frames has paid for n blurred ones. Each blurred
//! picture uses up one that was paid for; with none left, pictures are shown as they are. What a
//! key has paid for and nobody has shown stays for the next key, which then pays for less. So the
//! light of any run of pictures of a still surface is that of as many originals, but for
//!
//! ```text
//! (1) (paid for and not shown) * (original - blurred)
//! ```
//!
//! which is at most what one key pays for. How many pictures come after a key nobody knows before;
//! the ledger expects as many as came after the one before it, and need not be right.
//!
//! Which key has paid is kept with each ([`Ledger::age`]), because it paid for blur where its own
//! weights say ([`super::selection`]).
//!
//! A picture that was made and not shown is told by [`Ledger::dropped`]: the display showed the one
//! before again, and that one counts twice.

use foreframe_perception::compensation::MOST_FRAMES;

/// What finishing makes of a picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Part {
    /// Nothing.
    #[default]
    Plain,
    /// The frame that makes up for `frames - 1` others.
    Key {
        /// Frames that share the light, 2 to 16.
        frames: u32,
    },
    /// A blurred frame that one of [`Part::Key`] with as many frames makes up for.
    InBetween {
        /// Frames that share the light, 2 to 16.
        frames: u32,
    },
}

/// Blurred frames that are kept account of: what a key pays for, shown twice.
const CAPACITY: usize = 2 * MOST_FRAMES as usize;

/// What was paid for and not shown, or shown and not paid for. One of the two is empty.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Balance {
    /// For each frame that was paid for, how many share the light, oldest first.
    paid: [u8; CAPACITY],
    /// For each of them, how many keys ago it was paid for; at most 255.
    age: [u8; CAPACITY],
    count: usize,
    owed: u32,
}

impl Balance {
    /// Has a key pay, so that `expected` frames are paid for.
    fn pay(&mut self, expected: u32) -> Part {
        let needed = (expected + self.owed).saturating_sub(self.count as u32);
        let paid = needed.min(MOST_FRAMES - 1);
        if paid == 0 {
            return Part::Plain;
        }
        let settled = self.owed.min(paid);
        self.owed -= settled;
        self.add(paid + 1, paid - settled);
        Part::Key { frames: paid + 1 }
    }

    fn add(&mut self, frames: u32, count: u32) {
        for _ in 0..count {
            if let Some(place) = self.paid.get_mut(self.count) {
                (*place, self.age[self.count]) = (frames as u8, 0);
                self.count += 1;
            }
        }
    }

    /// Uses up the oldest frame that was paid for: how many share the light, how many keys ago it
    /// was.
    fn take(&mut self) -> Option<(u32, u8)> {
        let (frames, age) = (*self.paid[..self.count].first()?, self.age[0]);
        self.paid.copy_within(1..self.count, 0);
        self.age.copy_within(1..self.count, 0);
        self.count -= 1;
        Some((frames.into(), age))
    }

    /// A key has come.
    fn grow_older(&mut self) {
        for age in &mut self.age[..self.count] {
            *age = age.saturating_add(1);
        }
    }

    /// `part` was on the display once more than was planned.
    fn repeat(&mut self, part: Part) {
        match part {
            Part::Plain => {}
            Part::Key { frames } => {
                let settled = self.owed.min(frames - 1);
                self.owed -= settled;
                self.add(frames, frames - 1 - settled);
            }
            Part::InBetween { .. } => {
                if self.take().is_none() {
                    self.owed += 1;
                }
            }
        }
    }
}

/// The account of one stream.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    balance: Balance,
    shown: Part,
    /// How many keys ago the last picture was paid for.
    age: u8,
    /// Whether no picture was made of the newest key.
    is_new_key: bool,
    /// Pictures since the newest key.
    since_key: u32,
    /// In-between frames that are expected after a key.
    expected: u32,
    /// All of this before the last picture.
    before: Before,
}

#[derive(Clone, Copy, Debug, Default)]
struct Before {
    balance: Balance,
    shown: Part,
    is_new_key: bool,
}

impl Ledger {
    /// A key has come. After a cut nothing is left of what was paid for.
    pub fn on_key(&mut self, is_cut: bool) {
        if self.since_key > 0 {
            let is_usual = self.since_key <= MOST_FRAMES;
            self.expected = if is_usual { self.since_key - 1 } else { 0 };
        }
        (self.since_key, self.is_new_key) = (0, true);
        self.balance.grow_older();
        self.before.balance.grow_older();
        if is_cut {
            (self.balance, self.shown) = Default::default();
        }
    }

    /// What the next picture is.
    pub fn next_part(&mut self) -> Part {
        let Self { balance, shown, is_new_key, .. } = *self;
        self.before = Before { balance, shown, is_new_key };
        self.since_key = self.since_key.saturating_add(1);
        (self.shown, self.age) = if std::mem::take(&mut self.is_new_key) {
            (self.balance.pay(self.expected), 0)
        } else {
            let taken = self.balance.take();
            taken.map_or((Part::Plain, 0), |(frames, age)| (Part::InBetween { frames }, age))
        };
        self.shown
    }

    /// The last picture was not shown: the one before was, again.
    pub fn dropped(&mut self) {
        let Before { balance, shown, is_new_key } = self.before;
        (self.balance, self.shown, self.is_new_key) = (balance, shown, is_new_key);
        self.balance.repeat(shown);
    }

    /// How many keys ago the last picture was paid for: 0 by the newest key.
    #[must_use]
    pub fn age(&self) -> u8 {
        self.age
    }

    /// How many keys before the newest have paid for what is still to be shown, counted from it.
    #[must_use]
    pub fn oldest_age(&self) -> usize {
        self.balance.age[..self.balance.count].first().copied().unwrap_or(0).into()
    }

    /// Whether the same picture would be the same again, until a key comes: the one on the display
    /// may stay.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        let is_plain = !self.is_new_key && self.shown == Part::Plain && self.balance.count == 0;
        is_plain && self.since_key >= MOST_FRAMES
    }

    /// Blurred frames that are paid for and not shown, less those shown and not paid for.
    #[must_use]
    pub fn outstanding(&self) -> i64 {
        self.balance.count as i64 - i64::from(self.balance.owed)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// How often (original - blurred) a picture adds to the light of the original.
    fn sharpness(part: Part) -> i64 {
        match part {
            Part::Plain => 0,
            Part::Key { frames } => i64::from(frames) - 1,
            Part::InBetween { .. } => -1,
        }
    }

    fn run(ledger: &mut Ledger, pictures: u32) -> Vec<Part> {
        ledger.on_key(false);
        (0..pictures).map(|_| ledger.next_part()).collect()
    }

    #[test]
    fn steady_keys_pay_for_the_frames_between_them() {
        let mut ledger = Ledger::default();
        assert_eq!(run(&mut ledger, 3), [Part::Plain; 3], "nobody knows yet how many come");
        let [key, between] = [Part::Key { frames: 3 }, Part::InBetween { frames: 3 }];
        for _ in 0..5 {
            assert_eq!(run(&mut ledger, 3), [key, between, between]);
            assert_eq!(ledger.outstanding(), 0);
        }
        assert_eq!(run(&mut ledger, 5), [key, between, between, Part::Plain, Part::Plain]);
    }

    #[test]
    fn a_key_pays_for_less_where_frames_of_the_one_before_are_left() {
        let mut ledger = Ledger::default();
        run(&mut ledger, 4);
        run(&mut ledger, 2);
        assert_eq!(ledger.outstanding(), 2);
        let parts = run(&mut ledger, 3);
        assert_eq!(
            parts,
            [Part::Plain, Part::InBetween { frames: 4 }, Part::InBetween { frames: 4 }]
        );
    }

    #[test]
    fn every_picture_knows_how_many_keys_ago_it_was_paid_for() {
        let mut ledger = Ledger::default();
        run(&mut ledger, 4);
        run(&mut ledger, 2);
        assert_eq!((ledger.age(), ledger.oldest_age()), (0, 0));
        ledger.on_key(false);
        assert_eq!(ledger.oldest_age(), 1);
        // The key pays nothing, as two frames are paid for and one is expected; then those two.
        let ages = [(); 3].map(|()| {
            ledger.next_part();
            ledger.age()
        });
        assert_eq!((ages, ledger.oldest_age()), ([0, 1, 1], 0));
        run(&mut ledger, 3);
        assert_eq!(ledger.age(), 0);
    }

    #[test]
    fn nothing_is_left_after_a_cut_and_after_a_long_time() {
        let mut ledger = Ledger::default();
        run(&mut ledger, 4);
        run(&mut ledger, 2);
        ledger.on_key(true);
        assert_eq!(ledger.outstanding(), 0);
        assert!(!ledger.is_settled());
        let parts: Vec<_> = (0..40).map(|_| ledger.next_part()).collect();
        assert_eq!(parts[39], Part::Plain);
        assert!(ledger.is_settled());
        assert_eq!(run(&mut ledger, 2), [Part::Plain; 2], "keys so rare share no light");
    }

    #[test]
    fn a_picture_that_was_dropped_is_made_again_and_the_one_before_counts_twice() {
        let mut ledger = Ledger::default();
        run(&mut ledger, 3);
        assert_eq!(run(&mut ledger, 1), [Part::Key { frames: 3 }]);
        ledger.next_part();
        ledger.dropped();
        assert_eq!(ledger.outstanding(), 4, "the key was shown twice");
        ledger.on_key(false);
        assert_eq!(ledger.next_part(), Part::Plain);
        assert_eq!(ledger.next_part(), Part::InBetween { frames: 3 });
        ledger.on_key(false);
        ledger.next_part();
        ledger.dropped();
        assert!(ledger.is_new_key, "the key has still to be shown");
        assert_eq!(ledger.outstanding(), 2, "a blurred one was shown again");
    }

    proptest! {
        #[test]
        fn light_is_off_by_what_is_outstanding_and_no_more_whatever_comes(
            events in prop::collection::vec(0_u8..10, 1..300),
        ) {
            let mut ledger = Ledger::default();
            ledger.on_key(false);
            let (mut sum, mut on_display) = (0, Part::Plain);
            for event in events {
                if event < 3 {
                    ledger.on_key(false);
                    continue;
                }
                let part = ledger.next_part();
                if event == 9 {
                    ledger.dropped();
                } else {
                    on_display = part;
                }
                // What is shown, again or for the first time.
                sum += sharpness(on_display);
                let is_full = ledger.outstanding() == CAPACITY as i64;
                prop_assert!(sum == ledger.outstanding() || is_full);
                if is_full {
                    sum = ledger.outstanding();
                }
            }
        }
    }
}
