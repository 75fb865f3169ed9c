//! How much one client may ask of the main loop: a bucket of tokens, one per message.
//!
//! A client that renders at 1000 Hz and releases output frames at 1000 Hz sends 2000 messages a
//! second; twice that is granted, with a burst of a second's worth after a pause.

use foreframe_engine::MonoTime;

/// Messages that a client may send per second, for long.
pub const MESSAGES_PER_SECOND: u64 = 4_000;
/// Messages that a client may send at once.
pub const BURST: u64 = 4_000;

const NS_PER_MESSAGE: u64 = 1_000_000_000 / MESSAGES_PER_SECOND;

/// Counts the messages of one client.
#[derive(Clone, Copy, Debug)]
pub struct FloodGate {
    /// When the bucket will be full again, nanoseconds. It is full when this has passed.
    full_at_ns: u64,
}

impl FloodGate {
    /// A full bucket.
    #[must_use]
    pub fn new(now: MonoTime) -> Self {
        Self { full_at_ns: now.as_ns() }
    }

    /// Takes a token for a message at `now`; false if there is none left.
    #[must_use]
    pub fn admits(&mut self, now: MonoTime) -> bool {
        let full_at_ns = self.full_at_ns.max(now.as_ns()) + NS_PER_MESSAGE;
        if full_at_ns - now.as_ns() > BURST * NS_PER_MESSAGE {
            return false;
        }
        self.full_at_ns = full_at_ns;
        true
    }
}

#[cfg(test)]
mod tests {
    use foreframe_engine::MonoSpan;

    use super::*;

    #[test]
    fn a_burst_is_admitted_up_to_its_limit_and_no_further() {
        let now = MonoTime::from_ns(77);
        let mut gate = FloodGate::new(now);
        let admitted = (0..2 * BURST).filter(|_| gate.admits(now)).count();
        assert_eq!(admitted as u64, BURST);
    }

    #[test]
    fn a_steady_client_is_never_stopped() {
        let mut now = MonoTime::from_ns(1);
        let mut gate = FloodGate::new(now);
        for message in 0..10 * BURST {
            assert!(gate.admits(now), "message {message}");
            now += MonoSpan::from_ns(1_000_000_000 / 2_000);
        }
    }

    #[test]
    fn twice_the_rate_is_stopped_after_two_bursts_at_the_latest() {
        let mut now = MonoTime::from_ns(1);
        let mut gate = FloodGate::new(now);
        let stopped_at = (0..10 * BURST).find(|_| {
            now += MonoSpan::from_ns(1_000_000_000 / (2 * 4_000));
            !gate.admits(now)
        });
        assert!(stopped_at.is_some_and(|message| message <= 2 * BURST), "{stopped_at:?}");
    }
}
