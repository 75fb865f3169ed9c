//! A recording whose disk the test holds up.

use std::sync::{Condvar, MutexGuard};

use foreframe_protocol::memory::{ReadOnlyPool, SlotMemory, WritablePool};
use foreframe_protocol::{PlaneDescriptor, PlaneMap, PlaneSize};

use super::*;
use crate::capture::{Capture, CaptureSource};
use crate::stream::planes::PlaneCopier;

/// Running into this means that something is broken.
const PATIENCE: Duration = Duration::from_secs(60);
const SIZE: PlaneSize = PlaneSize { width: 4, height: 2 };

/// A disk that stops and goes on as it is told.
#[derive(Clone, Default)]
struct Disk(Arc<(Mutex<DiskState>, Condvar)>);

#[derive(Default)]
struct DiskState {
    bytes: Vec<u8>,
    is_stuck: bool,
}

impl Disk {
    fn lock(&self) -> MutexGuard<'_, DiskState> {
        self.0.0.lock().unwrap()
    }

    fn set_stuck(&self, is_stuck: bool) {
        self.lock().is_stuck = is_stuck;
        self.0.1.notify_all();
    }

    /// What is on it, read as a capture.
    fn capture(&self) -> Result<Capture, CaptureError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), &self.lock().bytes).unwrap();
        Capture::open(file.path())
    }

    fn wait_for_frames(&self, frames: usize) {
        while self.capture().map_or(0, |capture| capture.frame_count()) < frames {
            thread::yield_now();
        }
    }
}

impl io::Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut state = self.0.1.wait_while(self.lock(), |state| state.is_stuck).unwrap();
        state.bytes.extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn recorder(disk: &Disk, patience: Duration) -> Recorder {
    let session = SessionInfo::new("test", CaptureSource::Live);
    let writer = CaptureWriter::to_writer(disk.clone(), &session).unwrap();
    Recorder::start_writer(writer, patience).unwrap()
}

/// A stream that hands over keys of one colour, one per millisecond.
struct Source {
    create: CreateStream,
    memory: ReadOnlyPool,
    _slots: Vec<SlotMemory>,
    copier: PlaneCopier,
    next_key: u64,
}

impl Source {
    fn new() -> Self {
        let (pool, slots) = WritablePool::allocate("test", 1, 4096).unwrap();
        let fd = pool.fd().try_clone_to_owned().unwrap();
        Self {
            create: CreateStream {
                stream: 1,
                format: StreamFormat::rgba8(SIZE.width, SIZE.height),
                max_sizes: PlaneMap::from_fn(|kind| (kind == PlaneKind::Color).then_some(SIZE)),
                slots: 1,
            },
            memory: ReadOnlyPool::accept(fd, 4096, 4096).unwrap(),
            _slots: slots,
            copier: PlaneCopier::default(),
            next_key: 0,
        }
    }

    fn offer(&mut self, recorder: &mut StreamRecorder, keys: u64) {
        for _ in 0..keys {
            let arrived_at = MonoTime::from_ns(1_000_000 * (1 + self.next_key));
            let mut planes = PlaneMap::default();
            planes.set(PlaneKind::Color, Some(PlaneDescriptor::packed(0, SIZE, 4)));
            let submit = Submit {
                stream: 1,
                slot: 0,
                key_index: self.next_key,
                content_time_ns: arrived_at.as_ns(),
                motion_from_ns: None,
                is_cut: false,
                planes,
                camera: None,
                motion_from_camera: None,
            };
            self.next_key += 1;
            let format = &self.create.format;
            let planes = self.copier.copy(format, &submit.planes, &self.memory, 0).unwrap();
            recorder.offer(&submit, arrived_at, &planes);
        }
    }
}

#[test]
fn keys_that_a_stuck_disk_could_not_take_are_counted_where_they_are_missing() {
    let disk = Disk::default();
    let recorder = recorder(&disk, PATIENCE);
    let mut source = Source::new();
    let mut stream = recorder.stream(1);
    stream.announce(&source.create);
    source.offer(&mut stream, 1);
    disk.wait_for_frames(1);
    disk.set_stuck(true);
    // The queue, and one key in the writer's hands.
    source.offer(&mut stream, 30);
    disk.set_stuck(false);
    disk.wait_for_frames(1 + QUEUED_KEYS);
    source.offer(&mut stream, 1);
    drop(stream);
    drop(recorder);
    let info = disk.capture().unwrap().info().unwrap();
    assert_eq!(info.frames as u64 + info.gaps, 32, "every key is there, or counted");
    assert!((30 - QUEUED_KEYS as u64 - 1..=30 - QUEUED_KEYS as u64).contains(&info.gaps));
    assert!(!info.is_truncated());
}

#[test]
fn a_gap_at_the_end_of_a_stream_is_recorded_though_the_queue_is_full() {
    let disk = Disk::default();
    let recorder = recorder(&disk, PATIENCE);
    let mut source = Source::new();
    let mut stream = recorder.stream(1);
    stream.announce(&source.create);
    disk.set_stuck(true);
    source.offer(&mut stream, 30);
    drop(stream);
    disk.set_stuck(false);
    drop(recorder);
    let info = disk.capture().unwrap().info().unwrap();
    assert!(info.gaps >= 30 - QUEUED_KEYS as u64 - 1, "{}", info.gaps);
    assert_eq!(info.frames as u64 + info.gaps, 30);
}

#[test]
fn a_stream_that_starts_while_the_disk_is_stuck_does_not_wait_for_it() {
    let disk = Disk::default();
    let recorder = recorder(&disk, PATIENCE);
    let (mut first, mut second) = (Source::new(), Source::new());
    let mut stream = recorder.stream(1);
    stream.announce(&first.create);
    disk.set_stuck(true);
    first.offer(&mut stream, 30);
    let mut late = recorder.stream(2);
    late.announce(&second.create);
    second.offer(&mut late, 5);
    drop((stream, late));
    disk.set_stuck(false);
    drop(recorder);
    let info = disk.capture().unwrap().info().unwrap();
    assert_eq!(info.streams.len(), 2);
    assert_eq!(info.frames as u64 + info.gaps, 35);
}

#[test]
fn the_end_does_not_wait_for_a_stuck_disk_and_what_is_on_it_can_be_read() {
    let disk = Disk::default();
    let mut recorder = recorder(&disk, PATIENCE);
    let mut source = Source::new();
    let mut stream = recorder.stream(1);
    stream.announce(&source.create);
    source.offer(&mut stream, 3);
    disk.wait_for_frames(3);
    disk.set_stuck(true);
    source.offer(&mut stream, 30);
    recorder.patience = Duration::from_millis(1);
    // The stream still holds its end of the queue, as one with a stuck sink does.
    drop(recorder);
    let info = disk.capture().unwrap().info().unwrap();
    assert_eq!(info.frames, 3);
    drop(stream);
}

#[test]
fn the_end_does_not_wait_for_a_stream_that_hangs() {
    let disk = Disk::default();
    let recorder = recorder(&disk, PATIENCE);
    let mut source = Source::new();
    let mut stream = recorder.stream(1);
    stream.announce(&source.create);
    source.offer(&mut stream, 3);
    drop(recorder);
    let info = disk.capture().unwrap().info().unwrap();
    assert_eq!((info.frames, info.is_truncated()), (3, false));
    drop(stream);
}

#[test]
fn a_pipe_that_nobody_reads_is_refused_and_does_not_hang() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipe");
    rustix::fs::mkfifoat(rustix::fs::CWD, &path, Mode::RUSR | Mode::WUSR).unwrap();
    let session = SessionInfo::new("test", CaptureSource::Live);
    let error = format!("{:#}", Recorder::start(&path, &session, PATIENCE).unwrap_err());
    assert!(error.contains("expected a file") && error.contains("without reader"), "{error}");
}
