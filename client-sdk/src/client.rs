//! One session: streams, submissions, events. Nothing here waits unless a timeout is an argument.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::socket::{Channel, Received, Sent};
use foreframe_protocol::{
    Body, DaemonMessage, DestroyStream, EndReason, Error as ProtocolError, Goodbye, LateCamera,
    OutputPool, OutputReleased, Packet, PlaneKind, RegisterPool, Statistics, Submit, Subscribe,
    UiPlane, Unsubscribe, Welcome,
};

use crate::deadline::Deadline;
use crate::error::{Error, Result};
use crate::event::Event;
use crate::frame::KeyFrame;
use crate::key::Key;
use crate::options::StreamOptions;
use crate::outbox::Outbox;
use crate::output::{MappedPool, OutputFrame, OutputSource};
use crate::stream::{SlotLayout, Stream, StreamState};
use crate::ui::UiFrame;

/// Events that are kept for an application that does not look at them; older ones are lost first.
const MAX_EVENTS: usize = 1024;
/// Packets that one dispatch reads at most, so that a chatty daemon cannot hold the application.
const MAX_PACKETS_PER_DISPATCH: usize = 256;

/// Name of a stream within its client.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct StreamId(u32);

impl StreamId {
    pub(crate) const fn new(number: u32) -> Self {
        Self(number)
    }

    /// Its number on the wire.
    #[must_use]
    pub const fn number(self) -> u32 {
        self.0
    }
}

impl fmt::Display for StreamId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "stream {}", self.0)
    }
}

/// A session with the daemon. Dropping it ends the session.
#[derive(Debug)]
pub struct Client {
    channel: Channel,
    welcome: Welcome,
    is_connected: bool,
    outbox: Outbox,
    streams: BTreeMap<u32, Stream>,
    last_stream: u32,
    output_pools: BTreeMap<u32, Arc<MappedPool>>,
    released_outputs: Receiver<OutputReleased>,
    output_home: Sender<OutputReleased>,
    events: VecDeque<Event>,
    lost_events: u64,
}

impl Client {
    pub(crate) fn new(channel: Channel, welcome: Welcome) -> Self {
        let (output_home, released_outputs) = self::channel();
        Self {
            channel,
            welcome,
            is_connected: true,
            outbox: Outbox::default(),
            streams: BTreeMap::new(),
            last_stream: 0,
            output_pools: BTreeMap::new(),
            released_outputs,
            output_home,
            events: VecDeque::new(),
            lost_events: 0,
        }
    }

    /// What the daemon grants, and what it works with.
    #[must_use]
    pub fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// Starts a stream. Its pool is allocated here, which takes about half a millisecond per
    /// megabyte; key frames may be submitted at once. A refusal arrives as [`Event::Refused`].
    ///
    /// # Errors
    /// If the options contradict themselves or the daemon's limits, or memory is short.
    pub fn create_stream(&mut self, options: &StreamOptions) -> Result<StreamId> {
        self.connected()?;
        let number = self.last_stream + 1;
        let create = options.to_message(number);
        create.validate()?;
        let layout = SlotLayout::new(&create, options.row_alignment()?);
        self.check_limits(&create, &layout)?;
        let stream = Stream::new(create, layout)?;
        let fd = stream
            .pool()
            .fd()
            .try_clone_to_owned()
            .map_err(|reason| ProtocolError::Os { action: "pass on shared memory", reason })?;
        let pool = RegisterPool {
            stream: number,
            pool: number,
            slots: create.slots,
            slot_bytes: layout.slot_bytes,
        };
        self.post(&create, None)?;
        self.post(&pool, Some(fd))?;
        self.last_stream = number;
        self.streams.insert(number, stream);
        Ok(StreamId(number))
    }

    fn check_limits(
        &self,
        create: &foreframe_protocol::CreateStream,
        layout: &SlotLayout,
    ) -> Result<()> {
        let welcome = &self.welcome;
        let format = &create.format;
        let open = self.streams.values().filter(|stream| stream.state != StreamState::Ended);
        let (mut streams, mut pool_bytes) = (1_u64, layout.slot_bytes * u64::from(create.slots));
        for stream in open {
            streams += 1;
            pool_bytes = pool_bytes.saturating_add(stream.pool().pool_bytes());
        }
        let limits = [
            ("streams", streams, u64::from(welcome.max_streams)),
            ("slots", u64::from(create.slots), u64::from(welcome.max_slots)),
            ("width", u64::from(format.width), u64::from(welcome.max_width)),
            ("height", u64::from(format.height), u64::from(welcome.max_height)),
            ("bytes of all pools", pool_bytes, welcome.max_pool_bytes),
        ];
        match limits.into_iter().find(|(_, asked, most)| asked > most) {
            None => Ok(()),
            Some((option, asked, most)) => Err(Error::Option {
                option,
                expected: format!("at most {most}"),
                found: asked.to_string(),
            }),
        }
    }

    /// How far a stream has come.
    #[must_use]
    pub fn stream_state(&self, stream: StreamId) -> StreamState {
        self.streams.get(&stream.0).map_or(StreamState::Ended, |stream| stream.state)
    }

    /// Key frames of this stream that were skipped here because the daemon was behind.
    #[must_use]
    pub fn skipped_keys(&self, stream: StreamId) -> u64 {
        self.streams.get(&stream.0).map_or(0, |stream| stream.skipped_keys)
    }

    /// The newest counts of the daemon, if it has sent any.
    #[must_use]
    pub fn statistics(&self, stream: StreamId) -> Option<Statistics> {
        self.streams.get(&stream.0)?.statistics
    }

    /// A free slot, every plane at its largest size. Slots that the daemon gave back are seen
    /// after [`dispatch`](Self::dispatch).
    ///
    /// # Errors
    /// [`Error::WouldBlock`] if none is free; the key frame is counted as skipped.
    pub fn acquire(&mut self, stream: StreamId) -> Result<KeyFrame> {
        self.connected()?;
        let stream = open_stream(&mut self.streams, stream.0)?;
        let frame = stream.acquire();
        if frame.is_none() {
            stream.skipped_keys += 1;
        }
        frame.ok_or(Error::WouldBlock)
    }

    /// Hands a key frame to the daemon.
    ///
    /// # Errors
    /// [`Error::WouldBlock`] if the daemon has not read for a while: the slot is free again and
    /// the key frame counted as skipped. Other errors if the key frame contradicts its stream;
    /// nothing is sent then, and the slot is free again.
    pub fn submit(&mut self, mut frame: KeyFrame, key: Key) -> Result<()> {
        self.connected()?;
        let stream = open_stream(&mut self.streams, frame.stream())?;
        let submit = Submit {
            stream: frame.stream(),
            slot: frame.slot(),
            key_index: key.index,
            content_time_ns: key.content_time_ns,
            motion_from_ns: key.motion_from_ns,
            is_cut: key.is_cut,
            planes: *frame.planes(),
            camera: key.camera,
            motion_from_camera: key.motion_from_camera,
        };
        submit.validate()?;
        submit.check(&stream.create, stream.layout.slot_bytes)?;
        let mut order = stream.order;
        order.advance(&submit)?;
        // What waits was posted earlier and may be what this key frame depends on.
        if let Err(error) = self.outbox.flush(&self.channel) {
            return self.fail(error);
        }
        let sent = if self.outbox.is_waiting() {
            Ok(Sent::WouldBlock)
        } else {
            self.channel.send(&Packet::new(&submit), None)
        };
        match sent {
            Ok(Sent::Whole) => {
                stream.order = order;
                stream.on_submitted(key.index, &mut frame);
                Ok(())
            }
            Ok(Sent::WouldBlock) => {
                stream.skipped_keys += 1;
                Err(Error::WouldBlock)
            }
            Err(error) => self.fail(error.into()),
        }
    }

    /// A free slot for a user interface between key frames, of a stream that declares UI planes, at
    /// its largest size. The last free slot is left to key frames, so such a stream wants a slot
    /// more.
    ///
    /// # Errors
    /// [`Error::WouldBlock`] if none is free, [`Error::NoPlane`] if the stream has no UI planes.
    pub fn acquire_ui(&mut self, stream: StreamId) -> Result<UiFrame> {
        self.connected()?;
        let stream = open_stream(&mut self.streams, stream.0)?;
        if stream.create.format.ui.is_none() {
            return Err(Error::NoPlane { plane: PlaneKind::Ui });
        }
        stream.acquire_beside_keys().map(UiFrame::new).ok_or(Error::WouldBlock)
    }

    /// Shows a user interface from the next picture on, in the place of the one before.
    ///
    /// # Errors
    /// [`Error::WouldBlock`] if the daemon has not read for a while: it is left out, and the slot
    /// is free again. Other errors if it contradicts its stream; nothing is sent then.
    pub fn submit_ui(&mut self, ui: UiFrame) -> Result<()> {
        self.connected()?;
        let (mut frame, plane, place) = ui.into_parts()?;
        let stream = open_stream(&mut self.streams, frame.stream())?;
        let ui_index = stream.next_ui;
        let message =
            UiPlane { stream: frame.stream(), slot: frame.slot(), ui_index, place, plane };
        message.validate()?;
        message.check(&stream.create, stream.layout.slot_bytes)?;
        // What waits was posted earlier and may be what this depends on.
        if let Err(error) = self.outbox.flush(&self.channel) {
            return self.fail(error);
        }
        let sent = if self.outbox.is_waiting() {
            Ok(Sent::WouldBlock)
        } else {
            self.channel.send(&Packet::new(&message), None)
        };
        match sent {
            Ok(Sent::Whole) => {
                stream.next_ui += 1;
                stream.on_submitted(ui_index, &mut frame);
                Ok(())
            }
            Ok(Sent::WouldBlock) => Err(Error::WouldBlock),
            Err(error) => self.fail(error.into()),
        }
    }

    /// Tells where the camera is by now, at any time; the newest content time wins.
    ///
    /// # Errors
    /// [`Error::WouldBlock`] if the daemon has not read for a while; the pose is dropped.
    pub fn late_camera(
        &mut self,
        stream: StreamId,
        content_time_ns: u64,
        view: [f32; 16],
    ) -> Result<()> {
        self.connected()?;
        open_stream(&mut self.streams, stream.0)?;
        let pose = LateCamera { stream: stream.0, content_time_ns, view };
        pose.validate()?;
        match self.channel.send(&Packet::new(&pose), None) {
            Ok(Sent::Whole) => Ok(()),
            Ok(Sent::WouldBlock) => Err(Error::WouldBlock),
            Err(error) => self.fail(error.into()),
        }
    }

    /// Ends a stream. Frames of it that the application still holds cannot be submitted any more.
    ///
    /// # Errors
    /// If there is no such stream.
    pub fn destroy_stream(&mut self, stream: StreamId) -> Result<()> {
        self.connected()?;
        open_stream(&mut self.streams, stream.0)?.state = StreamState::Ended;
        self.post(&DestroyStream { stream: stream.0 }, None)
    }

    /// Asks for output frames, in a pool of this many slots (1 to 8). They arrive as
    /// [`Event::Output`].
    ///
    /// # Errors
    /// If the number of slots is out of range.
    pub fn subscribe(&mut self, source: OutputSource, slots: u32) -> Result<()> {
        self.connected()?;
        let subscribe = Subscribe { stream: source.number(), slots };
        subscribe.validate()?;
        self.post(&subscribe, None)
    }

    /// Asks for no more output frames.
    ///
    /// # Errors
    /// [`Error::Disconnected`] if the daemon is gone.
    pub fn unsubscribe(&mut self, source: OutputSource) -> Result<()> {
        self.connected()?;
        self.post(&Unsubscribe { stream: source.number() }, None)
    }

    /// Reads what the daemon has sent and sends what has been waiting. Never waits; call it once
    /// per frame, or when the descriptor can be read.
    ///
    /// # Errors
    /// [`Error::Disconnected`] if the daemon is gone, [`Error::Refused`] if it ended the session.
    pub fn dispatch(&mut self) -> Result<()> {
        self.connected()?;
        self.try_dispatch().or_else(|error| self.fail(error))
    }

    fn try_dispatch(&mut self) -> Result<()> {
        for _ in 0..MAX_PACKETS_PER_DISPATCH {
            match self.channel.receive()? {
                Received::Packet(incoming) => {
                    let (message, fd) = incoming.parse_daemon()?;
                    self.on_message(message, fd)?;
                }
                Received::WouldBlock => break,
                Received::Closed => return Err(Error::Disconnected),
            }
        }
        while let Ok(released) = self.released_outputs.try_recv() {
            self.outbox.post(&self.channel, &released, None)?;
        }
        self.outbox.flush(&self.channel)
    }

    /// Waits until the daemon has something to say, at most `timeout`, and dispatches. For programs
    /// without a loop of their own. True if something came.
    ///
    /// # Errors
    /// Those of [`dispatch`](Self::dispatch).
    pub fn wait(&mut self, timeout: Duration) -> Result<bool> {
        self.dispatch()?;
        if !self.events.is_empty() {
            return Ok(true);
        }
        let deadline = Deadline::new(timeout)?;
        let is_due = deadline.wait(self.channel.as_fd(), self.outbox.is_waiting())?;
        self.dispatch()?;
        Ok(is_due)
    }

    /// The oldest event that has not been looked at.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Events that were lost because nobody looked at them in time.
    #[must_use]
    pub fn lost_events(&self) -> u64 {
        self.lost_events
    }

    fn on_message(&mut self, message: DaemonMessage, fd: Option<OwnedFd>) -> Result<()> {
        let event = match message {
            DaemonMessage::StreamCreated(_) => return Ok(()),
            DaemonMessage::PoolAccepted(accepted) => {
                if let Some(stream) = self.streams.get_mut(&accepted.stream)
                    && stream.state == StreamState::Pending
                {
                    stream.state = StreamState::Ready;
                }
                Event::StreamReady(StreamId(accepted.stream))
            }
            DaemonMessage::SlotReleased(released) => {
                let stream = self.streams.get_mut(&released.stream);
                if stream.is_some_and(|stream| !stream.on_released(&released)) {
                    return Err(unexpected("a slot that the daemon has", format!("{released:?}")));
                }
                Event::SlotReleased(released)
            }
            DaemonMessage::StreamEnded(ended) => {
                self.streams.remove(&ended.stream);
                Event::StreamEnded { stream: StreamId(ended.stream), reason: ended.reason }
            }
            DaemonMessage::Statistics(statistics) => {
                if let Some(stream) = self.streams.get_mut(&statistics.stream) {
                    stream.statistics = Some(statistics);
                }
                Event::Statistics(statistics)
            }
            DaemonMessage::Presented(presented) => Event::Presented(presented),
            DaemonMessage::Pacing(pacing) => Event::Pacing(pacing),
            DaemonMessage::Hint(hint) => Event::Hint(hint),
            DaemonMessage::OutputPool(about) => return self.on_output_pool(about, fd),
            DaemonMessage::OutputFrame(about) => {
                let pool = self.output_pools.get(&about.pool);
                let Some(pool) = pool.filter(|pool| about.slot < pool.about.slots) else {
                    return Err(unexpected("a slot of an output pool", format!("{about:?}")));
                };
                let (pool, home) = (Arc::clone(pool), self.output_home.clone());
                Event::Output(OutputFrame::new(about, pool, home))
            }
            DaemonMessage::OutputEnded(ended) => {
                self.output_pools.retain(|_, pool| pool.about.stream != ended.stream);
                let source = OutputSource::from_number(ended.stream);
                Event::OutputEnded { source, reason: ended.reason }
            }
            DaemonMessage::Error(error) if error.is_fatal => return Err(Error::Refused(error)),
            DaemonMessage::Error(error) => Event::Refused(error),
            DaemonMessage::Goodbye(_) => return Err(Error::Disconnected),
            DaemonMessage::Welcome(_) | DaemonMessage::Reject(_) => {
                let found = message.kind().to_string();
                return Err(unexpected("no second handshake", found));
            }
        };
        if self.events.len() >= MAX_EVENTS {
            self.events.pop_front();
            self.lost_events += 1;
        }
        self.events.push_back(event);
        Ok(())
    }

    /// Maps the pool of the output frames to come. Frames of an older one stay readable until they
    /// are dropped.
    fn on_output_pool(&mut self, about: OutputPool, fd: Option<OwnedFd>) -> Result<()> {
        let Some(fd) = fd else {
            return Err(unexpected("a descriptor with an output pool", "none".to_owned()));
        };
        let bytes = about.slot_bytes.saturating_mul(u64::from(about.slots));
        let memory = ReadOnlyPool::accept(fd, bytes, bytes)?;
        self.output_pools.retain(|_, pool| pool.about.stream != about.stream);
        self.output_pools.insert(about.pool, Arc::new(MappedPool { about, memory }));
        Ok(())
    }

    fn connected(&self) -> Result<()> {
        if self.is_connected { Ok(()) } else { Err(Error::Disconnected) }
    }

    /// Nothing that happens after an error can be trusted, so the session is over.
    fn fail<T>(&mut self, error: Error) -> Result<T> {
        self.is_connected = false;
        Err(error)
    }

    fn post<T: Body>(&mut self, body: &T, fd: Option<OwnedFd>) -> Result<()> {
        let posted = self.outbox.post(&self.channel, body, fd);
        posted.or_else(|error| self.fail(error))
    }
}

impl AsFd for Client {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.channel.as_fd()
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        if self.is_connected {
            // The daemon sees the end of the connection in any case.
            let goodbye = Packet::new(&Goodbye { reason: EndReason::Requested });
            drop(self.channel.send(&goodbye, None));
        }
    }
}

fn open_stream(streams: &mut BTreeMap<u32, Stream>, number: u32) -> Result<&mut Stream> {
    streams
        .get_mut(&number)
        .filter(|stream| stream.state != StreamState::Ended)
        .ok_or(Error::Stream { stream: number })
}

fn unexpected(expected: &str, found: String) -> Error {
    Error::Protocol(ProtocolError::Packet { expected: expected.to_owned(), found })
}
