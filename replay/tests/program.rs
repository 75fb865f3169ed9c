//! The real program: exit codes, what it says of wrong usage, and what is left when it is killed.

#![allow(clippy::unwrap_used, reason = "a helper that cannot go on fails its test")]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

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
        ("check x.mcap", ["--baseline", "required"]),
        ("check x.mcap --baseline x.json --ratio 4", ["--write", "required"]),
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
fn a_check_passes_on_what_was_written_and_exits_with_1_when_something_regressed() {
    let folder = tempfile::tempdir().unwrap();
    let in_folder = |arguments: &str| {
        let mut command = foreframe();
        command.current_dir(&folder).args(arguments.split(' ')).output().unwrap()
    };
    let made = in_folder("scenes pan --size 64x36 --seconds 0.1 -o pan.mcap");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let missing = in_folder("check pan.mcap --baseline pan.json");
    let said = String::from_utf8(missing.stderr).unwrap();
    assert!(said.contains("pan.json: expected a baseline"), "{said}");
    assert!(in_folder("check pan.mcap --baseline pan.json --write --ratio 3").status.success());
    let passed = in_folder("check pan.mcap --baseline pan.json --threads 3 --junit pan.xml");
    assert!(passed.status.success(), "{}", String::from_utf8_lossy(&passed.stderr));
    let junit = fs::read_to_string(folder.path().join("pan.xml")).unwrap();
    assert!(junit.contains("failures=\"0\"") && junit.contains("\"pan.auto\""), "{junit}");

    // Of linear, not one digit of one digest is what it was.
    let path = folder.path().join("pan.json");
    let mut baseline: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    baseline["methods"][0]["digest"] = "0".repeat(32).into();
    fs::write(&path, baseline.to_string()).unwrap();
    let failed = in_folder("check pan.mcap --baseline pan.json --json --junit pan.xml");
    assert_eq!(failed.status.code(), Some(1));
    let found: serde_json::Value = serde_json::from_slice(&failed.stdout).unwrap();
    assert_eq!(found["passed"], false);
    assert_eq!(found["methods"][0]["digest"]["passed"], false);
    assert_eq!(found["methods"][1]["digest"]["passed"], true);
    let junit = fs::read_to_string(folder.path().join("pan.xml")).unwrap();
    assert!(junit.contains("failures=\"1\""), "{junit}");
    // A capture whose colours are the same, and its fields not.
    let other = in_folder("scenes pan --size 64x36 --seconds 0.1 --field-ratio 2 -o pan.mcap");
    assert!(other.status.success());
    let said = in_folder("check pan.mcap --baseline pan.json --junit pan.xml").stderr;
    let said = String::from_utf8(said).unwrap();
    assert!(said.contains("expected the capture that the baseline is of, \"pan\""), "{said}");
    assert_eq!(fs::read_to_string(folder.path().join("pan.xml")).unwrap(), "", "no older result");
}

#[test]
fn a_check_writes_over_nothing_but_baselines_and_takes_no_ratio_that_leaves_one_key() {
    let folder = tempfile::tempdir().unwrap();
    let fails = |arguments: &str, expected: &str| {
        let mut command = foreframe();
        let output = command.current_dir(&folder).args(arguments.split(' ')).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments}: {said}");
        assert!(said.contains(expected), "{arguments}: expected `{expected}` in: {said}");
    };
    let made = foreframe()
        .current_dir(&folder)
        .args("scenes pan --size 32x18 --seconds 0.05 -o pan.mcap".split(' '))
        .status()
        .unwrap();
    assert!(made.success());
    let capture = fs::read(folder.path().join("pan.mcap")).unwrap();
    fs::copy(folder.path().join("pan.mcap"), folder.path().join("other.mcap")).unwrap();
    fails("check pan.mcap --baseline ./pan.mcap --write", "expected another file than that of");
    fails("check pan.mcap --baseline other.mcap --write", "expected a baseline or no file");
    fails("check pan.mcap --baseline no-such-folder/x.json --write", "making a file beside");
    fails("check pan.mcap --baseline x.json --junit pan.mcap", "--junit: expected another file");
    for ratio in ["1000", "18446744073709551615"] {
        let line = format!("check pan.mcap --baseline x.json --write --ratio {ratio}");
        fails(&line, "expected frames between two keys, found none");
    }
    for name in ["pan.mcap", "other.mcap"] {
        assert_eq!(fs::read(folder.path().join(name)).unwrap(), capture, "{name} is whole");
    }
    let left = fs::read_dir(&folder).unwrap().count();
    assert_eq!(left, 2, "nothing is left behind");
}

#[test]
fn a_file_that_is_not_there_is_no_wrong_usage_and_is_told_once() {
    let output = foreframe().args(["info", "no-such-file.mcap"]).output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert_eq!(errors.matches("expected a capture, found no such file").count(), 1, "{errors}");
}

#[test]
fn what_is_no_capture_is_told_in_one_line_that_says_what_was_found() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let status = foreframe()
        .args(["scenes", "static", "--size", "32x18", "--seconds", "0.02", "-o"])
        .arg(at("whole.mcap"))
        .stdout(Stdio::null())
        .status()
        .unwrap();
    assert!(status.success());
    let whole = fs::read(at("whole.mcap")).unwrap();
    fs::create_dir(at("folder")).unwrap();
    fs::write(at("empty"), "").unwrap();
    fs::write(at("text"), "this is no capture").unwrap();
    fs::write(at("begun"), &whole[..20]).unwrap();
    let commands = ["info", "replay", "score --ratio 2", "export -o out"];
    let files = [
        ("missing", "expected a capture, found no such file"),
        ("folder", "expected a capture, found a folder"),
        ("empty", "expected an MCAP file"),
        ("text", "found [74, 68, 69, 73"),
        ("begun", "found the end after 20 bytes"),
    ];
    for command in commands {
        for (file, expected) in files {
            let mut program = foreframe();
            program.args(command.split(' ')).arg(file).current_dir(folder.path());
            assert_fails(program, expected);
        }
        let mut program = foreframe();
        program.args(command.split(' ')).arg("whole.mcap").current_dir(folder.path());
        assert!(program.output().unwrap().status.success(), "{command} of a whole capture");
    }
    // Opens, and has no whole frame: only `info` has something to tell.
    let first_frame = whole.len() / 2;
    let lengths = (0..first_frame).rev().step_by(97);
    let cut = lengths.map(|length| {
        fs::write(at("cut"), &whole[..length]).unwrap();
        foreframe().args(["info", "--json", "cut"]).current_dir(folder.path()).output().unwrap()
    });
    let is_begun =
        |output: &Output| String::from_utf8_lossy(&output.stdout).contains("\"frames\":0,");
    assert!(cut.into_iter().any(|output| is_begun(&output)), "a cut before the first frame's end");
    for command in ["replay", "score --ratio 2", "export -o out2"] {
        let mut program = foreframe();
        program.args(command.split(' ')).arg("cut").current_dir(folder.path());
        let output = program.output().unwrap();
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{command}: {errors}");
        let lines: Vec<_> = errors.lines().collect();
        assert_eq!(lines.len(), 2, "a warning and an error: {errors}");
        assert!(
            lines[0].contains("the file ends early") && lines[1].contains("expected"),
            "{errors}"
        );
    }
}

#[test]
fn a_folder_that_is_no_sequence_is_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("no-side-cars")).unwrap();
    fs::write(folder.path().join("no-side-cars/frame_0000.exr"), "x").unwrap();
    fs::create_dir(folder.path().join("broken")).unwrap();
    fs::write(folder.path().join("broken/frame_0000.json"), "{").unwrap();
    fs::write(folder.path().join("file"), "x").unwrap();
    for (name, expected) in [
        ("missing", "No such file"),
        ("file", "Not a directory"),
        ("no-side-cars", "expected frames with side-cars frame_NNNN.json, found none"),
        ("broken", "frame_0000.json: expected the side-car of a frame"),
    ] {
        let mut program = foreframe();
        program.args(["import", name, "-o", "out.mcap"]).current_dir(folder.path());
        assert_fails(program, expected);
        assert!(!folder.path().join("out.mcap").exists(), "{name}");
    }
}

/// Runs a command that fails with code 1 and one line that says `expected`.
fn assert_fails(mut program: Command, expected: &str) {
    let output = program.output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{program:?}: {errors}");
    assert_eq!(errors.lines().count(), 1, "{program:?}: {errors}");
    assert_eq!(errors.matches(expected).count(), 1, "{program:?}: {errors}");
    assert!(output.stdout.is_empty(), "{program:?}");
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
    let entries = fs::read_dir(folder.path()).unwrap();
    let folders = entries.map(|entry| entry.unwrap().path());
    let sockets = folders.map(|folder| folder.join("private/daemon.sock"));
    sockets.into_iter().find(|socket| socket.exists())
}
