//! The only place that waits: for a descriptor, and never longer than the caller allows.

use std::os::fd::{BorrowedFd, OwnedFd};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create,
    timerfd_settime,
};

use crate::error::{Error, Result};

/// A timer that runs once. Waiting again after a signal does not start it anew.
#[derive(Debug)]
pub(crate) struct Deadline {
    timer: OwnedFd,
}

impl Deadline {
    /// Ends `after` from now; at least a nanosecond, because 0 would mean never.
    pub(crate) fn new(after: Duration) -> Result<Self> {
        let timer = timerfd_create(TimerfdClockId::Monotonic, TimerfdFlags::CLOEXEC)
            .map_err(Error::os("make a timer"))?;
        let after = after.max(Duration::from_nanos(1));
        let once = Itimerspec {
            it_interval: Timespec { tv_sec: 0, tv_nsec: 0 },
            it_value: Timespec {
                tv_sec: i64::try_from(after.as_secs()).unwrap_or(i64::MAX),
                tv_nsec: after.subsec_nanos().into(),
            },
        };
        timerfd_settime(&timer, TimerfdTimerFlags::empty(), &once)
            .map_err(Error::os("start a timer"))?;
        Ok(Self { timer })
    }

    /// Waits until `fd` can be read (or written, if `for_write`), or has ended. False: the time is
    /// over first.
    pub(crate) fn wait(&self, fd: BorrowedFd<'_>, for_write: bool) -> Result<bool> {
        let write = if for_write { PollFlags::OUT } else { PollFlags::empty() };
        let mut fds = [
            PollFd::from_borrowed_fd(fd, PollFlags::IN | write),
            PollFd::new(&self.timer, PollFlags::IN),
        ];
        loop {
            match poll(&mut fds, None) {
                Ok(_) => return Ok(!fds[0].revents().is_empty()),
                Err(Errno::INTR) => {}
                Err(errno) => return Err(Error::os("wait for the daemon")(errno)),
            }
        }
    }
}
