//! The daemon: sessions, engine threads, sinks, recorder. The only place with clocks, sockets and logs.

pub mod capture;
pub mod clock;
pub mod config;
pub mod sink;
