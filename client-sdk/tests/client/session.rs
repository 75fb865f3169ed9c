//! What an application meets while the daemon works, lags, errs and dies.

use std::time::Duration;

use crate::fake_daemon::{PATIENCE, connect};
use foreframe_client::{
    ConnectOptions, Error, Event, Key, PlaneKind, ReleaseReason, StreamOptions, StreamState,
};
use foreframe_protocol::socket::{Channel, Listener};
use foreframe_protocol::{
    ErrorCode, ErrorMessage, Packet, Reject, RejectCode, SlotReleased, Statistics,
};

const MS: u64 = 1_000_000;

#[test]
fn key_frame_arrives_with_its_pixels_and_its_slot_comes_back() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2).slots(2));
    let mut frame = client.acquire(stream).unwrap();
    frame.color_mut().bytes.copy_from_slice(&[7; 4 * 2 * 4]);
    client.submit(frame, Key::new(3, 10 * MS)).unwrap();

    let submit = daemon.next_submit();
    assert_eq!((submit.key_index, submit.content_time_ns), (3, 10 * MS));
    let color = submit.planes.get(PlaneKind::Color).unwrap();
    let slot_bytes = 4096;
    let mut pixels = [0; 33];
    let start = u64::from(submit.slot) * slot_bytes + color.offset;
    daemon.pool.as_ref().unwrap().copy_to(start, &mut pixels).unwrap();
    assert_eq!(pixels[..32], [7; 32]);
    assert_eq!(pixels[32], 0, "nothing behind the plane was written");

    daemon.release(&submit, ReleaseReason::Copied);
    client.dispatch().unwrap();
    assert_eq!(client.stream_state(stream), StreamState::Ready);
    let held = [client.acquire(stream).unwrap(), client.acquire(stream).unwrap()];
    assert_eq!(held.len(), 2, "both slots are free again");
}

#[test]
fn without_a_free_slot_the_key_is_skipped_and_counted() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2).slots(2));
    for index in 0..2 {
        let frame = client.acquire(stream).unwrap();
        client.submit(frame, Key::new(index, (index + 1) * MS)).unwrap();
    }
    assert!(matches!(client.acquire(stream), Err(Error::WouldBlock)));
    assert!(matches!(client.acquire(stream), Err(Error::WouldBlock)));
    assert_eq!(client.skipped_keys(stream), 2);

    let submit = daemon.next_submit();
    daemon.release(&submit, ReleaseReason::Superseded);
    client.dispatch().unwrap();
    let frame = client.acquire(stream).expect("the slot came back");
    client.submit(frame, Key::new(5, 5 * MS)).unwrap();
    assert_eq!(client.skipped_keys(stream), 2, "a key that fits is not counted");
}

#[test]
fn a_daemon_that_does_not_read_costs_keys_but_no_wait() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2).slots(1));
    let mut unread = 0_u64;
    let identity = std::array::from_fn(|index| if index % 5 == 0 { 1.0 } else { 0.0 });
    while client.late_camera(stream, unread, identity).is_ok() {
        unread += 1;
        assert!(unread < 1_000_000, "a socket takes no more than its buffer");
    }
    let frame = client.acquire(stream).unwrap();
    assert!(matches!(client.submit(frame, Key::new(0, MS)), Err(Error::WouldBlock)));
    assert_eq!(client.skipped_keys(stream), 1);

    while daemon.next().is_some() {}
    let frame = client.acquire(stream).expect("the slot is free again");
    client.submit(frame, Key::new(0, MS)).expect("the key that was skipped never came");
}

#[test]
fn a_frame_that_is_dropped_gives_its_slot_back() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2).slots(1));
    drop(client.acquire(stream).unwrap());
    let frame = client.acquire(stream).expect("the only slot is free again");
    // On another thread too, as a frame that is filled there.
    std::thread::spawn(move || drop(frame)).join().unwrap();
    client.acquire(stream).expect("the only slot is free again");
    assert!(daemon.next().is_none(), "the daemon hears nothing of it");
}

#[test]
fn a_dead_daemon_costs_one_error() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2));
    let frame = client.acquire(stream).unwrap();
    drop(daemon);
    assert!(matches!(client.submit(frame, Key::new(0, MS)), Err(Error::Disconnected)));
    assert!(matches!(client.acquire(stream), Err(Error::Disconnected)));
    assert!(matches!(client.dispatch(), Err(Error::Disconnected)));
    assert!(matches!(client.wait(PATIENCE), Err(Error::Disconnected)));
}

#[test]
fn what_a_dying_daemon_said_last_is_still_read() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2));
    daemon.send(&Statistics { stream: stream.number(), keys_received: 9, ..Default::default() });
    drop(daemon);
    assert!(matches!(client.dispatch(), Err(Error::Disconnected)));
    assert_eq!(client.statistics(stream).unwrap().keys_received, 9);
}

#[test]
fn keys_that_do_not_get_newer_are_refused_here_and_not_sent() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2));
    let frame = client.acquire(stream).unwrap();
    client.submit(frame, Key::new(1, 10 * MS)).unwrap();
    daemon.next_submit();
    for key in [Key::new(1, 11 * MS), Key::new(2, 10 * MS), Key::new(2, 9 * MS)] {
        let frame = client.acquire(stream).unwrap();
        let refused = client.submit(frame, key).expect_err("time runs backwards").to_string();
        assert!(refused.contains("expected more than"), "{refused}");
    }
    assert!(daemon.next().is_none());
    let frame = client.acquire(stream).unwrap();
    client.submit(frame, Key::new(2, 11 * MS)).expect("a refused key changes nothing");
}

#[test]
fn a_fatal_error_ends_the_session_and_says_why() {
    let (mut client, daemon) = connect();
    daemon.send(&ErrorMessage {
        code: ErrorCode::Quota,
        is_fatal: true,
        stream: None,
        field: "quota".to_owned(),
        expected: "at most 1 byte".to_owned(),
        found: "2 bytes".to_owned(),
    });
    let error = client.wait(PATIENCE).expect_err("the session is over").to_string();
    assert!(error.contains("at most 1 byte") && error.contains("2 bytes"), "{error}");
    assert!(matches!(client.dispatch(), Err(Error::Disconnected)));
}

#[test]
fn a_daemon_that_releases_what_it_does_not_have_is_not_believed() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2));
    daemon.send(&SlotReleased {
        stream: stream.number(),
        slot: 0,
        key_index: 1,
        reason: ReleaseReason::Copied,
    });
    assert!(matches!(client.dispatch(), Err(Error::Protocol(_))));
}

#[test]
fn a_rejected_client_learns_both_versions() {
    let (ours, theirs) = Channel::pair().unwrap();
    let connecting = ConnectOptions::new("test").start_over(ours).unwrap();
    let reject = Reject {
        code: Some(RejectCode::Version),
        major_min: 7,
        major_max: 9,
        minor_max: 3,
        text: "expected major 7 to 9, found 1".to_owned(),
    };
    // As a daemon of another major would send it.
    let mut packet = Packet::new(&reject).as_bytes().to_vec();
    packet[4..6].copy_from_slice(&9_u16.to_le_bytes());
    assert_eq!(theirs.send_bytes(&packet, &[]).unwrap(), foreframe_protocol::socket::Sent::Whole);
    match connecting.dispatch() {
        Err(error @ Error::Rejected(_)) => {
            assert!(error.to_string().contains("7 to 9.3"), "{error}");
        }
        other => panic!("expected a refusal, found {other:?}"),
    }
}

#[test]
fn a_daemon_that_never_answers_is_given_up() {
    let folder = tempfile::tempdir().unwrap();
    let listener = Listener::bind(&folder.path().join("private").join("daemon.sock")).unwrap();
    let options = ConnectOptions::new("test").socket(listener.path());
    let refused = options.connect(Duration::from_millis(1));
    assert!(matches!(refused, Err(Error::Timeout { .. })), "{refused:?}");
}

#[test]
fn without_a_daemon_the_error_says_what_to_start() {
    let folder = tempfile::tempdir().unwrap();
    let options = ConnectOptions::new("test").socket(folder.path().join("daemon.sock"));
    let error = options.connect(PATIENCE).expect_err("nobody listens").to_string();
    assert!(error.contains("foreframe serve"), "{error}");
}

#[test]
fn events_come_in_order_and_name_their_stream() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(4, 2));
    daemon.send(&Statistics { stream: stream.number(), real: 4, ..Default::default() });
    assert!(client.wait(PATIENCE).unwrap());
    assert!(matches!(client.next_event(), Some(Event::StreamReady(ready)) if ready == stream));
    assert!(matches!(client.next_event(), Some(Event::Statistics(counts)) if counts.real == 4));
    assert!(client.next_event().is_none());
}
