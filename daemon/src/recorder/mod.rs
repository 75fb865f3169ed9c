//! Records what applications send, on a thread of its own, behind a bounded queue.
//!
//! Guarantees that no stream ever waits for the disk: with the queue full a key is not recorded,
//! and the file says so in a gap record. Every key is in the file when the writer turns to the next
//! one, so a daemon that is killed leaves a capture that opens up to its last whole key. The end of
//! the daemon waits for the file to be finished, and no longer than it was told to.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, Sender, SyncSender, TrySendError, channel, sync_channel,
};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use anyhow::Context as _;
use foreframe_engine::MonoTime;
use foreframe_protocol::{
    CreateStream, LateCamera, PlaneDescriptor, PlaneKind, PlaneMap, StreamFormat, Submit, UiPlane,
};
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl, open};
use tracing::warn;

use crate::capture::{CaptureError, CaptureWriter, Gap, PlaneBytes, PlaneInfo, SessionInfo};
use crate::stream::planes::KeyPlanes;

/// Late cameras that wait for the next key; of more, the oldest are left out.
const HELD_POSES: usize = 256;
/// Keys and UI planes that may wait for the disk, over all streams. At 60 keys a second this rides
/// out a stall of 130 ms; each costs one set of planes of memory.
const QUEUED_KEYS: usize = 8;

#[expect(clippy::large_enum_variant, reason = "nearly all are keys, and few wait")]
enum Job {
    Stream(CreateStream),
    Key {
        before: Unsaid,
        arrived_at: MonoTime,
        submit: Submit,
        planes: Arc<KeyPlanes>,
    },
    Ui {
        arrived_at: MonoTime,
        ui: UiPlane,
        planes: Arc<KeyPlanes>,
    },
    Unsaid(Unsaid),
    /// Wakes the thread, which then sees that the recording is over.
    End,
}

/// What is to be recorded before the next key, or at the end of the stream.
#[derive(Clone, Default, Debug)]
struct Unsaid {
    gap: Option<Gap>,
    /// Of the number that the stream has in the file, and when each arrived.
    poses: Vec<(LateCamera, MonoTime)>,
}

/// The recording of one daemon.
#[derive(Debug)]
pub struct Recorder {
    jobs: SyncSender<Job>,
    shared: Arc<Shared>,
    /// Holds nothing; it is disconnected when the thread has ended.
    ended: Receiver<()>,
    /// How long the end of the recording waits for the disk.
    patience: Duration,
}

/// What the thread looks at after each job.
#[derive(Default)]
struct Shared {
    is_over: AtomicBool,
    /// What streams that have ended could not put into the full queue.
    last_words: Mutex<Vec<Job>>,
}

/// One stream's end of the recording.
#[derive(Debug)]
pub struct StreamRecorder {
    jobs: SyncSender<Job>,
    shared: Arc<Shared>,
    /// Number of the stream in the file, where several sessions may use the same one.
    number: u32,
    /// There until it is in the queue.
    unannounced: Option<CreateStream>,
    unsaid: Unsaid,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").field("is_over", &self.is_over).finish_non_exhaustive()
    }
}

impl Recorder {
    /// Creates or replaces the file, and starts the thread. When this is dropped, it waits up to
    /// `patience` for everything to be in the file.
    ///
    /// # Errors
    /// If the file cannot be written, is a pipe without a reader, or the thread cannot be started.
    pub fn start(path: &Path, session: &SessionInfo, patience: Duration) -> anyhow::Result<Self> {
        let file = create(path)
            .map_err(|source| CaptureError::Open { path: path.to_owned(), source })
            .and_then(|file| CaptureWriter::to_writer(BufWriter::new(file), session));
        let writer = file.with_context(|| format!("starting the recording {}", path.display()))?;
        Self::start_writer(writer, patience).context("starting the recorder's thread")
    }

    fn start_writer<W: io::Write + Send + 'static>(
        writer: CaptureWriter<W>,
        patience: Duration,
    ) -> io::Result<Self> {
        let (jobs, queue) = sync_channel(QUEUED_KEYS);
        let (alive, ended) = channel();
        let shared = Arc::new(Shared::default());
        let seen = Arc::clone(&shared);
        thread::Builder::new().name("foreframe-record".to_owned()).spawn(move || {
            let _until_the_end: Sender<()> = alive;
            if let Err(error) = record_all(writer, &queue, &seen) {
                // Later jobs go nowhere: senders count them as missing, and say nothing more.
                warn!(error = format!("{:#}", anyhow::Error::from(error)), "the recording stops");
            }
        })?;
        Ok(Self { jobs, shared, ended, patience })
    }

    /// The end of a stream that is called `number` in the file, where no other one is.
    #[must_use]
    pub fn stream(&self, number: u32) -> StreamRecorder {
        let (jobs, shared) = (self.jobs.clone(), Arc::clone(&self.shared));
        StreamRecorder { jobs, shared, number, unannounced: None, unsaid: Unsaid::default() }
    }
}

impl Drop for Recorder {
    /// Waits until everything is in the file and closes it, but not for ever: the disk, or the
    /// reader of a pipe, may be stuck. What is in the file by then can be read.
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Release);
        // With the queue full the thread is awake and looks after each job.
        let _full = self.jobs.try_send(Job::End);
        if let Err(RecvTimeoutError::Timeout) = self.ended.recv_timeout(self.patience) {
            let waited_s = self.patience.as_secs_f64();
            warn!(waited_s, "the recording is stuck; what waits to be written is lost");
        }
    }
}

impl StreamRecorder {
    /// Announces the stream, before its first key. Never waits: with the queue full it is announced
    /// with a later key, and the keys until then count as missing.
    pub fn announce(&mut self, create: &CreateStream) {
        self.unannounced = Some(CreateStream { stream: self.number, ..*create });
        self.try_announce();
    }

    /// Hands a key over, or counts it as missing if the disk is behind. Never waits.
    pub fn offer(&mut self, submit: &Submit, arrived_at: MonoTime, planes: &Arc<KeyPlanes>) {
        if !self.try_announce() {
            return self.count_missing(arrived_at);
        }
        let submit = Submit { stream: self.number, ..*submit };
        let planes = Arc::clone(planes);
        let before = std::mem::take(&mut self.unsaid);
        let job = Job::Key { before, arrived_at, submit, planes };
        let Err(TrySendError::Full(job) | TrySendError::Disconnected(job)) =
            self.jobs.try_send(job)
        else {
            return;
        };
        if let Job::Key { before, .. } = job {
            self.unsaid = before;
        }
        self.count_missing(arrived_at);
    }

    /// Hands over a UI plane that is shown from now on, or counts it as missing if the disk is
    /// behind. Never waits.
    pub fn offer_ui(&mut self, ui: &UiPlane, arrived_at: MonoTime, planes: &Arc<KeyPlanes>) {
        let ui = UiPlane { stream: self.number, ..*ui };
        let job = Job::Ui { arrived_at, ui, planes: Arc::clone(planes) };
        if !self.try_announce() || self.jobs.try_send(job).is_err() {
            self.count_missing(arrived_at);
        }
    }

    /// Hands over a pose that leads pictures from now on. It is recorded with the next key.
    pub fn offer_late_camera(&mut self, pose: &LateCamera, arrived_at: MonoTime) {
        let poses = &mut self.unsaid.poses;
        if poses.len() == HELD_POSES {
            poses.remove(0);
        }
        poses.push((LateCamera { stream: self.number, ..*pose }, arrived_at));
    }

    /// True once the stream is announced.
    fn try_announce(&mut self) -> bool {
        let Some(create) = self.unannounced else { return true };
        let is_announced = self.jobs.try_send(Job::Stream(create)).is_ok();
        if is_announced {
            self.unannounced = None;
        }
        is_announced
    }

    fn count_missing(&mut self, arrived_at: MonoTime) {
        let at_ns = arrived_at.as_ns();
        let gap = self.unsaid.gap.get_or_insert_with(|| Gap {
            stream: self.number,
            count: 0,
            from_ns: at_ns,
            to_ns: at_ns,
            reason: "the disk was too slow".to_owned(),
        });
        gap.count += 1;
        gap.to_ns = at_ns;
    }
}

impl Drop for StreamRecorder {
    /// Records at the end of the stream what no key followed.
    fn drop(&mut self) {
        let unsaid = std::mem::take(&mut self.unsaid);
        if unsaid.gap.is_none() && unsaid.poses.is_empty() {
            return;
        }
        let announcement = self.unannounced.take().map(Job::Stream);
        let mut last_words = self.shared.lock();
        last_words.extend(announcement.into_iter().chain([Job::Unsaid(unsaid)]));
        drop(last_words);
        // With the queue full the thread is awake and looks after each job.
        let _full = self.jobs.try_send(Job::End);
    }
}

impl Shared {
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Job>> {
        self.last_words.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Creates or replaces a file. Where it is a pipe, somebody must be reading it already: to wait for
/// a reader would keep the daemon from starting and from stopping.
fn create(path: &Path) -> io::Result<File> {
    let flags = OFlags::WRONLY | OFlags::CREATE | OFlags::TRUNC | OFlags::CLOEXEC;
    let file = match open(path, flags | OFlags::NONBLOCK, Mode::from_raw_mode(0o666)) {
        Err(rustix::io::Errno::NXIO) => {
            let text =
                "expected a file, or a pipe that somebody reads, found a pipe without reader";
            return Err(io::Error::other(text));
        }
        opened => opened?,
    };
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    Ok(File::from(file))
}

fn record_all<W: io::Write>(
    mut writer: CaptureWriter<W>,
    queue: &Receiver<Job>,
    shared: &Shared,
) -> Result<(), CaptureError> {
    let mut formats = Vec::new();
    for job in queue {
        record(&mut writer, &mut formats, job)?;
        let is_over = shared.is_over.load(Ordering::Acquire);
        if is_over {
            // The streams have ended, or hang and are not waited for.
            queue.try_iter().try_for_each(|job| record(&mut writer, &mut formats, job))?;
        }
        let last_words = std::mem::take(&mut *shared.lock());
        last_words.into_iter().try_for_each(|job| record(&mut writer, &mut formats, job))?;
        if is_over {
            break;
        }
    }
    if let Err(error) = writer.finish() {
        let error = format!("{:#}", anyhow::Error::from(error));
        warn!(error, "the recording has no summary; it can be read all the same");
    }
    Ok(())
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
        Job::Unsaid(unsaid) => record_unsaid(writer, &unsaid),
        Job::End => Ok(()),
        Job::Key { before, arrived_at, submit, planes } => {
            record_unsaid(writer, &before)?;
            let format = format_of(formats, submit.stream);
            let planes = plane_bytes(format, &submit.planes, submit.motion_from_ns, &planes);
            writer.write_frame(arrived_at.as_ns(), &submit, &planes).map(|_| ())
        }
        Job::Ui { arrived_at, ui, planes } => {
            let format = format_of(formats, ui.stream);
            let described = PlaneMap::from_fn(|kind| (kind == PlaneKind::Ui).then_some(ui.plane));
            plane_bytes(format, &described, None, &planes)
                .iter()
                .try_for_each(|plane| writer.ui_plane(arrived_at.as_ns(), &ui, plane).map(|_| ()))
        }
    }
}

fn record_unsaid<W: io::Write>(
    writer: &mut CaptureWriter<W>,
    unsaid: &Unsaid,
) -> Result<(), CaptureError> {
    if let Some(gap) = &unsaid.gap {
        writer.gap(gap)?;
    }
    unsaid
        .poses
        .iter()
        .try_for_each(|(pose, arrived_at)| writer.late_camera(arrived_at.as_ns(), pose))
}

fn format_of(formats: &[(u32, StreamFormat)], stream: u32) -> &StreamFormat {
    let format = formats.iter().find(|(number, _)| *number == stream);
    format.map(|(_, format)| format).expect("a stream is announced before its keys")
}

/// The planes that are there, in the order of their kinds, as the writer takes them.
fn plane_bytes<'a>(
    format: &StreamFormat,
    described: &PlaneMap<PlaneDescriptor>,
    motion_from_ns: Option<u64>,
    planes: &'a KeyPlanes,
) -> Vec<PlaneBytes<'a>> {
    let info = |(kind, plane)| PlaneInfo::described(format, kind, plane, motion_from_ns);
    let infos = described.iter().filter_map(info);
    infos.filter_map(|info| Some(PlaneBytes::tight(info, planes.get(info.kind)?))).collect()
}

#[cfg(test)]
mod tests;
