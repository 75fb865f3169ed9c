//! The smallest client: colour alone, twenty key frames, no depth and no motion.
//!
//! Start a daemon first: `foreframe serve --sink null`. Then
//! `cargo run -p foreframe-client --example 01_color_only`.

mod clock;

use std::time::Duration;

use foreframe_client::{ConnectOptions, Error, Key, StreamOptions};

fn main() -> Result<(), Error> {
    // Give up after a second: an application without a daemon just goes on by itself.
    let mut client = ConnectOptions::new("colour only").connect(Duration::from_secs(1))?;
    println!("in-between frames are made by {}", client.welcome().gpu_name);

    // Allocates three slots of shared memory. Do it while loading, not while playing.
    let stream = client.create_stream(&StreamOptions::rgba8(640, 360))?;

    for index in 0..20 {
        // The simulation time that this picture will show.
        let content_time_ns = clock::monotonic_ns();
        match client.acquire(stream) {
            Ok(mut frame) => {
                // This memory is what the daemon reads: render or read back straight into it.
                let color = frame.color_mut();
                for (x, pixel) in color.bytes.chunks_exact_mut(4).enumerate() {
                    let shade = u8::try_from((x as u64 + 8 * index) % 256).expect("below 256");
                    pixel.copy_from_slice(&[shade, shade, 64, 255]);
                }
                client.submit(frame, Key::new(index, content_time_ns))?;
            }
            // All slots are with the daemon. Nothing waits: this key frame is left out.
            Err(Error::WouldBlock) => {}
            Err(error) => return Err(error),
        }
        // Your frame limiter goes here. This one also reads what the daemon has to say.
        clock::wait_until(&mut client, content_time_ns + 25_000_000)?;
    }
    println!("{} key frames were skipped", client.skipped_keys(stream));
    Ok(())
}
