//! What waits to be sent to one client.
//!
//! A client that does not read fills its socket. What it has to know then waits here, up to a
//! limit; what is only good to know is left out. Nobody waits for it.

use std::collections::VecDeque;
use std::os::fd::{AsFd as _, OwnedFd};

use foreframe_protocol::socket::{Channel, Sent};
use foreframe_protocol::{DaemonMessage, Error};

/// Messages that may wait. A client that reads has a few; what one can cause without reading is
/// bounded by its slots and requests, so this many mean that it never reads.
const MAX_WAITING: usize = 256;

/// Why a client gets no more messages.
#[derive(Debug)]
pub enum Unsendable {
    /// It has gone.
    Gone(Error),
    /// It does not read.
    NotReading {
        /// Messages that wait for it.
        waiting: usize,
    },
}

/// Messages to one client, in order.
#[derive(Debug, Default)]
pub struct Outbox {
    waiting: VecDeque<(DaemonMessage, Option<OwnedFd>)>,
}

impl Outbox {
    /// Whether something waits for the socket to take more.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Sends a message that the client has to get, now or later.
    ///
    /// # Errors
    /// If the client has gone or too much waits for it.
    pub fn send(
        &mut self,
        channel: &Channel,
        message: DaemonMessage,
        fd: Option<OwnedFd>,
    ) -> Result<(), Unsendable> {
        if self.waiting.len() >= MAX_WAITING {
            return Err(Unsendable::NotReading { waiting: self.waiting.len() });
        }
        self.waiting.push_back((message, fd));
        self.flush(channel)
    }

    /// Sends a message that the client can do without; false if it was left out.
    ///
    /// # Errors
    /// If the client has gone.
    pub fn offer(
        &mut self,
        channel: &Channel,
        message: &DaemonMessage,
    ) -> Result<bool, Unsendable> {
        if self.is_waiting() {
            return Ok(false);
        }
        let sent = channel.send(&message.to_packet(), None).map_err(Unsendable::Gone)?;
        Ok(sent == Sent::Whole)
    }

    /// Sends what waits, as far as the socket takes it.
    ///
    /// # Errors
    /// If the client has gone.
    pub fn flush(&mut self, channel: &Channel) -> Result<(), Unsendable> {
        while let Some((message, fd)) = self.waiting.front() {
            let fd = fd.as_ref().map(|fd| fd.as_fd());
            match channel.send(&message.to_packet(), fd).map_err(Unsendable::Gone)? {
                Sent::Whole => drop(self.waiting.pop_front()),
                Sent::WouldBlock => break,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use foreframe_protocol::socket::Received;
    use foreframe_protocol::{EndReason, Goodbye, StreamCreated};

    use super::*;

    fn message(stream: u32) -> DaemonMessage {
        StreamCreated { stream, slots: 1 }.into()
    }

    fn received(channel: &Channel) -> Vec<DaemonMessage> {
        std::iter::from_fn(|| match channel.receive().unwrap() {
            Received::Packet(packet) => Some(packet.parse_daemon().unwrap().0),
            Received::WouldBlock | Received::Closed => None,
        })
        .collect()
    }

    #[test]
    fn a_client_that_reads_late_gets_everything_in_order() {
        let (daemon, client) = Channel::pair().unwrap();
        let mut outbox = Outbox::default();
        let mut sent = 0;
        while !outbox.is_waiting() {
            sent += 1;
            outbox.send(&daemon, message(sent), None).unwrap();
        }
        let goodbye = DaemonMessage::from(Goodbye { reason: EndReason::Stopping });
        assert!(!outbox.offer(&daemon, &goodbye).unwrap(), "what waits goes first");
        let mut all = received(&client);
        outbox.flush(&daemon).unwrap();
        assert!(!outbox.is_waiting());
        all.extend(received(&client));
        assert_eq!(all, (1..=sent).map(message).collect::<Vec<_>>());
        assert!(outbox.offer(&daemon, &goodbye).unwrap());
    }

    #[test]
    fn a_client_that_never_reads_is_given_up() {
        let (daemon, _client) = Channel::pair().unwrap();
        let mut outbox = Outbox::default();
        let given_up =
            (1..100_000).find_map(|stream| outbox.send(&daemon, message(stream), None).err());
        assert!(matches!(given_up, Some(Unsendable::NotReading { waiting: MAX_WAITING })));
    }

    #[test]
    fn a_client_that_has_gone_is_noticed() {
        let (daemon, client) = Channel::pair().unwrap();
        drop(client);
        let error = Outbox::default().send(&daemon, message(1), None).unwrap_err();
        assert!(matches!(error, Unsendable::Gone(Error::Disconnected)), "{error:?}");
    }
}
