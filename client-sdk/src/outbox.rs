//! Messages that have to arrive even when the daemon is not reading right now. Key frames are not
//! among them: a late key frame is worth less than the next one.

use std::collections::VecDeque;
use std::os::fd::{AsFd, OwnedFd};

use foreframe_protocol::socket::{Channel, Sent};
use foreframe_protocol::{Body, Packet};

use crate::error::{Error, Result};

/// A daemon that leaves this many messages unread is as good as gone.
const MAX_WAITING: usize = 256;

/// Messages in the order in which they are to be sent.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    waiting: VecDeque<(Packet, Option<OwnedFd>)>,
}

impl Outbox {
    /// Whether something waits until the socket can be written.
    pub(crate) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Sends a message after all those that wait.
    pub(crate) fn post<T: Body>(
        &mut self,
        channel: &Channel,
        body: &T,
        fd: Option<OwnedFd>,
    ) -> Result<()> {
        if self.waiting.len() >= MAX_WAITING {
            return Err(Error::Disconnected);
        }
        self.waiting.push_back((Packet::new(body), fd));
        self.flush(channel)
    }

    /// Sends what there is room for.
    pub(crate) fn flush(&mut self, channel: &Channel) -> Result<()> {
        while let Some((packet, fd)) = self.waiting.front() {
            match channel.send(packet, fd.as_ref().map(AsFd::as_fd))? {
                Sent::Whole => drop(self.waiting.pop_front()),
                Sent::WouldBlock => break,
            }
        }
        Ok(())
    }
}
