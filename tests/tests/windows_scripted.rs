//! Windows of the daemon on a compositor that does what it is told.

mod daemon_fixture;
mod scripted;

use std::fs;
use std::path::PathBuf;

use daemon_fixture::child::{ChildProcess, run_if_asked};
use daemon_fixture::{Client, KeySource, private_folder};
use foreframe_engine::MonoSpan;
use foreframe_protocol::{DaemonMessage, DestroyStream, Presented};
use foreframed::clock;
use scripted::{Feedback, Script, Scripted};
use tempfile::TempDir;

/// Waiting this long means that something is broken.
const PATIENCE: MonoSpan = MonoSpan::from_ms(60_000);

#[test]
fn child_process() {
    run_if_asked();
}

struct Stage {
    _compositor: Scripted,
    _daemon: ChildProcess,
    client: Client,
    source: KeySource,
    log: PathBuf,
    folder: TempDir,
}

impl Stage {
    fn set(script: Script) -> Self {
        let compositor = Scripted::start(script);
        let folder = private_folder();
        let [socket, log] = ["daemon.sock", "log"].map(|name| folder.path().join(name));
        let daemon = ChildProcess::daemon_with_windows(&socket, &compositor.environment(), &log);
        let mut client = Client::connect(&socket);
        let source = client.open_stream(1, 64, 32);
        Self { _compositor: compositor, _daemon: daemon, client, source, log, folder }
    }

    /// Submits keys until `is_enough` of those that were shown, or the log, and gives the former.
    fn show_until(&mut self, is_enough: impl Fn(&[Presented], &str) -> bool) -> Vec<Presented> {
        let patience = clock::now() + PATIENCE;
        let mut shown = Vec::new();
        while !is_enough(&shown, &self.log()) {
            assert!(clock::now() < patience, "{} keys: {}", shown.len(), self.log());
            self.client.submit(&mut self.source, [200, 100, 50, 255]);
            shown.extend(self.client.take_waiting().into_iter().filter_map(|it| match it {
                DaemonMessage::Presented(presented) => Some(presented),
                _ => None,
            }));
        }
        shown
    }

    fn log(&self) -> String {
        fs::read_to_string(&self.log).expect("the daemon writes it")
    }

    /// Ends the stream, and its window with it; the daemon takes the next.
    fn strike(&mut self) {
        self.client.send(DestroyStream { stream: 1 });
        self.client.expect("the stream's end", |message| match message {
            DaemonMessage::StreamEnded(ended) => (ended.stream == 1).then_some(()),
            _ => None,
        });
        Client::connect(&self.folder.path().join("daemon.sock")).open_stream(1, 64, 64);
    }
}

#[test]
fn a_good_compositor_is_not_called_anything_else() {
    let mut stage = Stage::set(Script::GOOD);
    let shown = stage.show_until(|shown, _| shown.len() > 60);
    assert!(shown.iter().any(|it| it.presented_at_ns != it.present_at_ns), "{shown:?}");
    stage.strike();
    let log = stage.log();
    assert!(!log.contains("another pacing") && !log.contains("rate is measured"), "{log}");
    assert!(!log.contains("make no sense") && !log.contains("kept all buffers"), "{log}");
}

#[test]
fn feedback_that_is_discarded_each_time_gives_way_to_frame_callbacks() {
    let mut stage = Stage::set(Script { feedback: Feedback::Discarded, ..Script::GOOD });
    let shown = stage
        .show_until(|shown, log| log.contains("pacing=\"frame callbacks\"") && shown.len() > 20);
    assert!(shown.is_sorted_by_key(|it| it.presented_at_ns), "{shown:?}");
    stage.strike();
}

#[test]
fn a_compositor_that_answers_nothing_leaves_a_timer_and_frames_go_on() {
    let script = Script { feedback: Feedback::Never, has_callbacks: false, ..Script::GOOD };
    let mut stage = Stage::set(script);
    stage.show_until(|_, log| log.contains("pacing=\"timer\""));
    let handed_over = |log: &str| log.matches("is_taken=true").count();
    let before = handed_over(&stage.log());
    stage.show_until(|_, log| handed_over(log) > before + 50);
    stage.strike();
}

#[test]
fn times_of_the_raw_clock_are_ours_when_they_reach_the_application() {
    let mut stage = Stage::set(Script { is_raw: true, ..Script::GOOD });
    let shown = stage.show_until(|shown, _| shown.len() > 30);
    let now = clock::now().as_ns();
    for it in &shown {
        assert!((it.received_at_ns..now).contains(&it.presented_at_ns), "{it:?}");
    }
    stage.strike();
}

#[test]
fn a_refresh_rate_that_is_a_lie_is_found_out() {
    let interval = MonoSpan::from_ms(25);
    let mut stage = Stage::set(Script { announced_mhz: 60_000, interval, ..Script::GOOD });
    stage.show_until(|_, log| log.contains("the display's rate is measured"));
    stage.strike();
}

#[test]
fn buffers_that_never_come_back_stall_nobody() {
    let mut stage = Stage::set(Script { releases: false, ..Script::GOOD });
    stage.show_until(|_, log| log.matches("is_taken=false").count() > 20);
    // Returns when the slot has come back.
    stage.client.submit(&mut stage.source, [1, 2, 3, 255]);
    stage.strike();
    assert!(stage.log().contains("kept all buffers"), "{}", stage.log());
}

#[test]
fn a_compositor_that_dies_in_the_middle_takes_its_window_alone() {
    let mut stage = Stage::set(Script { dies_after: Some(20), ..Script::GOOD });
    stage.show_until(|_, log| log.contains("window closes"));
    let shown = stage.show_until(|shown, _| shown.len() > 10);
    assert!(!shown.is_empty());
    stage.strike();
}
