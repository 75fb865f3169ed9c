//! A display and an application that exist on paper only, and a run of a pacer between them.
//!
//! [`Scenario`] says how keys come ([`KeyScript`]), what the display does ([`DisplayScript`]) and
//! how long synthesis takes ([`WorkScript`]); [`simulate`] runs a [`Policy`] through it, event by
//! event, and measures what was seen on the display ([`SimReport`]). Time is computed, chance comes
//! from a seed: one scenario gives one report, on every machine. [`TRACES`] are the scenarios of
//! the published table, and [`Policy::COMPARED`] the pacers that ours is compared with.

mod compared;
mod display;
mod keys;
mod measure;
mod policy;
mod rng;
mod run;
#[cfg(test)]
mod tests;
mod traces;

pub use display::{DisplayScript, MissBurst};
pub use keys::{KeyScript, Stall, StallKind};
pub use measure::{SimPicture, SimReport};
pub use policy::Policy;
pub use rng::SplitMix64;
pub use run::{Scenario, WorkScript, simulate, simulate_pictures};
pub use traces::{TRACES, Trace};
