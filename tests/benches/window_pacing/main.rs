//! The daemon's windows on real compositors: how often a frame is shown when it was planned, how
//! even the frames are, and how long they take, beside a plain client that draws whenever it is
//! asked to. Two things are not the daemon's doing, so the plain client runs twice more: once as
//! late before the refresh as the daemon (late), and once while a daemon makes as many pictures for
//! nobody on the processors that the compositor draws on (busy).
//!
//! `cargo bench -p foreframe-tests --bench window_pacing [-- SECONDS [WxH] [COMPOSITOR[:HZ]...]]`.
//! The application runs at 40 keys a second, 640x360 where nothing else is said, full screen; the
//! first second is not counted. Below each row of the daemon: where the time of its last keys went,
//! from the last byte submitted to the picture handed to the compositor, and to its refresh. `none`
//! instead of a compositor: the same without one, up to the picture being ready.
//! `FOREFRAME_KEEP_LOG=FILE` keeps the log of the last daemon.

#[path = "../../tests/compositors/mod.rs"]
mod compositors;
#[path = "../../tests/daemon_fixture/mod.rs"]
mod daemon_fixture;
mod fifo;
mod record;

use std::path::Path;
use std::thread;

use compositors::{Compositor, Kind};
use daemon_fixture::child::{ChildProcess, run_if_asked};
use daemon_fixture::{Client, KeySource, private_folder};
use foreframe_engine::MonoSpan;
use foreframe_protocol::{
    CameraMotion, DaemonMessage, MotionConvention, MotionDirection, MotionFormat, MotionUnit,
    PlaneKind, Presented, StreamFormat, Submit,
};
use foreframe_replay::top::text;
use foreframed::clock;
use foreframed::control::{Controller, Request, Response, Spread};
use record::{Record, Row};

const SIZE: [u32; 2] = [640, 360];
/// Columns and rows.
type Size = [u32; 2];
const KEYS_PER_S: i64 = 40;
/// From the commit of the plain client that is late to the refresh that it is for: about what the
/// daemon learns to leave.
const LATE: MonoSpan = MonoSpan::from_us(4_500);
const DEFAULT: [&str; 5] = ["mutter:60", "mutter:120", "mutter:144", "weston:60", "sway:120"];

fn main() {
    run_if_asked();
    let mut words = std::env::args().skip(1).filter(|word| !word.starts_with("--"));
    let seconds = words.next().map_or(10, |word| word.parse().expect("a number of seconds"));
    let mut asked: Vec<String> = words.collect();
    let size = asked.first().and_then(|word| size(word));
    if size.is_some() {
        asked.remove(0);
    }
    let size = size.unwrap_or(SIZE);
    let asked = if asked.is_empty() { DEFAULT.map(str::to_owned).into() } else { asked };
    println!("{}", Row::HEAD);
    for name in asked {
        let (program, hz) = name.split_once(':').unwrap_or((&name, "60"));
        let hz = hz.parse().expect("a rate in Hz");
        if program == "none" {
            println!("{name} foreframe\n{}", to_nobody(size, hz, seconds));
            continue;
        }
        let kinds = [Kind::Mutter, Kind::Weston, Kind::Sway];
        let kind = kinds.into_iter().find(|kind| kind.program() == program);
        let kind = kind.expect("mutter, weston, sway or none");
        let Some(compositor) = Compositor::start(kind, size, hz) else { continue };
        // Clients of the first second are not shown by some.
        clock::sleep_until(clock::now() + MonoSpan::from_ms(2_000));
        let socket = compositor.folder().join(
            compositor
                .environment
                .iter()
                .find(|(name, _)| *name == "WAYLAND_DISPLAY")
                .map_or("", |(_, at)| at),
        );
        let interval = MonoSpan::from_hz(f64::from(hz));
        for (how, delay) in [("plain", MonoSpan::ZERO), ("plain, late", interval - LATE)] {
            let record = fifo::run(&socket, size, seconds, delay);
            println!("{}", record.row(&format!("{name} {how}"), interval));
        }
        let beside = beside_the_daemon(&socket, size, hz, seconds);
        println!("{}", beside.row(&format!("{name} plain, busy"), interval));
        let (record, keys, stages) = through_the_daemon(&compositor, size, seconds);
        println!(
            "{}{}",
            record.row(&format!("{name} foreframe"), interval),
            late_keys(&keys, interval)
        );
        println!("{stages}");
    }
}

/// The plain client again, while a daemon makes as many pictures and shows them to nobody.
fn beside_the_daemon(compositor: &Path, size: Size, hz: u32, seconds: i64) -> Record {
    let folder = private_folder();
    let socket = folder.path().join("daemon.sock");
    let daemon = ChildProcess::daemon_without_windows(&socket, hz);
    let record = thread::scope(|scope| {
        let plain = scope.spawn(|| fifo::run(compositor, size, seconds, MonoSpan::ZERO));
        submit_keys(&socket, size, seconds);
        plain.join().expect("the plain client goes on")
    });
    drop(daemon);
    record
}

/// Where the time of keys goes in a daemon that has the processors for itself: it shows nothing.
fn to_nobody(size: Size, hz: u32, seconds: i64) -> String {
    let folder = private_folder();
    let socket = folder.path().join("daemon.sock");
    let _daemon = ChildProcess::daemon_without_windows(&socket, hz);
    submit_keys(&socket, size, seconds).1
}

fn through_the_daemon(
    compositor: &Compositor,
    size: Size,
    seconds: i64,
) -> (Record, Vec<Presented>, String) {
    let folder = private_folder();
    let [socket, log] = ["daemon.sock", "log"].map(|name| folder.path().join(name));
    let daemon = ChildProcess::daemon_with_windows(&socket, &compositor.environment, &log);
    let (keys, stages) = submit_keys(&socket, size, seconds);
    drop(daemon);
    if let Some(kept) = std::env::var_os("FOREFRAME_KEEP_LOG") {
        std::fs::copy(&log, kept).expect("the place that FOREFRAME_KEEP_LOG names can be written");
    }
    (Record::of_log(&log), keys, stages)
}

/// `WxH`.
fn size(word: &str) -> Option<Size> {
    let (width, height) = word.split_once('x')?;
    Some([width.parse().ok()?, height.parse().ok()?])
}

/// Where the daemon says that the time of the last keys of its stream went.
fn stages(socket: &Path) -> String {
    let answer = Controller::connect(socket).and_then(|mut daemon| daemon.ask(&Request::Status));
    let status = match answer.expect("the daemon answers") {
        Response::Status(status) => status,
        other => panic!("{other:?}"),
    };
    let stream = status.streams.first().expect("the stream goes on");
    let spread = |(name, spread)| {
        let Spread { p50, p95 } = spread;
        format!("{name} {p50:.2} ({p95:.2})")
    };
    let stages = text::stages(stream).map(spread).join(", ");
    format!("  stages, median ms (95 %): {stages}")
}

/// What an application does for so many seconds, what it hears of its keys after the first one, and
/// where the time of the last ones went.
fn submit_keys(socket: &Path, size: Size, seconds: i64) -> (Vec<Presented>, String) {
    let mut client = Client::connect(socket);
    let [width, height] = size;
    let format = StreamFormat {
        motion: Some(MotionConvention {
            format: MotionFormat::Rg16f,
            direction: MotionDirection::CurrentToPrevious,
            unit: MotionUnit::Pixels,
            scale: [1.0; 2],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(width, height)
    };
    let mut source = client.open_stream_sized(1, format, 2);
    fill_motion(&mut source);
    let interval = MonoSpan::from_ns(1_000_000_000 / KEYS_PER_S);
    let (mut keys, mut before) = (Vec::new(), None::<Submit>);
    let mut due_at = clock::now();
    for key in 0..seconds * KEYS_PER_S {
        clock::sleep_until(due_at);
        due_at += interval;
        let grey = u8::try_from(key % 256).expect("a byte");
        let mut submit = source.fill([grey, 120, 160, 255]);
        submit.motion_from_ns = before.map(|before| before.content_time_ns);
        client.send(submit);
        client.expect_released(&submit);
        before = Some(submit);
        keys.extend(client.take_waiting().into_iter().filter_map(|message| match message {
            DaemonMessage::Presented(presented) if key > KEYS_PER_S => Some(presented),
            _ => None,
        }));
    }
    (keys, stages(socket))
}

/// How many keys were shown more than so many refreshes after they came.
fn late_keys(keys: &[Presented], interval: MonoSpan) -> String {
    let refreshes = |key: &Presented| {
        (key.presented_at_ns.saturating_sub(key.received_at_ns)) as f64 / interval.as_ns() as f64
    };
    let mut all: Vec<f64> = keys.iter().map(refreshes).collect();
    all.sort_by(f64::total_cmp);
    let at = |percent: usize| all.get((all.len().max(1) - 1) * percent / 100).copied();
    let [median, p99, most] = [50, 99, 100].map(|percent| at(percent).unwrap_or(f64::NAN));
    format!(
        "  keys: {median:.2} / {p99:.2} / {most:.2} refreshes from received to shown, of {}",
        keys.len()
    )
}

/// Everything moves 4 pixels to the left from key to key.
fn fill_motion(source: &mut KeySource) {
    const HALF_OF_4: [u8; 2] = 0x4400_u16.to_le_bytes();
    let submit = source.layout();
    let plane = submit.get(PlaneKind::Motion).expect("the format has motion");
    let (start, len) = (plane.offset as usize, plane.byte_len(4) as usize);
    for slot in &mut source.slots {
        for pixel in slot[start..start + len].chunks_exact_mut(4) {
            pixel[..2].copy_from_slice(&HALF_OF_4);
        }
    }
}
