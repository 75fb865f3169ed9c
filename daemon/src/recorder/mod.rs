//! Records what applications send, on a thread of its own, behind a bounded queue.
//!
//! Guarantees that no stream ever waits for the disk: with the queue full a key is not recorded,
//! and the file says so in a gap record in front of the next key that is. Every key is in the file
//! when the writer turns to the next one, so a daemon that is killed leaves a capture that opens up
//! to its last whole key.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use anyhow::Context as _;
use foreframe_engine::MonoTime;
use foreframe_protocol::{CreateStream, PlaneKind, StreamFormat, Submit};
use tracing::{error, warn};

use crate::capture::{
    CaptureError, CaptureWriter, Gap, PlaneBytes, PlaneInfo, SessionInfo, pixel_layout,
};
use crate::stream::planes::KeyPlanes;

/// Keys that may wait for the disk, over all streams. At 60 keys a second this rides out a stall of
/// 130 ms; each costs one set of planes of memory.
const QUEUED_KEYS: usize = 8;

#[expect(clippy::large_enum_variant, reason = "nearly all are keys, and few wait")]
enum Job {
    Stream(CreateStream),
    Key { gap: Option<Gap>, arrived_at: MonoTime, submit: Submit, planes: Arc<KeyPlanes> },
    Gap(Gap),
}

/// The recording of one daemon.
#[derive(Debug)]
pub struct Recorder {
    jobs: Option<SyncSender<Job>>,
    thread: Option<JoinHandle<()>>,
}

/// One stream's end of the recording.
#[derive(Debug)]
pub struct StreamRecorder {
    jobs: SyncSender<Job>,
    /// Number of the stream in the file, where several sessions may use the same one.
    number: u32,
    gap: Option<Gap>,
}

impl Recorder {
    /// Creates or replaces the file, and starts the thread.
    ///
    /// # Errors
    /// If the file cannot be written or the thread not started.
    pub fn start(path: &Path, session: &SessionInfo) -> anyhow::Result<Self> {
        let writer = CaptureWriter::create(path, session)
            .with_context(|| format!("starting the recording {}", path.display()))?;
        Self::start_writer(writer).context("starting the recorder's thread")
    }

    fn start_writer<W: io::Write + Send + 'static>(writer: CaptureWriter<W>) -> io::Result<Self> {
        let (jobs, queue) = sync_channel(QUEUED_KEYS);
        let thread = thread::Builder::new()
            .name("foreframe-record".to_owned())
            .spawn(move || record_all(writer, &queue))?;
        Ok(Self { jobs: Some(jobs), thread: Some(thread) })
    }

    /// The end of a stream that is called `number` in the file, where no other one is. None once
    /// the recording is over.
    #[must_use]
    pub fn stream(&self, number: u32) -> Option<StreamRecorder> {
        Some(StreamRecorder { jobs: self.jobs.clone()?, number, gap: None })
    }
}

impl Drop for Recorder {
    /// Waits until everything is in the file and closes it. The streams have ended before.
    fn drop(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            error!("the recorder's thread panicked");
        }
    }
}

impl StreamRecorder {
    /// Announces the stream, before its first key. Waits for the queue, so it is done by the
    /// stream's own thread, before the stream runs.
    pub fn announce(&self, create: &CreateStream) {
        let create = CreateStream { stream: self.number, ..*create };
        // A recording that has failed has said so.
        drop(self.jobs.send(Job::Stream(create)));
    }

    /// Hands a key over, or counts it as missing if the disk is behind. Never waits.
    pub fn offer(&mut self, submit: &Submit, arrived_at: MonoTime, planes: &Arc<KeyPlanes>) {
        let submit = Submit { stream: self.number, ..*submit };
        let planes = Arc::clone(planes);
        let job = Job::Key { gap: self.gap.take(), arrived_at, submit, planes };
        let Err(TrySendError::Full(job) | TrySendError::Disconnected(job)) =
            self.jobs.try_send(job)
        else {
            return;
        };
        let at_ns = arrived_at.as_ns();
        let before = if let Job::Key { gap, .. } = job { gap } else { None };
        let mut gap = before.unwrap_or_else(|| Gap {
            stream: self.number,
            count: 0,
            from_ns: at_ns,
            to_ns: at_ns,
            reason: "the disk was too slow".to_owned(),
        });
        gap.count += 1;
        gap.to_ns = at_ns;
        self.gap = Some(gap);
    }
}

impl Drop for StreamRecorder {
    /// Records a gap at the end of the stream. Waits for the queue: no frame is made any more.
    fn drop(&mut self) {
        if let Some(gap) = self.gap.take() {
            drop(self.jobs.send(Job::Gap(gap)));
        }
    }
}

fn record_all<W: io::Write>(mut writer: CaptureWriter<W>, queue: &Receiver<Job>) {
    let mut formats = Vec::new();
    for job in queue {
        if let Err(error) = record(&mut writer, &mut formats, job) {
            warn!(%error, "the recording stops here");
            // Later jobs go nowhere: senders count them as missing, and say nothing more.
            return;
        }
    }
    if let Err(error) = writer.finish() {
        warn!(%error, "the recording has no summary; it can be read all the same");
    }
}

fn record<W: io::Write>(
    writer: &mut CaptureWriter<W>,
    formats: &mut Vec<(u32, StreamFormat)>,
    job: Job,
) -> Result<(), CaptureError> {
    match job {
        Job::Stream(create) => {
            formats.push((create.stream, create.format));
            writer.add_stream(&create)
        }
        Job::Gap(gap) => writer.gap(&gap),
        Job::Key { gap, arrived_at, submit, planes } => {
            if let Some(gap) = gap {
                writer.gap(&gap)?;
            }
            let format = formats.iter().find(|(number, _)| *number == submit.stream);
            let (_, format) = format.expect("a stream is announced before its keys");
            let infos = PlaneKind::ALL.iter().filter_map(|&kind| plane(format, &submit, kind));
            let planes: Vec<PlaneBytes<'_>> = infos
                .filter_map(|info| Some(PlaneBytes::tight(info, planes.get(info.kind)?)))
                .collect();
            writer.write_frame(arrived_at.as_ns(), &submit, &planes).map(|_| ())
        }
    }
}

fn plane(format: &StreamFormat, submit: &Submit, kind: PlaneKind) -> Option<PlaneInfo> {
    let plane = submit.planes.get(kind)?;
    Some(PlaneInfo {
        kind,
        which: 0,
        layout: pixel_layout(format, kind)?,
        width: plane.width,
        height: plane.height,
        valid: plane.valid,
        jitter: plane.jitter,
        motion_from_ns: submit.motion_from_ns.filter(|_| kind == PlaneKind::Motion),
    })
}
