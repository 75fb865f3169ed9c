//! A user interface at a rate of its own: 30 key frames a second, and a clock hand that moves 120
//! times a second over whatever the daemon makes of them.
//!
//! Key frames hold the scene without the interface. The interface is never warped: it stays where
//! it is placed, to the pixel.

mod clock;

use std::time::Duration;

use foreframe_client::{
    Client, ColorFormat, ConnectOptions, Error, Features, Key, PlaneSize, StreamId, StreamOptions,
};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 540;
const BAR: PlaneSize = PlaneSize { width: 256, height: 24 };

fn main() -> Result<(), Error> {
    let mut client = ConnectOptions::new("user interface")
        .require(Features::UI_PLANE)
        .connect(Duration::from_secs(1))?;
    // The interface has the format of colour. One slot more, for it.
    let options =
        StreamOptions::rgba8(WIDTH, HEIGHT).ui(ColorFormat::Rgba8, BAR.width, BAR.height).slots(4);
    let stream = client.create_stream(&options)?;
    for tick in 0..240_u64 {
        let now_ns = clock::monotonic_ns();
        if tick.is_multiple_of(4) {
            submit_key(&mut client, stream, tick / 4, now_ns)?;
        }
        submit_bar(&mut client, stream, u32::try_from(tick).unwrap_or(0))?;
        client.dispatch()?;
        clock::wait_until(&mut client, now_ns + 8_333_333)?;
    }
    Ok(())
}

fn submit_key(
    client: &mut Client,
    stream: StreamId,
    index: u64,
    content_time_ns: u64,
) -> Result<(), Error> {
    match client.acquire(stream) {
        Ok(mut frame) => {
            frame.color_mut().bytes.fill(60);
            // The interface of this stream comes by itself, not with key frames.
            frame.omit(foreframe_client::PlaneKind::Ui)?;
            client.submit(frame, Key::new(index, content_time_ns))
        }
        Err(Error::WouldBlock) => Ok(()),
        Err(error) => Err(error),
    }
}

/// A bar whose lit part grows: opaque there, half transparent black elsewhere.
fn submit_bar(client: &mut Client, stream: StreamId, tick: u32) -> Result<(), Error> {
    match client.acquire_ui(stream) {
        Ok(mut ui) => {
            ui.set_place(40, 500);
            let mut pixels = ui.pixels_mut();
            for y in 0..pixels.height {
                for (x, pixel) in (0..).zip(pixels.row_mut(y).chunks_exact_mut(4)) {
                    let is_lit = x <= tick;
                    pixel.copy_from_slice(if is_lit {
                        &[80, 200, 120, 255]
                    } else {
                        &[0, 0, 0, 128]
                    });
                }
            }
            client.submit_ui(ui)
        }
        // The daemon is behind: this one is left out, and the next comes soon.
        Err(Error::WouldBlock) => Ok(()),
        Err(error) => Err(error),
    }
}
