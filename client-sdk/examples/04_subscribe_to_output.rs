//! Reads the output of the daemon: what an encoder, a recorder or a test does.
//!
//! Run another client meanwhile, so that there is something to see.

use std::time::Duration;

use foreframe_client::{ConnectOptions, Error, Event, Features, OutputSource};

fn main() -> Result<(), Error> {
    let mut client = ConnectOptions::new("subscriber")
        .require(Features::OUTPUT)
        .connect(Duration::from_secs(1))?;
    // Whatever is on display, through a pool of three slots that the daemon allocates.
    client.subscribe(OutputSource::Display, 3)?;

    let mut pixels = Vec::new();
    let mut shown = 0;
    while shown < 240 {
        if !client.wait(Duration::from_secs(5))? {
            println!("nothing was shown for five seconds");
            break;
        }
        while let Some(event) = client.next_event() {
            match event {
                Event::Output(frame) => {
                    frame.copy_to_vec(&mut pixels)?;
                    println!(
                        "{:>6} {:<11} key {:>5} + {:.3}  {}x{}, first pixel {:?}",
                        frame.sequence(),
                        frame.kind().name(),
                        frame.key_index(),
                        f64::from(frame.phase_q12()) / 4096.0,
                        frame.width(),
                        frame.height(),
                        pixels.get(..4),
                    );
                    shown += 1;
                    // Dropping the frame gives its slot back with the next dispatch.
                }
                Event::OutputEnded { reason, .. } => {
                    println!("the output has ended: {reason}");
                    return Ok(());
                }
                _ => {}
            }
        }
    }
    Ok(())
}
