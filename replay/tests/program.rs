//! The real program: exit codes, what it says of wrong usage, and what is left when it is killed.

#![allow(clippy::unwrap_used, reason = "a helper that cannot go on fails its test")]

use std::path::PathBuf;
use std::process::{Command, Stdio};

use foreframe_engine::MonoSpan;
use foreframe_protocol::socket::Channel;
use foreframed::clock;

fn foreframe() -> Command {
    Command::new(env!("CARGO_BIN_EXE_foreframe"))
}

#[test]
fn wrong_usage_exits_with_2_and_names_option_and_value() {
    for (arguments, expected) in [
        ("demo --seconds -1", ["--seconds", "-1"]),
        ("demo --seconds 11", ["0.5 to 10", "11"]),
        ("demo --scene nowhere", ["atrium", "nowhere"]),
        ("demo --sink null", ["--sink", "null"]),
        ("scenes nowhere -o x.mcap", ["atrium", "nowhere"]),
        ("scenes --png pictures", ["required", "<NAME>"]),
        ("scenes pan -o x.mcap --field-ratio 5", ["1 to 4", "5"]),
        ("replay x.mcap --ratio 0", ["1 or more", "0"]),
        ("replay x.mcap --refresh -60", ["1 to 1000", "-60"]),
        ("replay x.mcap --ppd 0", ["1 to 1000", "0"]),
        ("score x.mcap --ratio 1", ["2 or more", "1"]),
        ("score x.mcap --ratio 4 --methods hold,voxels", ["hold, blend", "voxels"]),
        ("score x.mcap --ratio 4 --threads -2", ["--threads", "-2"]),
        ("pacing --drift-ppm 2000", ["-1000 to 1000", "2000"]),
        ("serve --refresh 0", ["--refresh", "found 0"]),
        ("serve --json", ["--json", "`serve`"]),
        ("completions bash --json", ["--json", "`completions`"]),
    ] {
        let output = foreframe().args(arguments.split(' ')).output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {errors}");
        for word in expected {
            assert!(errors.contains(word), "{arguments}: expected `{word}` in: {errors}");
        }
        assert!(output.stdout.is_empty(), "{arguments}");
    }
}

#[test]
fn a_file_that_is_not_there_is_no_wrong_usage_and_is_told_once() {
    let output = foreframe().args(["info", "no-such-file.mcap"]).output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert_eq!(errors.matches("No such file").count(), 1, "{errors}");
}

#[test]
fn the_daemon_of_a_demo_that_is_killed_ends() {
    let folder = tempfile::tempdir().unwrap();
    let mut demo = foreframe()
        .args(["demo", "--size", "64x48", "--seconds", "10", "--out"])
        .arg(folder.path().join("out"))
        .env("TMPDIR", folder.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let patience = clock::now() + MonoSpan::from_ms(60_000);
    let socket = loop {
        assert!(clock::now() < patience, "the demo's daemon does not listen");
        assert!(demo.try_wait().unwrap().is_none(), "the demo ended early");
        let listens = |socket: &PathBuf| Channel::connect(socket).is_ok();
        if let Some(socket) = socket_below(&folder).filter(listens) {
            break socket;
        }
        std::thread::yield_now();
    };
    demo.kill().unwrap();
    demo.wait().unwrap();
    // A daemon that stops in good order removes its socket.
    while socket.exists() {
        assert!(clock::now() < patience, "the daemon of the demo goes on");
        std::thread::yield_now();
    }
}

/// The socket of the demo that has this folder for temporary files.
fn socket_below(folder: &tempfile::TempDir) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder.path()).unwrap();
    let folders = entries.map(|entry| entry.unwrap().path());
    let sockets = folders.map(|folder| folder.join("private/daemon.sock"));
    sockets.into_iter().find(|socket| socket.exists())
}
