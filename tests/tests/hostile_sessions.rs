//! Clients that break the rules: each ends its own session with a message that says why, and the
//! daemon and another client go on.

#![allow(clippy::unwrap_used, reason = "a helper that cannot go on fails its test")]

mod daemon_fixture;

use daemon_fixture::{Client, KeySource, RunningDaemon};
use foreframe_protocol::message::{EXTENSION_IS_CRITICAL, MessageKind, Packet};
use foreframe_protocol::socket::Sent;
use foreframe_protocol::{
    Body as _, ClientMessage, CreateStream, DaemonMessage, DestroyStream, ErrorCode, ErrorMessage,
    Features, Goodbye, Hello, OutputReleased, PlaneKind, Reject, RejectCode, ReleaseReason,
    StreamCreated, StreamFormat, Submit,
};

/// A well-behaved client beside a hostile one.
struct Witness {
    client: Client,
    source: KeySource,
}

impl Witness {
    fn new(daemon: &RunningDaemon) -> Self {
        let mut client = daemon.connect();
        let source = client.open_stream(1, 8, 8);
        Self { client, source }
    }

    /// Its keys still come to the display.
    fn goes_on(&mut self) {
        let submit = self.client.submit(&mut self.source, [7; 4]);
        self.client.expect_presented(&submit);
    }
}

/// What an attack is called, the error that answers it, and the attack.
type Attack<'a> = (&'a str, ErrorCode, &'a dyn Fn(&mut Client));

/// Runs one attack per line on a connection of its own, and expects a fatal error of this kind.
fn expect_fatal(attacks: &[Attack<'_>]) {
    let daemon = RunningDaemon::start("shm");
    let mut witness = Witness::new(&daemon);
    for (name, code, attack) in attacks {
        let mut client = daemon.connect();
        attack(&mut client);
        let error = fatal_error(name, client);
        assert_eq!(error.code, *code, "{name}: {error:?}");
        assert!(!error.expected.is_empty() && !error.found.is_empty(), "{name}: {error:?}");
        witness.goes_on();
    }
}

fn fatal_error(name: &str, mut client: Client) -> ErrorMessage {
    let said = client.read_to_end();
    let error = said.iter().find_map(|message| match message {
        DaemonMessage::Error(error) if error.is_fatal => Some(error.clone()),
        _ => None,
    });
    error.unwrap_or_else(|| panic!("{name}: no fatal error in {said:?}"))
}

fn send_raw(client: &Client, bytes: &[u8]) {
    assert_eq!(client.channel.send_bytes(bytes, &[]).unwrap(), Sent::Whole);
}

fn create(stream: u32) -> CreateStream {
    let format = StreamFormat::rgba8(8, 8);
    CreateStream { stream, format, max_sizes: format.full_sizes(), slots: 3 }
}

/// A packet of a good message with one byte changed.
fn with_byte(message: impl Into<ClientMessage>, at: usize, value: u8) -> Vec<u8> {
    let mut bytes = message.into().to_packet().as_bytes().to_vec();
    bytes[at] = value;
    bytes
}

#[test]
fn malformed_packets_end_the_session_with_what_was_expected_and_found() {
    let destroy = DestroyStream { stream: 1 };
    let whole = ClientMessage::from(destroy).to_packet().as_bytes().to_vec();
    let extended = |tag: u16| {
        let mut body = destroy.to_bytes();
        body.extend(tag.to_le_bytes());
        body.extend(0_u16.to_le_bytes());
        Packet::from_body_bytes(MessageKind::DestroyStream, &body).as_bytes().to_vec()
    };
    let message = ErrorCode::Message;
    expect_fatal(&[
        ("one byte", message, &|it| send_raw(it, &[1])),
        ("other magic", message, &|it| send_raw(it, &with_byte(destroy, 0, b'X'))),
        ("other major", message, &|it| send_raw(it, &with_byte(destroy, 4, 9))),
        ("unknown type", message, &|it| send_raw(it, &with_byte(destroy, 6, 250))),
        ("wrong length", message, &|it| send_raw(it, &with_byte(destroy, 8, 99))),
        ("reserved bits", message, &|it| send_raw(it, &with_byte(destroy, 12, 1))),
        ("reserved field", message, &|it| send_raw(it, &with_byte(destroy, 20, 1))),
        ("cut off", message, &|it| send_raw(it, &whole[..whole.len() - 1])),
        ("half a body", message, &|it| {
            send_raw(it, Packet::from_body_bytes(MessageKind::DestroyStream, &[1]).as_bytes());
        }),
        ("too long", message, &|it| send_raw(it, &[0x46; 2000])),
        ("critical extension", message, &|it| send_raw(it, &extended(EXTENSION_IS_CRITICAL | 5))),
        ("broken extension", message, &|it| {
            let mut body = destroy.to_bytes();
            body.extend([1, 0, 200, 0]);
            send_raw(it, Packet::from_body_bytes(MessageKind::DestroyStream, &body).as_bytes());
        }),
        ("a daemon's message", message, &|it| {
            let created = StreamCreated { stream: 1, slots: 1 };
            send_raw(it, DaemonMessage::from(created).to_packet().as_bytes());
        }),
        ("a descriptor too many", message, &|it| {
            let packet = ClientMessage::from(destroy).to_packet();
            let fd = daemon_fixture::duplicate(&it.channel);
            let fds = [std::os::fd::AsFd::as_fd(&fd)];
            assert_eq!(it.channel.send_bytes(packet.as_bytes(), &fds).unwrap(), Sent::Whole);
        }),
        ("a pool without a descriptor", message, &|it| {
            let source = KeySource::new(create(1));
            it.send(create(1));
            it.send(source.register);
        }),
    ]);
}

#[test]
fn an_unknown_optional_extension_is_skipped() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut body = create(1).to_bytes();
    body.extend([5, 0, 4, 0, 1, 2, 3, 4]);
    send_raw(&client, Packet::from_body_bytes(MessageKind::CreateStream, &body).as_bytes());
    client.expect("stream created", |message| {
        matches!(message, DaemonMessage::StreamCreated(_)).then_some(())
    });
}

#[test]
fn messages_out_of_turn_end_the_session() {
    expect_fatal(&[
        ("a second hello", ErrorCode::State, &|it| it.send(Hello::new("again"))),
        ("a stream that never was", ErrorCode::Unknown, &|it| it.send(DestroyStream { stream: 3 })),
        ("a stream number again", ErrorCode::Order, &|it| {
            it.send(create(2));
            it.send(create(2));
        }),
        ("a key without a pool", ErrorCode::State, &|it| {
            it.send(create(1));
            it.send(KeySource::new(create(1)).fill([0; 4]));
        }),
        ("a second pool", ErrorCode::State, &|it| {
            let source = it.open_stream(1, 8, 8);
            it.register(&source);
        }),
        ("a pool with other slots", ErrorCode::Message, &|it| {
            it.send(create(1));
            let source = KeySource::new(CreateStream { slots: 2, ..create(1) });
            it.register(&source);
        }),
        ("an output slot that holds nothing", ErrorCode::State, &|it| {
            it.open_stream(1, 8, 8);
            let screen = it.subscribe(1, 2);
            it.send(OutputReleased { pool: screen.pool.pool, slot: 1 });
        }),
        ("an output pool that never was", ErrorCode::Unknown, &|it| {
            it.send(OutputReleased { pool: 4, slot: 0 });
        }),
    ]);
}

/// Opens a stream, submits one good key, then one that `change` has changed.
fn submit_changed(client: &mut Client, change: impl Fn(&mut Submit)) {
    let mut source = client.open_stream(1, 8, 8);
    client.submit(&mut source, [1; 4]);
    let mut submit = source.fill([2; 4]);
    change(&mut submit);
    client.send(submit);
}

#[test]
fn keys_out_of_order_or_in_foreign_slots_end_the_session() {
    expect_fatal(&[
        ("content time backwards", ErrorCode::Order, &|it| {
            submit_changed(it, |submit| submit.content_time_ns = 5);
        }),
        ("key index again", ErrorCode::Order, &|it| {
            submit_changed(it, |submit| submit.key_index = 0);
        }),
        ("a slot beyond the pool", ErrorCode::Message, &|it| {
            submit_changed(it, |submit| submit.slot = 3);
        }),
        ("a stream that never was", ErrorCode::Unknown, &|it| {
            submit_changed(it, |submit| submit.stream = 9);
        }),
        ("motion from the future", ErrorCode::Message, &|it| {
            submit_changed(it, |submit| submit.motion_from_ns = Some(submit.content_time_ns));
        }),
        ("a matrix with NaN", ErrorCode::Message, &|it| {
            submit_changed(it, |submit| {
                let matrix = [f32::NAN; 16];
                let camera = foreframe_protocol::Camera { view: matrix, projection: matrix };
                submit.camera = Some(camera);
            });
        }),
        ("a jitter of a whole screen", ErrorCode::Plane, &|it| {
            submit_changed(it, |submit| {
                submit.planes.get_mut(PlaneKind::Color).unwrap().jitter = [1e9, 0.0];
            });
        }),
    ]);
}

#[test]
fn a_key_whose_planes_do_not_fit_is_refused_and_the_session_goes_on() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    let changes: [fn(&mut Submit); 4] = [
        |submit| submit.planes.get_mut(PlaneKind::Color).unwrap().offset = 1 << 40,
        |submit| submit.planes.get_mut(PlaneKind::Color).unwrap().stride = 4,
        |submit| {
            let plane = submit.planes.get_mut(PlaneKind::Color).unwrap();
            (plane.width, plane.valid.width) = (4, 4);
        },
        |submit| submit.planes.get_mut(PlaneKind::Color).unwrap().stride = 130_000,
    ];
    for change in changes {
        let mut submit = source.fill([3; 4]);
        change(&mut submit);
        client.send(submit);
        let error = client.expect_error();
        assert!(!error.is_fatal && error.code == ErrorCode::Plane, "{error:?}");
        assert!(matches!(client.expect_released(&submit), ReleaseReason::Refused));
    }
    let submit = client.submit(&mut source, [4; 4]);
    client.expect_presented(&submit);
}

fn rejection(client: &mut Client) -> Reject {
    let said = client.read_to_end();
    match said.as_slice() {
        [DaemonMessage::Reject(reject)] => reject.clone(),
        other => panic!("expected one reject, found {other:?}"),
    }
}

#[test]
fn who_does_not_say_hello_properly_is_rejected_with_the_reason() {
    let daemon = RunningDaemon::start("shm");
    let mut witness = Witness::new(&daemon);
    let hello = Hello::new("x");
    let attempts: [(RejectCode, Vec<u8>); 5] = [
        (RejectCode::Version, with_byte(hello.clone(), 4, 2)),
        (RejectCode::Version, with_byte(hello.clone(), 16, 2)),
        (RejectCode::Malformed, with_byte(hello.clone(), 0, 0)),
        (
            RejectCode::Malformed,
            ClientMessage::from(DestroyStream { stream: 1 }).to_packet().as_bytes().to_vec(),
        ),
        (RejectCode::Feature, {
            let hello = Hello { required_features: Features(1 << 60), ..hello };
            ClientMessage::from(hello).to_packet().as_bytes().to_vec()
        }),
    ];
    for (code, packet) in attempts {
        let mut client = Client::connect_silently(&daemon.socket);
        send_raw(&client, &packet);
        let reject = rejection(&mut client);
        assert_eq!(reject.code, Some(code), "{reject:?}");
        assert!(reject.text.contains("expected") && reject.text.contains("found"), "{reject:?}");
        witness.goes_on();
    }
    let mut silent = Client::connect_silently(&daemon.socket);
    assert_eq!(rejection(&mut silent).code, Some(RejectCode::Timeout));
    witness.goes_on();
}

#[test]
fn more_clients_than_allowed_are_rejected_until_one_leaves() {
    let args = foreframed::Args { max_clients: Some(2), ..Default::default() };
    let daemon = RunningDaemon::start_with("shm", args);
    let mut first = daemon.connect();
    let _second = daemon.connect();
    let mut third = Client::connect_silently(&daemon.socket);
    assert_eq!(rejection(&mut third).code, Some(RejectCode::Sessions));
    first.send(Goodbye { reason: foreframe_protocol::EndReason::Requested });
    assert!(first.receive().is_none(), "the daemon hangs up after a goodbye");
    daemon.connect();
}

#[test]
fn a_flood_ends_the_session_that_makes_it() {
    let daemon = RunningDaemon::start("shm");
    let mut witness = Witness::new(&daemon);
    let flooder = daemon.connect();
    let packet = ClientMessage::from(create(1)).to_packet();
    let late = ClientMessage::from(foreframe_protocol::LateCamera {
        stream: 1,
        content_time_ns: 1,
        view: std::array::from_fn(|index| if index % 5 == 0 { 1.0 } else { 0.0 }),
    });
    assert_eq!(flooder.channel.send(&packet, None).unwrap(), Sent::Whole);
    // Until the daemon hangs up.
    let mut taken = 0;
    while let Ok(sent) = flooder.channel.send(&late.to_packet(), None) {
        taken += u32::from(sent == Sent::Whole);
        assert!(taken < 200_000, "far more than the bucket holds, and nobody minds");
    }
    let error = fatal_error("flood", flooder);
    assert_eq!(error.code, ErrorCode::Quota);
    witness.goes_on();
}

#[test]
fn a_client_that_never_reads_does_not_disturb_the_others() {
    let daemon = RunningDaemon::start("shm");
    let mut witness = Witness::new(&daemon);
    let mut deaf = daemon.connect();
    let mut source = deaf.open_stream(1, 8, 8);
    for _ in 0..200 {
        deaf.send(source.fill([1; 4]));
        witness.goes_on();
    }
}

#[test]
fn a_client_that_scribbles_over_its_slots_spoils_nothing_but_its_picture() {
    let daemon = RunningDaemon::start("shm");
    let mut witness = Witness::new(&daemon);
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 256, 256);
    for round in 0..30_u8 {
        let submit = source.fill([round; 4]);
        client.send(submit);
        let slot = submit.slot as usize;
        source.slots[slot].fill(round ^ 0xff);
        client.expect_released(&submit);
    }
    witness.goes_on();
}

#[test]
fn keys_faster_than_they_can_be_taken_are_superseded_and_every_one_is_accounted_for() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 512, 512);
    let mut last = None;
    for _ in 0..40 {
        let burst: Vec<_> = (0..3).map(|_| source.fill([5; 4])).collect();
        for submit in &burst {
            client.send(*submit);
        }
        let reasons = burst.iter().map(|submit| client.expect_released(submit));
        let reasons: Vec<_> = reasons.collect();
        let (newest, older) = reasons.split_last().unwrap();
        // Nothing came after it that could have replaced it.
        assert!(matches!(newest, ReleaseReason::Copied), "{reasons:?}");
        let is_fair = |it| matches!(it, &ReleaseReason::Copied | &ReleaseReason::Superseded);
        assert!(older.iter().all(is_fair), "{reasons:?}");
        last = burst.last().copied();
    }
    client.expect_presented(&last.unwrap());
    client.send(DestroyStream { stream: 1 });
    client.expect("the stream's end", |message| {
        matches!(message, DaemonMessage::StreamEnded(_)).then_some(())
    });
    let told = client.take_waiting();
    let counts = told.iter().rev().find_map(|message| match message {
        DaemonMessage::Statistics(counts) => Some(*counts),
        _ => None,
    });
    let counts = counts.expect("the last counts");
    let is_presented = |message: &&DaemonMessage| matches!(message, DaemonMessage::Presented(_));
    let presented = 1 + told.iter().filter(is_presented).count() as u64;
    assert_eq!((counts.keys_received, counts.keys_refused), (120, 0), "{counts:?}");
    assert_eq!(presented + counts.keys_superseded, 120, "{presented} shown, {counts:?}");
}

#[test]
fn a_stream_that_costs_more_than_is_granted_is_refused_and_a_smaller_one_is_not() {
    let args = foreframed::Args { memory_mb: Some(16), ..Default::default() };
    let daemon = RunningDaemon::start_with("shm", args);
    let mut client = daemon.connect();
    let format = StreamFormat::rgba8(4096, 4096);
    client.send(CreateStream { format, max_sizes: format.full_sizes(), ..create(1) });
    let error = client.expect_error();
    assert!(!error.is_fatal && error.code == ErrorCode::Quota, "{error:?}");
    assert!(error.expected.contains("--memory-mb"), "{error:?}");
    client.open_stream(2, 64, 64);
}
