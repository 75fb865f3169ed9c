//! Windows of the daemon on real compositors: frames are shown, their feedback paces the stream,
//! and what a display lacks is named. None of these tests knows how fast anything has to be.

mod compositors;
mod daemon_fixture;

use std::fs;
use std::path::PathBuf;

use compositors::{Compositor, Kind};
use daemon_fixture::child::{BACKEND, ChildProcess, LAYOUT, lavapipe, run_if_asked};
use daemon_fixture::{Client, KeySource, private_folder};
use foreframe_engine::MonoSpan;
use foreframe_protocol::{DaemonMessage, DestroyStream, Presented};
use foreframed::clock;
use foreframed::control::{Controller, Request, Response};
use rustix::process::Signal;
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
        Self::set_with(kind, hz, &[])
    }

    /// The same with options, as a child has them.
    fn set_with(kind: Kind, hz: u32, options: &[(&'static str, &str)]) -> Option<Self> {
        let mut compositor = Compositor::start(kind, MONITOR, hz)?;
        let options = options.iter().map(|&(name, value)| (name, value.to_owned()));
        compositor.environment.extend(options);
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

    /// What the daemon says of how its only stream is drawn, once it has reported.
    fn drawn_by(&mut self) -> String {
        let socket = self.folder.path().join("daemon.sock");
        let mut controller = Controller::connect(&socket).expect("the daemon listens");
        let patience = clock::now() + PATIENCE;
        loop {
            assert!(clock::now() < patience, "no report: {}", self.log());
            self.client.submit(&mut self.source, [9, 9, 9, 255]);
            self.client.take_waiting();
            let answer = controller.ask(&Request::Status).expect("the daemon answers");
            let Response::Status(status) = answer else { panic!("{answer:?}") };
            let [stream] = &status.streams[..] else { panic!("{status:?}") };
            if !stream.drawn_by.is_empty() {
                return stream.drawn_by.clone();
            }
        }
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
    assert_eq!(stage.drawn_by(), "wl_shm: the CPU makes the pictures");
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
    assert_eq!(stage.drawn_by(), "softbuffer: the CPU makes the pictures");
    stage.strike();
}

/// What the newest statistics of the stream say, once they pass: [shown, dropped].
fn count_until(stage: &mut Stage, is_enough: impl Fn([u64; 2]) -> bool) -> [u64; 2] {
    let patience = clock::now() + PATIENCE;
    let mut counts = [0; 2];
    while !is_enough(counts) {
        assert!(clock::now() < patience, "{counts:?}: {}", stage.log());
        stage.client.submit(&mut stage.source, [200, 100, 50, 255]);
        for message in stage.client.take_waiting() {
            if let DaemonMessage::Statistics(it) = message {
                counts = [it.real + it.synthesised, it.dropped];
            }
        }
    }
    counts
}

#[test]
fn pictures_that_an_x_server_never_took_count_as_dropped() {
    let Some(mut stage) = Stage::set(Kind::Xvfb, 60) else { return };
    let [shown, dropped] = count_until(&mut stage, |[shown, _]| shown > 20);
    stage.compositor.signal(Signal::STOP);
    let asleep = count_until(&mut stage, |[_, it]| it > dropped + 60);
    // Some were under way when it fell asleep, and what is newest may still be shown.
    assert!(asleep[0] < shown + 60, "{shown} shown, {asleep:?} while nothing is");
    stage.compositor.signal(Signal::CONT);
    count_until(&mut stage, |[it, _]| it > asleep[0] + 60);
    stage.strike();
}

/// Two streams on X11, each with another colour, and what the screen shows of them.
fn side_by_side_on_x11(options: &[(&'static str, &str)], way: &str) {
    const COLORS: [[u8; 4]; 2] = [[200, 100, 50, 255], [10, 60, 220, 255]];
    /// In the middle of the left half, and of the right: without a window manager nobody makes the
    /// window as large as the screen.
    const MIDDLES: [[usize; 2]; 2] = [[80, 90], [240, 90]];
    let options: Vec<_> = options.iter().copied().chain([(LAYOUT, "side-by-side")]).collect();
    let Some(mut stage) = Stage::set_with(Kind::Xvfb, 60, &options) else { return };
    let mut second = stage.client.open_stream(2, 320, 180);
    let [left, right] = COLORS.map(|[red, green, blue, _]| [red, green, blue]);
    let mut shown = [0, 0];
    let patience = clock::now() + PATIENCE;
    while shown.into_iter().min() < Some(20)
        || MIDDLES.map(|at| stage.compositor.pixel(at)) != [left, right]
    {
        let seen = MIDDLES.map(|at| stage.compositor.pixel(at));
        assert!(clock::now() < patience, "{shown:?} keys, {seen:?}: {}", stage.log());
        stage.client.submit(&mut stage.source, COLORS[0]);
        stage.client.submit(&mut second, COLORS[1]);
        for message in stage.client.take_waiting() {
            if let DaemonMessage::Presented(presented) = message {
                shown[presented.stream as usize - 1] += 1;
            }
        }
    }
    // The one that is left gets all of the window, without a new key.
    stage.client.send(DestroyStream { stream: 1 });
    let patience = clock::now() + PATIENCE;
    while stage.compositor.pixel(MIDDLES[0]) != right {
        assert!(clock::now() < patience, "{:?}", stage.compositor.pixel(MIDDLES[0]));
        stage.client.take_waiting();
        std::thread::yield_now();
    }
    let log = stage.log();
    assert_eq!(log.matches(way).count(), 2, "{log}");
    assert!(!log.contains("each gets a window") && !log.contains("another way"), "{log}");
    assert_eq!(log.matches("window opens").count(), 1, "{log}");
}

#[test]
fn on_x11_streams_are_side_by_side_in_one_window() {
    side_by_side_on_x11(&[], "way=\"softbuffer");
}

#[test]
fn on_x11_surfaces_are_side_by_side_in_one_window() {
    let Some(backend) = lavapipe() else { return };
    side_by_side_on_x11(&[(BACKEND, backend)], "way=\"a surface of llvmpipe");
}

/// Shows keys through a surface, which stays the way.
fn on_a_surface(kind: Kind, hz: u32, pacing: &str) {
    let Some(backend) = lavapipe() else { return };
    let Some(mut stage) = Stage::set_with(kind, hz, &[(BACKEND, backend)]) else { return };
    stage.show_until_logged(&format!("pacing=\"{pacing}\""));
    stage.show(40);
    let drawn_by = stage.drawn_by();
    assert!(drawn_by.starts_with("a surface of llvmpipe"), "{drawn_by}");
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
    let Some(mut stage) = Stage::set_with(Kind::Mutter, 60, &[(BACKEND, backend)]) else { return };
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
