//! One connected client: its socket, what it has, what it may.
//!
//! A session knows nothing of other sessions and of threads. [`crate::server`] owns them all, acts
//! on their messages, and ends them.

pub mod fault;
pub mod flood;
pub mod handshake;
pub mod outbox;

use std::collections::BTreeMap;
use std::os::fd::OwnedFd;
use std::rc::Rc;
use std::sync::Arc;

use calloop::RegistrationToken;
use foreframe_engine::MonoTime;
use foreframe_protocol::DaemonMessage;
use foreframe_protocol::socket::Channel;

use crate::stream::allocator::Wish;
use crate::stream::outlet::Outlet;
use crate::stream::reaper::Reaped;
use flood::FloodGate;
use outbox::{Outbox, Unsendable};

/// How far a session is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stage {
    /// Connected, no hello yet.
    Connected,
    /// Welcomed.
    Open,
}

/// A subscription to output frames.
#[derive(Debug)]
pub struct Subscription {
    /// What the client calls the stream; 0 for whatever the daemon shows.
    pub stream: u32,
    /// Slots of its pools.
    pub slots: u32,
    /// The stream that it follows at present, by its number in this process, and its pool.
    pub outlet: Option<(u64, Arc<Reaped<Outlet>>)>,
    /// The stream that it will follow, as soon as its pool is allocated.
    pub awaited: Option<AwaitedPool>,
    /// Bytes of the one pool or the other.
    pub cost: u64,
}

impl Subscription {
    /// The stream that it follows or will follow.
    #[must_use]
    pub fn followed(&self) -> Option<u64> {
        let awaited = self.awaited.as_ref().map(|awaited| awaited.ordinal);
        self.outlet.as_ref().map(|(ordinal, _)| *ordinal).or(awaited)
    }
}

/// A pool that is being allocated.
#[derive(Debug)]
pub struct AwaitedPool {
    /// The stream that it is for, by its number in this process.
    pub ordinal: u64,
    /// Its number in the session.
    pub pool: u32,
    /// Says that it is wanted as long as this lives.
    pub wish: Wish,
}

/// A connected client.
#[derive(Debug)]
pub struct Session {
    /// Number of the session in this process.
    pub id: u32,
    /// Its socket.
    pub channel: Rc<Channel>,
    /// How far it is.
    pub stage: Stage,
    /// The GPU adapter that makes its pictures, by its index; None is the CPU.
    pub adapter: Option<usize>,
    /// How much it may ask for.
    pub gate: FloodGate,
    /// Its streams: numbers of the process by numbers of the client. One that ends stays until its
    /// thread has ended.
    pub streams: BTreeMap<u32, u64>,
    /// Highest number that the client has given a stream.
    pub last_stream: u32,
    /// Its subscriptions.
    pub subscriptions: Vec<Subscription>,
    /// Highest number of an output pool.
    pub last_output_pool: u32,
    /// Bytes that its streams and output pools cost.
    pub cost: u64,
    /// Where the main loop watches the socket.
    pub watch: Option<RegistrationToken>,
    /// Whether it also watches for room in the socket.
    pub watches_for_room: bool,
    /// The timer that ends a session without hello.
    pub deadline: Option<RegistrationToken>,
    outbox: Outbox,
}

impl Session {
    /// A client that has just connected.
    #[must_use]
    pub fn new(id: u32, channel: Channel, now: MonoTime) -> Self {
        Self {
            id,
            channel: Rc::new(channel),
            stage: Stage::Connected,
            adapter: None,
            gate: FloodGate::new(now),
            streams: BTreeMap::new(),
            last_stream: 0,
            subscriptions: Vec::new(),
            last_output_pool: 0,
            cost: 0,
            watch: None,
            watches_for_room: false,
            deadline: None,
            outbox: Outbox::default(),
        }
    }

    /// Sends what the client has to get, now or when it reads again.
    ///
    /// # Errors
    /// If it has gone, or never reads.
    pub fn send(&mut self, message: impl Into<DaemonMessage>) -> Result<(), Unsendable> {
        self.outbox.send(&self.channel, message.into(), None)
    }

    /// As [`send`](Self::send), with a descriptor.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn send_with_fd(
        &mut self,
        message: impl Into<DaemonMessage>,
        fd: OwnedFd,
    ) -> Result<(), Unsendable> {
        self.outbox.send(&self.channel, message.into(), Some(fd))
    }

    /// Sends what the client can do without, unless it is behind; false if it was left out.
    ///
    /// # Errors
    /// If it has gone.
    pub fn offer(&mut self, message: impl Into<DaemonMessage>) -> Result<bool, Unsendable> {
        self.outbox.offer(&self.channel, &message.into())
    }

    /// Sends what waits, as far as the socket takes it.
    ///
    /// # Errors
    /// If it has gone.
    pub fn flush(&mut self) -> Result<(), Unsendable> {
        self.outbox.flush(&self.channel)
    }

    /// Whether messages wait for the socket to take more.
    #[must_use]
    pub fn is_behind(&self) -> bool {
        self.outbox.is_waiting()
    }

    /// The subscription under this number of the client's.
    #[must_use]
    pub fn subscription(&mut self, stream: u32) -> Option<&mut Subscription> {
        self.subscriptions.iter_mut().find(|subscription| subscription.stream == stream)
    }
}
