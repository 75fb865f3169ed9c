//! The stability suite: where methods fail.
//!
//! A [`Sweep`](sweeps::Sweep) turns one knob on a probe scene of [`foreframe_fixtures::probes`]: a
//! speed, the width of a bar, noise in the motion. For each point of it [`shoot`] renders keys and
//! truths, [`spoil`] damages the keys' planes, and [`run`] lets every method make the frames
//! between and compares. [`report`] says how good each was, from where on it is worse than holding
//! the key, and how long it took to recover; [`plot`] draws one small chart per sweep.
//!
//! Every number comes from a fixed seed and from pictures that are the same on every machine. No
//! time is measured.

pub mod page;
pub mod plot;
pub mod report;
pub mod run;
pub mod shoot;
pub mod spoil;
pub mod sweeps;
