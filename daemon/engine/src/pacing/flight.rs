//! Frames that were handed over and not heard of yet, and what their answers teach.
//!
//! Four things: how long answers usually take, so that a display which cannot keep up is noticed
//! and not flooded; whether the display answers at all; how early before a refresh it needs a
//! frame ([`Deadline`]); and how many whole refreshes it shows everything later than that suggests,
//! which some compositors do as a rule.
//!
//! An answer about a frame says of all older ones that theirs got lost.

use std::collections::VecDeque;

use super::deadline::Deadline;
use super::recent::Recent;
use crate::time::{MonoSpan, MonoTime};

/// Answers that the usual delay looks back on.
const DELAY_WINDOW: usize = 32;
/// Delay of answers until enough were heard: what the slowest displays known take, 5 refreshes at
/// 60 Hz.
const FIRST_DELAY: MonoSpan = MonoSpan::from_ms(85);
/// So many answers make a delay.
const ANSWERS_TO_LEARN: usize = 8;
/// So many overdue answers hold the next frame back.
const OVERDUE_LIMIT: usize = 2;
/// An answer that is overdue for this long never comes.
const PATIENCE: MonoSpan = MonoSpan::from_ms(100);
/// After so many answers in a row that never came the display is one that does not answer.
const SILENT_LIMIT: u32 = 8;
/// A frame shown so much later after the one before than planned came after the deadline, as a
/// share of the interval in percent. Displays without a beam show such a frame a little late, not
/// at the next refresh, and go on from there. Timestamps of software are off by 12 % at 144 Hz.
const LATE_PERCENT: i64 = 18;
/// Frames that tell whether any is ever shown as soon as planned.
const PASSAGE_WINDOW: usize = 32;
/// They are not, if the shortest passage is longer than the usual lead by this share of the
/// interval.
const PASSAGE_PERCENT: i64 = 5;
/// Frames that the lateness of a display looks back on.
const LATENESS_WINDOW: usize = 16;
/// A display shows everything at most so many refreshes late.
const LARGEST_OFFSET: i64 = 3;
/// Answers after a lost one for which more of them may get lost.
const LOSS_MEMORY: u32 = 1_024;

/// A frame without an answer.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    planned: MonoTime,
    /// From being handed over to the refresh that it was planned for.
    lead: MonoSpan,
    /// Handed over early enough, as far as was known.
    was_in_time: bool,
}

/// The frames under way.
#[derive(Clone, Debug, Default)]
pub(super) struct Flight {
    /// Oldest first.
    waiting: VecDeque<Waiting>,
    /// From the planned refresh to the answer being heard.
    delays: Recent<DELAY_WINDOW>,
    usual_delay: Option<MonoSpan>,
    silent_in_a_row: u32,
    answers_since_loss: Option<u32>,
    /// Whole refreshes from the planned to the real one, newest last.
    lateness: VecDeque<i64>,
    /// Refreshes that the display needs from its deadline to showing a frame.
    offset: i64,
    deadline: Deadline,
    /// What the deadline starts from.
    first_deadline: MonoSpan,
    /// The frame that was shown last: planned and presented.
    shown: Option<(MonoTime, MonoTime)>,
    /// From being handed over to being shown, of frames not a whole refresh late.
    passages: Recent<PASSAGE_WINDOW>,
    /// From being handed over to the planned refresh, of the same frames.
    leads: Recent<PASSAGE_WINDOW>,
}

impl Flight {
    /// On a display that is expected to need frames so long before a refresh.
    pub(super) fn with_deadline(first_deadline: MonoSpan) -> Self {
        let deadline = Deadline::starting_at(first_deadline);
        Self { deadline, first_deadline, ..Self::default() }
    }

    /// A frame for `planned` was handed over.
    pub(super) fn hand_over(&mut self, planned: MonoTime, lead: MonoSpan, was_in_time: bool) {
        self.waiting.push_back(Waiting { planned, lead, was_in_time });
    }

    /// The frame for `planned` was shown `late` after it; this was heard at `heard_at`.
    pub(super) fn on_shown(
        &mut self,
        planned: MonoTime,
        late: MonoSpan,
        heard_at: MonoTime,
        interval: MonoSpan,
    ) {
        let Some(Waiting { lead, was_in_time, .. }) = self.take(planned) else { return };
        // What is not about the next refresh, or was late already, tells nothing of the deadline.
        let ahead = lead - interval.scale(self.offset, 1);
        let half = interval.scale(1, 2);
        let refreshes = (late + half).as_ns().div_euclid(interval.as_ns().max(1));
        let gap = self.gap_before(planned, late, interval);
        let was_late = late.min(gap) > interval.scale(LATE_PERCENT, 100);
        self.shown = Some((planned, planned + late));
        if (0..=1).contains(&refreshes) && ahead > MonoSpan::ZERO {
            self.deadline.on_frame(ahead, was_late, interval);
        }
        if refreshes == self.offset {
            self.learn_passage(lead, lead + late, interval);
        }
        self.delays.push(heard_at - planned);
        if self.delays.len() >= ANSWERS_TO_LEARN {
            self.usual_delay = self.delays.percentile(95);
        }
        if was_in_time {
            self.learn_offset(refreshes);
        }
    }

    /// The frame for `planned` will never be shown. `is_blamed`: because it came too late.
    pub(super) fn on_discarded(&mut self, planned: MonoTime, interval: MonoSpan, is_blamed: bool) {
        let Some(frame) = self.take(planned) else { return };
        let ahead = frame.lead - interval.scale(self.offset, 1);
        if is_blamed && ahead > MonoSpan::ZERO {
            self.deadline.on_frame(ahead, true, interval);
        }
    }

    /// Nothing that was learned from the display holds any more.
    pub(super) fn on_mode(&mut self) {
        let first = Self::with_deadline(self.first_deadline);
        *self = Self { silent_in_a_row: self.silent_in_a_row, ..first };
    }

    /// Refreshes from the display's deadline to the one that shows a frame, beyond the first.
    pub(super) fn offset(&self) -> i64 {
        self.offset
    }

    /// How long before a refresh the display needs a frame.
    pub(super) fn deadline(&self) -> MonoSpan {
        self.deadline.before_refresh()
    }

    /// Frames without an answer.
    pub(super) fn unanswered(&self) -> usize {
        self.waiting.len()
    }

    /// Whether the display has stopped to answer, or never did.
    pub(super) fn is_silent(&self) -> bool {
        self.silent_in_a_row >= SILENT_LIMIT
    }

    /// Gives up waiting for what is overdue for too long, and says until when the next frame has to
    /// wait if too many answers are overdue at `now`. A display that never answered holds nothing.
    pub(super) fn hold_until(&mut self, now: MonoTime, interval: MonoSpan) -> Option<MonoTime> {
        let usual = self.usual_delay.unwrap_or(FIRST_DELAY);
        // Where answers get lost, one that is missing may still be told of by those after it.
        let tolerance = interval.scale(if self.answers_since_loss.is_some() { 3 } else { 1 }, 1);
        let due = |frame: &Waiting| frame.planned + usual + tolerance;
        while self.waiting.front().is_some_and(|oldest| due(oldest) + PATIENCE <= now) {
            self.waiting.pop_front();
            self.silent_in_a_row = self.silent_in_a_row.saturating_add(1);
        }
        self.usual_delay.filter(|_| !self.is_silent())?;
        let overdue = self.waiting.iter().filter(|frame| due(frame) <= now).count();
        let oldest = self.waiting.front()?;
        (overdue >= OVERDUE_LIMIT).then(|| due(oldest) + PATIENCE)
    }

    /// Takes out the frame for `planned` and all older ones.
    fn take(&mut self, planned: MonoTime) -> Option<Waiting> {
        let position = self.waiting.iter().position(|frame| frame.planned == planned)?;
        self.silent_in_a_row = 0;
        self.answers_since_loss = match (position, self.answers_since_loss) {
            (1.., _) => Some(0),
            (_, Some(answers)) if answers < LOSS_MEMORY => Some(answers + 1),
            _ => None,
        };
        self.waiting.drain(..=position).next_back()
    }

    /// By how much longer than planned the frame before was shown: when a display goes on from a
    /// late frame, those after it are late, too, and not to blame.
    fn gap_before(&self, planned: MonoTime, late: MonoSpan, interval: MonoSpan) -> MonoSpan {
        let Some((before, shown)) = self.shown else { return late };
        let half = interval.scale(1, 2);
        let steps = (planned - before + half).as_ns().div_euclid(interval.as_ns().max(1)).max(1);
        planned + late - shown - interval.scale(steps, 1)
    }

    /// A display that shows frames when it gets them shows all of them late if all come too late,
    /// and seems to refresh more slowly. It gives itself away by never showing one sooner.
    fn learn_passage(&mut self, lead: MonoSpan, passage: MonoSpan, interval: MonoSpan) {
        self.leads.push(lead);
        self.passages.push(passage);
        if self.passages.len() < PASSAGE_WINDOW {
            return;
        }
        let (Some(shortest), Some(usual_lead)) =
            (self.passages.percentile(0), self.leads.percentile(50))
        else {
            return;
        };
        if shortest - usual_lead > interval.scale(PASSAGE_PERCENT, 100) {
            let needed = shortest - interval.scale(self.offset, 1);
            self.deadline.move_up_to(needed, interval);
            self.passages.clear();
            self.leads.clear();
        }
    }

    fn learn_offset(&mut self, refreshes: i64) {
        self.lateness.push_back(refreshes);
        if self.lateness.len() < LATENESS_WINDOW {
            return;
        }
        let (least, most) = self
            .lateness
            .iter()
            .fold((i64::MAX, i64::MIN), |(least, most), &late| (least.min(late), most.max(late)));
        self.lateness.pop_front();
        let change = if most < 0 { most } else { least.max(0) };
        let offset = (self.offset + change).clamp(0, LARGEST_OFFSET);
        if offset != self.offset {
            self.offset = offset;
            self.lateness.clear();
            self.deadline = Deadline::starting_at(self.first_deadline);
            self.passages.clear();
            self.leads.clear();
        }
    }

    pub(super) fn verify_invariants(&self) {
        assert!((0..=LARGEST_OFFSET).contains(&self.offset), "offset out of bounds: {self:?}");
        self.deadline.verify_invariants();
        assert!(self.lateness.len() < LATENESS_WINDOW, "lateness was not judged: {self:?}");
        let planned = self.waiting.iter().map(|frame| frame.planned);
        assert!(planned.is_sorted(), "frames out of order: {self:?}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL: MonoSpan = MonoSpan::from_ms(10);
    const LEAD: MonoSpan = MonoSpan::from_ms(1);

    fn at(ms: i64) -> MonoTime {
        MonoTime::ZERO + MonoSpan::from_ms(ms)
    }

    /// A flight whose frames, one each 10 ms, were shown `late` refreshes late and told of 1 ms on.
    fn flown(frames: i64, late: i64) -> Flight {
        let mut flight = Flight::default();
        for frame in 1..=frames {
            flight.hand_over(at(frame * 10), LEAD, true);
            let heard_at = at((frame + late) * 10 + 1);
            flight.on_shown(at(frame * 10), INTERVAL.scale(late, 1), heard_at, INTERVAL);
            flight.verify_invariants();
        }
        flight
    }

    #[test]
    fn a_display_that_stops_to_answer_holds_the_next_frame_and_then_is_called_silent() {
        let mut flight = flown(20, 0);
        flight.hand_over(at(210), LEAD, true);
        assert_eq!(flight.hold_until(at(225), INTERVAL), None, "one answer may be late");
        flight.hand_over(at(220), LEAD, true);
        assert_eq!(flight.hold_until(at(231), INTERVAL), Some(at(321)));
        assert_eq!(flight.hold_until(at(320), INTERVAL), Some(at(321)));
        assert_eq!(flight.hold_until(at(321), INTERVAL), None);
        for frame in 0..i64::from(SILENT_LIMIT) {
            flight.hand_over(at(330 + frame * 10), LEAD, true);
        }
        assert_eq!(flight.hold_until(at(2_000), INTERVAL), None);
        assert!(flight.is_silent());
        flight.hand_over(at(2_010), LEAD, true);
        flight.on_shown(at(2_010), MonoSpan::ZERO, at(2_011), INTERVAL);
        assert!(!flight.is_silent());
    }

    #[test]
    fn answers_that_are_always_late_are_waited_for_and_do_not_hold_anything() {
        let mut flight = Flight::default();
        for frame in 1..100 {
            flight.hand_over(at(frame * 10), LEAD, true);
            if frame > 8 {
                flight.on_shown(at((frame - 8) * 10), MonoSpan::ZERO, at(frame * 10), INTERVAL);
            }
            assert_eq!(flight.hold_until(at(frame * 10), INTERVAL), None, "frame {frame}");
        }
        assert_eq!(flight.unanswered(), 8);
    }

    #[test]
    fn an_answer_clears_all_older_frames_and_one_that_is_unknown_none() {
        let mut flight = flown(10, 0);
        (11..15).for_each(|frame| flight.hand_over(at(frame * 10), LEAD, true));
        flight.on_discarded(at(777), INTERVAL, true);
        assert_eq!(flight.unanswered(), 4);
        flight.on_shown(at(130), MonoSpan::ZERO, at(131), INTERVAL);
        assert_eq!(flight.unanswered(), 1);
    }

    #[test]
    fn a_display_that_shows_everything_a_refresh_late_has_an_offset_of_one() {
        assert_eq!(flown(LATENESS_WINDOW as i64 - 1, 1).offset(), 0);
        let mut flight = flown(LATENESS_WINDOW as i64, 1);
        assert_eq!(flight.offset(), 1);
        for frame in 100..200 {
            flight.hand_over(at(frame * 10), LEAD, true);
            flight.on_shown(
                at(frame * 10),
                INTERVAL.scale(i64::from(frame % 5 == 0), 1),
                at(frame * 10 + 1),
                INTERVAL,
            );
        }
        assert_eq!(flight.offset(), 1, "a miss now and then is none");
        for frame in 200..220 {
            flight.hand_over(at(frame * 10), LEAD, true);
            flight.on_shown(at(frame * 10), INTERVAL.scale(-1, 1), at(frame * 10 + 1), INTERVAL);
        }
        assert_eq!(flight.offset(), 0);
    }

    /// Shows each frame when it gets it, but not sooner than `passage` later or one interval after
    /// the frame before. Frames are planned one interval after the frame that was shown last.
    fn shown_when_it_comes(
        flight: &mut Flight,
        passage: MonoSpan,
        lead: impl Fn(i64, &Flight) -> MonoSpan,
    ) {
        let mut shown = at(0);
        for frame in 1..400 {
            let planned = shown + INTERVAL;
            let lead = lead(frame, flight);
            flight.hand_over(planned, lead, true);
            shown = planned.max(planned - lead + passage);
            flight.on_shown(planned, shown - planned, shown, INTERVAL);
        }
    }

    #[test]
    fn frames_shown_a_little_late_give_the_deadline_away() {
        let mut flight = Flight::default();
        let leads = |frame, _: &Flight| MonoSpan::from_us(1_000 + (frame * 37) % 50 * 100);
        shown_when_it_comes(&mut flight, MonoSpan::from_ms(4), leads);
        let range = MonoSpan::from_us(1_700)..MonoSpan::from_us(4_600);
        assert!(range.contains(&flight.deadline()), "{:?}", flight.deadline());
    }

    #[test]
    fn frames_that_all_come_too_late_for_a_display_that_follows_move_up() {
        let mut flight = Flight::default();
        let lead = |_, flight: &Flight| flight.deadline() + MonoSpan::from_us(500);
        shown_when_it_comes(&mut flight, MonoSpan::from_ms(4), lead);
        let range = MonoSpan::from_us(3_500)..MonoSpan::from_us(5_000);
        assert!(range.contains(&flight.deadline()), "{:?}", flight.deadline());
    }

    #[test]
    fn an_expected_deadline_comes_back_when_all_that_was_learned_is_forgotten() {
        let mut flight = Flight::with_deadline(MonoSpan::from_ms(4));
        assert_eq!(flight.deadline(), MonoSpan::from_ms(4));
        for frame in 1..2_000 {
            flight.hand_over(at(frame * 10), MonoSpan::from_ms(5), true);
            flight.on_shown(at(frame * 10), MonoSpan::ZERO, at(frame * 10 + 1), INTERVAL);
        }
        assert!(flight.deadline() < MonoSpan::from_us(3_500), "{:?}", flight.deadline());
        flight.on_mode();
        assert_eq!(flight.deadline(), MonoSpan::from_ms(4));
    }

    #[test]
    fn frames_that_we_handed_over_late_say_nothing_about_the_display() {
        let mut flight = Flight::default();
        for frame in 1..100 {
            flight.hand_over(at(frame * 10), LEAD, false);
            flight.on_shown(at(frame * 10), INTERVAL, at(frame * 10 + 11), INTERVAL);
        }
        assert_eq!(flight.offset(), 0);
    }
}
