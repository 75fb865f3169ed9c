//! Dynamic resolution, dropped key frames, and a descriptor that is watched by somebody else.
//!
//! Colour keeps its size; its valid rectangle shrinks when rendering is slow, and the daemon
//! stretches it. Depth changes its size instead, which is as good.

mod clock;

use std::time::Duration;

use foreframe_client::{
    ConnectOptions, Depth, DepthFormat, DepthMeaning, Error, Event, Key, PlaneKind, Rect,
    StreamOptions, ValidRectUse,
};

fn main() -> Result<(), Error> {
    let mut client = ConnectOptions::new("dynamic resolution").connect(Duration::from_secs(1))?;
    let options = StreamOptions::rgba8(960, 540)
        .valid_rect_use(ValidRectUse::Stretch)
        .depth(Depth::new(DepthFormat::F16, DepthMeaning::Standard).ratio(1.5))
        .slots(4)
        // Some read-backs want rows that start at multiples of 256 bytes.
        .row_align(256);
    let stream = client.create_stream(&options)?;

    let mut scale = 1.0_f64;
    for index in 0..60_u64 {
        let content_time_ns = clock::monotonic_ns();
        match client.acquire(stream) {
            Ok(mut frame) => {
                let over = |size: u32| (f64::from(size) * scale) as u32;
                let (width, height) = (over(960), over(540));
                frame.set_valid(PlaneKind::Color, Rect::full(width, height))?;
                frame.resize(PlaneKind::Depth, over(640), over(360))?;
                if let Some(mut color) = frame.plane_mut(PlaneKind::Color) {
                    for y in 0..height {
                        color.row_mut(y)[..width as usize * 4].fill(90);
                    }
                }
                if let Some(depth) = frame.plane_mut(PlaneKind::Depth) {
                    depth.bytes.fill(0x38);
                }
                if index % 7 == 3 {
                    // The application changed its mind: the slot is free again, nothing is sent.
                    drop(frame);
                } else {
                    client.submit(frame, Key::new(index, content_time_ns))?;
                }
            }
            Err(Error::WouldBlock) => {}
            Err(error) => return Err(error),
        }

        // Everything the daemon says is optional to read. This is what it recommends.
        client.dispatch()?;
        while let Some(event) = client.next_event() {
            match event {
                Event::Hint(hint) => scale = (f64::from(hint.width) / 960.0).clamp(0.5, 1.0),
                Event::Refused(error) => eprintln!("{error:?}"),
                _ => {}
            }
        }
        if index % 20 == 10 {
            scale = 0.75;
        }
        clock::wait_until(&mut client, content_time_ns + 25_000_000)?;
    }
    Ok(())
}
