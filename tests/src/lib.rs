//! Tests that cross a process or a crate live in `tests/`; this library is empty.
