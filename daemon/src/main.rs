//! The daemon on its own.
fn main() {}
