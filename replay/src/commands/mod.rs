//! One module per command: `Args` (what was typed) and `run` (read, call, report).

pub mod adapters;
pub mod bench;
pub mod check;
pub mod completions;
pub mod ctl;
pub mod demo;
pub mod doctor;
pub mod export;
pub mod import;
pub mod info;
pub mod man;
pub mod pacing;
pub mod perception;
mod plot;
pub mod replay;
pub mod scenes;
pub mod score;
pub mod serve;
pub mod stability;
pub mod top;
