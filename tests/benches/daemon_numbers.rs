//! What the daemon costs, measured from outside: a real second process, a client at 40 keys a
//! second, a subscriber to 120 frames a second.
//!
//! Prints private memory with output pools, time from submit to the slot's return, processor share,
//! and what became of the frames; then how long keys that come about once a refresh, at changing
//! places in it, take to be shown: `cargo bench -p foreframe-tests --bench daemon_numbers`.

#[path = "../tests/daemon_fixture/mod.rs"]
mod daemon_fixture;

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command};

use daemon_fixture::{Client, KeySource, private_folder};
use foreframe_engine::{MonoSpan, MonoTime};
use foreframe_protocol::{
    CameraMotion, DaemonMessage, DepthConvention, DepthFormat, DepthMeaning, MotionConvention,
    MotionDirection, MotionFormat, MotionUnit, OutputReleased, PlaneKind, Statistics, StreamFormat,
    Submit,
};
use foreframed::huge_pages::HugePages;
use foreframed::{Args, clock};

/// As in `foreframed`.
#[global_allocator]
static ALLOCATOR: HugePages = HugePages;

const KEYS_PER_S: i64 = 40;
const SECONDS: i64 = 10;

fn main() {
    if let Some(socket) = std::env::var_os("FOREFRAME_BENCH_DAEMON") {
        let args =
            Args { socket: Some(socket.into()), log: Some("warn".to_owned()), ..Args::default() };
        foreframed::run(args).expect("the daemon runs");
        return;
    }
    println!("{KEYS_PER_S} to 120 Hz, linear, {SECONDS} s, depth f32 and motion rg16f:");
    for (width, height, divisor) in
        [(1280, 720, 1), (1280, 720, 2), (1920, 1080, 1), (1920, 1080, 2)]
    {
        measure(width, height, divisor);
    }
    measure_keeping_up(640, 360);
}

/// A daemon in a process of its own, and where it listens.
fn start_daemon(folder: &tempfile::TempDir) -> (Child, PathBuf) {
    let socket = folder.path().join("daemon.sock");
    let daemon = Command::new(std::env::current_exe().expect("this program has a path"))
        .env("FOREFRAME_BENCH_DAEMON", &socket)
        .spawn()
        .expect("a second process can be started");
    while !socket.exists() {
        clock::sleep_until(clock::now() + MonoSpan::from_ms(5));
    }
    (daemon, socket)
}

/// Keys a little faster than the display's 120 Hz, so that they come at every place in a refresh,
/// each up to 3 ms early or late.
fn measure_keeping_up(width: u32, height: u32) {
    const KEYS_PER_1000_S: i64 = 120_500;
    let folder = private_folder();
    let (mut daemon, socket) = start_daemon(&folder);
    let mut client = Client::connect(&socket);
    let mut source = client.open_stream_sized(1, format(width, height), 2);
    fill_motion(&mut source);
    let interval = MonoSpan::from_ns(1_000_000_000_000 / KEYS_PER_1000_S);
    let mut due_at = clock::now();
    let mut before: Option<Submit> = None;
    let mut shown = Vec::new();
    let keys = SECONDS * KEYS_PER_1000_S / 1000;
    let mut random = 1_u64;
    let mut newest = Statistics::default();
    for _ in 0..keys {
        due_at += interval;
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let jitter = i64::try_from((random >> 33) % 6001).expect("it is small") - 3000;
        clock::sleep_until(due_at + MonoSpan::from_ns(jitter * 1000));
        let mut submit = source.fill([80, 120, 160, 255]);
        submit.motion_from_ns = before.map(|before| before.content_time_ns);
        client.send(submit);
        client.expect_released(&submit);
        before = Some(submit);
        for message in client.take_waiting() {
            match message {
                DaemonMessage::Presented(it) => {
                    let received_at = MonoTime::from_ns(it.received_at_ns);
                    shown.push(MonoTime::from_ns(it.presented_at_ns) - received_at);
                }
                DaemonMessage::Statistics(statistics) => newest = statistics,
                _ => {}
            }
        }
    }
    shown.sort_unstable();
    let at = |percent: usize| shown[(shown.len() - 1) * percent / 100];
    println!(
        "{width}x{height}, keys at {} Hz for 120: {} of {keys} shown; received to presented p5 {}, \
         p50 {}, p95 {}; {} synthesised, {} repeated, {} dropped",
        KEYS_PER_1000_S as f64 / 1000.0,
        shown.len(),
        at(5),
        at(50),
        at(95),
        newest.synthesised,
        newest.repeated,
        newest.dropped,
    );
    daemon.kill().expect("the daemon runs until now");
    daemon.wait().expect("the daemon was killed");
}

fn measure(width: u32, height: u32, divisor: u32) {
    let folder = private_folder();
    let (mut daemon, socket) = start_daemon(&folder);
    let mut client = Client::connect(&socket);
    let mut source = client.open_stream_sized(1, format(width, height), divisor);
    fill_motion(&mut source);
    let screen = client.subscribe(1, 3);

    let interval = MonoSpan::from_ns(1_000_000_000 / KEYS_PER_S);
    let mut due_at = clock::now();
    let mut before: Option<Submit> = None;
    let mut latencies = Vec::new();
    let mut warm: Option<(u64, MonoTime, Statistics)> = None;
    let mut newest = Statistics::default();
    for key in 0..SECONDS * KEYS_PER_S {
        clock::sleep_until(due_at);
        due_at += interval;
        let mut submit = source.fill([80, 120, 160, 255]);
        submit.motion_from_ns = before.map(|before| before.content_time_ns);
        let sent_at = clock::now();
        client.send(submit);
        client.expect_released(&submit);
        latencies.push(clock::now() - sent_at);
        before = Some(submit);
        for message in client.take_waiting() {
            match message {
                DaemonMessage::OutputFrame(frame) => {
                    client.send(OutputReleased { pool: frame.pool, slot: frame.slot });
                }
                DaemonMessage::Statistics(statistics) => newest = statistics,
                _ => {}
            }
        }
        if key == KEYS_PER_S {
            warm = Some((processor_ticks(&daemon), clock::now(), newest));
        }
    }
    let (ticks, since, first) = warm.expect("more than one second was measured");
    let share = 10.0 * (processor_ticks(&daemon) - ticks) as f64
        / (clock::now() - since).as_ms_f64()
        * 100.0;
    latencies.sort_unstable();
    let at = |percent: usize| latencies[(latencies.len() - 1) * percent / 100];
    let private = anonymous_bytes(&daemon);
    let output = screen.pool.slot_bytes * u64::from(screen.pool.slots);
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    println!(
        "{width}x{height}, planes 1/{divisor}: private {:.0} MiB + output pool {:.0} MiB; submit to \
         release p50 {}, p99 {}; processor {share:.0} %; {} real, {} synthesised ({} each), {} \
         repeated, {} dropped after the first second",
        mib(private),
        mib(output),
        at(50),
        at(99),
        newest.real - first.real,
        newest.synthesised - first.synthesised,
        MonoSpan::from_ns(i64::try_from(newest.synthesis_mean_ns).unwrap_or(i64::MAX)),
        newest.repeated - first.repeated,
        newest.dropped - first.dropped,
    );
    daemon.kill().expect("the daemon runs until now");
    daemon.wait().expect("the daemon was killed");
}

fn format(width: u32, height: u32) -> StreamFormat {
    StreamFormat {
        depth: Some(DepthConvention { format: DepthFormat::F32, meaning: DepthMeaning::Reversed }),
        motion: Some(MotionConvention {
            format: MotionFormat::Rg16f,
            direction: MotionDirection::CurrentToPrevious,
            unit: MotionUnit::Pixels,
            scale: [1.0; 2],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(width, height)
    }
}

/// Everything moves 4 pixels to the left from key to key: no tile is still.
fn fill_motion(source: &mut KeySource) {
    const HALF_OF_4: [u8; 2] = 0x4400_u16.to_le_bytes();
    let submit = source.layout();
    let plane = submit.get(PlaneKind::Motion).expect("the format has motion");
    let start = plane.offset as usize;
    let len = plane.byte_len(4) as usize;
    for slot in &mut source.slots {
        for pixel in slot[start..start + len].chunks_exact_mut(4) {
            pixel[..2].copy_from_slice(&HALF_OF_4);
        }
    }
}

/// User and system time so far, in ticks of 10 ms.
fn processor_ticks(daemon: &Child) -> u64 {
    let stat = fs::read_to_string(format!("/proc/{}/stat", daemon.id())).expect("it runs");
    let (_, fields) = stat.rsplit_once(") ").expect("the name ends in a bracket");
    let ticks = fields.split(' ').skip(11).take(2);
    ticks.map(|field| field.parse::<u64>().expect("a number")).sum()
}

/// Memory that belongs to the process alone, without pools.
fn anonymous_bytes(daemon: &Child) -> u64 {
    let rollup =
        fs::read_to_string(format!("/proc/{}/smaps_rollup", daemon.id())).expect("it runs");
    let line = rollup.lines().find_map(|line| line.strip_prefix("Anonymous:"));
    let kib =
        line.and_then(|line| line.trim().strip_suffix(" kB")).expect("the kernel says it in kB");
    kib.trim().parse::<u64>().expect("a number") << 10
}
