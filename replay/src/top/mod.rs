//! A running daemon for people: as text, and as a terminal view that keeps itself up to date.
//!
//! Both show a [`foreframed::control::DaemonStatus`] and nothing else, so what `top` shows is what
//! `ctl status --json` says. [`view`] draws one status into any terminal buffer; [`screen`] owns
//! the terminal.

pub mod screen;
pub mod text;
mod view;
