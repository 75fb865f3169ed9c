//! A capture becomes a folder of EXR frames and side-cars.
//!
//! One EXR per frame: `R G B A`, `Z`, `backward.u/.v`, scanlines, ZIP16. Planes of another size
//! than colour stand in parts of their own. Colour of 8 bits is written as linear halves, which
//! every program shows right and which lead back to the very levels; everything else keeps its
//! bits. Matrices, units and conventions are attributes of the image and fields of the side-car.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, ensure};
use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, LineOrder, Text, WritableImage as _,
};
use foreframe_protocol::{Camera, PlaneKind, StreamFormat};
use foreframed::capture::{Capture, CapturedFrame, CapturedPlane};
use half::f16;

use super::exported::{self, Exported, FormatText, PlaneText, Samples};
use super::sidecar::{self, Sidecar};
use super::srgb;

/// Scanlines in blocks of 16, each a ZIP stream: lossless for every type, small, widely read.
const ENCODING: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

/// Exports one stream of `capture` to `folder`, which is made if it is not there. `progress` is
/// called with the number of frames done and that of all. Returns how many there were.
///
/// # Errors
/// If there is no such stream, the folder has frames in it already, a frame cannot be read or a
/// file not written.
pub fn export(
    capture: &Capture,
    stream: usize,
    folder: &Path,
    mut progress: impl FnMut(u64, u64),
) -> anyhow::Result<u64> {
    let streams = capture.streams().len();
    ensure!(stream < streams, "expected a stream below {streams}, found {stream}");
    let format = capture.streams()[stream].format;
    let numbers: Vec<usize> = capture
        .times()
        .enumerate()
        .filter(|(_, times)| times.stream == stream)
        .map(|(number, _)| number)
        .collect();
    ensure!(
        !numbers.is_empty(),
        "expected at least one whole frame in stream {stream}, found none"
    );
    let name = folder.display();
    fs::create_dir_all(folder).with_context(|| format!("making the folder {name}"))?;
    ensure!(
        sidecar::list(folder).is_err(),
        "{name}: expected a folder without frames, found frame_NNNN.json: choose another one"
    );
    let origin = numbers
        .first()
        .map_or(0, |&number| capture.times().nth(number).map_or(0, |times| times.content_time_ns));
    for (done, &number) in numbers.iter().enumerate() {
        let frame = capture.frame(number)?;
        let image_name = format!("frame_{done:04}.exr");
        let sidecar = side_car(&frame, &format, done as u64, origin, capture, &image_name);
        write_image(&frame, &format, &folder.join(&image_name))
            .with_context(|| format!("writing {image_name}"))?;
        let text = serde_json::to_string_pretty(&sidecar)?;
        let path = folder.join(format!("frame_{done:04}.json"));
        fs::write(&path, text).with_context(|| format!("writing {}", path.display()))?;
        progress(done as u64 + 1, numbers.len() as u64);
    }
    Ok(numbers.len() as u64)
}

#[expect(clippy::cast_precision_loss, reason = "for other programs; the exact time stands beside")]
fn side_car(
    frame: &CapturedFrame,
    format: &StreamFormat,
    number: u64,
    origin_ns: u64,
    capture: &Capture,
    image_name: &str,
) -> Sidecar {
    let submit = &frame.submit;
    let camera = submit.camera;
    Sidecar {
        frame: number,
        time: submit.content_time_ns.saturating_sub(origin_ns) as f64 / 1e9,
        fps: None,
        width: format.width,
        height: format.height,
        name: Some(capture.session().name.clone()),
        files: BTreeMap::from([("color".to_owned(), image_name.to_owned())]),
        world_to_camera: camera.map(|camera| sidecar::rows(&camera.view)),
        projection: camera.map(|camera| sidecar::rows(&camera.projection)),
        is_first_frame_after_cut: submit.is_cut,
        foreframe: Some(Exported {
            format: FormatText::new(format),
            key_index: submit.key_index,
            content_time_ns: submit.content_time_ns,
            arrived_at_ns: frame.arrived_at_ns,
            motion_from_ns: submit.motion_from_ns,
            motion_from_camera: submit
                .motion_from_camera
                .map(|Camera { view, projection }| [view, projection]),
            planes: frame.planes.iter().map(|plane| PlaneText::new(&plane.info)).collect(),
        }),
    }
}

/// The channels of one part.
type Channels = Vec<AnyChannel<FlatSamples>>;

fn write_image(frame: &CapturedFrame, format: &StreamFormat, path: &Path) -> anyhow::Result<()> {
    // Planes of one size share a part; colour's comes first.
    let mut parts: Vec<((u32, u32), Channels)> = Vec::new();
    for plane in &frame.planes {
        let size = (plane.info.width, plane.info.height);
        let channels = plane_channels(plane, format);
        match parts.iter_mut().find(|(of, _)| *of == size) {
            Some((_, part)) => part.extend(channels),
            None => parts.push((size, channels)),
        }
    }
    let (width, height) = (format.width as usize, format.height as usize);
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions((width, height)));
    attributes.other = conventions(format);
    let is_alone = parts.len() == 1;
    let mut layers = exr::image::Layers::new();
    for (index, ((width, height), channels)) in parts.into_iter().enumerate() {
        let mut attributes = if is_alone {
            LayerAttributes::default()
        } else {
            LayerAttributes::named(format!("part{index}").as_str())
        };
        attributes.world_to_camera = frame.submit.camera.map(|camera| camera.view);
        attributes.other = matrices(frame);
        layers.push(Layer::new(
            (width as usize, height as usize),
            attributes,
            ENCODING,
            AnyChannels::sort(channels.into_iter().collect()),
        ));
    }
    let image = Image { attributes, layer_data: layers };
    image.write().non_parallel().to_file(path)?;
    Ok(())
}

fn text(value: &str) -> AttributeValue {
    AttributeValue::Text(Text::from(value))
}

/// Conventions as attributes, so that the image alone says what its numbers mean.
fn conventions(format: &StreamFormat) -> std::collections::HashMap<Text, AttributeValue> {
    let mut attributes = std::collections::HashMap::new();
    let mut put = |name: &str, value: String| {
        attributes.insert(Text::from(name), text(&value));
    };
    put("foreframe.color", format!("{} {} {}", format.color, format.transfer, format.primaries));
    if let Some(depth) = format.depth {
        put("foreframe.depth", format!("{} {}", depth.format, depth.meaning));
    }
    if let Some(motion) = format.motion {
        let [x, y] = motion.scale;
        put(
            "foreframe.motion",
            format!(
                "{} {} {} scale {x} {y}, camera motion {}; x right, y down after the scale",
                motion.format, motion.direction, motion.unit, motion.camera_motion
            ),
        );
    }
    attributes
}

/// Matrices and times of a frame. `worldToCamera` is a standard attribute; OpenEXR writes vectors
/// as rows, so its matrices stand in memory as our columns do.
fn matrices(frame: &CapturedFrame) -> std::collections::HashMap<Text, AttributeValue> {
    let submit = &frame.submit;
    let mut attributes = std::collections::HashMap::new();
    if let Some(camera) = submit.camera {
        attributes.insert(
            Text::from("foreframe.projection"),
            AttributeValue::Matrix4x4(camera.projection),
        );
    }
    let mut put = |name: &str, value: String| {
        attributes.insert(Text::from(name), text(&value));
    };
    put("foreframe.content_time_ns", submit.content_time_ns.to_string());
    for plane in frame.planes.iter().filter(|plane| plane.info.kind == PlaneKind::Motion) {
        if let Some(from) = plane.info.motion_from_ns {
            let nth = plane.info.which;
            put(&format!("foreframe.motion{nth}_from_ns"), from.to_string());
        }
    }
    attributes
}

/// The channels of one plane.
fn plane_channels(plane: &CapturedPlane, format: &StreamFormat) -> Vec<AnyChannel<FlatSamples>> {
    let (names, samples) = exported::channels(format, &plane.info);
    let pixels = plane.bytes.chunks_exact(plane.info.layout.pixel_bytes());
    names
        .iter()
        .enumerate()
        .map(|(channel, name)| {
            let pixels = pixels.clone();
            let data = match samples {
                Samples::SrgbLevels if channel == 3 => {
                    FlatSamples::F16(pixels.map(|pixel| srgb::unit_from_level(pixel[3])).collect())
                }
                Samples::SrgbLevels => FlatSamples::F16(
                    pixels.map(|pixel| srgb::linear_from_level(pixel[channel])).collect(),
                ),
                Samples::Halves => FlatSamples::F16(
                    pixels.map(|pixel| f16::from_bits(short(pixel, channel))).collect(),
                ),
                Samples::Floats => FlatSamples::F32(
                    pixels.map(|pixel| f32::from_bits(word(pixel, channel))).collect(),
                ),
                Samples::Words => {
                    FlatSamples::U32(pixels.map(|pixel| word(pixel, channel)).collect())
                }
                Samples::ShortWords => {
                    FlatSamples::U32(pixels.map(|pixel| u32::from(short(pixel, channel))).collect())
                }
                Samples::Bytes => {
                    FlatSamples::U32(pixels.map(|pixel| u32::from(pixel[channel])).collect())
                }
            };
            AnyChannel::new(name.as_str(), data)
        })
        .collect()
}

fn short(pixel: &[u8], channel: usize) -> u16 {
    u16::from_le_bytes([pixel[channel * 2], pixel[channel * 2 + 1]])
}

fn word(pixel: &[u8], channel: usize) -> u32 {
    let at = channel * 4;
    u32::from_le_bytes([pixel[at], pixel[at + 1], pixel[at + 2], pixel[at + 3]])
}
