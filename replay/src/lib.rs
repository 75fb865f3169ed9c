//! The `foreframe` tool: demo, record and replay, import and export, score.
//!
//! [`cli`] defines every command and option once; shell completions and man pages are made from
//! the same definitions. Each module in [`commands`] owns one command and does no more than read
//! its arguments, call a library, and report.

pub mod bench;
pub mod check;
pub mod cli;
pub mod commands;
pub mod demo;
pub mod doctor;
pub mod exr_frames;
pub mod html;
pub mod options;
pub mod output;
pub mod pictures;
pub mod recording;
pub mod score;
pub mod stability;
pub mod top;
pub mod virtual_time;
pub mod whole_file;

pub use foreframed::draw;
