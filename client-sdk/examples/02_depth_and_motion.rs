//! Depth and motion at half resolution: what makes the in-between frames good.
//!
//! Declare what your renderer produces; nothing has to be converted. Here: reversed depth, motion
//! as most upscalers take it (current to previous, in fractions of the image), camera per frame.

mod clock;

use std::time::Duration;

use foreframe_client::{
    Camera, ConnectOptions, Depth, DepthFormat, DepthMeaning, Error, Key, Motion, MotionDirection,
    MotionFormat, MotionUnit, PlaneKind, StreamOptions,
};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;
/// Pixels that the scene moves to the right from key frame to key frame.
const STEP_PX: u32 = 6;

fn main() -> Result<(), Error> {
    let mut client = ConnectOptions::new("depth and motion").connect(Duration::from_secs(1))?;
    let options = StreamOptions::rgba8(WIDTH, HEIGHT)
        .depth(Depth::new(DepthFormat::F32, DepthMeaning::Reversed).ratio(2.0))
        .motion(
            Motion::new(MotionFormat::Rg32f)
                .direction(MotionDirection::CurrentToPrevious)
                .unit(MotionUnit::Uv)
                .ratio(2.0),
        );
    let stream = client.create_stream(&options)?;

    let mut previous_ns = None;
    for index in 0..40_u64 {
        let content_time_ns = clock::monotonic_ns();
        let frame = match client.acquire(stream) {
            Ok(frame) => Some(frame),
            Err(Error::WouldBlock) => None,
            Err(error) => return Err(error),
        };
        if let Some(mut frame) = frame {
            fill(&mut frame, index);
            let mut key = Key::new(index, content_time_ns).camera(camera());
            // The motion plane points back to the frame rendered before this one. That holds even
            // when that one was never submitted, so keep its time, not the last submitted one's.
            if let Some(previous_ns) = previous_ns {
                key = key.motion_from(previous_ns);
            }
            match client.submit(frame, key) {
                Ok(()) | Err(Error::WouldBlock) => {}
                Err(error) => return Err(error),
            }
        }
        previous_ns = Some(content_time_ns);
        clock::wait_until(&mut client, content_time_ns + 25_000_000)?;
    }
    if let Some(counts) = client.statistics(stream) {
        println!("{counts:?}");
    }
    Ok(())
}

/// A striped wall that slides to the right.
fn fill(frame: &mut foreframe_client::KeyFrame, index: u64) {
    let shift = u32::try_from(index).expect("few frames") * STEP_PX;
    // All planes at once; they could be filled on several threads.
    let mut planes = frame.planes_mut();
    if let Some(color) = planes.get_mut(PlaneKind::Color) {
        for y in 0..color.height {
            for (x, pixel) in (0_u32..).zip(color.row_mut(y).chunks_exact_mut(4)) {
                let is_light = (x.wrapping_sub(shift) / 32) % 2 == 0;
                pixel.copy_from_slice(if is_light {
                    &[220, 220, 200, 255]
                } else {
                    &[60, 80, 120, 255]
                });
            }
        }
    }
    if let Some(depth) = planes.get_mut(PlaneKind::Depth) {
        for pixel in depth.bytes.chunks_exact_mut(4) {
            pixel.copy_from_slice(&0.1_f32.to_le_bytes());
        }
    }
    if let Some(motion) = planes.get_mut(PlaneKind::Motion) {
        let [x, y] = [-(STEP_PX as f32) / WIDTH as f32, 0.0];
        for pixel in motion.bytes.chunks_exact_mut(8) {
            pixel[..4].copy_from_slice(&x.to_le_bytes());
            pixel[4..].copy_from_slice(&y.to_le_bytes());
        }
    }
}

/// View and projection, column-major, without jitter: reversed depth, infinite far plane, near 0.1.
fn camera() -> Camera {
    let (focal_x, focal_y, near) = (1.0, WIDTH as f32 / HEIGHT as f32, 0.1);
    Camera {
        view: [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.],
        projection: [focal_x, 0., 0., 0., 0., focal_y, 0., 0., 0., 0., 0., -1., 0., 0., near, 0.],
    }
}
