//! The pacers that a scenario can be run with, behind one small trait.

use super::compared::{Fsr3Style, GamescopeStyle, MonadoStyle, NaiveTimer};
use crate::pacing::{Pacer, PacerConfig, PacerStatus, Plan};
use crate::time::{MonoSpan, MonoTime};

/// Who plans.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Policy {
    /// [`Pacer`].
    Pacer(PacerConfig),
    /// A timer at the announced rate, without feedback or content clock.
    NaiveTimer,
    /// Spaced by the mean of the last ten frame times, as FSR 3 does.
    Fsr3Style,
    /// Rolling maximum of the draw time and a red zone, as gamescope has.
    GamescopeStyle,
    /// A composing time that is stepped up and down, as in Monado.
    MonadoStyle,
}

impl Policy {
    /// The others, in the order of the published table.
    pub const COMPARED: [Self; 4] =
        [Self::NaiveTimer, Self::Fsr3Style, Self::GamescopeStyle, Self::MonadoStyle];

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pacer(_) => "foreframe",
            Self::NaiveTimer => "naive timer",
            Self::Fsr3Style => "FSR3 style",
            Self::GamescopeStyle => "gamescope style",
            Self::MonadoStyle => "Monado style",
        }
    }

    pub(super) fn planner(self, refresh_interval: MonoSpan) -> Box<dyn Planner> {
        match self {
            Self::Pacer(config) => Box::new(Pacer::new(config)),
            Self::NaiveTimer => Box::new(NaiveTimer::new(refresh_interval)),
            Self::Fsr3Style => Box::new(Fsr3Style::new(refresh_interval)),
            Self::GamescopeStyle => Box::new(GamescopeStyle::new(refresh_interval)),
            Self::MonadoStyle => Box::new(MonadoStyle::new(refresh_interval)),
        }
    }
}

/// A pacer at work: it is told what happens, and says what to do next. What a pacer does not want
/// to know it leaves out.
pub(super) trait Planner {
    /// A key has arrived.
    fn on_key(&mut self, content_time: MonoTime, arrived_at: MonoTime);

    /// The next frame, as seen at `now`.
    fn plan(&mut self, now: MonoTime) -> Plan;

    /// The frame of `plan` is being made.
    fn start(&mut self, plan: &Plan);

    /// It took `work` from its planned wake.
    fn on_work(&mut self, _work: MonoSpan) {}

    /// It was handed to the display.
    fn on_handed_over(&mut self, _plan: &Plan, _handed_over_at: MonoTime) {}

    /// It was not handed over.
    fn on_dropped(&mut self) {}

    /// The display will not show the frame that was planned for `planned`.
    fn on_discarded(&mut self, _planned: MonoTime) {}

    /// The display says that it showed that frame at `presented_at`.
    fn on_presented(&mut self, _planned: MonoTime, _presented_at: MonoTime, _heard_at: MonoTime) {}

    /// Whether a frame that is ready after its `submit_by` is dropped.
    fn drops_what_is_late(&self) -> bool {
        false
    }

    /// What it knows, if it tells.
    fn status(&self) -> Option<PacerStatus> {
        None
    }
}

impl Planner for Pacer {
    fn on_key(&mut self, content_time: MonoTime, arrived_at: MonoTime) {
        Self::on_key(self, content_time, arrived_at, false);
    }

    fn plan(&mut self, now: MonoTime) -> Plan {
        Self::plan(self, now)
    }

    fn start(&mut self, plan: &Plan) {
        Self::start(self, plan);
    }

    fn on_work(&mut self, work: MonoSpan) {
        Self::on_work(self, work);
    }

    fn on_handed_over(&mut self, plan: &Plan, handed_over_at: MonoTime) {
        Self::on_handed_over(self, plan, handed_over_at);
    }

    fn on_dropped(&mut self) {
        Self::on_dropped(self);
    }

    fn on_discarded(&mut self, planned: MonoTime) {
        Self::on_discarded(self, planned);
    }

    fn on_presented(&mut self, planned: MonoTime, presented_at: MonoTime, heard_at: MonoTime) {
        Self::on_presented(self, planned, presented_at, heard_at);
    }

    fn drops_what_is_late(&self) -> bool {
        true
    }

    fn status(&self) -> Option<PacerStatus> {
        Some(Self::status(self))
    }
}
