//! The real program: a signal ends it in good order, and wrong usage has an exit code of its own.
//! Here because only this package's tests know where the program is.

use std::process::Command;

use foreframe_engine::MonoSpan;
use foreframe_protocol::socket::Channel;
use foreframed::clock;
use rustix::process::{Pid, Signal, kill_process};

#[test]
fn a_signal_ends_the_daemon_with_success_and_removes_its_socket() {
    let folder = tempfile::tempdir().unwrap();
    for signal in [Signal::TERM, Signal::INT] {
        let socket = folder.path().join("private/daemon.sock");
        let mut daemon = Command::new(env!("CARGO_BIN_EXE_foreframed"))
            .arg("--socket")
            .arg(&socket)
            .args(["--log", "warn"])
            .spawn()
            .unwrap();
        let patience = clock::now() + MonoSpan::from_ms(60_000);
        while Channel::connect(&socket).is_err() {
            assert!(clock::now() < patience, "the daemon does not listen");
            std::thread::yield_now();
        }
        kill_process(Pid::from_child(&daemon), signal).unwrap();
        let status = daemon.wait().unwrap();
        assert!(status.success(), "{signal:?}: {status}");
        assert!(!socket.exists(), "{signal:?}: the socket is removed");
    }
}

#[test]
fn wrong_usage_exits_with_2_and_a_place_that_cannot_be_used_with_1() {
    let run = |arguments: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_foreframed"))
            .args(arguments.split_whitespace())
            .env("XDG_RUNTIME_DIR", "relative/folder")
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    for (arguments, expected) in [
        ("--refresh 0", "--refresh: expected 1 to 1000 Hz, found 0"),
        ("--refresh -60", "--refresh: expected 1 to 1000 Hz, found -60"),
        ("--threads 0", "--threads"),
        ("--memory-mb -1", "--memory-mb"),
        ("--log a=b=c", "--log: expected a level"),
        ("--config no-such-file.toml", "--config: expected a file that can be read"),
    ] {
        let (code, errors) = run(arguments);
        assert_eq!(code, Some(2), "{arguments}: {errors}");
        assert!(errors.contains(expected), "{arguments}: {errors}");
    }
    let (code, errors) = run("");
    assert_eq!(code, Some(1), "{errors}");
    let expected = "XDG_RUNTIME_DIR: expected an absolute path, found `relative/folder`";
    assert!(errors.contains(expected), "{errors}");
}
