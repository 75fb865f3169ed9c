//! Windows of the daemon on real compositors: frames are shown, their feedback paces the stream,
//! and what a display lacks is named. None of these tests knows how fast anything has to be.

mod compositors;
mod daemon_fixture;

use std::fs;
use std::path::PathBuf;

use compositors::{Compositor, Kind};
use daemon_fixture::child::{BACKEND, ChildProcess, lavapipe, run_if_asked};
use daemon_fixture::{Client, KeySource, private_folder};
use foreframe_engine::MonoSpan;
use foreframe_protocol::{DaemonMessage, DestroyStream, Presented};
use foreframed::clock;
use tempfile::TempDir;

const MONITOR: [u32; 2] = [640, 360];
/// Waiting this long means that something is broken.
const PATIENCE: MonoSpan = MonoSpan::from_ms(60_000);

#[test]
fn child_process() {
    run_if_asked();
}

/// A daemon with windows on a compositor, and a client with a stream.
struct Stage {
    compositor: Compositor,
    _daemon: ChildProcess,
    client: Client,
    source: KeySource,
    log: PathBuf,
    folder: TempDir,
}

impl Stage {
    fn set(kind: Kind, hz: u32) -> Option<Self> {
        Self::set_with(kind, hz, None)
    }

    /// The same on a GPU adapter.
    fn set_with(kind: Kind, hz: u32, backend: Option<&str>) -> Option<Self> {
        let mut compositor = Compositor::start(kind, MONITOR, hz)?;
        let backend = backend.map(|name| (BACKEND, name.to_owned()));
        compositor.environment.extend(backend);
        let folder = private_folder();
        let [socket, log] = ["daemon.sock", "log"].map(|name| folder.path().join(name));
        let daemon = ChildProcess::daemon_with_windows(&socket, &compositor.environment, &log);
        let mut client = Client::connect(&socket);
        let source = client.open_stream(1, 320, 180);
        Some(Self { compositor, _daemon: daemon, client, source, log, folder })
    }

    /// Submits keys, each of another grey, until `count` of them were shown.
    fn show(&mut self, count: usize) -> Vec<Presented> {
        let patience = clock::now() + PATIENCE;
        let mut shown = Vec::new();
        let mut grey = 0_u8;
        while shown.len() < count {
            assert!(clock::now() < patience, "{} keys of {count}: {}", shown.len(), self.log());
            grey = grey.wrapping_add(16);
            self.client.submit(&mut self.source, [grey, grey, grey, 255]);
            shown.extend(self.client.take_waiting().into_iter().filter_map(|it| match it {
                DaemonMessage::Presented(presented) => Some(presented),
                _ => None,
            }));
        }
        shown
    }

    /// Submits keys until the daemon's log has this text.
    fn show_until_logged(&mut self, text: &str) {
        let patience = clock::now() + PATIENCE;
        while !self.log().contains(text) {
            assert!(clock::now() < patience, "no `{text}`: {}", self.log());
            self.client.submit(&mut self.source, [200, 100, 50, 255]);
            self.client.take_waiting();
        }
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
        let mut second = Client::connect(&self.folder.path().join("daemon.sock"));
        second.open_stream(1, 64, 64);
    }
}

/// Shown in the order of their keys, and not at the times that they were planned for.
fn assert_told_by_the_display(shown: &[Presented]) {
    assert!(shown.is_sorted_by_key(|it| (it.key_index, it.presented_at_ns)), "{shown:?}");
    let is_other = |it: &Presented| it.present_at_ns != it.presented_at_ns;
    assert!(shown.iter().any(is_other), "all as planned, to the nanosecond: {shown:?}");
}

fn on_mutter(hz: u32) {
    let Some(mut stage) = Stage::set(Kind::Mutter, hz) else { return };
    let shown = stage.show(40);
    assert_told_by_the_display(&shown);
    let log = stage.log();
    assert!(log.contains("way=\"wl_shm: the CPU makes the pictures\""), "{log}");
    assert!(log.contains("pacing=\"presentation feedback\""), "{log}");
    assert!(!log.contains("another pacing"), "{log}");
    let interval = stage.client.expect("pacing", |message| match message {
        DaemonMessage::Pacing(pacing) => Some(pacing.refresh_interval_ns as f64 / 1e9),
        _ => None,
    });
    let off = interval * f64::from(hz) - 1.0;
    assert!(off.abs() < 0.07, "expected {hz} Hz, found one refresh in {interval} s");
    stage.strike();
}

#[test]
fn on_mutter_at_60_hz_frames_are_paced_by_presentation_feedback() {
    on_mutter(60);
}

#[test]
fn on_mutter_at_120_hz_frames_are_paced_by_presentation_feedback() {
    on_mutter(120);
}

#[test]
fn on_mutter_at_144_hz_frames_are_paced_by_presentation_feedback() {
    on_mutter(144);
}

#[test]
fn weston_tells_times_of_another_clock_and_they_are_ours_in_the_end() {
    let Some(mut stage) = Stage::set(Kind::Weston, 60) else { return };
    let shown = stage.show(40);
    assert_told_by_the_display(&shown);
    for Presented { received_at_ns, presented_at_ns, .. } in &shown {
        assert!(presented_at_ns > received_at_ns, "shown before it came: {shown:?}");
    }
    stage.strike();
}

#[test]
fn on_sway_feedback_never_comes_and_frame_callbacks_take_its_place() {
    let Some(mut stage) = Stage::set(Kind::Sway, 120) else { return };
    stage.show_until_logged("pacing=\"frame callbacks\" was=\"presentation feedback\"");
    assert_told_by_the_display(&stage.show(40));
    stage.strike();
}

#[test]
fn on_x11_frames_are_paced_by_a_timer_and_that_is_said() {
    let Some(mut stage) = Stage::set(Kind::Xvfb, 60) else { return };
    stage.show(40);
    let log = stage.log();
    assert!(log.contains("pacing=\"timer\""), "{log}");
    stage.strike();
}

/// Shows keys through a surface, which stays the way.
fn on_a_surface(kind: Kind, hz: u32, pacing: &str) {
    let Some(backend) = lavapipe() else { return };
    let Some(mut stage) = Stage::set_with(kind, hz, Some(backend)) else { return };
    stage.show_until_logged(&format!("pacing=\"{pacing}\""));
    stage.show(40);
    stage.strike();
    let log = stage.log();
    assert!(log.contains("way=\"a surface of llvmpipe"), "{log}");
    assert!(!log.contains("another way") && !log.contains("from now on"), "{log}");
}

#[test]
fn on_mutter_a_surface_is_paced_by_presentation_feedback() {
    on_a_surface(Kind::Mutter, 60, "presentation feedback");
}

#[test]
fn on_weston_a_surface_is_paced_by_presentation_feedback() {
    on_a_surface(Kind::Weston, 60, "presentation feedback");
}

#[test]
fn on_sway_a_surface_is_paced_by_frame_callbacks() {
    on_a_surface(Kind::Sway, 120, "frame callbacks");
}

#[test]
fn on_x11_a_surface_is_paced_by_a_timer() {
    on_a_surface(Kind::Xvfb, 60, "timer");
}

#[test]
fn a_surface_that_loses_its_compositor_ends_the_window_and_nothing_else() {
    let Some(backend) = lavapipe() else { return };
    let Some(mut stage) = Stage::set_with(Kind::Mutter, 60, Some(backend)) else { return };
    stage.show(5);
    stage.compositor.kill();
    stage.show_until_logged("window closes");
    stage.client.take_waiting();
    stage.client.submit(&mut stage.source, [7, 7, 7, 255]);
    stage.strike();
}

#[test]
fn a_daemon_outlives_its_compositor_and_serves_who_else_gets_frames() {
    let Some(mut stage) = Stage::set(Kind::Mutter, 60) else { return };
    stage.show(5);
    stage.compositor.kill();
    stage.show_until_logged("window closes");
    stage.client.take_waiting();
    let screen = stage.client.subscribe(1, 2);
    let submit = stage.client.submit(&mut stage.source, [7, 7, 7, 255]);
    stage.client.expect("a frame of it", |message| match message {
        DaemonMessage::OutputFrame(frame) => {
            (frame.pool == screen.pool.pool && frame.key_index == submit.key_index).then_some(())
        }
        _ => None,
    });
    stage.strike();
}

#[test]
fn without_a_display_the_daemon_says_so_in_one_line() {
    let folder = private_folder();
    let [socket, log] = ["daemon.sock", "log"].map(|name| folder.path().join(name));
    let none = ["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"].map(|name| (name, String::new()));
    let mut daemon = ChildProcess::daemon_that_ends(&socket, &none, &log);
    let (status, _) = daemon.end();
    let said = fs::read_to_string(log).unwrap();
    assert_eq!(status.code(), Some(1), "{said}");
    let line = said.strip_prefix("foreframed: --sink window: expected a display").expect(&said);
    assert_eq!(line.lines().count(), 1, "{said}");
    assert!(!line.contains(".rs"), "no place in a source is told: {said}");
}
