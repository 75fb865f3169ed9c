//! Laws of the format: what was written comes back, and nothing else ever does.

use std::io::Cursor;

use foreframe_protocol::{
    Camera, CameraMotion, CreateStream, DepthConvention, DepthFormat, DepthMeaning,
    MotionConvention, MotionDirection, MotionFormat, MotionUnit, PlaneDescriptor, PlaneKind,
    PlaneMap, PlaneSize, StreamFormat, Submit,
};
use proptest::prelude::*;

use super::*;

mod late_camera;
mod ui_plane;

const WIDTH: u32 = 6;
const HEIGHT: u32 = 4;
const INTERVAL_NS: u64 = 25_000_000;

fn format() -> StreamFormat {
    StreamFormat {
        depth: Some(DepthConvention {
            format: DepthFormat::F32,
            meaning: DepthMeaning::LinearView,
        }),
        motion: Some(MotionConvention {
            format: MotionFormat::Rg16f,
            direction: MotionDirection::CurrentToPrevious,
            unit: MotionUnit::Pixels,
            scale: [1.0, -1.0],
            camera_motion: CameraMotion::Included,
        }),
        ..StreamFormat::rgba8(WIDTH, HEIGHT)
    }
}

fn create(stream: u32) -> CreateStream {
    CreateStream { stream, format: format(), max_sizes: format().full_sizes(), slots: 3 }
}

/// Matrices that can be inverted and whose elements tell frames apart.
fn camera(seed: f32) -> Camera {
    let mut view = [0.0; 16];
    for diagonal in [0, 5, 10, 15] {
        view[diagonal] = 1.0;
    }
    view[12] = seed;
    Camera { view, projection: view }
}

/// A frame to write, owned.
#[derive(Clone, Debug)]
struct Sample {
    arrived_at_ns: u64,
    submit: Submit,
    planes: Vec<CapturedPlane>,
}

impl Sample {
    /// Frame `number`: even ones with depth and two motion planes, odd ones with colour alone.
    fn new(stream: u32, number: u32) -> Self {
        let content_time_ns = 1_000_000_000 + u64::from(number) * INTERVAL_NS;
        let size = PlaneSize { width: WIDTH, height: HEIGHT };
        let is_key = number.is_multiple_of(2);
        let mut planes = PlaneMap::default();
        let mut bytes = Vec::new();
        for &kind in &PlaneKind::ALL[..if is_key { 3 } else { 1 }] {
            let layout = pixel_layout(&format(), kind).unwrap();
            let bytes_per_pixel = u32::try_from(layout.pixel_bytes()).unwrap();
            let descriptor = PlaneDescriptor::packed(0, size, bytes_per_pixel);
            planes.set(kind, Some(descriptor));
            let spans = if kind == PlaneKind::Motion { 2 } else { 1 };
            for which in 0..spans {
                let from = content_time_ns - (1 + 3 * u64::from(which)) * INTERVAL_NS;
                let mut info =
                    PlaneInfo::described(&format(), kind, &descriptor, Some(from)).unwrap();
                info.which = which;
                let pixels = pattern(info.raw_len(), number * 10 + kind.code() + u32::from(which));
                bytes.push(CapturedPlane { info, bytes: pixels });
            }
        }
        let submit = Submit {
            stream,
            slot: number % 3,
            key_index: u64::from(number),
            content_time_ns,
            motion_from_ns: is_key.then_some(content_time_ns - INTERVAL_NS),
            is_cut: number == 4,
            planes,
            camera: Some(camera(number as f32)),
            motion_from_camera: None,
        };
        Self { arrived_at_ns: content_time_ns + 700_000, submit, planes: bytes }
    }

    fn write<W: std::io::Write>(&self, writer: &mut CaptureWriter<W>) -> Result<u64, CaptureError> {
        let planes: Vec<_> =
            self.planes.iter().map(|plane| PlaneBytes::tight(plane.info, &plane.bytes)).collect();
        writer.write_frame(self.arrived_at_ns, &self.submit, &planes)
    }
}

/// Smooth in its first half, noise in its second.
fn pattern(len: u64, seed: u32) -> Vec<u8> {
    let mut state = seed.wrapping_mul(2_654_435_761) | 1;
    (0..len)
        .map(|i| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            if i < len / 2 { (i / 3) as u8 } else { state as u8 }
        })
        .collect()
}

fn session() -> SessionInfo {
    SessionInfo::new("sample", CaptureSource::Live).with_config("method", "linear")
}

fn written(samples: &[Sample], coding: Coding) -> Vec<u8> {
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap().with_coding(coding);
    let mut streams: Vec<u32> = samples.iter().map(|sample| sample.submit.stream).collect();
    streams.dedup();
    for stream in streams {
        writer.add_stream(&create(stream)).unwrap();
    }
    for sample in samples {
        sample.write(&mut writer).unwrap();
    }
    writer.finish().unwrap()
}

fn samples(count: u32) -> Vec<Sample> {
    (0..count).map(|number| Sample::new(1, number)).collect()
}

fn open(bytes: &[u8]) -> Result<Capture<Cursor<&[u8]>>, CaptureError> {
    Capture::from_source(Cursor::new(bytes))
}

#[track_caller]
fn assert_is_sample(frame: &CapturedFrame, sample: &Sample) {
    assert_eq!(frame.arrived_at_ns, sample.arrived_at_ns, "arrival");
    assert_eq!(frame.submit, sample.submit, "submit message");
    assert_eq!(frame.planes, sample.planes, "planes");
}

#[test]
fn what_was_written_comes_back_with_every_coding() {
    let samples = samples(5);
    for coding in Coding::ALL {
        let bytes = written(&samples, coding);
        let capture = open(&bytes).unwrap();
        assert_eq!(capture.session(), &session());
        assert_eq!(capture.streams(), [create(1)]);
        assert_eq!(capture.frame_count(), samples.len());
        for (frame, sample) in capture.frames().zip(&samples) {
            assert_is_sample(&frame.unwrap(), sample);
        }
        let info = capture.info().unwrap();
        assert!(!info.is_truncated(), "{:?}", info.tail);
        assert_eq!(info.damaged, []);
    }
}

#[test]
fn the_content_hash_is_of_what_is_shown_and_not_of_how_it_is_stored() {
    let hash = |samples: &[Sample], coding| {
        open(&written(samples, coding)).unwrap().content_hash(0).unwrap()
    };
    let first = hash(&samples(5), Coding::RAW);
    for coding in Coding::ALL {
        let mut late = samples(5);
        late.iter_mut().for_each(|sample| sample.arrived_at_ns += 12_345);
        assert_eq!(hash(&late, coding), first);
    }
    let changes: [fn(&mut Sample); 5] = [
        |sample| sample.planes[0].bytes[7] ^= 1,
        |sample| sample.planes[1].bytes[0] ^= 1,
        |sample| sample.planes[1].info.jitter[0] += 0.25,
        |sample| sample.submit.is_cut = true,
        |sample| sample.submit.camera = Some(camera(0.5)),
    ];
    for (number, change) in changes.iter().enumerate() {
        let mut changed = samples(5);
        change(&mut changed[2]);
        assert_ne!(hash(&changed, Coding::RAW), first, "change {number}");
    }
    assert_ne!(hash(&samples(4), Coding::RAW), first);
}

#[test]
fn frames_are_found_in_any_order_and_by_the_planes_that_are_wanted() {
    let samples = samples(5);
    let bytes = written(&samples, Coding::FAST);
    let capture = open(&bytes).unwrap();
    for number in [4, 0, 3] {
        assert_is_sample(&capture.frame(number).unwrap(), &samples[number]);
    }
    let frame = capture.frame_with(2, |info| info.which == 1).unwrap();
    let kinds: Vec<_> =
        frame.planes.iter().map(|plane| (plane.info.kind, plane.info.which)).collect();
    assert_eq!(kinds, [(PlaneKind::Color, 0), (PlaneKind::Motion, 1)]);
    let error = capture.frame(5).unwrap_err();
    assert!(matches!(error, CaptureError::NoSuchFrame { frames: 5, found: 5 }), "{error}");
}

#[test]
fn motion_is_found_by_the_content_time_it_points_back_to() {
    let bytes = written(&samples(3), Coding::FAST);
    let frame = open(&bytes).unwrap().frame(2).unwrap();
    let content = frame.submit.content_time_ns;
    for (span, which) in [(1, 0), (4, 1)] {
        let plane = frame.motion_from(content - span * INTERVAL_NS).unwrap();
        assert_eq!(plane.info.which, which, "span of {span}");
    }
    assert!(frame.motion_from(content).is_none(), "no motion spans no time");
}

#[test]
fn row_padding_is_left_out() {
    let mut sample = Sample::new(1, 1);
    let tight = sample.planes[0].bytes.clone();
    let row = tight.len() / HEIGHT as usize;
    // The last row may lack its padding.
    let mut padded = tight.chunks(row).collect::<Vec<_>>().join(&[0xee_u8; 8][..]);
    std::mem::swap(&mut sample.planes[0].bytes, &mut padded);
    let plane = PlaneBytes {
        info: sample.planes[0].info,
        stride: u32::try_from(row + 8).unwrap(),
        bytes: &sample.planes[0].bytes,
    };
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    writer.add_stream(&create(1)).unwrap();
    writer.write_frame(5, &sample.submit, &[plane]).unwrap();
    let bytes = writer.finish().unwrap();
    assert_eq!(open(&bytes).unwrap().frame(0).unwrap().color().bytes, tight);
}

#[test]
fn several_streams_share_a_file() {
    let all: Vec<Sample> = (0..4).map(|n| Sample::new(if n < 2 { 1 } else { 7 }, n)).collect();
    let bytes = written(&all, Coding::SMALL);
    let capture = open(&bytes).unwrap();
    assert_eq!(capture.streams(), [create(1), create(7)]);
    let streams: Vec<usize> = capture.times().map(|times| times.stream).collect();
    assert_eq!(streams, [0, 0, 1, 1]);
    assert_is_sample(&capture.frame(3).unwrap(), &all[3]);
    let info = capture.info().unwrap();
    assert_eq!(info.streams.iter().map(|s| s.frames).collect::<Vec<_>>(), [2, 2]);
    assert!((info.duration_s - 0.025).abs() < 1e-12, "of the first stream: {}", info.duration_s);
}

#[test]
fn gaps_are_counted() {
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    writer.add_stream(&create(1)).unwrap();
    let gap =
        |count| Gap { stream: 1, count, from_ns: 3, to_ns: 9, reason: "queue full".to_owned() };
    writer.gap(&gap(2)).unwrap();
    Sample::new(1, 0).write(&mut writer).unwrap();
    writer.gap(&gap(5)).unwrap();
    let bytes = writer.finish().unwrap();
    let capture = open(&bytes).unwrap();
    assert_eq!(capture.gaps(), [gap(2), gap(5)]);
    assert_eq!(capture.info().unwrap().gaps, 7);
}

#[test]
fn the_writer_refuses_what_the_reader_would_not_accept() {
    let sample = Sample::new(1, 0);
    let attempt = |edit: &dyn Fn(&mut Sample)| {
        let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
        writer.add_stream(&create(1)).unwrap();
        let mut bad = sample.clone();
        edit(&mut bad);
        let result = bad.write(&mut writer).map(|_| ());
        sample.write(&mut writer).expect("a refused frame does not spoil the file");
        let bytes = writer.finish().unwrap();
        assert!(open(&bytes).unwrap().frame_count() >= 1);
        result.map_err(|error| error.to_string())
    };
    assert_eq!(attempt(&|_| {}), Ok(()));
    type Edit = &'static dyn Fn(&mut Sample);
    let refused: [(Edit, &str); 8] = [
        (&|s| s.submit.stream = 2, "a stream that was added"),
        (&|s| s.planes.clear(), "a color plane"),
        (&|s| s.planes.swap(0, 1), "a color plane first"),
        (&|s| s.planes[3].info.which = 0, "motion plane number 1"),
        (&|s| s.planes[0].info.width = 5, "color of 6x4 as in the submit message"),
        (&|s| s.planes[1].info.valid.width = 7, "inside 6x4"),
        (&|s| s.planes[1].bytes.truncate(95), "96 bytes of depth"),
        (&|s| s.planes[1].bytes.push(0), "at most 96 bytes of depth"),
    ];
    for (edit, expected) in refused {
        let error = attempt(edit).unwrap_err();
        assert!(error.contains(expected), "`{error}` does not say `{expected}`");
    }
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    writer.add_stream(&create(3)).unwrap();
    assert!(writer.add_stream(&create(3)).is_err(), "a stream number is used once");
}

#[test]
fn a_capture_cut_off_at_any_byte_opens_up_to_its_last_whole_frame() {
    let samples = samples(4);
    let bytes = written(&samples, Coding::SMALL);
    // Where each frame is complete: opening up to there finds it, up to one byte less does not.
    let mut whole_before = 0;
    for len in 0..bytes.len() {
        let Ok(capture) = open(&bytes[..len]) else {
            assert_eq!(whole_before, 0, "a longer file lost what a shorter one had, at {len}");
            continue;
        };
        let info = capture.info().unwrap();
        assert!(info.is_truncated(), "cut at {len} of {}", bytes.len());
        let frames = capture.frame_count();
        assert!(frames >= whole_before, "{frames} frames at {len}, {whole_before} before");
        whole_before = frames;
        for (frame, sample) in capture.frames().zip(&samples) {
            assert_is_sample(&frame.unwrap(), sample);
        }
    }
    assert_eq!(whole_before, samples.len());
    assert!(!open(&bytes).unwrap().info().unwrap().is_truncated(), "the whole file is whole");
}

#[test]
fn each_frame_is_whole_as_soon_as_it_was_written() {
    // A kill leaves the file as it is between two calls.
    struct Spy(std::rc::Rc<std::cell::RefCell<Vec<u8>>>);
    impl std::io::Write for Spy {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.borrow_mut().extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let file = std::rc::Rc::new(std::cell::RefCell::new(Vec::new()));
    let buffered = std::io::BufWriter::new(Spy(file.clone()));
    let mut writer = CaptureWriter::to_writer(buffered, &session()).unwrap();
    writer.add_stream(&create(1)).unwrap();
    for (before, sample) in samples(3).iter().enumerate() {
        assert_eq!(open(&file.borrow()).unwrap().frame_count(), before);
        sample.write(&mut writer).unwrap();
        assert_eq!(open(&file.borrow()).unwrap().frame_count(), before + 1);
    }
}

#[test]
fn a_tail_of_zeros_is_a_cut() {
    let mut bytes = written(&samples(2), Coding::FAST);
    let whole = bytes.len();
    let frames_end =
        (0..whole).find(|&len| open(&bytes[..len]).is_ok_and(|c| c.frame_count() == 2));
    bytes.truncate(frames_end.unwrap());
    bytes.resize(whole + 4096, 0);
    let capture = open(&bytes).unwrap();
    assert_eq!(capture.frame_count(), 2);
    let tail = capture.info().unwrap().tail.unwrap();
    assert_eq!(tail.found, "opcode 0");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]
    #[test]
    fn a_flipped_bit_is_an_error_or_changes_nothing_that_is_read(place: prop::sample::Index, bit in 0_u8..8) {
        let samples = samples(3);
        let mut bytes = written(&samples, Coding::SMALL);
        let at = place.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        if let Ok(capture) = open(&bytes) {
            let info = capture.info().ok();
            let frames: Vec<_> = capture.frames().collect();
            let noticed = frames.iter().any(Result::is_err)
                || info.is_none_or(|info| info.is_truncated() || !info.damaged.is_empty());
            prop_assert!(noticed || frames.len() == samples.len(), "lost a frame in silence, byte {at}");
            for frame in frames.into_iter().flatten() {
                let sample = &samples[usize::try_from(frame.submit.key_index).unwrap()];
                assert_is_sample(&frame, sample);
            }
            prop_assert_eq!(capture.streams(), [create(1)]);
            prop_assert_eq!(capture.session(), &session());
        }
    }

    #[test]
    fn arbitrary_bytes_are_an_error_and_no_panic(
        tail in prop::collection::vec(any::<u8>(), 0..400),
        keep: prop::sample::Index,
    ) {
        prop_assert!(open(&tail).is_err());
        let bytes = written(&samples(2), Coding::RAW);
        let mut bytes = bytes[..keep.index(bytes.len())].to_vec();
        bytes.extend(tail);
        if let Ok(capture) = open(&bytes) {
            for (frame, sample) in capture.frames().flatten().zip(samples(2)) {
                assert_is_sample(&frame, &sample);
            }
        }
    }
}

#[test]
fn a_damaged_frame_costs_itself_and_no_other() {
    let samples = samples(4);
    let bytes = written(&samples, Coding::RAW);
    // Raw pixels stand in the file as they are: find those of frame 1 and spoil one.
    let pixels = &samples[1].planes[0].bytes;
    let at = bytes.windows(pixels.len()).position(|window| window == pixels).unwrap();
    let mut bytes = bytes.clone();
    bytes[at + 5] ^= 4;
    let capture = open(&bytes).unwrap();
    let error = capture.frame(1).unwrap_err();
    assert!(matches!(error, CaptureError::Plane { plane: "color", frame: 1, .. }), "{error}");
    assert!(error.to_string().contains("expected hash"), "{error}");
    for number in [0, 2, 3] {
        assert_is_sample(&capture.frame(number).unwrap(), &samples[number]);
    }
}

#[test]
fn foreign_files_and_other_versions_are_named() {
    let foreign = |profile: &str| {
        let mut out = Vec::new();
        let options = mcap::WriteOptions::new().profile(profile).compression(None);
        options.create(Cursor::new(&mut out)).unwrap().finish().unwrap();
        open(&out).unwrap_err()
    };
    let error = open(b"\x76/1\x01 an EXR file").unwrap_err();
    assert!(matches!(error, CaptureError::NotMcap { .. }), "{error}");
    let error = foreign("ros2");
    assert!(matches!(&error, CaptureError::Foreign { found, .. } if found == "ros2"), "{error}");
    let error = foreign("foreframe-capture/2");
    assert!(
        matches!(&error, CaptureError::Version { expected: 1, found } if found == "2"),
        "{error}"
    );
    let error = foreign("foreframe-capture/1");
    assert!(matches!(error, CaptureError::Empty { .. }), "{error}");
    assert!(matches!(open(b"").unwrap_err(), CaptureError::NotMcap { .. }));
}

#[test]
fn the_mcap_crate_reads_the_file_with_every_crc_checked() {
    let samples = samples(3);
    let bytes = written(&samples, Coding::SMALL);
    let options = mcap::sans_io::linear_reader::LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true);
    let mut reader = mcap::sans_io::LinearReader::new_with_options(options);
    let mut rest = &bytes[..];
    while let Some(event) = reader.next_event() {
        if let mcap::sans_io::LinearReadEvent::ReadRequest(wanted) = event.unwrap() {
            let len = wanted.min(rest.len());
            reader.insert(len).copy_from_slice(&rest[..len]);
            reader.notify_read(len);
            rest = &rest[len..];
        }
    }
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let topics: Vec<&str> = messages.iter().map(|message| message.channel.topic.as_str()).collect();
    let key = ["submit", "color", "depth", "motion", "motion/1"].map(|t| format!("/stream/1/{t}"));
    let mut expected = vec!["/session", "/stream/1/create"];
    expected.extend(key.iter().map(String::as_str));
    expected.extend(["/stream/1/submit", "/stream/1/color"]);
    expected.extend(key.iter().map(String::as_str));
    assert_eq!(topics, expected);
    assert!(messages.iter().all(|message| message.channel.schema.is_some()), "all have a schema");
    let submit = &messages[2];
    assert_eq!(submit.log_time, samples[0].arrived_at_ns, "log time is the arrival");
    assert_eq!(submit.publish_time, samples[0].submit.content_time_ns);
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    // One for the session, one for the stream, one per frame.
    assert_eq!(summary.chunk_indexes.len(), 2 + samples.len());
    assert!(summary.chunk_indexes.iter().all(|chunk| chunk.compression.is_empty()));
}

#[test]
fn the_schemas_in_the_file_are_valid_json_or_text() {
    for schema in [schema::SESSION, schema::GAP] {
        let text: serde_json::Value = serde_json::from_str(schema.text).unwrap();
        assert_eq!(text["title"], schema.name);
    }
    let json = serde_json::to_value(session()).unwrap();
    let schema: serde_json::Value = serde_json::from_str(schema::SESSION.text).unwrap();
    for required in schema["required"].as_array().unwrap() {
        assert!(json.get(required.as_str().unwrap()).is_some(), "{required}");
    }
}

/// A capture of version 1 in the repository: what was recorded once stays readable.
#[test]
fn the_capture_in_the_repository_is_still_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/captures/version-1.mcap");
    if std::env::var_os("FOREFRAME_BLESS").is_some() {
        std::fs::write(path, written(&samples(3), Coding::SMALL)).unwrap();
    }
    let capture = Capture::open(std::path::Path::new(path)).unwrap();
    assert_eq!(capture.frame_count(), 3);
    assert!(!capture.info().unwrap().is_truncated(), "the file is whole");
    for (frame, sample) in capture.frames().zip(samples(3)) {
        assert_is_sample(&frame.unwrap(), &sample);
    }
}
