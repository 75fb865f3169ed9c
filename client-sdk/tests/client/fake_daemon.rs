//! A daemon in the same thread, driven step by step: it answers what a test tells it to.
//!
//! The tests of the demonstration client use it, too.

#![allow(dead_code, reason = "each test program uses its own part")]

use std::time::Duration;

use foreframe_client::{Client, ConnectOptions, Handshake, StreamId, StreamOptions};
use foreframe_protocol::limits::MAX_POOL_BYTES;
use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::socket::{Channel, Received, Sent};
use foreframe_protocol::{
    Body, ClientMessage, Clock, CreateStream, Features, GpuKind, Packet, PlaneDescriptor,
    PlaneKind, PoolAccepted, RegisterPool, ReleaseReason, SlotReleased, StreamCreated, Submit,
    Welcome,
};

/// Long enough to mean that something is wrong when it is used up.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

pub(crate) struct FakeDaemon {
    pub(crate) channel: Channel,
    pub(crate) pool: Option<ReadOnlyPool>,
    /// Of the stream that was accepted last.
    pub(crate) stream: Option<(CreateStream, RegisterPool)>,
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
    let mut daemon = FakeDaemon { channel: theirs, pool: None, stream: None };
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
        self.stream = Some((create, register));
        id
    }

    pub(crate) fn next_submit(&mut self) -> Submit {
        self.submit_if_any().expect("a submit")
    }

    pub(crate) fn submit_if_any(&mut self) -> Option<Submit> {
        match self.next()? {
            ClientMessage::Submit(submit) => Some(submit),
            other => panic!("expected a submit, found {other:?}"),
        }
    }

    /// The bytes of a plane, row by row without padding.
    pub(crate) fn plane(&self, submit: &Submit, kind: PlaneKind, pixel_bytes: u32) -> Vec<u8> {
        let PlaneDescriptor { offset, stride, width, height, .. } =
            *submit.planes.get(kind).expect("a plane that the stream declares");
        let (_, register) = self.stream.as_ref().expect("a stream was accepted");
        let offset = u64::from(submit.slot) * register.slot_bytes + offset;
        let pool = self.pool.as_ref().expect("its pool came with it");
        let mut bytes = Vec::new();
        pool.copy_rows_to_vec(offset, stride, width * pixel_bytes, height, &mut bytes)
            .expect("a plane inside its slot");
        bytes
    }

    pub(crate) fn release(&self, submit: &Submit, reason: ReleaseReason) {
        let Submit { stream, slot, key_index, .. } = *submit;
        self.send(&SlotReleased { stream, slot, key_index, reason });
    }
}
