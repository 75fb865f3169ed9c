//! A daemon in the same thread, driven step by step: it answers what a test tells it to.

use std::time::Duration;

use foreframe_client::{Client, ConnectOptions, Handshake, StreamId, StreamOptions};
use foreframe_protocol::limits::MAX_POOL_BYTES;
use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::socket::{Channel, Received, Sent};
use foreframe_protocol::{
    Body, ClientMessage, Clock, Features, GpuKind, Packet, PoolAccepted, ReleaseReason,
    SlotReleased, StreamCreated, Submit, Welcome,
};

/// Long enough to mean that something is wrong when it is used up.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

pub(crate) struct FakeDaemon {
    pub(crate) channel: Channel,
    pub(crate) pool: Option<ReadOnlyPool>,
}

pub(crate) fn welcome() -> Welcome {
    Welcome {
        major: 1,
        minor: 0,
        session: 1,
        features: Features::OUTPUT,
        clock: Clock::Monotonic,
        clock_now_ns: 5,
        max_streams: 4,
        max_slots: 8,
        max_width: 8192,
        max_height: 8192,
        max_pool_bytes: MAX_POOL_BYTES,
        refresh_interval_ns: 8_333_333,
        gpu_kind: GpuKind::Cpu,
        gpu_name: "two cores".to_owned(),
        gpu_pci: None,
    }
}

/// A client whose handshake is done, and the daemon at its other end.
pub(crate) fn connect() -> (Client, FakeDaemon) {
    let (ours, theirs) = Channel::pair().expect("a pair of sockets");
    let mut daemon = FakeDaemon { channel: theirs, pool: None };
    let connecting = ConnectOptions::new("test").start_over(ours).expect("a hello is sent");
    let Handshake::Pending(connecting) = connecting.dispatch().expect("no answer yet") else {
        panic!("the daemon has not answered");
    };
    assert!(matches!(daemon.next(), Some(ClientMessage::Hello(_))));
    daemon.send(&welcome());
    match connecting.dispatch().expect("a welcome") {
        Handshake::Done(client) => (client, daemon),
        Handshake::Pending(_) => panic!("the daemon has answered"),
    }
}

impl FakeDaemon {
    pub(crate) fn send<T: Body>(&self, body: &T) {
        let sent = self.channel.send(&Packet::new(body), None).expect("the client lives");
        assert_eq!(sent, Sent::Whole);
    }

    /// The next message, if one has come; a pool that comes with it is mapped.
    pub(crate) fn next(&mut self) -> Option<ClientMessage> {
        let Received::Packet(incoming) = self.channel.receive().expect("a whole packet") else {
            return None;
        };
        let (message, fd) = incoming.parse_client().expect("a message that a client may send");
        if let (ClientMessage::RegisterPool(register), Some(fd)) = (&message, fd) {
            let bytes = register.pool_bytes();
            self.pool = Some(ReadOnlyPool::accept(fd, bytes, bytes).expect("a sealed pool"));
        }
        Some(message)
    }

    /// Accepts the stream that the client has just asked for.
    pub(crate) fn accept_stream(
        &mut self,
        client: &mut Client,
        options: &StreamOptions,
    ) -> StreamId {
        let id = client.create_stream(options).expect("a stream within the limits");
        let Some(ClientMessage::CreateStream(create)) = self.next() else {
            panic!("expected a create-stream first");
        };
        let Some(ClientMessage::RegisterPool(register)) = self.next() else {
            panic!("expected a pool second");
        };
        self.send(&StreamCreated { stream: create.stream, slots: create.slots });
        self.send(&PoolAccepted { stream: register.stream, pool: register.pool });
        id
    }

    pub(crate) fn next_submit(&mut self) -> Submit {
        match self.next() {
            Some(ClientMessage::Submit(submit)) => submit,
            other => panic!("expected a submit, found {other:?}"),
        }
    }

    pub(crate) fn release(&self, submit: &Submit, reason: ReleaseReason) {
        let Submit { stream, slot, key_index, .. } = *submit;
        self.send(&SlotReleased { stream, slot, key_index, reason });
    }
}
