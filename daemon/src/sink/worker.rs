//! A slow sink on a thread of its own, behind a bounded queue.
//!
//! Guarantees that the stream's thread never waits for a disk or a pipe: with the queue full a
//! frame is left out of the file and counted. Frames change hands without a copy: the stream gives
//! its picture away and gets an empty one back.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::thread::{self, JoinHandle};

use foreframe_engine::ColorPlane;
use tracing::warn;

use super::Sink;

/// Frames that may wait for the sink. At 120 Hz this rides out a stall of 25 ms; each costs
/// one picture of memory.
const QUEUED_FRAMES: usize = 3;

struct Job {
    index: u64,
    frame: ColorPlane,
    /// Refreshes between the frame before and this one that showed nothing new, or nothing that
    /// reached this sink.
    repeats_before: u64,
}

/// The stream's end of a sink that runs elsewhere.
#[derive(Debug)]
pub struct SinkWorker {
    jobs: Option<SyncSender<Job>>,
    spares: Receiver<ColorPlane>,
    thread: Option<JoinHandle<()>>,
    repeats: u64,
    left_out: u64,
    failed: Arc<AtomicU64>,
}

impl SinkWorker {
    /// Moves `sink` to a new thread.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn spawn(sink: Sink) -> io::Result<Self> {
        let (jobs, queue) = sync_channel(QUEUED_FRAMES);
        let (give_back, spares) = channel();
        let failed = Arc::new(AtomicU64::new(0));
        let failures = Arc::clone(&failed);
        let thread = thread::Builder::new()
            .name("foreframe-sink".to_owned())
            .spawn(move || write_all(sink, &queue, &give_back, &failures))?;
        Ok(Self { jobs: Some(jobs), spares, thread: Some(thread), repeats: 0, left_out: 0, failed })
    }

    /// Gives frame number `index` away, and leaves a picture of any size and content in `frame`.
    /// With the queue full, `frame` stays as it was and is counted as left out.
    pub fn offer(&mut self, index: u64, frame: &mut ColorPlane) {
        let Some(jobs) = &self.jobs else { return };
        let spare =
            self.spares.try_recv().unwrap_or_else(|_| ColorPlane::new(frame.format(), 0, 0));
        let given = std::mem::replace(frame, spare);
        let job = Job { index, frame: given, repeats_before: self.repeats };
        match jobs.try_send(job) {
            Ok(()) => self.repeats = 0,
            Err(TrySendError::Full(job) | TrySendError::Disconnected(job)) => {
                *frame = job.frame;
                self.repeats += 1;
                self.left_out += 1;
            }
        }
    }

    /// That many refreshes showed the last frame again.
    pub fn repeat(&mut self, refreshes: u64) {
        self.repeats += refreshes;
    }

    /// Frames that did not reach the file: the queue was full, or the write failed.
    #[must_use]
    pub fn left_out(&self) -> u64 {
        self.left_out + self.failed.load(Ordering::Relaxed)
    }
}

impl Drop for SinkWorker {
    /// Waits until everything that was taken is written.
    fn drop(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the sink's thread panicked");
        }
    }
}

fn write_all(
    mut sink: Sink,
    queue: &Receiver<Job>,
    give_back: &Sender<ColorPlane>,
    failed: &AtomicU64,
) {
    let mut is_broken = false;
    for job in queue {
        if is_broken {
            failed.fetch_add(1, Ordering::Relaxed);
        } else if let Err(error) = write(&mut sink, &job) {
            warn!(%error, frame = job.index, "the sink takes no more frames");
            failed.fetch_add(1, Ordering::Relaxed);
            is_broken = true;
        }
        // The stream has ended when nobody takes the picture back.
        drop(give_back.send(job.frame));
    }
}

fn write(sink: &mut Sink, job: &Job) -> io::Result<()> {
    for _ in 0..job.repeats_before {
        sink.repeat()?;
    }
    sink.write(job.index, &job.frame)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use foreframe_engine::color::ColorFormat;
    use foreframe_engine::{MonoSpan, StreamFormat};

    use super::*;
    use crate::sink::y4m::Y4mSink;

    /// A pipe that nobody reads until the test says so.
    struct Gate {
        open: Receiver<()>,
        written: Sender<Vec<u8>>,
    }

    impl Write for Gate {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if bytes.starts_with(b"FRAME") {
                self.open.recv().map_err(|_| io::ErrorKind::BrokenPipe)?;
            }
            drop(self.written.send(bytes.to_vec()));
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn gated() -> (SinkWorker, Sender<()>, Receiver<Vec<u8>>) {
        let (open, opened) = channel();
        let (written, writes) = channel();
        let gate: Box<dyn Write + Send> = Box::new(Gate { open: opened, written });
        let format = StreamFormat::rgba8(2, 2);
        let sink = Y4mSink::create(gate, &format, MonoSpan::from_hz(120.0)).unwrap();
        (SinkWorker::spawn(Sink::Y4m(sink)).unwrap(), open, writes)
    }

    fn count_frames(writes: &Receiver<Vec<u8>>) -> usize {
        writes.iter().filter(|bytes| bytes.starts_with(b"FRAME")).count()
    }

    #[test]
    fn a_stuck_sink_never_blocks_the_stream() {
        let (mut worker, open, writes) = gated();
        for index in 0..50 {
            worker.offer(index, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        }
        // One frame is in the writer's hands at most, the rest of what was taken is in the queue.
        let left_out = worker.left_out();
        assert!((46..=47).contains(&left_out), "{left_out}");
        for _ in 0..50 {
            open.send(()).unwrap();
        }
        drop(worker);
        assert_eq!(count_frames(&writes) as u64, 50 - left_out);
    }

    #[test]
    fn refreshes_that_showed_nothing_new_keep_the_file_at_its_rate() {
        let (mut worker, open, writes) = gated();
        for _ in 0..4 {
            open.send(()).unwrap();
        }
        worker.offer(0, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        worker.repeat(2);
        worker.offer(3, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        drop(worker);
        assert_eq!(count_frames(&writes), 4);
    }

    #[test]
    fn a_broken_sink_is_counted_and_the_stream_goes_on() {
        let (mut worker, open, writes) = gated();
        drop(open);
        for index in 0..10 {
            worker.offer(index, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        }
        let failed = Arc::clone(&worker.failed);
        let full = worker.left_out;
        drop(worker);
        assert_eq!(full + failed.load(Ordering::Relaxed), 10);
        assert_eq!(count_frames(&writes), 0);
    }
}
