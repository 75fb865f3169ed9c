//! The real program: a signal ends it in good order. Here because only this package's tests know
//! where the program is.

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
