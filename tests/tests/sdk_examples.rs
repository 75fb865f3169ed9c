//! The SDK's examples as their users run them: programs beside a daemon on the default socket.

#![allow(clippy::unwrap_used, reason = "a helper that cannot go on fails its test")]

mod daemon_fixture;

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use daemon_fixture::private_folder;
use foreframe_engine::MonoSpan;
use foreframe_protocol::socket::Channel;
use foreframed::{Args, Daemon, clock};

/// A daemon where programs with this `XDG_RUNTIME_DIR` look for it.
struct DefaultDaemon {
    folder: tempfile::TempDir,
    stopper: foreframed::Stopper,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl DefaultDaemon {
    fn start() -> Self {
        let folder = private_folder();
        let socket = folder.path().join("foreframe").join("daemon.sock");
        let config = Args { socket: Some(socket.clone()), ..Args::default() }.resolve().unwrap();
        let (bound, is_bound) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || {
            let daemon = Daemon::bind(config).unwrap();
            bound.send(daemon.stopper()).unwrap();
            daemon.run().unwrap();
        });
        let stopper = is_bound.recv().expect("the daemon starts");
        drop(Channel::connect(&socket).expect("the daemon listens"));
        Self { folder, stopper, thread: Some(thread) }
    }

    fn run(&self, example: &str) -> Child {
        Command::new(example_path(example))
            .env("XDG_RUNTIME_DIR", self.folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }
}

impl Drop for DefaultDaemon {
    fn drop(&mut self) {
        self.stopper.stop();
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the daemon ends in good order");
        }
    }
}

/// Cargo builds examples before tests, in a folder beside theirs.
fn example_path(name: &str) -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let profile = test.ancestors().nth(2).expect("tests lie in deps/ of their profile");
    let path = profile.join("examples").join(name);
    assert!(path.exists(), "{name} is not built: `cargo build -p foreframe-tests --examples`");
    path
}

fn ended(name: &str, child: Child) -> String {
    let output = child.wait_with_output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.is_empty(), "{name}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_applications_run_to_their_end_and_nothing_is_refused() {
    let daemon = DefaultDaemon::start();
    let names = [
        "sdk_01_color_only",
        "sdk_02_depth_and_motion",
        "sdk_03_dynamic_resolution",
        "sdk_06_user_interface",
        "sdk_07_multiplexing",
    ];
    let children = names.map(|name| (name, daemon.run(name)));
    let [first, second, ..] = children.map(|(name, child)| ended(name, child));
    assert!(first.contains("in-between frames are made by"), "{first}");
    assert!(first.contains("key frames were skipped"), "{first}");
    assert!(second.contains("keys_refused: 0"), "{second}");
    assert!(!second.contains("synthesised: 0,"), "its motion makes in-between frames: {second}");
}

#[test]
fn the_subscriber_sees_what_an_application_shows() {
    let daemon = DefaultDaemon::start();
    let subscriber = daemon.run("sdk_04_subscribe_to_output");
    // It shows 240 frames, or gives up after five seconds without any.
    let patience = clock::now() + MonoSpan::from_ms(60_000);
    let mut subscriber = Some(subscriber);
    let seen = loop {
        ended("sdk_02_depth_and_motion", daemon.run("sdk_02_depth_and_motion"));
        let mut running = subscriber.take().expect("put back below");
        if running.try_wait().unwrap().is_some() {
            break ended("sdk_04_subscribe_to_output", running);
        }
        subscriber = Some(running);
        assert!(clock::now() < patience, "the subscriber sees nothing");
    };
    let lines: Vec<_> = seen.lines().filter(|line| line.contains("640x360")).collect();
    assert_eq!(lines.len(), 240, "{seen}");
    assert!(lines.iter().any(|line| line.contains("real")), "{seen}");
    assert!(lines.iter().any(|line| line.contains("synthesised")), "{seen}");
}
