//! Scoring: what left-out frames of a recording look like against what a method makes of them.
//!
//! [`run`] hands the keys of a [`Recording`](crate::recording::Recording) to one engine per method
//! and compares what they make with the frames between; [`tally`] collects, [`report`] prints,
//! [`chart`] draws speed against accuracy, and [`page`] puts all of it on one page for a browser,
//! with the pictures of [`flips`] to flip through.
//! [`picture`] turns any colour plane into the 8-bit sRGB pictures that [`metrics`] compare.

pub mod chart;
pub mod flips;
pub mod metrics;
pub mod page;
pub mod picture;
pub mod report;
pub mod retina;
pub mod run;
pub mod tally;
