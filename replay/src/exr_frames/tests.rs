//! A capture that goes out as EXR frames comes back bit for bit; Blender's conventions are read as
//! they are meant.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    WritableImage as _,
};
use foreframe_protocol::{
    Camera, CameraMotion, ColorFormat, CreateStream, DepthConvention, DepthFormat, DepthMeaning,
    MaskFormat, MotionConvention, MotionDirection, MotionFormat, MotionUnit, PlaneDescriptor,
    PlaneKind, PlaneMap, PlaneSize, Primaries, Rect, StreamFormat, Submit, Transfer, ValidRectUse,
};
use foreframed::capture::{
    Capture, CaptureSource, CaptureWriter, CapturedFrame, Coding, PlaneBytes, PlaneInfo,
    SessionInfo, pixel_layout,
};
use half::f16;
use serde_json::json;
use tempfile::TempDir;

use super::import::{self, ORIGIN_NS, Options};
use super::{export, srgb};

const WIDTH: u32 = 7;
const HEIGHT: u32 = 5;

fn options() -> Options {
    Options { name: None, coding: Coding::FAST }
}

/// Every bit pattern turns up sooner or later: NaN, infinities, denormals.
fn noise(len: u64, seed: u64) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()[5]
    };
    (0..len).map(|_| next()).collect()
}

fn camera(seed: f32) -> Camera {
    let mut view = [0.0; 16];
    for diagonal in [0, 5, 10, 15] {
        view[diagonal] = 1.0 + seed / 3.0;
    }
    view[12] = 0.1;
    Camera { view, projection: view }
}

fn formats() -> Vec<StreamFormat> {
    let motion = |format, scale| {
        Some(MotionConvention {
            format,
            direction: MotionDirection::PreviousToCurrent,
            unit: MotionUnit::Uv,
            scale,
            camera_motion: CameraMotion::Missing,
        })
    };
    let depth = |format, meaning| Some(DepthConvention { format, meaning });
    let plain = StreamFormat::rgba8(WIDTH, HEIGHT);
    vec![
        plain,
        StreamFormat {
            depth: depth(DepthFormat::F32, DepthMeaning::LinearView),
            motion: motion(MotionFormat::Rg16f, [1.0, -1.0]),
            ui: Some(ColorFormat::Rgba8),
            mask: Some(MaskFormat::Class8),
            ..plain
        },
        StreamFormat {
            color: ColorFormat::Rgba16f,
            transfer: Transfer::Linear,
            white_cd_m2: 203.0,
            depth: depth(DepthFormat::F16, DepthMeaning::Reversed),
            motion: motion(MotionFormat::Rg32f, [0.1, 3.0]),
            ui: Some(ColorFormat::Rgba16f),
            ..plain
        },
        StreamFormat {
            color: ColorFormat::Rgb10a2,
            transfer: Transfer::Pq,
            primaries: Primaries::Bt2020,
            valid_rect_use: ValidRectUse::Stretch,
            display_profile: Some("htc-vive".parse().unwrap()),
            depth: depth(DepthFormat::U16, DepthMeaning::Standard),
            ..plain
        },
        StreamFormat { depth: depth(DepthFormat::U24, DepthMeaning::Standard), ..plain },
    ]
}

/// Two frames of every plane that the format has, two spans of motion, planes of several sizes.
fn write_capture(path: &Path, format: &StreamFormat) {
    let session = SessionInfo::new("round", CaptureSource::Live);
    let mut writer = CaptureWriter::create(path, &session).unwrap();
    let create =
        CreateStream { stream: 1, format: *format, max_sizes: format.full_sizes(), slots: 3 };
    writer.add_stream(&create).unwrap();
    for number in 0..2_u64 {
        let content_time_ns = 5_000_000_001 + number * 16_666_667;
        let mut descriptors = PlaneMap::default();
        let mut planes = Vec::new();
        for &kind in PlaneKind::ALL {
            let Some(layout) = pixel_layout(format, kind) else { continue };
            let is_half = matches!(kind, PlaneKind::Depth | PlaneKind::Motion) && number == 1;
            let (width, height) = if is_half { (4, 3) } else { (WIDTH, HEIGHT) };
            let bytes_per_pixel = u32::try_from(layout.pixel_bytes()).unwrap();
            let descriptor = PlaneDescriptor {
                valid: Rect { x: 1, y: 0, width: width - 1, height },
                jitter: [0.25, -0.125],
                ..PlaneDescriptor::packed(0, PlaneSize { width, height }, bytes_per_pixel)
            };
            descriptors.set(kind, Some(descriptor));
            for which in 0..if kind == PlaneKind::Motion { 2 } else { 1 } {
                let from = content_time_ns - 1_000_000 * (1 + u64::from(which));
                let info = PlaneInfo {
                    which,
                    ..PlaneInfo::described(format, kind, &descriptor, Some(from)).unwrap()
                };
                let seed = number * 100 + u64::from(kind.code()) * 10 + u64::from(which);
                planes.push((info, noise(info.raw_len(), seed)));
            }
        }
        let has_motion = format.motion.is_some();
        let submit = Submit {
            stream: 1,
            slot: 2,
            key_index: 40 + number,
            content_time_ns,
            motion_from_ns: has_motion.then_some(content_time_ns - 1_000_000),
            is_cut: number == 1,
            planes: descriptors,
            camera: (number == 0).then(|| camera(1.0)),
            motion_from_camera: (number == 0 && has_motion).then(|| camera(2.0)),
        };
        let planes: Vec<_> =
            planes.iter().map(|(info, bytes)| PlaneBytes::tight(*info, bytes)).collect();
        writer.write_frame(content_time_ns + 3, &submit, &planes).unwrap();
    }
    writer.finish().unwrap();
}

/// What must survive: everything but where planes lay in the application's memory.
fn comparable(frame: CapturedFrame) -> CapturedFrame {
    let submit = Submit { slot: 0, planes: PlaneMap::default(), ..frame.submit };
    CapturedFrame { submit, ..frame }
}

#[test]
fn exported_frames_come_back_bit_for_bit_in_every_format() {
    for format in formats() {
        let dir = TempDir::new().unwrap();
        let (first, second) = (dir.path().join("a.mcap"), dir.path().join("b.mcap"));
        let frames = dir.path().join("frames");
        write_capture(&first, &format);
        let before = Capture::open(&first).unwrap();
        assert_eq!(export::export(&before, 0, &frames, |_, _| ()).unwrap(), 2);
        import::import(&frames, &second, &options(), |_, _| ()).unwrap();
        let after = Capture::open(&second).unwrap();
        assert_eq!(after.streams()[0].format, format);
        assert_eq!(after.session().name, "round");
        assert_eq!(after.frame_count(), before.frame_count());
        for (after, before) in after.frames().zip(before.frames()) {
            assert_eq!(comparable(after.unwrap()), comparable(before.unwrap()));
        }
    }
}

#[test]
fn a_folder_that_has_frames_is_not_written_over() {
    let dir = TempDir::new().unwrap();
    let file = dir.path().join("a.mcap");
    write_capture(&file, &formats()[0]);
    let capture = Capture::open(&file).unwrap();
    let frames = dir.path().join("frames");
    export::export(&capture, 0, &frames, |_, _| ()).unwrap();
    let error = export::export(&capture, 0, &frames, |_, _| ()).unwrap_err().to_string();
    assert!(error.contains("expected a folder without frames"), "{error}");
}

/// One frame as Blender writes it.
struct Rendered {
    number: u64,
    color: [f32; 3],
    depth: f32,
    /// Name of the file and vectors in it, the same for every pixel.
    vectors: Vec<(&'static str, [f32; 2])>,
    /// Turn of the camera about its vertical axis, radians.
    turn: f64,
}

fn write_exr(path: &Path, channels: Vec<(&str, FlatSamples)>) {
    let list = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
    let size = (WIDTH as usize, HEIGHT as usize);
    let layer =
        Layer::new(size, LayerAttributes::default(), Encoding::default(), AnyChannels::sort(list));
    Image::from_layer(layer).write().non_parallel().to_file(path).unwrap();
}

fn halves(value: f32) -> FlatSamples {
    FlatSamples::F16(vec![f16::from_f32(value); (WIDTH * HEIGHT) as usize])
}

impl Rendered {
    fn write(&self, folder: &Path) {
        let number = self.number;
        let [r, g, b] = self.color;
        write_exr(
            &folder.join(format!("frame_{number:04}.exr")),
            vec![
                ("ViewLayer.Combined.R", halves(r)),
                ("ViewLayer.Combined.G", halves(g)),
                ("ViewLayer.Combined.B", halves(b)),
            ],
        );
        let mut files = serde_json::Map::new();
        files.insert("color".to_owned(), json!(format!("frame_{number:04}.exr")));
        for &(name, [x, y]) in &self.vectors {
            let file = format!("{name}_{number:04}.exr");
            let depth = FlatSamples::F32(vec![self.depth; (WIDTH * HEIGHT) as usize]);
            let mut channels = vec![
                ("ViewLayer.Vector.X", halves(x)),
                ("ViewLayer.Vector.Y", halves(y)),
                // The way to the next frame: poison that must not turn up anywhere.
                ("ViewLayer.Vector.Z", halves(77.0)),
                ("ViewLayer.Vector.W", halves(77.0)),
            ];
            if name == "data" {
                channels.push(("ViewLayer.Depth.Z", depth));
            }
            write_exr(&folder.join(&file), channels);
            files.insert(name.to_owned(), json!(file));
        }
        let (sin, cos) = (libm::sin(self.turn), libm::cos(self.turn));
        let sidecar = json!({
            "scene": "made up", "frame": number, "time": number as f64 / 100.0, "fps": 100.0,
            "width": WIDTH, "height": HEIGHT, "files": files,
            "world_to_camera": [[cos, 0.0, -sin, 1.0], [0.0, 1.0, 0.0, 2.0], [sin, 0.0, cos, 3.0], [0.0, 0.0, 0.0, 1.0]],
            "projection": [[1.0, 0.0, 0.0, 0.0], [0.0, 1.4, 0.0, 0.0], [0.0, 0.0, -1.0, -0.2], [0.0, 0.0, -1.0, 0.0]],
            "is_first_frame_after_cut": number == 2,
        });
        let path = folder.join(format!("frame_{number:04}.json"));
        std::fs::write(path, sidecar.to_string()).unwrap();
    }
}

/// Frame 4 has one-frame and four-frame vectors, frame 2 colour alone, frame 3 only its camera.
fn rendered() -> Vec<Rendered> {
    let level = |level| srgb::linear_from_level(level).to_f32();
    let color = [level(0), level(100), level(255)];
    let alone = |number| Rendered { number, color, depth: 0.0, vectors: Vec::new(), turn: 0.1 };
    let vectors = vec![("data", [1.5, 2.5]), ("vector_step4", [6.0, -10.0])];
    vec![alone(2), alone(3), Rendered { depth: 12.5, vectors, turn: 0.0, ..alone(4) }]
}

fn imported(frames: &[Rendered]) -> anyhow::Result<(TempDir, Capture)> {
    let dir = TempDir::new().unwrap();
    for frame in frames {
        frame.write(dir.path());
    }
    std::fs::write(dir.path().join("object_ids.json"), "{}").unwrap();
    let file = dir.path().join("out.mcap");
    import::import(dir.path(), &file, &options(), |_, _| ())?;
    let capture = Capture::open(&file)?;
    Ok((dir, capture))
}

fn first_vector(frame: &CapturedFrame, from_ns: u64) -> [f32; 2] {
    let bytes = &frame.motion_from(from_ns).expect("motion of that span").bytes;
    [0, 2].map(|at| f16::from_le_bytes([bytes[at], bytes[at + 1]]).to_f32())
}

#[test]
fn blender_frames_keep_their_numbers_and_say_what_they_mean() {
    let (_dir, capture) = imported(&rendered()).unwrap();
    let format = capture.streams()[0].format;
    assert_eq!((format.color, format.transfer), (ColorFormat::Rgba8, Transfer::Srgb));
    let motion = format.motion.unwrap();
    assert_eq!(motion.direction, MotionDirection::CurrentToPrevious);
    assert_eq!((motion.unit, motion.scale), (MotionUnit::Pixels, [1.0, -1.0]), "y is up");
    assert_eq!(format.depth.unwrap().meaning, DepthMeaning::LinearView);
    assert_eq!(capture.session().name, "made up");

    let frames: Vec<_> = capture.frames().map(Result::unwrap).collect();
    assert_eq!(frames[0].planes.len(), 1, "a frame may have colour alone");
    assert_eq!(frames[0].submit.motion_from_ns, None);
    assert!(frames[0].submit.is_cut && !frames[1].submit.is_cut);
    assert_eq!(frames[0].color().bytes[..4], [0, 100, 255, 255]);

    let last = &frames[2];
    let now = ORIGIN_NS + 40_000_000;
    assert_eq!((last.submit.content_time_ns, last.submit.key_index), (now, 4));
    assert_eq!(last.arrived_at_ns, now, "files arrive at their content time");
    assert_eq!(last.submit.motion_from_ns, Some(now - 10_000_000));
    assert_eq!(first_vector(last, now - 10_000_000), [1.5, 2.5]);
    assert_eq!(first_vector(last, now - 40_000_000), [6.0, -10.0], "frame 0 need not be there");
    assert_eq!(last.plane(PlaneKind::Depth).unwrap().bytes[..4], 12.5_f32.to_le_bytes());
    let view = last.submit.camera.unwrap().view;
    assert_eq!(view[12..15], [1.0, 2.0, 3.0], "translation stands in the last column");
    assert_eq!(last.submit.motion_from_camera, frames[1].submit.camera);
}

#[test]
fn background_moves_as_the_camera_turns() {
    let mut frames = rendered();
    frames[2].depth = 1e10;
    frames[2].vectors = vec![("data", [0.0, 0.0]), ("vector_step4", [0.0, 0.0])];
    let (_dir, capture) = imported(&frames).unwrap();
    let frame = capture.frame(2).unwrap();
    let now = frame.submit.content_time_ns;
    let pixels = &frame.motion_from(now - 10_000_000).unwrap().bytes;
    // Row 2, column 3 is the centre of the picture.
    let at = (2 * WIDTH as usize + 3) * 4;
    let x = f16::from_le_bytes([pixels[at], pixels[at + 1]]).to_f32();
    let y = f16::from_le_bytes([pixels[at + 2], pixels[at + 3]]).to_f32();
    // Frame 3 looked 0.1 rad to the side: half the width times tan of the angle, at P00 = 1.
    let expected = f64::from(WIDTH) / 2.0 * libm::tan(0.1);
    assert!((f64::from(x.abs()) - expected).abs() < 1e-3, "{x} for {expected}");
    assert!(y.abs() < 1e-3, "{y}");
    let unknown = first_vector(&frame, now - 40_000_000);
    assert!(unknown.iter().all(|v| v.is_nan()), "frame 0 is not there: {unknown:?}");
}

#[test]
fn clipped_vectors_are_no_motion() {
    let mut frames = rendered();
    frames[2].vectors = vec![("data", [-32768.0, 3.0]), ("vector_step4", [3.0, 32768.0])];
    let (_dir, capture) = imported(&frames).unwrap();
    let frame = capture.frame(2).unwrap();
    for span in [10_000_000, 40_000_000] {
        let vector = first_vector(&frame, frame.submit.content_time_ns - span);
        assert!(vector.iter().all(|v| v.is_nan()), "{vector:?}");
    }
}

#[test]
fn colour_off_the_levels_stays_half_floats() {
    let mut frames = rendered();
    for frame in &mut frames {
        frame.color = [0.501, 2.5, 0.0];
    }
    let (_dir, capture) = imported(&frames).unwrap();
    let format = capture.streams()[0].format;
    assert_eq!((format.color, format.transfer), (ColorFormat::Rgba16f, Transfer::Linear));
    let bytes = &capture.frame(0).unwrap().planes[0].bytes;
    assert_eq!(bytes[2..4], f16::from_f32(2.5).to_le_bytes(), "above 1 is kept");
}

#[test]
fn what_is_wrong_with_a_folder_is_said_with_file_expected_and_found() {
    type Spoil = fn(&Path);
    let cases: [(Spoil, &[&str]); 6] = [
        (
            |dir| std::fs::remove_file(dir.join("frame_0003.exr")).unwrap(),
            &["frame 3", "frame_0003.exr"],
        ),
        (
            |dir| std::fs::write(dir.join("frame_0003.exr"), "no image").unwrap(),
            &["frame_0003.exr", "expected an EXR"],
        ),
        (
            |dir| std::fs::write(dir.join("frame_0003.json"), "{").unwrap(),
            &["frame_0003.json", "expected the side-car"],
        ),
        (
            |dir| {
                std::fs::rename(dir.join("frame_0003.json"), dir.join("frame_0009.json")).unwrap();
            },
            &["expected frame 9", "found 3"],
        ),
        (
            |dir| write_exr(&dir.join("data_0004.exr"), vec![("ViewLayer.Vector.X", halves(1.0))]),
            &["frame 4", "expected a channel `ViewLayer.Vector.Y`"],
        ),
        (
            |dir| {
                let path = dir.join("frame_0004.json");
                let text = std::fs::read_to_string(&path).unwrap();
                std::fs::write(&path, text.replace("\"width\":7", "\"width\":8")).unwrap();
            },
            &["frame 4", "expected 7x5", "found 8x5"],
        ),
    ];
    for (spoil, expected) in cases {
        let dir = TempDir::new().unwrap();
        for frame in rendered() {
            frame.write(dir.path());
        }
        spoil(dir.path());
        let file = dir.path().join("out.mcap");
        let error = import::import(dir.path(), &file, &options(), |_, _| ()).unwrap_err();
        let text = format!("{error:#}");
        for part in expected {
            assert!(text.contains(part), "`{text}` does not say `{part}`");
        }
        assert!(!file.exists(), "a failed import leaves nothing behind");
    }
}

#[test]
fn an_empty_folder_says_what_it_should_hold() {
    let dir = TempDir::new().unwrap();
    let file = dir.path().join("out.mcap");
    let error = import::import(dir.path(), &file, &options(), |_, _| ()).unwrap_err();
    assert!(error.to_string().contains("frame_NNNN.json"), "{error:#}");
}
