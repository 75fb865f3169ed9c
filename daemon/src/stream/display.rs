//! The window of a stream as its thread has it: pictures to it, and its word to the core.

use std::collections::VecDeque;

use foreframe_engine::MonoTime;
use foreframe_engine::pacing::Plan;
use foreframe_protocol::Presented;
use tracing::{debug, info, warn};

use super::core::{StreamCore, Told};
use crate::clock;
use crate::sink::window::{Feedback, Window, WindowConfig, WindowEvent, WindowOpener};

/// Keys whose first picture was handed over and not heard of yet. A display that answers nothing is
/// not waited for.
const MOST_AWAITED: usize = 64;

/// A window that a stream is paced by.
#[derive(Debug)]
pub(super) struct WindowDisplay {
    window: Window,
    feedback: Feedback,
    /// Whether it was said that the announced rate is wrong.
    is_rate_corrected: bool,
    /// Oldest first.
    awaited: VecDeque<Presented>,
    shown: Vec<Presented>,
}

impl WindowDisplay {
    /// Opens a window and paces `core` by it. Without one the stream goes on, on a timer.
    pub(super) fn open(
        opener: &WindowOpener,
        config: &WindowConfig,
        core: &mut StreamCore,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Option<Self> {
        let window = Window::open(opener, config, wake)
            .inspect_err(|error| warn!(%error, "no window; pictures go to subscribers alone"))
            .ok()?;
        let feedback = window.feedback();
        let announced = window.refresh_interval();
        info!(window = config.title, pacing = feedback.name(), ?announced, "window is paced");
        let (awaited, shown) = (VecDeque::new(), Vec::new());
        let mut display = Self { window, feedback, is_rate_corrected: false, awaited, shown };
        match feedback {
            Feedback::Timer => {
                announced.into_iter().for_each(|it| core.use_timer(it, clock::now()));
            }
            Feedback::Presentation | Feedback::FrameCallbacks => core.use_display(announced),
        }
        display.hear(core);
        Some(display)
    }

    /// Hands over the picture that was just made, not sooner than its plan allows.
    pub(super) fn show(&mut self, plan: &Plan, core: &mut StreamCore) {
        clock::sleep_until(plan.submit_from);
        let is_taken = self.window.present(plan.present_at, core.frame());
        core.on_handed_over(plan, clock::now(), is_taken);
    }

    /// Takes in what happened to the window; false once it is closed, and `core` on a timer again.
    pub(super) fn hear(&mut self, core: &mut StreamCore) -> bool {
        for event in self.window.take_events() {
            match event {
                WindowEvent::Told(told) => {
                    self.settle(told);
                    core.on_told(told);
                }
                WindowEvent::Feedback(feedback) => {
                    warn!(pacing = feedback.name(), was = self.feedback.name(), "another pacing");
                    self.feedback = feedback;
                }
                WindowEvent::Key(key) => debug!(%key, "a key that nothing is bound to"),
                WindowEvent::Closed(why) => {
                    let pacing = core.pacing();
                    info!(?why, ?pacing, "window closes");
                    core.leave_display(clock::now());
                    return false;
                }
            }
        }
        let pacing = core.pacing();
        if pacing.is_rate_corrected != self.is_rate_corrected {
            self.is_rate_corrected = pacing.is_rate_corrected;
            let measured = pacing.refresh_interval;
            warn!(%measured, is_corrected = self.is_rate_corrected, "the display's rate is measured");
        }
        true
    }

    /// The first picture of a key was handed over: its client hears of it when it is shown.
    pub(super) fn await_word_of(&mut self, presented: Presented) {
        if self.feedback == Feedback::Timer {
            return self.shown.push(presented);
        }
        if self.awaited.len() == MOST_AWAITED {
            self.awaited.pop_front();
        }
        self.awaited.push_back(presented);
    }

    /// What clients are to hear.
    pub(super) fn take_shown(&mut self) -> Vec<Presented> {
        std::mem::take(&mut self.shown)
    }

    fn settle(&mut self, told: Told) {
        match told {
            Told::Presented { planned, presented_at, .. } => {
                let is_older = |one: &Presented| MonoTime::from_ns(one.present_at_ns) <= planned;
                while let Some(mut presented) = self.awaited.pop_front_if(|one| is_older(one)) {
                    if presented.present_at_ns == planned.as_ns() {
                        presented.presented_at_ns = presented_at.as_ns();
                        self.shown.push(presented);
                    }
                }
            }
            Told::Discarded { planned } => {
                self.awaited.retain(|one| one.present_at_ns != planned.as_ns());
            }
            Told::Mode(_) | Told::Visible(_) => {}
        }
    }
}
