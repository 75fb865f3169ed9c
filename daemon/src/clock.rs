//! The only reader of the clock and the only sleeper of the project.
//!
//! Everything else takes time as an argument. All instants are of `CLOCK_MONOTONIC`. Waits are for
//! absolute instants on a timer descriptor, which the kernel fires without timer slack, so that a
//! thread that was held up before its wait does not sleep too long.

use std::io;
use std::os::fd::OwnedFd;

use foreframe_engine::MonoTime;
use rustix::event::{EventfdFlags, PollFd, PollFlags, eventfd, poll};
use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{
    ClockId, Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, clock_gettime,
    timerfd_create, timerfd_settime,
};

const NS_PER_S: u64 = 1_000_000_000;

/// The present instant.
#[must_use]
pub fn now() -> MonoTime {
    let time = clock_gettime(ClockId::Monotonic);
    // The monotonic clock starts near 0 at boot: neither field is ever negative.
    MonoTime::from_ns(time.tv_sec.unsigned_abs() * NS_PER_S + time.tv_nsec.unsigned_abs())
}

/// The instant at which the clock of the kernel with number `id` showed `time_ns`, by both clocks
/// as they are now; None for clocks that a presentation time is never told in.
#[must_use]
pub fn from_other_clock(id: u32, time_ns: u64) -> Option<MonoTime> {
    let other = match id {
        1 => return Some(MonoTime::from_ns(time_ns)),
        4 => ClockId::MonotonicRaw,
        _ => return None,
    };
    let time = clock_gettime(other);
    let shown = time.tv_sec.unsigned_abs() * NS_PER_S + time.tv_nsec.unsigned_abs();
    let ago = MonoTime::from_ns(shown) - MonoTime::from_ns(time_ns);
    Some(now() - ago)
}

/// Sleeps until `deadline`; returns at once when it has passed.
pub fn sleep_until(deadline: MonoTime) {
    let request = timespec(deadline);
    while clock_nanosleep_absolute(ClockId::Monotonic, &request) == Err(Errno::INTR) {}
}

/// Wakes a thread that waits in [`Alarm::wait`]. Wakes that nobody has waited for yet add up to
/// one.
#[derive(Debug)]
pub struct Waker {
    event: OwnedFd,
}

impl Waker {
    /// A waker that has not been used.
    ///
    /// # Errors
    /// If the process has no descriptor left.
    pub fn new() -> io::Result<Self> {
        let flags = EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK;
        Ok(Self { event: eventfd(0, flags)? })
    }

    /// Ends the wait that is under way, or else the next one. Never blocks.
    pub fn wake(&self) {
        // The one failure of a write to an event descriptor is a counter that is full: it is awake.
        let _full = rustix::io::write(&self.event, &1_u64.to_ne_bytes());
    }
}

/// What ended a wait.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Woken {
    /// The waker was used, before or during the wait.
    ByWaker,
    /// The deadline has come.
    AtDeadline,
}

/// A thread's own timer.
#[derive(Debug)]
pub struct Alarm {
    timer: OwnedFd,
}

impl Alarm {
    /// A timer that is not set.
    ///
    /// # Errors
    /// If the process has no descriptor left.
    pub fn new() -> io::Result<Self> {
        let flags = TimerfdFlags::CLOEXEC | TimerfdFlags::NONBLOCK;
        Ok(Self { timer: timerfd_create(TimerfdClockId::Monotonic, flags)? })
    }

    /// Waits for `waker` or `deadline`, whichever comes first; the waker wins a tie.
    /// [`MonoTime::FAR_FUTURE`] waits for the waker alone.
    ///
    /// # Errors
    /// If the kernel refuses to wait, which it does for lack of memory alone.
    pub fn wait(&self, waker: &Waker, deadline: MonoTime) -> io::Result<Woken> {
        // All zeros would switch the timer off, and the epoch of the clock is always in the past.
        let value = timespec(deadline.max(MonoTime::from_ns(1)));
        let once = Itimerspec { it_interval: Timespec { tv_sec: 0, tv_nsec: 0 }, it_value: value };
        timerfd_settime(&self.timer, TimerfdTimerFlags::ABSTIME, &once)?;
        loop {
            let mut ready =
                [PollFd::new(&waker.event, PollFlags::IN), PollFd::new(&self.timer, PollFlags::IN)];
            match poll(&mut ready, None) {
                Ok(_) => {}
                Err(Errno::INTR) => continue,
                Err(error) => return Err(error.into()),
            }
            if ready[0].revents().contains(PollFlags::IN) {
                let mut count = [0; 8];
                rustix::io::read(&waker.event, &mut count)?;
                return Ok(Woken::ByWaker);
            }
            if ready[1].revents().contains(PollFlags::IN) {
                return Ok(Woken::AtDeadline);
            }
        }
    }
}

fn timespec(time: MonoTime) -> Timespec {
    let ns = time.as_ns();
    Timespec {
        tv_sec: i64::try_from(ns / NS_PER_S).expect("2^64 ns are fewer than 2^63 seconds"),
        tv_nsec: (ns % NS_PER_S).try_into().expect("less than a second of nanoseconds fits"),
    }
}

#[cfg(test)]
mod tests {
    use foreframe_engine::MonoSpan;

    use super::*;

    #[test]
    fn another_clock_is_told_by_how_long_ago_it_was() {
        let raw = clock_gettime(ClockId::MonotonicRaw);
        let raw_ns = raw.tv_sec.unsigned_abs() * NS_PER_S + raw.tv_nsec.unsigned_abs();
        let before = from_other_clock(4, raw_ns - 5_000_000).unwrap();
        let ago = now() - before;
        assert!(ago >= MonoSpan::from_us(4_990) && ago < MonoSpan::from_ms(60_000), "{ago}");
        assert_eq!(from_other_clock(1, 77), Some(MonoTime::from_ns(77)));
        assert_eq!(from_other_clock(0, 77), None);
    }

    #[test]
    fn a_wait_never_ends_before_its_deadline() {
        let (alarm, waker) = (Alarm::new().unwrap(), Waker::new().unwrap());
        for step_us in [0, 1, 50, 2_000] {
            let deadline = now() + MonoSpan::from_us(step_us);
            assert_eq!(alarm.wait(&waker, deadline).unwrap(), Woken::AtDeadline);
            assert!(now() >= deadline, "woke early from a wait of {step_us} us");
        }
    }

    #[test]
    fn a_sleep_never_ends_before_its_deadline() {
        let deadline = now() + MonoSpan::from_us(500);
        sleep_until(deadline);
        assert!(now() >= deadline);
    }

    #[test]
    fn a_waker_used_before_the_wait_ends_it_once() {
        let (alarm, waker) = (Alarm::new().unwrap(), Waker::new().unwrap());
        waker.wake();
        waker.wake();
        assert_eq!(alarm.wait(&waker, MonoTime::FAR_FUTURE).unwrap(), Woken::ByWaker);
        assert_eq!(alarm.wait(&waker, MonoTime::ZERO).unwrap(), Woken::AtDeadline);
    }

    #[test]
    fn a_waker_ends_the_wait_of_another_thread() {
        let (alarm, waker) = (Alarm::new().unwrap(), Waker::new().unwrap());
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| alarm.wait(&waker, MonoTime::FAR_FUTURE).unwrap());
            waker.wake();
            assert_eq!(waiting.join().unwrap(), Woken::ByWaker);
        });
    }
}
