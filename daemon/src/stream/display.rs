//! The window of a stream as its thread has it: pictures to it, and its word to the core.

use std::collections::VecDeque;
use std::sync::Arc;

use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::pacing::Plan;
use foreframe_engine::{ColorPlane, MonoTime};
use foreframe_protocol::Presented;
use tracing::{debug, info, trace, warn};

use super::core::{PresentedFrame, StreamCore, Told};
use crate::clock;
use crate::control::StreamStatus;
use crate::hud::{Hud, HudView};
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
    hud: Hud,
    /// The picture on display where it is not the engine's: with a HUD in it.
    picture: ColorPlane,
}

impl WindowDisplay {
    /// Opens a window and paces `core` by it. Without one the stream goes on, on a timer.
    pub(super) fn open(
        opener: &WindowOpener,
        config: &WindowConfig,
        gpu: Option<&Arc<Gpu>>,
        view: HudView,
        core: &mut StreamCore,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Option<Self> {
        let window = Window::open(opener, config, gpu, wake)
            .inspect_err(|error| warn!(%error, "no window; pictures go to subscribers alone"))
            .ok()?;
        let feedback = window.feedback();
        let announced = window.refresh_interval();
        info!(window = config.title, pacing = feedback.name(), ?announced, "window is paced");
        let (awaited, shown) = (VecDeque::new(), Vec::new());
        let mut hud = Hud::default();
        hud.set_view(view);
        let picture = ColorPlane::default();
        let mut display =
            Self { window, feedback, is_rate_corrected: false, awaited, shown, hud, picture };
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
    pub(super) fn show(&mut self, plan: &Plan, frame: &PresentedFrame, core: &mut StreamCore) {
        let is_taken = if self.hud.view() == HudView::Off {
            clock::sleep_until(plan.submit_from);
            match core.kept().take() {
                Some(picture) => self.window.present_kept(plan.present_at, picture),
                None => self.window.present(plan.present_at, core.frame()),
            }
        } else {
            self.draw_hud(frame, core);
            clock::sleep_until(plan.submit_from);
            self.window.present(plan.present_at, &self.picture)
        };
        let now = clock::now();
        trace!(
            planned = plan.present_at.as_ns(),
            submit_by = plan.submit_by.as_ns(),
            at = now.as_ns(),
            is_taken,
            "handed over"
        );
        core.on_handed_over(plan, now, is_taken);
    }

    /// Whether pictures can be shown that stay on the GPU that makes them.
    pub(super) fn takes_kept_pictures(&self) -> bool {
        self.hud.view() == HudView::Off && self.window.takes_kept_pictures()
    }

    /// Copies the picture that was just made and draws the HUD into it. Frames of a kind that the
    /// HUD hides leave the picture before in place.
    fn draw_hud(&mut self, frame: &PresentedFrame, core: &mut StreamCore) {
        let made = core.frame();
        let has_size =
            (self.picture.width(), self.picture.height()) == (made.width(), made.height());
        if !self.hud.view().shows(frame.kind) && has_size {
            return;
        }
        self.picture.reset(made.format(), made.width(), made.height());
        self.picture.copy_from(made);
        self.hud.draw(frame, core.inspect(), &mut self.picture);
    }

    /// Draws something else into the pictures from now on.
    pub(super) fn set_hud(&mut self, view: HudView) {
        info!(%view, "hud");
        self.hud.set_view(view);
    }

    /// Adds to a report what the window knows, and shows it in the HUD.
    pub(super) fn report(&mut self, report: &mut StreamStatus) {
        self.feedback.name().clone_into(&mut report.paced_by);
        self.window.way().clone_into(&mut report.drawn_by);
        if self.feedback != Feedback::Presentation {
            report.warnings.push(format!("the display is paced by {}", self.feedback.name()));
        }
        if self.is_rate_corrected {
            report.warnings.push("the display announces a wrong refresh rate".to_owned());
        }
        self.hud.report(report);
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
                WindowEvent::Key('h') => self.set_hud(self.hud.view().next()),
                WindowEvent::Key(key) => debug!(%key, "a key that nothing is bound to"),
                WindowEvent::Closed(why) => {
                    let pacing = core.pacing();
                    info!(?why, ?pacing, "window closes");
                    core.leave_display(clock::now());
                    if self.feedback == Feedback::Timer {
                        self.settle_by_time(MonoTime::FAR_FUTURE);
                    }
                    return false;
                }
            }
        }
        let pacing = core.pacing();
        if self.feedback == Feedback::Timer {
            self.settle_by_time(clock::now() - pacing.refresh_interval);
        }
        if pacing.is_rate_corrected != self.is_rate_corrected {
            self.is_rate_corrected = pacing.is_rate_corrected;
            let measured = pacing.refresh_interval;
            warn!(%measured, is_corrected = self.is_rate_corrected, "the display's rate is measured");
        }
        true
    }

    /// The first picture of a key was handed over: its client hears of it when it is shown.
    pub(super) fn await_word_of(&mut self, presented: Presented) {
        if self.awaited.len() == MOST_AWAITED {
            self.awaited.pop_front();
        }
        self.awaited.push_back(presented);
    }

    /// What clients are to hear.
    pub(super) fn take_shown(&mut self) -> Vec<Presented> {
        std::mem::take(&mut self.shown)
    }

    /// Nothing tells of what is shown: what was due before `until`, a refresh ago, was.
    fn settle_by_time(&mut self, until: MonoTime) {
        let is_over = |one: &mut Presented| MonoTime::from_ns(one.present_at_ns) < until;
        self.shown.extend(std::iter::from_fn(|| self.awaited.pop_front_if(is_over)));
    }

    fn settle(&mut self, told: Told) {
        match told {
            Told::Presented { planned, presented_at, heard_at } => {
                trace!(
                    planned = planned.as_ns(),
                    at = presented_at.as_ns(),
                    heard_at = heard_at.as_ns(),
                    "shown"
                );
                let is_older = |one: &Presented| MonoTime::from_ns(one.present_at_ns) <= planned;
                while let Some(mut presented) = self.awaited.pop_front_if(|one| is_older(one)) {
                    if presented.present_at_ns == planned.as_ns() {
                        presented.presented_at_ns = presented_at.as_ns();
                        self.shown.push(presented);
                    }
                }
            }
            Told::Discarded { planned } => {
                trace!(planned = planned.as_ns(), "discarded");
                self.awaited.retain(|one| one.present_at_ns != planned.as_ns());
            }
            Told::Mode(_) | Told::Visible(_) | Told::Moved => {}
        }
    }
}
