//! Scoring: what left-out frames of a recording look like against what a method makes of them.
//!
//! [`run`] hands the keys of a [`Recording`](crate::recording::Recording) to one engine per method
//! and compares what they make with the frames between; [`tally`] collects, [`report`] prints.
//! [`picture`] turns any colour plane into the 8-bit sRGB pictures that [`metrics`] compare.

pub mod metrics;
pub mod picture;
pub mod report;
pub mod run;
pub mod tally;
