//! Subscriptions: who gets which output frames.
//!
//! A client follows a stream of its own, or whatever the daemon shows: the stream that started last
//! and has not ended. When that changes, the subscriber gets a pool of the new size.

use std::sync::Arc;

use foreframe_protocol::{EndReason, ErrorCode, OutputEnded, Subscribe};

use super::Server;
use super::requests::quota_fault;
use crate::session::fault::Fault;
use crate::session::{AwaitedPool, Subscription};
use crate::stream::allocator::{AllocatedPool, PoolRequest, Wish};
use crate::stream::mailbox::Outlets;
use crate::stream::outlet;

impl Server {
    pub(super) fn subscribe(&mut self, id: u32, subscribe: Subscribe) -> Result<(), Fault> {
        let Subscribe { stream: number, slots } = subscribe;
        if !self.terms.features.contains(foreframe_protocol::Features::OUTPUT) {
            let expected = "a daemon that was not started with --sink null";
            let fault = Fault::fatal(ErrorCode::Unsupported, "subscribe", expected, "--sink null");
            return Err(fault.tolerated().of_stream(number));
        }
        let ordinal = if number == 0 {
            self.shown_stream()
        } else {
            self.stream_of(id, number)?;
            self.open_session(id)?.streams.get(&number).copied()
        };
        let session = self.open_session(id)?;
        if session.subscription(number).is_some() {
            let expected = "one subscription per stream";
            let fault = Fault::fatal(ErrorCode::State, "subscribe", expected, "another");
            return Err(fault.of_stream(number));
        }
        let subscription =
            Subscription { stream: number, slots, outlet: None, awaited: None, cost: 0 };
        session.subscriptions.push(subscription);
        self.follow(id, number, ordinal);
        Ok(())
    }

    pub(super) fn unsubscribe(&mut self, id: u32, number: u32) -> Result<(), Fault> {
        if self.open_session(id)?.subscription(number).is_none() {
            // It may have ended with its stream a moment ago.
            let expected = "a subscription to this stream";
            let fault = Fault::fatal(ErrorCode::Unknown, "unsubscribe", expected, number);
            return Err(fault.tolerated().of_stream(number));
        }
        self.end_subscription(id, number, EndReason::Requested);
        Ok(())
    }

    /// The stream that started last and has not ended.
    fn shown_stream(&self) -> Option<u64> {
        self.streams.iter().rev().find(|(_, stream)| !stream.is_closed()).map(|(&it, _)| it)
    }

    /// Points whoever wants what the daemon shows at what it shows now.
    pub(super) fn follow_shown_stream(&mut self) {
        let shown = self.shown_stream();
        let followers: Vec<u32> = self.sessions.keys().copied().collect();
        for id in followers {
            let Some(session) = self.sessions.get_mut(&id) else { continue };
            let Some(subscription) = session.subscription(0) else { continue };
            if subscription.followed() != shown {
                self.follow(id, 0, shown);
            }
        }
    }

    /// A stream is gone: so are the subscriptions that were to it alone.
    pub(super) fn on_source_ended(
        &mut self,
        ordinal: u64,
        session: u32,
        number: u32,
        reason: EndReason,
    ) {
        let reason = match reason {
            EndReason::Stopping => EndReason::Stopping,
            _ => EndReason::SourceEnded,
        };
        let Some(owner) = self.sessions.get_mut(&session) else { return };
        let subscription = owner.subscription(number);
        if subscription.is_some_and(|it| it.followed() == Some(ordinal)) {
            self.end_subscription(session, number, reason);
        }
    }

    /// Gives a subscription a pool for this stream, or none. The pool comes when it is allocated.
    fn follow(&mut self, id: u32, number: u32, ordinal: Option<u64>) {
        let before = self.detach(id, number);
        if let Some(before) = before {
            self.refresh_outlets(before);
        }
        let Some(ordinal) = ordinal else { return };
        if let Err(fault) = self.request_pool(id, number, ordinal) {
            self.fail(id, fault.tolerated().of_stream(number));
            self.end_subscription(id, number, EndReason::Error);
        }
    }

    /// Takes the pool of a subscription away. Gives the stream that it followed.
    fn detach(&mut self, id: u32, number: u32) -> Option<u64> {
        let session = self.sessions.get_mut(&id)?;
        let subscription = session.subscription(number)?;
        let followed = subscription.followed();
        let cost = std::mem::take(&mut subscription.cost);
        subscription.outlet = None;
        subscription.awaited = None;
        session.cost = session.cost.saturating_sub(cost);
        followed
    }

    fn request_pool(&mut self, id: u32, number: u32, ordinal: u64) -> Result<(), Fault> {
        let memory_per_client = self.config.memory_per_client;
        let Some(format) = self.streams.get(&ordinal).map(|stream| stream.create.format) else {
            return Ok(());
        };
        let session = self.open_session(id)?;
        let used = session.cost;
        let pool = session.last_output_pool + 1;
        let Some(subscription) = session.subscription(number) else { return Ok(()) };
        let slots = subscription.slots;
        let cost = outlet::pool_bytes(&format, slots);
        if used.saturating_add(cost) > memory_per_client {
            return Err(quota_fault("subscribe", memory_per_client, used, cost));
        }
        let wish = Wish::default();
        let wanted = Arc::downgrade(&wish);
        subscription.awaited = Some(AwaitedPool { ordinal, pool, wish });
        subscription.cost = cost;
        session.last_output_pool = pool;
        session.cost += cost;
        let stream = number;
        let request = PoolRequest { session: id, stream, pool, slots, format, wish: wanted };
        self.allocator.request(request);
        Ok(())
    }

    /// Puts a pool into use, unless its subscription has changed its mind meanwhile.
    pub(super) fn on_allocated(&mut self, allocated: AllocatedPool) {
        let AllocatedPool { session: id, stream: number, pool, made } = allocated;
        let reaper = self.reaper.clone();
        // What is not wanted any more is unmapped elsewhere, too.
        let made = made.map(|(outlet, message, fd)| (reaper.guard(outlet), message, fd));
        let Some(session) = self.sessions.get_mut(&id) else { return };
        let Some(subscription) = session.subscription(number) else { return };
        let Some(awaited) = subscription.awaited.take_if(|awaited| awaited.pool == pool) else {
            return;
        };
        match made {
            Ok((outlet, message, fd)) => {
                subscription.outlet = Some((awaited.ordinal, Arc::new(outlet)));
                let sent = session.send_with_fd(message, fd);
                self.after_send(id, sent);
                self.refresh_outlets(awaited.ordinal);
            }
            Err(error) => {
                self.fail(id, Fault::from(error).tolerated().of_stream(number));
                self.end_subscription(id, number, EndReason::Error);
            }
        }
    }

    fn end_subscription(&mut self, id: u32, number: u32, reason: EndReason) {
        let followed = self.detach(id, number);
        let Some(session) = self.sessions.get_mut(&id) else { return };
        session.subscriptions.retain(|subscription| subscription.stream != number);
        self.send(id, OutputEnded { stream: number, reason });
        if let Some(ordinal) = followed {
            self.refresh_outlets(ordinal);
        }
    }

    /// Tells a stream's thread who gets its frames.
    pub(super) fn refresh_outlets(&self, ordinal: u64) {
        let Some(stream) = self.streams.get(&ordinal) else { return };
        let subscriptions = self.sessions.values().flat_map(|session| &session.subscriptions);
        let outlets: Outlets = subscriptions
            .filter_map(|subscription| subscription.outlet.as_ref())
            .filter(|(followed, _)| *followed == ordinal)
            .map(|(_, outlet)| Arc::clone(outlet))
            .collect();
        stream.mailbox.set_outlets(outlets);
    }
}
