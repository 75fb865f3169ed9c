//! A clock and a frame limiter for the examples. An application has its own.

use std::time::Duration;

use foreframe_client::{Client, Error};
use rustix::time::{ClockId, clock_gettime};

/// `CLOCK_MONOTONIC`, the clock of all times in the protocol.
pub(crate) fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    u64::try_from(now.tv_sec * 1_000_000_000 + now.tv_nsec).expect("the clock starts at 0")
}

/// Reads messages of the daemon until it is time for the next frame. The events are thrown away.
pub(crate) fn wait_until(client: &mut Client, due_ns: u64) -> Result<(), Error> {
    loop {
        while client.next_event().is_some() {}
        let now = monotonic_ns();
        if now >= due_ns {
            return Ok(());
        }
        client.wait(Duration::from_nanos(due_ns - now))?;
    }
}
