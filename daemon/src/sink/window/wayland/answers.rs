//! What to ask a compositor for with each frame, by how it has answered so far.
//!
//! Requests for feedback cannot be taken back, and some compositors never say of a frame that they
//! have shown it, or discard some and are silent about the others. So requests are counted, and
//! with too many out none is added. Until the first frame was said to be shown, a frame callback
//! goes with each: when those come and that word does not, callbacks take its place, and feedback
//! is tried again now and then. A compositor that answers nothing is asked for one callback at a
//! time, as a sign of life.

use crate::sink::window::Feedback;

/// Requests for feedback that may be out: half a second at 120 Hz.
const MOST_FEEDBACKS: u32 = 60;
/// Frame callbacks that may be out. They come one refresh after the other where they come at all.
const MOST_CALLBACKS: u32 = 12;
/// Callbacks without a frame that was said to be shown, after which that is not expected. Fewer
/// than the discarded frames in a row that would make the window one that nobody sees.
const CALLBACKS_TO_GIVE_UP: u32 = 10;
/// Frames without any answer, after which none is expected.
const FRAMES_TO_GIVE_UP: u32 = 60;
/// Frames until feedback is tried again for the first time. It doubles from try to try.
const FRAMES_TO_TRY: u32 = 64;
/// So many times all feedback got lost without one answer in between, and it is given up.
const LOSSES_TO_GIVE_UP: u32 = 3;

/// What goes with the next frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Ask {
    pub(super) feedback: bool,
    pub(super) callback: bool,
}

/// What has changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Change {
    Feedback(Feedback),
    Visible(bool),
}

/// Requests and answers of one surface.
#[derive(Clone, Debug)]
pub(super) struct Answers {
    /// Whether there is feedback to ask for.
    has_feedback: bool,
    mode: Feedback,
    /// Requests for feedback without an answer.
    feedbacks: u32,
    /// Frame callbacks without an answer.
    callbacks: u32,
    /// Callbacks that came in vain: without word of a frame being shown.
    vain_callbacks: u32,
    /// Frames since anything was answered.
    unanswered_frames: u32,
    /// Whether this mode has ever brought an answer.
    is_answered: bool,
    losses: u32,
    frames_to_try: u32,
    /// What `frames_to_try` starts from.
    patience: u32,
    /// Nothing is answered any more, as for a window that nobody sees.
    is_hidden: bool,
}

impl Answers {
    pub(super) fn new(has_feedback: bool) -> Self {
        let mode = if has_feedback { Feedback::Presentation } else { Feedback::FrameCallbacks };
        Self {
            has_feedback,
            mode,
            feedbacks: 0,
            callbacks: 0,
            vain_callbacks: 0,
            unanswered_frames: 0,
            is_answered: false,
            losses: 0,
            frames_to_try: FRAMES_TO_TRY,
            patience: FRAMES_TO_TRY,
            is_hidden: false,
        }
    }

    pub(super) fn mode(&self) -> Feedback {
        self.mode
    }

    /// A frame is about to be committed: what to ask for with it, and what that means.
    pub(super) fn on_frame(&mut self) -> (Ask, Option<Change>) {
        self.unanswered_frames = self.unanswered_frames.saturating_add(1);
        let is_silent = self.unanswered_frames > FRAMES_TO_GIVE_UP;
        match self.mode {
            Feedback::Presentation if self.is_answered => {
                let feedback = self.ask_feedback();
                // With everything out, a callback tells when we are drawn again.
                let callback = !feedback && self.ask_callback(1);
                let change = if feedback { None } else { self.hide() };
                (Ask { feedback, callback }, change)
            }
            Feedback::Presentation => {
                let change = if is_silent { self.go_to(Feedback::FrameCallbacks) } else { None };
                let feedback = change.is_none() && self.ask_feedback();
                (Ask { feedback, callback: self.ask_callback(MOST_CALLBACKS) }, change)
            }
            Feedback::FrameCallbacks => {
                let callback = self.ask_callback(MOST_CALLBACKS);
                let change = match (callback, self.is_answered) {
                    (false, true) => self.hide(),
                    (false, false) if is_silent => self.go_to(Feedback::Timer),
                    _ => None,
                };
                (Ask { feedback: self.is_worth_a_try() && self.ask_feedback(), callback }, change)
            }
            Feedback::Timer => (Ask { feedback: false, callback: self.ask_callback(1) }, None),
        }
    }

    /// A frame was shown, by the compositor's word.
    pub(super) fn on_presented(&mut self) -> Option<Change> {
        self.feedbacks = self.feedbacks.saturating_sub(1);
        self.losses = 0;
        self.vain_callbacks = 0;
        self.unanswered_frames = 0;
        let change = match self.mode {
            Feedback::Presentation => self.show(),
            Feedback::FrameCallbacks | Feedback::Timer => {
                self.is_hidden = false;
                self.go_to(Feedback::Presentation)
            }
        };
        self.is_answered = true;
        change
    }

    /// A frame was not shown, by the compositor's word; a good compositor says so of some, and a
    /// bad one, too.
    pub(super) fn on_discarded(&mut self) {
        self.feedbacks = self.feedbacks.saturating_sub(1);
    }

    /// A frame callback has come.
    pub(super) fn on_callback(&mut self) -> Option<Change> {
        self.callbacks = self.callbacks.saturating_sub(1);
        self.unanswered_frames = 0;
        match self.mode {
            Feedback::Presentation if !self.is_answered => {
                self.vain_callbacks += 1;
                let is_vain = self.vain_callbacks >= CALLBACKS_TO_GIVE_UP;
                if is_vain { self.go_to(Feedback::FrameCallbacks) } else { None }
            }
            // It draws us again, and what was asked before was lost.
            Feedback::Presentation if self.feedbacks >= MOST_FEEDBACKS => {
                self.losses += 1;
                if self.losses >= LOSSES_TO_GIVE_UP {
                    self.is_hidden = false;
                    return self.go_to(Feedback::FrameCallbacks);
                }
                self.feedbacks = 0;
                self.show()
            }
            Feedback::Presentation => None,
            Feedback::FrameCallbacks => {
                self.is_answered = true;
                self.show()
            }
            Feedback::Timer => {
                let change = self.go_to(Feedback::FrameCallbacks);
                self.is_answered = true;
                change
            }
        }
    }

    fn is_worth_a_try(&mut self) -> bool {
        self.frames_to_try = self.frames_to_try.saturating_sub(1);
        if self.frames_to_try > 0 || !self.has_feedback {
            return false;
        }
        self.patience = self.patience.saturating_mul(2);
        self.frames_to_try = self.patience;
        true
    }

    fn ask_feedback(&mut self) -> bool {
        let may = self.feedbacks < MOST_FEEDBACKS;
        self.feedbacks += u32::from(may);
        may
    }

    fn ask_callback(&mut self, most: u32) -> bool {
        let may = self.callbacks < most;
        self.callbacks += u32::from(may);
        may
    }

    fn go_to(&mut self, mode: Feedback) -> Option<Change> {
        self.mode = mode;
        self.is_answered = false;
        self.unanswered_frames = 0;
        self.vain_callbacks = 0;
        Some(Change::Feedback(mode))
    }

    fn hide(&mut self) -> Option<Change> {
        let is_new = !self.is_hidden;
        self.is_hidden = true;
        is_new.then_some(Change::Visible(false))
    }

    fn show(&mut self) -> Option<Change> {
        let was_hidden = std::mem::replace(&mut self.is_hidden, false);
        was_hidden.then_some(Change::Visible(true))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The changes in `frames` frames, each of which is answered by `answer`.
    fn run(
        answers: &mut Answers,
        frames: u32,
        mut answer: impl FnMut(&mut Answers, Ask) -> Option<Change>,
    ) -> Vec<Change> {
        let mut changes = Vec::new();
        for _ in 0..frames {
            let (ask, change) = answers.on_frame();
            changes.extend(change);
            changes.extend(answer(answers, ask));
            assert!(answers.feedbacks <= MOST_FEEDBACKS && answers.callbacks <= MOST_CALLBACKS);
        }
        changes
    }

    fn answer_all(answers: &mut Answers, ask: Ask) -> Option<Change> {
        let shown = ask.feedback.then(|| answers.on_presented()).flatten();
        let drawn = ask.callback.then(|| answers.on_callback()).flatten();
        shown.or(drawn)
    }

    fn answer_callbacks(answers: &mut Answers, ask: Ask) -> Option<Change> {
        ask.callback.then(|| answers.on_callback()).flatten()
    }

    #[test]
    fn a_compositor_that_answers_is_asked_for_feedback_alone_and_for_ever() {
        let mut answers = Answers::new(true);
        assert_eq!(run(&mut answers, 1_000, answer_all), []);
        assert_eq!(answers.on_frame().0, Ask { feedback: true, callback: false });
    }

    #[test]
    fn feedback_that_is_never_answered_gives_way_to_frame_callbacks_and_is_seldom_tried_again() {
        let mut answers = Answers::new(true);
        let mut asked = 0;
        let changes = run(&mut answers, 10_000, |answers, ask| {
            asked += u32::from(ask.feedback);
            answer_callbacks(answers, ask)
        });
        assert_eq!(changes, [Change::Feedback(Feedback::FrameCallbacks)]);
        assert!(asked < 20, "{asked} requests that cannot be taken back");
    }

    #[test]
    fn discarded_frames_are_no_proof_that_any_is_shown() {
        let mut answers = Answers::new(true);
        let changes = run(&mut answers, 500, |answers, ask| {
            if ask.feedback {
                answers.on_discarded();
            }
            answer_callbacks(answers, ask)
        });
        assert_eq!(changes, [Change::Feedback(Feedback::FrameCallbacks)]);
    }

    #[test]
    fn feedback_that_works_after_all_is_found_out() {
        let mut answers = Answers::new(true);
        run(&mut answers, 50, answer_callbacks);
        let changes = run(&mut answers, 200, answer_all);
        assert_eq!(changes, [Change::Feedback(Feedback::Presentation)]);
    }

    #[test]
    fn a_compositor_that_answers_nothing_leaves_a_timer_and_one_callback_as_a_sign_of_life() {
        let mut answers = Answers::new(true);
        let changes = run(&mut answers, 500, |_, _| None);
        let expected = [Feedback::FrameCallbacks, Feedback::Timer].map(Change::Feedback);
        assert_eq!(changes, expected);
        let change = answers.on_callback();
        assert_eq!(
            change,
            Some(Change::Feedback(Feedback::FrameCallbacks)),
            "it draws us after all"
        );
    }

    #[test]
    fn a_window_that_is_covered_is_hidden_until_it_is_drawn_again() {
        let mut answers = Answers::new(true);
        run(&mut answers, 100, answer_all);
        assert_eq!(run(&mut answers, 500, |_, _| None), [Change::Visible(false)]);
        assert_eq!(answers.on_callback(), Some(Change::Visible(true)));
        assert_eq!(run(&mut answers, 100, answer_all), []);
        assert_eq!(answers.mode(), Feedback::Presentation);
    }

    #[test]
    fn feedback_that_stops_for_good_while_frames_are_drawn_is_given_up() {
        let mut answers = Answers::new(true);
        run(&mut answers, 100, answer_all);
        let changes = run(&mut answers, 2_000, answer_callbacks);
        assert!(changes.contains(&Change::Feedback(Feedback::FrameCallbacks)), "{changes:?}");
    }
}
