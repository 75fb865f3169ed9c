//! When to show which content time: a pure state machine with time as an argument.
//!
//! [`Pacer`] hears of keys, of work done and of presented frames, and plans the next frame: when
//! to wake, when it has to be handed over, when the display starts to show it, and which content
//! time it shows. It guarantees that
//! - the targets of started frames strictly increase, one frame per refresh, and at most one waits;
//! - no wake lies in the past;
//! - from the first refresh that is still reachable when a key arrives, frames are made from that
//!   key, at a phase that is never negative;
//! - content time never runs backwards, except where the application's own clock does.
//!
//! The parts, one idea each: [`refresh`] tracks the display's period and phase from presentation
//! feedback, [`rate_doubt`] finds out whether it tells the truth about its rate, [`flight`] what
//! became of the frames under way, and [`deadline`] how early it needs them; [`content`] maps
//! present time to content time through one slowly moving delay; [`cadence`] learns when the next
//! key is overdue; [`easing`] brings motion to rest when it is; [`budget`] learns how long before
//! the refresh work has to start. All decisions are integer arithmetic. Frames are planned on the
//! grid of the display, or, where it has none, so that keys find it free ([`variable`]).
//!
//! [`timer`] is the grid of sinks that have no display behind them; [`sim`] runs a pacer against a
//! simulated display and application.

mod budget;
mod cadence;
mod content;
mod deadline;
mod easing;
mod flight;
mod pacer;
mod rate_doubt;
mod recent;
mod refresh;
pub mod sim;
#[cfg(test)]
mod tests;
mod timer;
mod types;
mod variable;

pub use budget::WorkEstimate;
pub use pacer::Pacer;
pub use timer::TimerDisplay;
pub use types::{FeedbackState, PacerConfig, PacerCounts, PacerStatus, Plan, RefreshKind};
