//! What is left when a daemon or a client is killed, told to stop, or started twice.

#![allow(clippy::unwrap_used, reason = "a helper that cannot go on fails its test")]

mod daemon_fixture;

use daemon_fixture::child::{ChildProcess, Role, run_if_asked};
use daemon_fixture::{Client, RunningDaemon, private_folder};
use foreframe_engine::MonoSpan;
use foreframed::capture::{Capture, DISPLAY_ORIGIN};
use foreframed::clock;
use rustix::process::Signal;
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;

#[test]
fn child_process() {
    run_if_asked();
}

#[test]
fn a_killed_client_leaves_nothing_behind_and_the_next_one_is_served() {
    let folder = private_folder();
    let socket = folder.path().join("daemon.sock");
    let daemon = ChildProcess::daemon(&socket, None);
    // The first stream makes what stays: the sinks' and the engine's one-time descriptors.
    ChildProcess::ready(Role::Client, &socket).kill();
    let pools = |daemon: &ChildProcess| {
        daemon.count_maps_of("memfd:test") + daemon.count_maps_of("memfd:foreframe-output")
    };
    until("the first client is gone", &socket, || pools(&daemon) == 0);
    let fds = daemon.count_fds();
    for _ in 0..3 {
        let mut client = ChildProcess::ready(Role::Client, &socket);
        assert!(pools(&daemon) >= 2, "a key pool and an output pool are mapped");
        client.kill();
        until("pools and descriptors are back", &socket, || {
            pools(&daemon) == 0 && daemon.count_fds() <= fds
        });
    }
    let mut client = Client::connect(&socket);
    let mut source = client.open_stream(1, 8, 8);
    let submit = client.submit(&mut source, [9; 4]);
    client.expect_presented(&submit);
}

/// Waits for a state of the daemon that no message tells of: asks it something, over and over.
fn until(what: &str, socket: &Path, is_so: impl Fn() -> bool) {
    let patience = clock::now() + MonoSpan::from_ms(60_000);
    while !is_so() {
        assert!(clock::now() < patience, "{what}: not within a minute");
        drop(Client::connect(socket));
    }
}

#[test]
fn a_recording_of_a_killed_daemon_opens_up_to_its_last_whole_frame() {
    let folder = private_folder();
    let (socket, file) = (folder.path().join("daemon.sock"), folder.path().join("a.mcap"));
    let mut daemon = ChildProcess::daemon(&socket, Some(&file));
    let mut client = Client::connect(&socket);
    let mut source = client.open_stream(7, 64, 48);
    let frames = || Capture::open(&file).map_or(0, |capture| capture.frame_count());
    let mut submitted = Vec::new();
    while frames() < 5 {
        submitted.push(client.submit(&mut source, [submitted.len() as u8, 2, 3, 255]));
        assert!(submitted.len() < 10_000, "nothing is recorded");
    }
    daemon.kill();
    let capture = Capture::open(&file).unwrap();
    assert!(capture.info().unwrap().is_truncated(), "a killed daemon writes no summary");
    let count = capture.frame_count();
    assert!((5..=submitted.len()).contains(&count), "{count} of {}", submitted.len());
    let recorded = capture.frame(4).unwrap();
    let sent = submitted.iter().find(|sent| sent.key_index == recorded.submit.key_index).unwrap();
    assert_eq!(recorded.submit.content_time_ns, sent.content_time_ns);
    assert_eq!(recorded.color().bytes, [sent.key_index as u8, 2, 3, 255].repeat(64 * 48));

    // The socket that it left behind is in nobody's way.
    let _next = ChildProcess::daemon(&socket, None);
    drop(Client::connect(&socket));
}

#[test]
fn a_daemon_that_stops_finishes_its_recording() {
    let args = foreframed::Args { record: Some("a.mcap".into()), ..Default::default() };
    let mut daemon = RunningDaemon::start_with("shm", args);
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 16, 16);
    for _ in 0..4 {
        client.submit(&mut source, [1; 4]);
    }
    daemon.stop();
    let capture = Capture::open(&daemon.path("a.mcap")).unwrap();
    let origin: u64 = capture.session().config[DISPLAY_ORIGIN].parse().unwrap();
    let arrived_at = capture.frame(0).map_or(u64::MAX, |frame| frame.arrived_at_ns);
    assert!((1..arrived_at).contains(&origin), "a refresh before the first key, for replay");
    let info = capture.info().unwrap();
    assert!(!info.is_truncated());
    assert_eq!(info.frames as u64 + info.gaps, 4, "every key is there, or counted as missing");
}

#[test]
fn a_sink_that_cannot_be_written_is_told_in_one_line_before_the_first_stream() {
    let folder = private_folder();
    let socket = folder.path().join("daemon.sock");
    let sink = format!("y4m:{}", folder.path().join("none/out.y4m").display());
    let args = foreframed::Args {
        socket: Some(socket.clone()),
        sink: Some(sink.parse().unwrap()),
        ..Default::default()
    };
    let error = foreframed::Daemon::bind(args.resolve().unwrap()).expect_err("no such folder");
    let error = format!("{error:#}");
    assert!(error.contains(&format!("--sink {sink}: expected ")), "{error}");
    assert!(!socket.exists(), "{error}");
}

#[test]
fn a_second_daemon_is_told_in_one_line() {
    let folder = private_folder();
    let socket = folder.path().join("daemon.sock");
    let _first = ChildProcess::daemon(&socket, None);
    assert_one_line(&socket, "another daemon");
    // The first one still serves.
    drop(Client::connect(&socket));
}

#[test]
fn a_folder_that_others_can_enter_is_refused_in_one_line() {
    let folder = private_folder();
    std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(0o755)).unwrap();
    assert_one_line(&folder.path().join("daemon.sock"), "chmod 700");
}

#[test]
fn a_missing_parent_folder_is_told_in_one_line() {
    let folder = private_folder();
    assert_one_line(
        &folder.path().join("no/such/daemon.sock"),
        "expected a folder that can be made for the socket, found ",
    );
}

fn assert_one_line(socket: &Path, expected: &str) {
    let (status, errors) = ChildProcess::spawn(Role::Daemon, socket, None).end();
    assert_eq!(status.code(), Some(1), "{errors}");
    let lines: Vec<_> = errors.lines().filter(|line| line.starts_with("foreframed: ")).collect();
    assert_eq!(lines.len(), 1, "{errors}");
    assert!(lines[0].contains(expected), "{errors}");
}

#[test]
fn no_handler_for_sigbus_is_installed() {
    let folder = private_folder();
    let socket = folder.path().join("daemon.sock");
    let mut daemon = ChildProcess::daemon(&socket, None);
    let mut client = Client::connect(&socket);
    let mut source = client.open_stream(1, 8, 8);
    client.submit(&mut source, [1; 4]);
    // The standard library of Rust catches SIGBUS and SIGSEGV once, to tell a stack overflow, in
    // every program; a process that does nothing shows which signals those are.
    let bystander = ChildProcess::ready(Role::Bystander, &socket);
    assert_eq!(daemon.status_line("SigCgt"), bystander.status_line("SigCgt"));
    // Its handler gives way after the first signal. One of ours would go on.
    let patience = clock::now() + MonoSpan::from_ms(60_000);
    while daemon.child.try_wait().unwrap().is_none() {
        assert!(clock::now() < patience, "somebody catches SIGBUS");
        daemon.signal(Signal::BUS);
        std::thread::yield_now();
    }
    let (status, _) = daemon.end();
    assert_eq!(status.signal(), Some(Signal::BUS.as_raw()));
}
