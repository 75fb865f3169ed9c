//! Tests of the whole pacer: laws that hold whatever happens, and schedules to read.

mod laws;
mod schedule;
