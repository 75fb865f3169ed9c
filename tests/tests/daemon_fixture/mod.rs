//! A daemon in this process, and clients that speak the protocol packet by packet.
//!
//! Nothing sleeps: a client waits for a packet with a time limit that no working daemon comes near,
//! and a test that runs into it fails.

#![allow(dead_code, reason = "each test file uses its own part of the fixture")]
#![expect(clippy::unwrap_used, reason = "a fixture that cannot go on fails its test")]

pub(crate) mod child;

use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use foreframe_protocol::memory::{ReadOnlyPool, SlotMemory, WritablePool};
use foreframe_protocol::socket::{Channel, Received, Sent};
use foreframe_protocol::{
    ClientMessage, CreateStream, DaemonMessage, ErrorMessage, Hello, OutputFrame, OutputPool,
    PlaneDescriptor, PlaneKind, PlaneMap, PlaneSize, RegisterPool, ReleaseReason, StreamFormat,
    Submit, Subscribe,
};
use foreframed::config::SinkSpec;
use foreframed::{Args, Config, Daemon, Stopper, clock};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tempfile::TempDir;

/// Waiting this long means that something is broken.
const PATIENCE_S: i64 = 60;

/// A daemon in a thread, with a folder of its own.
pub(crate) struct RunningDaemon {
    pub(crate) folder: TempDir,
    pub(crate) socket: PathBuf,
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
}

impl RunningDaemon {
    /// With this sink, whose paths are relative to the folder.
    pub(crate) fn start(sink: &str) -> Self {
        Self::start_with(sink, Args::default())
    }

    pub(crate) fn start_with(sink: &str, args: Args) -> Self {
        Self::start_config(sink, args, |_| ())
    }

    /// With a configuration that `change` has the last word on.
    pub(crate) fn start_config(sink: &str, args: Args, change: impl FnOnce(&mut Config)) -> Self {
        let folder = private_folder();
        let sink = match sink.split_once(':') {
            Some((kind, path)) => format!("{kind}:{}", folder.path().join(path).display()),
            None => sink.to_owned(),
        };
        let socket = folder.path().join("daemon.sock");
        let args = Args {
            socket: Some(socket.clone()),
            sink: Some(sink.parse::<SinkSpec>().unwrap()),
            record: args.record.map(|file| folder.path().join(file)),
            ..args
        };
        let mut config = args.resolve().unwrap();
        change(&mut config);
        let (bound, is_bound) = std::sync::mpsc::channel();
        // The main loop lives on the thread that makes it.
        let thread = std::thread::spawn(move || {
            let daemon = Daemon::bind(config).unwrap();
            bound.send(daemon.stopper()).unwrap();
            daemon.run().unwrap();
        });
        let stopper = is_bound.recv().expect("the daemon starts");
        Self { folder, socket, stopper, thread: Some(thread) }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn connect(&self) -> Client {
        Client::connect(&self.socket)
    }

    /// Stops it in good order and waits until it has.
    pub(crate) fn stop(&mut self) {
        self.stopper.stop();
        self.join();
    }

    /// Waits until it has stopped, because somebody else asked it to.
    pub(crate) fn join(&mut self) {
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the daemon ends in good order");
        }
    }
}

impl Drop for RunningDaemon {
    fn drop(&mut self) {
        self.stop();
    }
}

/// A folder that only this user can enter.
pub(crate) fn private_folder() -> TempDir {
    use std::os::unix::fs::PermissionsExt as _;
    tempfile::Builder::new().permissions(std::fs::Permissions::from_mode(0o700)).tempdir().unwrap()
}

/// A client that says exactly what it is told to.
pub(crate) struct Client {
    pub(crate) channel: Channel,
    waiting: Vec<(DaemonMessage, Option<OwnedFd>)>,
}

impl Client {
    /// Connected, nothing said.
    pub(crate) fn connect_silently(socket: &Path) -> Self {
        Self { channel: Channel::connect(socket).unwrap(), waiting: Vec::new() }
    }

    /// Connected and welcomed.
    pub(crate) fn connect(socket: &Path) -> Self {
        let mut client = Self::connect_silently(socket);
        client.send(Hello::new("test"));
        client.expect("a welcome", |message| match message {
            DaemonMessage::Welcome(welcome) => Some(welcome.clone()),
            _ => None,
        });
        client
    }

    pub(crate) fn send(&self, message: impl Into<ClientMessage>) {
        let sent = self.channel.send(&message.into().to_packet(), None).unwrap();
        assert_eq!(sent, Sent::Whole);
    }

    /// The next packet, as it comes; None when the daemon has hung up.
    pub(crate) fn receive(&mut self) -> Option<(DaemonMessage, Option<OwnedFd>)> {
        loop {
            match self.channel.receive().unwrap() {
                Received::Packet(packet) => return Some(packet.parse_daemon().unwrap()),
                Received::Closed => return None,
                Received::WouldBlock => self.wait(),
            }
        }
    }

    fn wait(&self) {
        let mut ready = [PollFd::new(&self.channel, PollFlags::IN)];
        let patience = Timespec { tv_sec: PATIENCE_S, tv_nsec: 0 };
        let events = poll(&mut ready, Some(&patience)).unwrap();
        assert!(events > 0, "the daemon has said nothing for {PATIENCE_S} s");
    }

    /// The first message, of those that came and those to come, that `pick` picks. The others stay
    /// for later calls.
    pub(crate) fn expect<T>(
        &mut self,
        what: &str,
        pick: impl Fn(&DaemonMessage) -> Option<T>,
    ) -> T {
        self.expect_with_fd(what, |message, _| pick(message))
    }

    pub(crate) fn expect_with_fd<T>(
        &mut self,
        what: &str,
        pick: impl Fn(&DaemonMessage, &mut Option<OwnedFd>) -> Option<T>,
    ) -> T {
        for index in 0..self.waiting.len() {
            let (message, fd) = &mut self.waiting[index];
            if let Some(picked) = pick(message, fd) {
                self.waiting.remove(index);
                return picked;
            }
        }
        loop {
            let Some((message, mut fd)) = self.receive() else {
                panic!("hung up instead of {what}; before: {:?}", self.waiting);
            };
            if let Some(picked) = pick(&message, &mut fd) {
                return picked;
            }
            self.waiting.push((message, fd));
        }
    }

    pub(crate) fn expect_error(&mut self) -> ErrorMessage {
        self.expect("an error", |message| match message {
            DaemonMessage::Error(error) => Some(error.clone()),
            _ => None,
        })
    }

    /// What came and was not asked for yet.
    pub(crate) fn take_waiting(&mut self) -> Vec<DaemonMessage> {
        self.waiting.drain(..).map(|(message, _)| message).collect()
    }

    /// Reads until the daemon hangs up; everything that it said.
    pub(crate) fn read_to_end(&mut self) -> Vec<DaemonMessage> {
        let mut all: Vec<_> = self.waiting.drain(..).map(|(message, _)| message).collect();
        while let Some((message, _)) = self.receive() {
            all.push(message);
        }
        all
    }

    /// A stream of this size with a registered pool.
    pub(crate) fn open_stream(&mut self, number: u32, width: u32, height: u32) -> KeySource {
        self.open_stream_of(number, StreamFormat::rgba8(width, height))
    }

    pub(crate) fn open_stream_of(&mut self, number: u32, format: StreamFormat) -> KeySource {
        self.open_stream_sized(number, format, 1)
    }

    /// With depth and motion planes that have 1/`divisor` of colour's columns and rows.
    pub(crate) fn open_stream_sized(
        &mut self,
        number: u32,
        format: StreamFormat,
        divisor: u32,
    ) -> KeySource {
        let max_sizes = PlaneMap::from_fn(|kind| {
            let PlaneSize { width, height } = *format.full_sizes().get(kind)?;
            let divisor = if kind == PlaneKind::Color { 1 } else { divisor };
            Some(PlaneSize { width: width / divisor, height: height / divisor })
        });
        let create = CreateStream { stream: number, format, max_sizes, slots: 3 };
        self.send(create);
        self.expect("stream created", |message| match message {
            DaemonMessage::StreamCreated(created) => (created.stream == number).then_some(()),
            _ => None,
        });
        let source = KeySource::new(create);
        self.register(&source);
        self.expect("pool accepted", |message| match message {
            DaemonMessage::PoolAccepted(accepted) => (accepted.stream == number).then_some(()),
            _ => None,
        });
        source
    }

    pub(crate) fn register(&self, source: &KeySource) {
        let message = ClientMessage::from(source.register).to_packet();
        let sent = self.channel.send(&message, Some(source.pool.fd())).unwrap();
        assert_eq!(sent, Sent::Whole);
    }

    /// Submits a key of one colour, and waits until its slot comes back.
    pub(crate) fn submit(&mut self, source: &mut KeySource, color: [u8; 4]) -> Submit {
        let submit = source.fill(color);
        self.send(submit);
        let reason = self.expect_released(&submit);
        assert!(matches!(reason, ReleaseReason::Copied), "{reason}");
        submit
    }

    pub(crate) fn expect_released(&mut self, submit: &Submit) -> ReleaseReason {
        self.expect("slot released", |message| match message {
            DaemonMessage::SlotReleased(released) => (released.key_index == submit.key_index
                && released.stream == submit.stream)
                .then_some(released.reason),
            _ => None,
        })
    }

    pub(crate) fn expect_presented(&mut self, submit: &Submit) {
        self.expect("presented", |message| match message {
            DaemonMessage::Presented(it) => (it.key_index == submit.key_index).then_some(()),
            _ => None,
        });
    }

    pub(crate) fn subscribe(&mut self, stream: u32, slots: u32) -> Screen {
        self.send(Subscribe { stream, slots });
        self.expect_screen(stream)
    }

    pub(crate) fn expect_screen(&mut self, stream: u32) -> Screen {
        self.expect_with_fd("an output pool", |message, fd| match message {
            DaemonMessage::OutputPool(pool) if pool.stream == stream => {
                let bytes = pool.slot_bytes * u64::from(pool.slots);
                let memory = ReadOnlyPool::accept(fd.take().unwrap(), bytes, bytes).unwrap();
                Some(Screen { pool: *pool, memory })
            }
            _ => None,
        })
    }

    pub(crate) fn expect_frame(&mut self, screen: &Screen) -> OutputFrame {
        self.expect("an output frame", |message| match message {
            DaemonMessage::OutputFrame(frame) => (frame.pool == screen.pool.pool).then_some(*frame),
            _ => None,
        })
    }
}

/// What a subscriber maps.
pub(crate) struct Screen {
    pub(crate) pool: OutputPool,
    pub(crate) memory: ReadOnlyPool,
}

impl Screen {
    /// All bytes of a frame.
    pub(crate) fn pixels(&self, frame: &OutputFrame) -> Vec<u8> {
        let mut bytes = Vec::new();
        let offset = u64::from(frame.slot) * self.pool.slot_bytes;
        let len = self.pool.stride as usize * self.pool.height as usize;
        self.memory.copy_to_vec(offset, len, &mut bytes).unwrap();
        bytes
    }
}

/// The keys of one stream: numbered, timed by the real clock, in rotating slots.
pub(crate) struct KeySource {
    pub(crate) create: CreateStream,
    pub(crate) pool: WritablePool,
    pub(crate) slots: Vec<SlotMemory>,
    pub(crate) register: RegisterPool,
    pub(crate) next_key: u64,
}

impl KeySource {
    pub(crate) fn new(create: CreateStream) -> Self {
        let format = create.format;
        let plane_bytes = |kind| {
            let bytes = u64::from(format.bytes_per_pixel(kind)?);
            let size = create.max_sizes.get(kind)?;
            Some((u64::from(size.width) * u64::from(size.height) * bytes).next_multiple_of(16))
        };
        let bytes: u64 = PlaneKind::ALL.iter().filter_map(|&kind| plane_bytes(kind)).sum();
        let slot_bytes = bytes.next_multiple_of(4096);
        let (pool, slots) = WritablePool::allocate("test", create.slots, slot_bytes).unwrap();
        let register =
            RegisterPool { stream: create.stream, pool: 1, slots: create.slots, slot_bytes };
        Self { create, pool, slots, register, next_key: 0 }
    }

    /// Where the planes of a key lie in its slot, one after the other.
    pub(crate) fn layout(&self) -> PlaneMap<PlaneDescriptor> {
        let mut offset = 0;
        PlaneMap::from_fn(|kind| {
            let bytes_per_pixel = self.create.format.bytes_per_pixel(kind)?;
            let size = *self.create.max_sizes.get(kind)?;
            let plane = PlaneDescriptor::packed(offset, size, bytes_per_pixel);
            offset = (offset + plane.byte_len(bytes_per_pixel)).next_multiple_of(16);
            Some(plane)
        })
    }

    /// The next key, with its colour plane filled and all other planes zero.
    pub(crate) fn fill(&mut self, color: [u8; 4]) -> Submit {
        let key_index = self.next_key;
        self.next_key += 1;
        let slot = (key_index % self.slots.len() as u64) as usize;
        let planes = self.layout();
        let pixels = color_bytes(&self.create.format);
        for pixel in self.slots[slot][..pixels].chunks_exact_mut(4) {
            pixel.copy_from_slice(&color);
        }
        let content_time_ns = clock::now().as_ns();
        Submit {
            stream: self.create.stream,
            slot: slot as u32,
            key_index,
            content_time_ns,
            motion_from_ns: None,
            is_cut: false,
            planes,
            camera: None,
            motion_from_camera: None,
        }
    }
}

fn color_bytes(format: &StreamFormat) -> usize {
    let PlaneSize { width, height } = PlaneSize { width: format.width, height: format.height };
    width as usize * height as usize * format.color.bytes_per_pixel() as usize
}

/// The descriptor of a pool, as a hostile client may send anything in its place.
pub(crate) fn duplicate(fd: impl std::os::fd::AsFd) -> OwnedFd {
    fd.as_fd().try_clone_to_owned().unwrap()
}
