//! Temporal resolution multiplexing: 120 key frames a second, of which every second one is rendered
//! at half the columns and rows. The daemon shows all of them as if they had been rendered in full;
//! 37.5 % of the pixels are never rendered.
//!
//! For applications that are fast enough for the display's rate, nearly. Below 90 key frames a
//! second the eye sees full and reduced pictures alternate. A picture that is to stay is sent in full
//! twice: the second time it is shown as it is.

mod clock;

use std::time::Duration;

use foreframe_client::{ConnectOptions, Error, Key, PlaneKind, Rect, StreamOptions, ValidRectUse};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 540;

fn main() -> Result<(), Error> {
    let mut client = ConnectOptions::new("multiplexing").connect(Duration::from_secs(1))?;
    let options = StreamOptions::rgba8(WIDTH, HEIGHT).valid_rect_use(ValidRectUse::Multiplex);
    let stream = client.create_stream(&options)?;
    for index in 0..120_u64 {
        let content_time_ns = clock::monotonic_ns();
        match client.acquire(stream) {
            Ok(mut frame) => {
                // Whether a key is a reduced one is said by its valid rectangle, and by nothing
                // else.
                let divisor = if index.is_multiple_of(2) { 1 } else { 2 };
                let (width, height) = (WIDTH / divisor, HEIGHT / divisor);
                frame.set_valid(PlaneKind::Color, Rect::full(width, height))?;
                if let Some(mut color) = frame.plane_mut(PlaneKind::Color) {
                    for y in 0..height {
                        let row = &mut color.row_mut(y)[..width as usize * 4];
                        for (x, pixel) in (0..).zip(row.chunks_exact_mut(4)) {
                            // A render at half the size: what a pixel covers, not every second one.
                            pixel.copy_from_slice(&shade(x * divisor, divisor));
                        }
                    }
                }
                client.submit(frame, Key::new(index, content_time_ns))?;
            }
            Err(Error::WouldBlock) => {}
            Err(error) => return Err(error),
        }
        clock::wait_until(&mut client, content_time_ns + 8_333_333)?;
    }
    Ok(())
}

/// Lines of two pixels in light and dark grey: the mean over `columns` from `x` on.
fn shade(x: u32, columns: u32) -> [u8; 4] {
    let level = |x: u32| if x % 4 < 2 { 180 } else { 60 };
    let mean = (x..x + columns).map(level).sum::<u32>() / columns;
    let mean = u8::try_from(mean).unwrap_or(u8::MAX);
    [mean, mean, mean, 255]
}
