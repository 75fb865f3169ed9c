//! A slow sink on a thread of its own, behind a bounded queue.
//!
//! Guarantees that the stream's thread never waits for a disk or a pipe: with the queue full a
//! frame is left out of the file and counted. The sink is opened on its own thread as well, because
//! to open a pipe waits for its reader. Only the end of a stream waits for what was taken to be
//! written, and no longer than it was told to. Frames change hands without a copy: the stream gives
//! its picture away and gets an empty one back.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError, channel, sync_channel,
};
use std::thread;
use std::time::Duration;

use foreframe_engine::ColorPlane;
use tracing::{error, warn};

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
    repeats: u64,
    left_out: u64,
    failed: Arc<AtomicU64>,
    /// How long the end of the stream waits for the sink.
    patience: Duration,
}

impl SinkWorker {
    /// Starts a thread that opens the sink with `open` and writes to it. A sink that cannot be
    /// opened is logged, and every frame counts as left out. When this is dropped, it waits up to
    /// `patience` for what was taken to be written.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn spawn(
        open: impl FnOnce() -> io::Result<Sink> + Send + 'static,
        patience: Duration,
    ) -> io::Result<Self> {
        let (jobs, queue) = sync_channel(QUEUED_FRAMES);
        let (give_back, spares) = channel();
        let failed = Arc::new(AtomicU64::new(0));
        let failures = Arc::clone(&failed);
        thread::Builder::new().name("foreframe-sink".to_owned()).spawn(move || {
            write_all(open, &queue, &give_back, &failures);
        })?;
        Ok(Self { jobs: Some(jobs), spares, repeats: 0, left_out: 0, failed, patience })
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
    /// Waits until everything that was taken is written, but not for ever: a pipe that nobody reads
    /// would keep its stream, and the daemon, from ending.
    fn drop(&mut self) {
        self.jobs = None;
        loop {
            // A picture comes back after each write; the end of the channel is the thread's.
            match self.spares.recv_timeout(self.patience) {
                Ok(_) => {}
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {
                    let waited_s = self.patience.as_secs_f64();
                    warn!(waited_s, "the sink is stuck; what waits for it is not written");
                    return;
                }
            }
        }
    }
}

fn write_all(
    open: impl FnOnce() -> io::Result<Sink>,
    queue: &Receiver<Job>,
    give_back: &Sender<ColorPlane>,
    failed: &AtomicU64,
) {
    let mut sink = match open() {
        Ok(sink) => Some(sink),
        Err(error) => {
            error!(%error, "the sink cannot be opened; its frames go nowhere");
            None
        }
    };
    for job in queue {
        if let Some(open) = &mut sink
            && let Err(error) = write(open, &job)
        {
            warn!(%error, frame = job.index, "the sink takes no more frames");
            sink = None;
        }
        if sink.is_none() {
            failed.fetch_add(1, Ordering::Relaxed);
        }
        // The stream has ended when nobody takes the picture back.
        drop(give_back.send(job.frame));
    }
}

fn write(sink: &mut Sink, job: &Job) -> io::Result<()> {
    sink.repeat(job.repeats_before)?;
    sink.write(job.index, &job.frame)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use foreframe_engine::color::ColorFormat;
    use foreframe_engine::{MonoSpan, StreamFormat};

    use super::*;
    use crate::sink::y4m::Y4mSink;

    /// Running into this means that something is broken.
    const PATIENCE: Duration = Duration::from_secs(60);
    const HZ_120: MonoSpan = MonoSpan::from_ns(8_333_333);

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
        let open_sink = move || Y4mSink::create(gate, &format, HZ_120).map(Sink::Y4m);
        (SinkWorker::spawn(open_sink, PATIENCE).unwrap(), open, writes)
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
    fn a_long_rest_is_filled_up_to_one_second_only() {
        let (mut worker, open, writes) = gated();
        for _ in 0..1_000 {
            open.send(()).unwrap();
        }
        worker.offer(0, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        worker.repeat(500_000);
        worker.offer(500_001, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        drop(worker);
        assert_eq!(count_frames(&writes), 2 + 120);
    }

    #[test]
    fn a_sink_that_waits_to_be_opened_holds_nobody_up() {
        let (let_open, may_open) = channel::<()>();
        let open = move || {
            may_open.recv().map_err(io::Error::other)?;
            Ok(Sink::Null)
        };
        let mut worker = SinkWorker::spawn(open, PATIENCE).unwrap();
        for index in 0..10 {
            worker.offer(index, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        }
        assert_eq!(worker.left_out(), 10 - QUEUED_FRAMES as u64);
        let_open.send(()).unwrap();
        let failed = Arc::clone(&worker.failed);
        drop(worker);
        assert_eq!(failed.load(Ordering::Relaxed), 0, "what waited is written");
    }

    #[test]
    fn every_frame_of_a_sink_that_cannot_be_opened_is_counted() {
        let fail = || Err(io::Error::from(io::ErrorKind::PermissionDenied));
        let mut worker = SinkWorker::spawn(fail, PATIENCE).unwrap();
        for index in 0..10 {
            worker.offer(index, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        }
        let failed = Arc::clone(&worker.failed);
        let full = worker.left_out;
        drop(worker);
        assert_eq!(full + failed.load(Ordering::Relaxed), 10);
    }

    #[test]
    fn the_end_of_a_stream_does_not_wait_for_a_stuck_sink_for_ever() {
        let (mut worker, _open, _writes) = gated();
        worker.patience = Duration::from_millis(1);
        worker.offer(0, &mut ColorPlane::new(ColorFormat::Rgba8, 2, 2));
        drop(worker);
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
