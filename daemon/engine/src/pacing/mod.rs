//! When to show which content time: a pure state machine with time as an argument.
//!
//! [`Pacer`] hears of keys, of work done and of presented frames, and plans the next frame: when
//! to wake, when it has to be handed over, when the display starts to show it, and which content
//! time it shows. It guarantees that
//! - the targets of started frames strictly increase, one frame per refresh;
//! - no wake lies in the past;
//! - from the first refresh that is still reachable when a key arrives, frames are made from that
//!   key, at a phase that is never negative;
//! - content time never runs backwards, except where the application's own clock does.
//!
//! The parts, one idea each: [`refresh`] tracks the display's period and phase from presentation
//! feedback; [`content`] maps present time to content time through one slowly moving delay;
//! [`cadence`] learns when the next key is overdue; [`easing`] brings motion to rest when it is;
//! [`budget`] learns how long before the refresh work has to start. All decisions are integer
//! arithmetic. The display has a fixed refresh: frames are planned on its grid.
//!
//! [`timer`] is the grid of sinks that have no display behind them; [`sim`] runs a pacer against a
//! simulated display and application.

mod budget;
mod cadence;
mod content;
mod easing;

mod pacer;
mod recent;
mod refresh;
pub mod sim;
#[cfg(test)]
mod tests;
mod timer;

pub use budget::WorkEstimate;
pub use pacer::{Pacer, PacerConfig, PacerCounts, PacerStatus, Plan};
pub use timer::TimerDisplay;
