//! The client against a daemon that does exactly what a test says, in one thread.

mod fake_daemon;
mod frames;
mod output;
mod session;
