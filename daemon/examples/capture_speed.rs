//! How fast a capture is written and read, per coding:
//! `cargo run --release -p foreframed --example capture_speed -- FILE.mcap`.
//!
//! Takes colour, depth and motion of the first frame that has all three, repeats them to
//! 1920x1080, writes that frame to memory and to a file, and reads it back. One thread, one core:
//! what the recorder of the daemon has.

use std::io::Cursor;
use std::path::PathBuf;

use anyhow::Context as _;
use foreframe_engine::MonoSpan;
use foreframe_protocol::{CreateStream, PlaneDescriptor, PlaneSize, StreamFormat, Submit};
use foreframed::capture::{
    Capture, CaptureSource, CaptureWriter, CapturedPlane, Coding, PlaneBytes, PlaneInfo,
    SessionInfo,
};
use foreframed::clock;

const WIDTH: u32 = 1920;
const HEIGHT: u32 = 1080;
const FRAMES: u64 = 20;

fn main() -> anyhow::Result<()> {
    let path: PathBuf =
        std::env::args_os().nth(1).context("expected a capture, found no argument")?.into();
    let capture = Capture::open(&path)?;
    let frame = capture
        .frames()
        .flatten()
        .find(|frame| frame.planes.len() >= 3)
        .context("expected a frame with colour, depth and motion, found none")?;
    let format = StreamFormat { width: WIDTH, height: HEIGHT, ..capture.streams()[0].format };
    let create = CreateStream { stream: 1, format, max_sizes: format.full_sizes(), slots: 3 };
    let planes: Vec<_> = frame.planes[..3].iter().map(|plane| repeated(plane, &format)).collect();
    let mut submit = Submit { stream: 1, ..frame.submit };
    for (info, _) in &planes {
        let size = PlaneSize { width: WIDTH, height: HEIGHT };
        let bytes_per_pixel = u32::try_from(info.layout.pixel_bytes())?;
        submit.planes.set(info.kind, Some(PlaneDescriptor::packed(0, size, bytes_per_pixel)));
    }
    let raw: u64 = planes.iter().map(|(info, _)| info.raw_len()).sum();
    println!("{WIDTH}x{HEIGHT}, colour, depth and motion: {:.1} MB a frame", raw as f64 / 1e6);
    println!(
        "{:<12} {:>6} {:>12} {:>12} {:>12}",
        "coding", "ratio", "write MB/s", "to file", "read MB/s"
    );
    for coding in Coding::ALL {
        let write = |out: &mut dyn std::io::Write| -> anyhow::Result<u64> {
            let session = SessionInfo::new("speed", CaptureSource::Scene);
            let mut writer = CaptureWriter::to_writer(out, &session)?.with_coding(coding);
            writer.add_stream(&create)?;
            let planes: Vec<_> =
                planes.iter().map(|(info, bytes)| PlaneBytes::tight(*info, bytes)).collect();
            let mut stored = 0;
            for _ in 0..FRAMES {
                stored += writer.write_frame(0, &submit, &planes)?;
            }
            writer.finish()?;
            Ok(stored)
        };
        let mut memory = Vec::new();
        write(&mut memory)?;
        memory.clear();
        let start = clock::now();
        let stored = write(&mut memory)?;
        let to_memory = clock::now() - start;
        let mut file = tempfile::tempfile()?;
        let start = clock::now();
        write(&mut file)?;
        file.sync_all()?;
        let to_file = clock::now() - start;
        let written = Capture::from_source(Cursor::new(&memory))?;
        let start = clock::now();
        for frame in written.frames() {
            frame?;
        }
        let reading = clock::now() - start;
        let rate = |span: MonoSpan| (raw * FRAMES) as f64 / 1e6 / span.as_secs_f64();
        println!(
            "{:<12} {:>6.2} {:>12.0} {:>12.0} {:>12.0}",
            coding.name(),
            (raw * FRAMES) as f64 / stored as f64,
            rate(to_memory),
            rate(to_file),
            rate(reading)
        );
    }
    Ok(())
}

/// The plane side by side and below itself, cut to the size of the benchmark.
fn repeated(plane: &CapturedPlane, format: &StreamFormat) -> (PlaneInfo, Vec<u8>) {
    let (pixel, row) = (plane.info.layout.pixel_bytes(), plane.info.row_bytes() as usize);
    let mut bytes = Vec::with_capacity(WIDTH as usize * HEIGHT as usize * pixel);
    for y in 0..HEIGHT as usize {
        let line = &plane.bytes[y % plane.info.height as usize * row..][..row];
        bytes.extend(line.iter().cycle().take(WIDTH as usize * pixel));
    }
    let size = PlaneSize { width: format.width, height: format.height };
    let descriptor = PlaneDescriptor::packed(0, size, u32::try_from(pixel).unwrap_or(u32::MAX));
    let info =
        PlaneInfo::described(format, plane.info.kind, &descriptor, plane.info.motion_from_ns);
    (info.expect("the format declares the planes of its frames"), bytes)
}
