//! A subscriber gets frames it can copy, gives their slots back, and believes no bad pool.

use crate::fake_daemon::{FakeDaemon, PATIENCE, connect};
use foreframe_client::{
    Client, ColorFormat, EndReason, Error, Event, OutputFrame, OutputKind, OutputSource, Primaries,
    Transfer,
};
use foreframe_protocol::memory::{SlotMemory, WritablePool};
use foreframe_protocol::socket::Sent;
use foreframe_protocol::{
    ClientMessage, OutputEnded, OutputFrame as FrameMessage, OutputPool, Packet,
};

fn about(pool: u32) -> OutputPool {
    OutputPool {
        stream: 0,
        pool,
        slots: 2,
        width: 3,
        height: 2,
        stride: 16,
        color: ColorFormat::Rgba8,
        transfer: Transfer::Srgb,
        primaries: Primaries::Bt709,
        white_cd_m2: 0.0,
        slot_bytes: 4096,
    }
}

fn frame(pool: u32, slot: u32) -> FrameMessage {
    FrameMessage {
        stream: 0,
        pool,
        slot,
        kind: OutputKind::Synthesised,
        phase_q12: 1365,
        sequence: 12,
        key_index: 4,
        content_time_ns: 1,
        present_at_ns: 2,
        skipped: 0,
    }
}

/// A subscription whose pool has arrived.
fn subscribed() -> (Client, FakeDaemon, Vec<SlotMemory>) {
    let (mut client, mut daemon) = connect();
    client.subscribe(OutputSource::Display, 2).expect("a message is posted");
    assert!(matches!(daemon.next(), Some(ClientMessage::Subscribe(wanted)) if wanted.slots == 2));
    let slots = send_pool(&daemon, 1);
    (client, daemon, slots)
}

fn send_pool(daemon: &FakeDaemon, number: u32) -> Vec<SlotMemory> {
    let (pool, slots) = WritablePool::allocate("test", 2, 4096).expect("a pool");
    let packet = Packet::new(&about(number));
    let sent = daemon.channel.send(&packet, Some(pool.fd())).expect("the client lives");
    assert_eq!(sent, Sent::Whole);
    slots
}

fn next_output(client: &mut Client) -> OutputFrame {
    client.wait(PATIENCE).expect("the daemon lives");
    match client.next_event() {
        Some(Event::Output(frame)) => frame,
        other => panic!("expected an output frame, found {other:?}"),
    }
}

#[test]
fn a_frame_is_copied_without_padding_and_its_slot_goes_back() {
    let (mut client, mut daemon, mut slots) = subscribed();
    for (index, byte) in slots[1][..32].iter_mut().enumerate() {
        *byte = u8::try_from(index).unwrap();
    }
    daemon.send(&frame(1, 1));
    let output = next_output(&mut client);
    assert_eq!((output.width(), output.height(), output.kind()), (3, 2, OutputKind::Synthesised));
    let mut pixels = Vec::new();
    output.copy_to_vec(&mut pixels).unwrap();
    let expected: Vec<u8> = (0..12).chain(16..28).collect();
    assert_eq!(pixels, expected);
    for (first, step, rows) in [
        (0, 2, 0..12),
        (1, 2, 16..28),
        (1, 1, 16..28),
        (0, u32::MAX, 0..12),
        (2, 1, 0..0),
        (u32::MAX, 0, 0..0),
    ] {
        output.copy_rows_to_vec(first, step, &mut pixels).unwrap();
        assert_eq!(pixels, rows.collect::<Vec<u8>>(), "from row {first} in steps of {step}");
    }

    client.dispatch().unwrap();
    assert!(daemon.next().is_none(), "the frame is still held");
    drop(output);
    client.dispatch().unwrap();
    match daemon.next() {
        Some(ClientMessage::OutputReleased(released)) => {
            assert_eq!((released.pool, released.slot), (1, 1));
        }
        other => panic!("expected a release, found {other:?}"),
    }
}

#[test]
fn frames_of_an_older_pool_stay_readable_but_no_new_ones_come_in_it() {
    let (mut client, daemon, mut slots) = subscribed();
    slots[0].fill(7);
    daemon.send(&frame(1, 0));
    let old = next_output(&mut client);
    let _new_slots = send_pool(&daemon, 2);
    daemon.send(&frame(2, 0));
    next_output(&mut client);
    let mut pixels = Vec::new();
    old.copy_to_vec(&mut pixels).unwrap();
    assert!(pixels.iter().all(|&byte| byte == 7));
    daemon.send(&frame(1, 0));
    assert!(matches!(client.dispatch(), Err(Error::Protocol(_))), "that pool is void");
}

#[test]
fn frames_outside_their_pool_end_the_session() {
    for bad in [frame(1, 2), frame(9, 0)] {
        let (mut client, daemon, _slots) = subscribed();
        daemon.send(&bad);
        assert!(matches!(client.dispatch(), Err(Error::Protocol(_))), "{bad:?}");
        assert!(matches!(client.dispatch(), Err(Error::Disconnected)));
    }
}

#[test]
fn a_pool_that_could_fault_is_not_mapped() {
    let (mut client, daemon) = connect();
    let fd = foreframe_protocol::memory::create_memfd("unsealed").unwrap();
    rustix::fs::ftruncate(&fd, 8192).unwrap();
    let packet = Packet::new(&about(1));
    use std::os::fd::AsFd;
    assert_eq!(daemon.channel.send(&packet, Some(fd.as_fd())).unwrap(), Sent::Whole);
    let error = client.dispatch().expect_err("no seals").to_string();
    assert!(error.contains("seals"), "{error}");
}

#[test]
fn the_end_of_the_output_is_an_event() {
    let (mut client, daemon, _slots) = subscribed();
    daemon.send(&OutputEnded { stream: 0, reason: EndReason::SourceEnded });
    client.wait(PATIENCE).unwrap();
    let ended = client.next_event();
    assert!(
        matches!(
            ended,
            Some(Event::OutputEnded {
                source: OutputSource::Display,
                reason: EndReason::SourceEnded
            })
        ),
        "{ended:?}"
    );
}
