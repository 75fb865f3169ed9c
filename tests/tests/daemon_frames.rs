//! Key frames go in, pictures come out: at a subscriber, as PNG files, as a y4m file.

#![allow(clippy::unwrap_used, reason = "a helper that cannot go on fails its test")]

mod daemon_fixture;

use std::path::Path;

use daemon_fixture::{Client, KeySource, RunningDaemon, Screen};
use foreframe_protocol::{
    CameraMotion, ColorFormat, CreateStream, DaemonMessage, DestroyStream, EndReason, ErrorCode,
    ErrorMessage, Goodbye, LateCamera, MotionConvention, MotionDirection, MotionFormat, MotionUnit,
    OutputKind, OutputReleased, PlaneDescriptor, PlaneKind, PlaneSize, Rect, ReleaseReason,
    StreamFormat, UiPlane, ValidRectUse,
};
use foreframe_replay::recording::Recording as _;
use foreframe_replay::recording::capture::CaptureRecording;
use foreframe_replay::recording::keys::KeyReader;
use foreframe_replay::recording::plan::Plan;
use foreframe_replay::virtual_time::keys::{KeyTiming, timed_keys, timed_uis};
use foreframe_replay::virtual_time::{ReplayConfig, replay};

const RED: [u8; 4] = [255, 0, 0, 255];
const GREEN: [u8; 4] = [0, 255, 0, 255];

#[test]
fn a_subscriber_sees_the_keys_of_its_own_stream_as_they_are() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 33, 17);
    let screen = client.subscribe(1, 3);
    for color in [RED, GREEN] {
        let submit = client.submit(&mut source, color);
        let frame = loop {
            let frame = client.expect_frame(&screen);
            if frame.key_index == submit.key_index {
                break frame;
            }
            client.send(OutputReleased { pool: frame.pool, slot: frame.slot });
        };
        assert_eq!(screen.pixels(&frame), color.repeat(33 * 17));
        assert!(matches!(frame.kind, OutputKind::Real), "without motion a key is shown as it is");
        client.expect_presented(&submit);
        client.send(OutputReleased { pool: frame.pool, slot: frame.slot });
    }
}

#[test]
fn a_reduced_key_between_full_ones_is_shown_at_full_size_and_made_up_for() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let format =
        StreamFormat { valid_rect_use: ValidRectUse::Multiplex, ..StreamFormat::rgba8(32, 8) };
    let mut source = client.open_stream_of(1, format);
    let screen = client.subscribe(1, 3);
    // Lines in light and dark grey, and what is left of them at half the size.
    let lines: Vec<u8> = (0..32 * 8).flat_map(|i| [[180, 60][i % 2]; 4]).collect();
    let mut shown = Vec::new();
    for is_full in [true, false, true] {
        let mut submit = source.fill([120; 4]);
        if is_full {
            source.slots[submit.slot as usize][..lines.len()].copy_from_slice(&lines);
        } else if let Some(color) = submit.planes.get_mut(PlaneKind::Color) {
            color.valid = Rect { x: 0, y: 0, width: 16, height: 4 };
        }
        client.send(submit);
        let frame = loop {
            let frame = client.expect_frame(&screen);
            if frame.key_index == submit.key_index {
                break frame;
            }
            client.send(OutputReleased { pool: frame.pool, slot: frame.slot });
        };
        shown.push(screen.pixels(&frame));
        client.expect_presented(&submit);
        client.send(OutputReleased { pool: frame.pool, slot: frame.slot });
    }
    assert_eq!(shown[0], lines, "the first has nobody to make up for");
    assert_eq!(shown[1], [120; 4].repeat(32 * 8), "the whole picture");
    let middle = &shown[2][(4 * 32 + 16) * 4..][..8];
    assert!(middle[0] > 200 && middle[4] < 20, "twice the contrast: {middle:?}");
}

#[test]
fn png_files_hold_the_keys() {
    let mut daemon = RunningDaemon::start("png:frames");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 40, 30);
    let submit = client.submit(&mut source, RED);
    client.expect_presented(&submit);
    daemon.stop();
    let picture = image::open(daemon.path("frames/frame_000000.png")).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (40, 30));
    assert!(picture.pixels().all(|pixel| pixel.0 == [255, 0, 0]));
}

#[test]
fn a_y4m_file_holds_whole_frames() {
    let mut daemon = RunningDaemon::start("y4m:out.y4m");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 16, 8);
    for color in [RED, GREEN] {
        let submit = client.submit(&mut source, color);
        client.expect_presented(&submit);
    }
    daemon.stop();
    let bytes = std::fs::read(daemon.path("out.y4m")).unwrap();
    let header = b"YUV4MPEG2 W16 H8 F120:1 Ip A1:1 C444 XCOLORRANGE=LIMITED\n";
    let frames = bytes.strip_prefix(header).expect("the header of a 16x8 stream at 120 Hz");
    let frame_bytes = b"FRAME\n".len() + 3 * 16 * 8;
    assert_eq!(frames.len() % frame_bytes, 0, "{} bytes", frames.len());
    let frames: Vec<_> = frames.chunks(frame_bytes).collect();
    assert!(frames.len() >= 2 && frames.iter().all(|frame| frame.starts_with(b"FRAME\n")));
    // Red is (63, 102, 240) and green (173, 42, 26) in BT.709, limited range.
    let luma = |frame: &[u8]| frame[6];
    assert_eq!((luma(frames[0]), luma(frames[frames.len() - 1])), (63, 173));
}

#[test]
fn two_clients_are_served_at_once_and_each_sees_its_own() {
    let daemon = RunningDaemon::start("shm");
    let mut clients = [(daemon.connect(), RED), (daemon.connect(), GREEN)];
    let mut opened: Vec<_> = clients
        .iter_mut()
        .map(|(client, _)| (client.open_stream(1, 8, 8), client.subscribe(1, 3)))
        .collect();
    for ((client, color), (source, screen)) in clients.iter_mut().zip(&mut opened) {
        client.submit(source, *color);
        let frame = client.expect_frame(screen);
        assert_eq!(screen.pixels(&frame), color.repeat(64));
    }
}

#[test]
fn a_subscriber_to_whatever_is_shown_follows_the_newest_stream() {
    let daemon = RunningDaemon::start("shm");
    let mut viewer = daemon.connect();
    viewer.send(foreframe_protocol::Subscribe { stream: 0, slots: 2 });
    let mut player = daemon.connect();
    let mut first = player.open_stream(1, 8, 8);
    let screen = viewer.expect_screen(0);
    player.submit(&mut first, RED);
    let frame = viewer.expect_frame(&screen);
    assert_eq!(screen.pixels(&frame), RED.repeat(64));

    let mut second = player.open_stream(2, 4, 4);
    let screen = viewer.expect_screen(0);
    assert_eq!((screen.pool.width, screen.pool.height), (4, 4));
    player.submit(&mut second, GREEN);
    let frame = viewer.expect_frame(&screen);
    assert_eq!(screen.pixels(&frame), GREEN.repeat(16));

    player.send(DestroyStream { stream: 2 });
    let screen = viewer.expect_screen(0);
    assert_eq!((screen.pool.width, screen.pool.height), (8, 8));
}

#[test]
fn a_subscriber_that_gives_nothing_back_loses_frames_and_the_stream_goes_on() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    let screen = client.subscribe(1, 1);
    let first = client.submit(&mut source, RED);
    let frame = client.expect_frame(&screen);
    client.expect_presented(&first);
    for _ in 0..3 {
        let submit = client.submit(&mut source, GREEN);
        client.expect_presented(&submit);
    }
    assert_eq!(screen.pixels(&frame), RED.repeat(64), "a lent slot is never written");
    client.send(OutputReleased { pool: frame.pool, slot: frame.slot });
    // The release is known before the next key is.
    let submit = client.submit(&mut source, RED);
    let frame = client.expect_frame(&screen);
    assert!(frame.skipped >= 1, "{frame:?}");
    assert!(frame.key_index <= submit.key_index);
}

#[test]
fn a_daemon_that_stops_ends_streams_and_says_goodbye() {
    let mut daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let _source = client.open_stream(1, 8, 8);
    daemon.stop();
    let said = client.read_to_end();
    assert!(matches!(said.last(), Some(DaemonMessage::Goodbye(_))), "{said:?}");
    assert!(said.iter().any(|it| matches!(it, DaemonMessage::StreamEnded(_))), "{said:?}");
    assert!(!daemon.socket.exists(), "the socket is removed");
}

#[test]
fn a_pipe_without_a_reader_holds_up_neither_streams_nor_clients_nor_the_end() {
    let pipes = daemon_fixture::private_folder();
    let pipe = pipes.path().join("pipe");
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, mode).unwrap();
    let args = foreframed::Args { record: Some("a.mcap".into()), ..Default::default() };
    let sink = format!("y4m:{}", pipe.display());
    let mut daemon = RunningDaemon::start_config(&sink, args, |config| {
        config.stop_within = std::time::Duration::from_millis(50);
    });
    let mut clients = [daemon.connect(), daemon.connect()];
    for client in &mut clients {
        let mut source = client.open_stream(1, 8, 8);
        for color in [RED, GREEN] {
            let submit = client.submit(&mut source, color);
            client.expect_presented(&submit);
        }
    }
    daemon.stop();
    let capture = foreframed::capture::Capture::open(&daemon.path("a.mcap")).unwrap();
    let info = capture.info().unwrap();
    assert!(!info.is_truncated(), "the recording is finished");
    assert_eq!(info.frames as u64 + info.gaps, 4);
}

#[test]
fn a_subscription_that_is_taken_back_at_once_leaves_no_pool_and_can_be_made_again() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    for _ in 0..20 {
        client.send(foreframe_protocol::Subscribe { stream: 1, slots: 2 });
        client.send(foreframe_protocol::Unsubscribe { stream: 1 });
        client.expect("the end of the subscription", |message| {
            matches!(message, DaemonMessage::OutputEnded(_)).then_some(())
        });
    }
    // Pools that were allocated before their subscription was taken back came with a message.
    client.take_waiting();
    let screen = client.subscribe(1, 2);
    assert_eq!(screen.pool.pool, 21, "each subscription has a number of its own");
    client.submit(&mut source, RED);
    let frame = client.expect_frame(&screen);
    assert_eq!(screen.pixels(&frame), RED.repeat(64));
}

#[test]
fn a_recording_holds_the_poses_that_led_pictures() {
    let args = foreframed::Args { record: Some("a.mcap".into()), ..Default::default() };
    let mut daemon = RunningDaemon::start_with("null", args);
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    let first = client.submit(&mut source, RED);
    client.expect_presented(&first);
    let mut view = [0.0; 16];
    for diagonal in [0, 5, 10, 15] {
        view[diagonal] = 1.0;
    }
    let content_time_ns = first.content_time_ns + 1;
    let pose = LateCamera { stream: 1, content_time_ns, view };
    client.send(pose);
    let second = client.submit(&mut source, GREEN);
    client.expect_presented(&second);
    daemon.stop();
    let capture = foreframed::capture::Capture::open(&daemon.path("a.mcap")).unwrap();
    let [found] = capture.late_cameras() else { panic!("{:?}", capture.late_cameras()) };
    assert_eq!((found.pose.content_time_ns, found.pose.view), (content_time_ns, view));
    let arrivals: Vec<_> = capture.times().map(|times| times.arrived_at_ns).collect();
    assert!((arrivals[0]..=arrivals[1]).contains(&found.arrived_at_ns), "{arrivals:?}");
}

/// A stream whose vectors are pixels from the older place to the newer, times `scale`.
fn with_motion(width: u32, height: u32, scale: [f32; 2]) -> StreamFormat {
    let motion = MotionConvention {
        format: MotionFormat::Rg32f,
        direction: MotionDirection::PreviousToCurrent,
        unit: MotionUnit::Pixels,
        scale,
        camera_motion: CameraMotion::Included,
    };
    StreamFormat { motion: Some(motion), ..StreamFormat::rgba8(width, height) }
}

#[test]
fn a_client_whose_motion_is_flipped_is_told_and_one_whose_motion_is_right_is_not() {
    let mut daemon = RunningDaemon::start("null");
    let said = [1.0, -1.0].map(|sign| {
        let mut client = daemon.connect();
        let mut source = client.open_stream_of(1, with_motion(64, 48, [1.0, sign]));
        let mut before = None;
        for key in 0..16_u32 {
            let mut submit = source.fill(RED);
            let place = |kind| source.layout().get(kind).unwrap().offset as usize;
            let (color, vectors) = (place(PlaneKind::Color), place(PlaneKind::Motion));
            let slot = &mut source.slots[submit.slot as usize];
            for (i, pixel) in slot[color..][..64 * 48 * 4].chunks_exact_mut(4).enumerate() {
                // Blotches of 3x3 that move 3 pixels down from key to key.
                let (x, y) = (i as u32 % 64 / 3, (i as u32 / 64 + 300 - 3 * key) / 3);
                let level = (x * 73 + y * 151).wrapping_mul(2_654_435_761).to_le_bytes()[3];
                pixel.copy_from_slice(&[level, level, level, 255]);
            }
            for vector in slot[vectors..][..64 * 48 * 8].chunks_exact_mut(8) {
                vector.copy_from_slice([0.0_f32, 3.0].map(f32::to_le_bytes).as_flattened());
            }
            submit.motion_from_ns = before.replace(submit.content_time_ns);
            client.send(submit);
            client.expect_released(&submit);
        }
        daemon_says(client)
    });
    daemon.stop();
    let [right, flipped] = said;
    assert_eq!(right, None);
    let told = flipped.expect("a word about motion");
    assert_eq!((told.code, told.is_fatal, &*told.field), (ErrorCode::Content, false, "motion"));
    assert!(told.found.contains("y-flipped"), "{}", told.found);
}

/// The first error that a client that leaves was told.
fn daemon_says(mut client: Client) -> Option<ErrorMessage> {
    client.send(Goodbye { reason: EndReason::Requested });
    client.read_to_end().into_iter().find_map(|message| match message {
        DaemonMessage::Error(error) => Some(error),
        _ => None,
    })
}

/// Sends a UI plane of one colour, 3x2 at column 4 and row 1, from a slot that no key uses now.
fn submit_ui(
    client: &mut Client,
    source: &mut KeySource,
    ui_index: u64,
    color: [u8; 4],
) -> UiPlane {
    let place = source.layout().get(PlaneKind::Ui).unwrap().offset;
    let plane = PlaneDescriptor::packed(place, PlaneSize { width: 3, height: 2 }, 4);
    let slot = source.slots.len() - 1;
    let pixels = &mut source.slots[slot][place as usize..][..plane.byte_len(4) as usize];
    pixels.chunks_exact_mut(4).for_each(|pixel| pixel.copy_from_slice(&color));
    let ui = UiPlane { stream: 1, slot: slot as u32, ui_index, place: [4, 1], plane };
    client.send(ui);
    let reason = client.expect("its slot back", |message| match message {
        DaemonMessage::SlotReleased(it) => (it.slot == ui.slot).then_some(it.reason),
        _ => None,
    });
    assert_eq!(reason, ReleaseReason::Copied);
    ui
}

/// The first frame with this pixel at column 5 of row 2. Every frame until then that is not the one
/// before again is put behind `seen`.
fn expect_pixel(
    client: &mut Client,
    screen: &Screen,
    color: [u8; 4],
    seen: &mut Vec<Vec<u8>>,
) -> Vec<u8> {
    loop {
        let frame = client.expect_frame(screen);
        let pixels = screen.pixels(&frame);
        client.send(OutputReleased { pool: frame.pool, slot: frame.slot });
        if seen.last() != Some(&pixels) {
            seen.push(pixels.clone());
        }
        if pixels[4 * (2 * 8 + 5)..][..4] == color {
            return pixels;
        }
    }
}

fn with_ui() -> StreamFormat {
    StreamFormat { ui: Some(ColorFormat::Rgba8), ..StreamFormat::rgba8(8, 8) }
}

#[test]
fn a_user_interface_changes_without_a_key_and_lies_over_the_next_one_too() {
    let args = foreframed::Args { record: Some("a.mcap".into()), ..Default::default() };
    let mut daemon = RunningDaemon::start_with("shm", args);
    let mut client = daemon.connect();
    let mut source = client.open_stream_of(1, with_ui());
    let screen = client.subscribe(1, 3);
    let mut seen = Vec::new();
    // Its own UI plane is all zero: clear.
    client.submit(&mut source, RED);
    expect_pixel(&mut client, &screen, RED, &mut seen);
    let first = submit_ui(&mut client, &mut source, 1, [0, 0, 200, 255]);
    let shown = expect_pixel(&mut client, &screen, [0, 0, 200, 255], &mut seen);
    for (i, pixel) in shown.chunks(4).enumerate() {
        let is_covered = (4..7).contains(&(i % 8)) && (1..3).contains(&(i / 8));
        assert_eq!(pixel, if is_covered { [0, 0, 200, 255] } else { RED }, "pixel {i}");
    }
    // 100 of 255 parts of blue over red.
    submit_ui(&mut client, &mut source, 2, [0, 0, 100, 100]);
    expect_pixel(&mut client, &screen, [155, 0, 100, 255], &mut seen);
    // The next key brings a clear one.
    client.submit(&mut source, GREEN);
    expect_pixel(&mut client, &screen, GREEN, &mut seen);
    daemon.stop();
    let capture = foreframed::capture::Capture::open(&daemon.path("a.mcap")).unwrap();
    let recorded: Vec<_> = capture.ui_planes().copied().collect();
    assert_eq!(recorded.len(), 2);
    assert_eq!((recorded[0].ui.place, recorded[0].ui.ui_index), ([4, 1], first.ui_index));
    assert_eq!(capture.ui_pixels(1).unwrap().bytes, [0, 0, 100, 100].repeat(6));
    let arrivals: Vec<_> = capture.times().map(|times| times.arrived_at_ns).collect();
    assert!(recorded.iter().all(|ui| (arrivals[0]..=arrivals[1]).contains(&ui.arrived_at_ns)));
    assert_eq!(seen.len(), 4);
    assert!(replayed(&daemon.path("a.mcap"), true) == seen, "a replay shows what was shown live");
    assert!(replayed(&daemon.path("a.mcap"), false) != seen, "and not without what came between");
}

/// What a replay of the capture shows, without repetitions; with the user interfaces between keys
/// or not.
fn replayed(path: &Path, with_ui: bool) -> Vec<Vec<u8>> {
    let mut recording = CaptureRecording::open(path).unwrap();
    let one = std::num::NonZeroUsize::MIN;
    let plan = Plan::new(recording.heads(), one);
    let reader = KeyReader::new(recording.format(), &plan).unwrap();
    let timing = KeyTiming::AsRecorded;
    let uis = timed_uis(&recording.ui_arrivals(), recording.heads(), &plan, timing);
    let uis = recording.read_uis(if with_ui { uis } else { Vec::new() });
    let config = ReplayConfig {
        method: foreframe_engine::Method::Linear,
        gpu: None,
        threads: one,
        refresh_interval: foreframe_engine::MonoSpan::from_hz(120.0),
        display_origin: recording.display_origin().unwrap(),
        pixels_per_degree: None,
        late_cameras: Vec::new(),
        finish: foreframe_engine::FinishConfig::default(),
        least_step_px: 0.0,
    };
    let keys = timed_keys(&mut recording, &reader, &plan, timing);
    let mut seen: Vec<Vec<u8>> = Vec::new();
    replay(*reader.format(), &config, keys, uis, |_, picture| {
        let mut bytes = Vec::new();
        picture.write_bytes(&mut bytes);
        if seen.last() != Some(&bytes) {
            seen.push(bytes);
        }
        Ok(())
    })
    .unwrap();
    seen
}

#[test]
fn a_ui_plane_that_does_not_fit_costs_itself_and_one_of_another_format_its_stream() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut source = client.open_stream_of(1, with_ui());
    let screen = client.subscribe(1, 3);
    let mut seen = Vec::new();
    client.submit(&mut source, RED);
    let mut large = submit_ui(&mut client, &mut source, 1, [9, 9, 9, 255]);
    large.ui_index = 2;
    large.plane.offset = 1 << 20;
    client.send(large);
    let reason = client.expect("a refusal", |message| match message {
        DaemonMessage::SlotReleased(it) => (it.key_index == 2).then_some(it.reason),
        _ => None,
    });
    assert_eq!(reason, ReleaseReason::Refused);
    let error = client.expect_error();
    assert!(error.code == ErrorCode::Plane && !error.is_fatal, "{error:?}");
    submit_ui(&mut client, &mut source, 3, [7, 7, 7, 255]);
    expect_pixel(&mut client, &screen, [7, 7, 7, 255], &mut seen);

    let format = StreamFormat { ui: Some(ColorFormat::Rgba16f), ..StreamFormat::rgba8(8, 8) };
    let create = CreateStream { stream: 2, format, max_sizes: format.full_sizes(), slots: 3 };
    client.send(create);
    let error = client.expect_error();
    assert!(error.code == ErrorCode::Unsupported && !error.is_fatal, "{error:?}");
    assert_eq!(
        (error.expected.as_str(), error.found.as_str()),
        ("rgba8, as colour has", "rgba16f")
    );
    let last = submit_ui(&mut client, &mut source, 4, [6, 6, 6, 255]);
    // An index that was used is not what a client sends that keeps to the protocol.
    client.send(UiPlane { slot: 0, ..last });
    let said = client.read_to_end();
    let is_fatal =
        |message: &DaemonMessage| matches!(message, DaemonMessage::Error(it) if it.is_fatal);
    assert!(said.iter().any(is_fatal), "{said:?}");
}

#[test]
fn a_client_whose_picture_stands_still_is_told_to_render_it_whole_and_no_oftener_than_it_can() {
    let args = foreframed::Args { ppd: Some(40.0), ..Default::default() };
    let daemon = RunningDaemon::start_with("null", args);
    let mut client = daemon.connect();
    let mut source = client.open_stream_of(1, with_motion(64, 32, [1.0; 2]));
    let first = source.fill(RED).content_time_ns;
    for key in 1..=60 {
        let mut submit = source.fill(RED);
        submit.content_time_ns = first + key * 1_000_000_000 / 50;
        submit.motion_from_ns = Some(submit.content_time_ns - 1_000_000_000 / 50);
        client.send(submit);
        assert_eq!(client.expect_released(&submit), ReleaseReason::Copied);
    }
    let hint = client.expect("a hint", |message| match message {
        DaemonMessage::Hint(hint) => Some(*hint),
        _ => None,
    });
    assert_eq!((hint.stream, hint.width, hint.height), (1, 64, 32));
    assert_eq!(hint.key_interval_ns, 20_000_000, "nothing moves: no more than the least rate");
}

#[test]
fn a_stream_is_shown_for_the_display_it_names_and_an_unknown_one_ends_it_alone() {
    let daemon = RunningDaemon::start("shm");
    let mut client = daemon.connect();
    let mut source = client.open_stream(1, 8, 8);
    let named = |name: &str| StreamFormat {
        display_profile: Some(name.parse().unwrap()),
        ..StreamFormat::rgba8(8, 8)
    };
    let format = named("/etc/passwd.toml");
    client.send(CreateStream { stream: 2, format, max_sizes: format.full_sizes(), slots: 3 });
    let error = client.expect_error();
    assert!(error.code == ErrorCode::Unsupported && !error.is_fatal, "{error:?}");
    assert_eq!((error.stream, error.found.as_str()), (Some(2), "/etc/passwd.toml"));
    assert!(error.expected.contains("asus-pg279q"), "{error:?}");
    let submit = client.submit(&mut source, RED);
    client.expect_presented(&submit);
    let mut headset = client.open_stream_of(3, named("htc-vive"));
    let submit = client.submit(&mut headset, RED);
    client.expect_presented(&submit);
}
