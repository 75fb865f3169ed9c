//! What people ask of a running daemon over its control socket, while applications use it.

mod daemon_fixture;

use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;

use daemon_fixture::{Client, RunningDaemon};
use foreframe_replay::doctor::machine::Facts;
use foreframed::capture::Capture;
use foreframed::control::{Controller, DaemonStatus, Request, Response, control_path};

const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];

fn controller(daemon: &RunningDaemon) -> Controller {
    Controller::connect(&daemon.socket).expect("the daemon listens")
}

fn status(controller: &mut Controller) -> DaemonStatus {
    match controller.ask(&Request::Status).expect("the daemon answers") {
        Response::Status(status) => *status,
        other => panic!("{other:?}"),
    }
}

fn done(controller: &mut Controller, request: &Request) -> Vec<String> {
    match controller.ask(request).expect("the daemon answers") {
        Response::Done(done) => done,
        other => panic!("{other:?}"),
    }
}

/// Shows keys until the stream has reported what `is_seen` waits for.
fn show_until(
    client: &mut Client,
    source: &mut daemon_fixture::KeySource,
    controller: &mut Controller,
    is_seen: impl Fn(&DaemonStatus) -> bool,
) -> DaemonStatus {
    loop {
        for color in [RED, GREEN] {
            let submit = client.submit(source, color);
            client.expect_presented(&submit);
        }
        client.take_waiting();
        let status = status(controller);
        if is_seen(&status) {
            return status;
        }
    }
}

#[test]
fn the_doctor_finds_the_daemon_that_runs_and_says_where_none_does() {
    let daemon = RunningDaemon::start("shm");
    let found = Facts::gather(Some(&daemon.socket)).daemon;
    let expected = format!("version {}, 0 streams", env!("CARGO_PKG_VERSION"));
    assert_eq!(found, Ok(Some(expected)));
    let elsewhere = daemon.socket.with_file_name("elsewhere.sock");
    assert_eq!(Facts::gather(Some(&elsewhere)).daemon, Ok(None));
    let nowhere = daemon.socket.join("below-a-socket/daemon.sock");
    let found = Facts::gather(Some(&nowhere));
    assert!(
        found.socket.as_ref().is_err_and(|said| said.contains("below-a-socket: expected a folder")),
        "{found:?}"
    );
}

#[test]
fn a_status_tells_of_the_daemon_and_of_each_stream() {
    let daemon = RunningDaemon::start("shm");
    let mut controller = controller(&daemon);
    let idle = status(&mut controller);
    assert_eq!((idle.clients, idle.streams.len()), (0, 0));
    assert_eq!((idle.socket.as_path(), idle.sink.as_str()), (daemon.socket.as_path(), "shm"));
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 40, 24);
    let seen = show_until(&mut client, &mut source, &mut controller, |status| {
        status.streams.first().is_some_and(|stream| stream.frames[0] >= 4)
    });
    let stream = &seen.streams[0];
    assert_eq!((seen.clients, stream.width, stream.height), (1, 40, 24));
    assert_eq!((stream.backend.as_str(), stream.keys[2]), ("cpu", 0));
    assert!(stream.keys[0] >= stream.frames[0], "{stream:?}");
    let latency = &stream.latency_ms;
    assert!(latency.whole.p50 > 0.0 && latency.whole.p50 <= latency.whole.p95, "{latency:?}");
    assert!(stream.ready_before_refresh.iter().sum::<u32>() >= 4, "{stream:?}");
    drop(client);
    while !status(&mut controller).streams.is_empty() {}
}

#[test]
fn a_method_changes_in_running_streams_and_holds_for_new_ones() {
    let daemon = RunningDaemon::start("shm");
    let mut controller = controller(&daemon);
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 16, 16);
    let is = |name: &'static str| {
        move |status: &DaemonStatus| status.streams.iter().any(|stream| stream.method == name)
    };
    for name in ["hold", "auto", "blend", "grid", "voxel", "linear"] {
        let request = Request::Method { method: name.to_owned() };
        done(&mut controller, &request);
        assert_eq!(done(&mut controller, &request), [""; 0], "it is that already");
        show_until(&mut client, &mut source, &mut controller, is(name));
    }
    let refused = controller.ask(&Request::Method { method: "magic".to_owned() }).unwrap();
    assert!(matches!(&refused, Response::Refused(why) if why.contains("magic")), "{refused:?}");
    done(&mut controller, &Request::Method { method: "hold".to_owned() });
    let mut second = client.open_stream(2, 16, 16);
    let seen = show_until(&mut client, &mut second, &mut controller, |status| {
        status.streams.last().is_some_and(|stream| !stream.method.is_empty())
    });
    assert_eq!(seen.streams.last().unwrap().method, "hold");
}

#[test]
fn a_recording_starts_goes_on_in_another_file_and_ends_while_a_stream_runs() {
    let mut daemon = RunningDaemon::start("shm");
    let mut controller = controller(&daemon);
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    let unrecorded = client.submit(&mut source, RED);
    client.expect_presented(&unrecorded);
    for name in ["a.mcap", "b.mcap"] {
        done(&mut controller, &Request::Record { file: Some(daemon.path(name)) });
        for color in [RED, GREEN, RED] {
            let submit = client.submit(&mut source, color);
            client.expect_presented(&submit);
        }
    }
    assert_eq!(status(&mut controller).recording, Some(daemon.path("b.mcap")));
    done(&mut controller, &Request::Record { file: None });
    let unrecorded = client.submit(&mut source, RED);
    client.expect_presented(&unrecorded);
    assert_eq!(status(&mut controller).recording, None);
    daemon.stop();
    for name in ["a.mcap", "b.mcap"] {
        // The first is finished by a thread of its own.
        while Capture::open(&daemon.path(name)).unwrap().info().unwrap().is_truncated() {}
        let info = Capture::open(&daemon.path(name)).unwrap().info().unwrap();
        assert_eq!((info.frames, info.gaps), (3, 0), "{name}");
    }
}

#[test]
fn a_recording_that_cannot_be_made_is_refused_and_the_one_that_runs_goes_on() {
    let mut daemon = RunningDaemon::start("shm");
    let mut controller = controller(&daemon);
    done(&mut controller, &Request::Record { file: Some(daemon.path("a.mcap")) });
    // The file that is being written, by its path and by another one, would be cut to nothing.
    let detour = daemon.path(".").join("a.mcap");
    let running = [daemon.path("a.mcap"), detour];
    let never = ["relative.mcap".into(), daemon.path("no/such/folder.mcap")];
    for wrong in running.into_iter().chain(never) {
        let refused = controller.ask(&Request::Record { file: Some(wrong) }).unwrap();
        assert!(matches!(refused, Response::Refused(_)), "{refused:?}");
    }
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    let submit = client.submit(&mut source, RED);
    client.expect_presented(&submit);
    daemon.stop();
    assert_eq!(Capture::open(&daemon.path("a.mcap")).unwrap().frame_count(), 1);
}

#[test]
fn a_cap_thins_out_what_is_shown_and_can_be_taken_back() {
    let daemon = RunningDaemon::start("shm");
    let mut controller = controller(&daemon);
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    let screen = client.subscribe(1, 8);
    let gaps = |client: &mut Client, source: &mut daemon_fixture::KeySource| {
        let mut times = Vec::new();
        for color in [RED, GREEN, RED] {
            client.submit(source, color);
            let frame = client.expect_frame(&screen);
            client.send(foreframe_protocol::OutputReleased { pool: frame.pool, slot: frame.slot });
            times.push(frame.present_at_ns);
        }
        times.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap()
    };
    gaps(&mut client, &mut source);
    let said = done(&mut controller, &Request::Cap { hz: Some(30.0) });
    assert_eq!(said, ["at most 30.0000 frames a second"]);
    assert!(gaps(&mut client, &mut source) >= 33_000_000);
    done(&mut controller, &Request::Cap { hz: None });
    assert_eq!(status(&mut controller).cap_hz, None);
    let refused = controller.ask(&Request::Cap { hz: Some(0.0) }).unwrap();
    assert!(matches!(refused, Response::Refused(_)));

    let files = RunningDaemon::start("y4m:out.y4m");
    let refused = self::controller(&files).ask(&Request::Cap { hz: Some(30.0) }).unwrap();
    assert!(matches!(&refused, Response::Refused(why) if why.contains("rate of its own")));
}

#[test]
fn nonsense_is_answered_or_cut_off_and_the_daemon_goes_on() {
    let daemon = RunningDaemon::start("shm");
    let mut raw = UnixStream::connect(control_path(&daemon.socket)).unwrap();
    raw.write_all(b"hello\n{\"request\":\"cap\",\"speed\":1}\n").unwrap();
    let mut answers = BufReader::new(raw.try_clone().unwrap()).lines();
    for expected in ["as one JSON object", "speed"] {
        let answer = answers.next().unwrap().unwrap();
        assert!(answer.contains("refused") && answer.contains(expected), "{answer}");
    }
    // A line without an end is given up.
    let mut flood = UnixStream::connect(control_path(&daemon.socket)).unwrap();
    let _cut_off = flood.write_all(&[b'x'; 1 << 20]);
    let mut answers = BufReader::new(flood).lines();
    assert!(answers.by_ref().any(|answer| answer.is_err() || answer.unwrap().contains("4096")));
    drop(raw);
    assert_eq!(status(&mut controller(&daemon)).clients, 0);
}

#[test]
fn a_daemon_stops_on_request_and_leaves_no_socket() {
    let mut daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let _source = client.open_stream(1, 8, 8);
    done(&mut controller(&daemon), &Request::Stop);
    client.read_to_end();
    daemon.join();
    assert!(!daemon.socket.exists() && !control_path(&daemon.socket).exists());
    let gone = Controller::connect(&daemon.socket).unwrap_err().to_string();
    assert!(gone.contains("expected a running daemon"), "{gone}");
}
