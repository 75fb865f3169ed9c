//! The main loop: one thread that listens, speaks with every client, and owns every stream.
//!
//! Nothing here waits for a peer, a disk or pixels: sockets are non-blocking, pixels are copied and
//! made on the streams' threads, sinks are opened on threads of their own, memory of subscribers is
//! allocated and all memory unmapped elsewhere. What does take time here is small and bounded: to
//! start a stream's threads, and to map the pool that a client hands over. Whatever a client does
//! wrong ends that client's session ([`Server::fail`]) and nothing else.
//!
//! - [`control`]: what people ask of the daemon while it runs
//! - [`connections`]: accept, handshake, read, end
//! - [`requests`]: what each message of a client leads to
//! - [`streams`]: streams and the events of their threads
//! - [`subscriptions`]: who gets which output frames

mod connections;
mod control;
mod requests;
mod streams;
mod subscriptions;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context as _;
use calloop::generic::Generic;
use calloop::ping::{Ping, make_ping};
use calloop::signals::{Signal, Signals};
use calloop::timer::{TimeoutAction, Timer};
use calloop::{EventLoop, Interest, LoopHandle, LoopSignal, Mode, PostAction, RegistrationToken};
use foreframe_engine::MonoTime;
use foreframe_protocol::socket::{Listener, default_socket_path};
use foreframe_protocol::{EndReason, Features, Goodbye};
use tracing::{info, warn};

use crate::capture::{
    CaptureSource, DISPLAY_ORIGIN, PIXELS_PER_DEGREE, PIXELS_PER_DEGREE_IS_GIVEN, SessionInfo,
};
use crate::clock;
use crate::config::{Args, Config, SinkSpec};
use crate::gpu::Gpus;
use crate::recorder::Recorder;
use crate::session::Session;
use crate::session::handshake::Terms;
use crate::sink;
use crate::sink::window::WindowSystem;
use crate::stream::FromStream;
use crate::stream::allocator::Allocator;
use crate::stream::reaper::Reaper;
use streams::Stream;

/// Streams of one client at once.
const MAX_STREAMS: u32 = 4;

/// A daemon that listens.
#[derive(Debug)]
pub struct Daemon {
    event_loop: EventLoop<'static, Server>,
    server: Server,
    stop: Ping,
}

/// Stops a daemon from another thread.
#[derive(Clone, Debug)]
pub struct Stopper(Ping);

impl Stopper {
    /// Asks the daemon to say goodbye to everybody and end.
    pub fn stop(&self) {
        self.0.ping();
    }
}

/// Everything that the main loop's callbacks share.
#[derive(Debug)]
struct Server {
    config: Config,
    /// Where applications connect.
    socket: PathBuf,
    /// What the configuration was made from, to be read again.
    told: Option<Args>,
    /// Open connections to the control socket.
    controllers: usize,
    terms: Terms,
    handle: LoopHandle<'static, Server>,
    signal: LoopSignal,
    /// Gone when the daemon stops.
    listener: Option<RegistrationToken>,
    sessions: BTreeMap<u32, Session>,
    last_session: u32,
    /// Every stream whose thread runs, by its number in this process.
    streams: BTreeMap<u64, Stream>,
    next_ordinal: u64,
    events: calloop::channel::Sender<FromStream>,
    /// An instant of the refresh grid, which all streams share.
    display_origin: MonoTime,
    gpus: Arc<Gpus>,
    reaper: Reaper,
    allocator: Allocator,
    recorder: Option<Recorder>,
    /// The desktop, if streams are shown in windows.
    windows: Option<WindowSystem>,
}

impl Daemon {
    /// Takes the socket and starts the recording.
    ///
    /// # Errors
    /// If the sink's place cannot be written, another daemon holds the socket, its folder may not
    /// be used, or a file cannot be made.
    pub fn bind(config: Config) -> anyhow::Result<Self> {
        sink::prepare(&config.sink)?;
        let windows = match config.sink {
            SinkSpec::Window => Some(WindowSystem::start(&config.window).context("--sink window")?),
            _ => None,
        };
        let gpus = Gpus::find(config.backend.clone()).context("--backend")?;
        let path = match &config.socket {
            Some(path) => path.clone(),
            None => default_socket_path()?,
        };
        let listener = Listener::bind(&path)?;
        let display_origin = clock::now();
        let recorder = match &config.record {
            Some(file) => {
                let session = session_info(&config, display_origin);
                Some(Recorder::start(file, &session, config.stop_within)?)
            }
            None => None,
        };
        let event_loop = EventLoop::try_new().context("making the main loop")?;
        let handle = event_loop.handle();
        let (events, from_streams) = calloop::channel::channel();
        let reaper = Reaper::spawn().context("starting the thread that unmaps memory")?;
        let (pools, from_allocator) = calloop::channel::channel();
        let allocator =
            Allocator::spawn(pools).context("starting the thread that allocates memory")?;
        let features = match config.sink {
            SinkSpec::Null => Features::NONE,
            _ => Features::OUTPUT,
        };
        let features = features
            .with(Features::LATE_CAMERA)
            .with(Features::UI_PLANE)
            .with(Features::MASK_PLANE);
        let terms = Terms {
            features,
            max_streams: MAX_STREAMS,
            memory_per_client: config.memory_per_client,
            refresh_interval: config.refresh_interval,
        };
        let mut server = Server {
            config,
            socket: path.clone(),
            told: None,
            controllers: 0,
            terms,
            handle: handle.clone(),
            signal: event_loop.get_signal(),
            listener: None,
            sessions: BTreeMap::new(),
            last_session: 0,
            streams: BTreeMap::new(),
            next_ordinal: 0,
            events,
            display_origin,
            gpus: Arc::new(gpus),
            reaper,
            allocator,
            recorder,
            windows,
        };

        info!(socket = %listener.path().display(), "listening");
        server.listen_for_control(&path)?;
        let source = Generic::new(listener, Interest::READ, Mode::Level);
        let on_connection = |_, listener: &mut _, server: &mut Server| {
            let listener: &mut calloop::generic::NoIoDrop<Listener> = listener;
            server.accept_all(listener);
            Ok(PostAction::Continue)
        };
        server.listener = Some(insert(&handle, source, on_connection)?);
        insert(&handle, from_streams, |event, (), server: &mut Server| {
            if let calloop::channel::Event::Msg(event) = event {
                server.on_stream_event(event);
            }
        })?;
        insert(&handle, from_allocator, |event, (), server: &mut Server| {
            if let calloop::channel::Event::Msg(allocated) = event {
                server.on_allocated(allocated);
            }
        })?;
        let (stop, stopped) = make_ping().context("making the stop signal")?;
        insert(&handle, stopped, |(), (), server: &mut Server| server.begin_stop())?;
        Ok(Self { event_loop, server, stop })
    }

    /// Also stops on these signals.
    ///
    /// # Errors
    /// If the main loop cannot watch them.
    pub fn stop_on(&mut self, signals: Signals) -> anyhow::Result<()> {
        insert(&self.event_loop.handle(), signals, |event, (), server| {
            info!(signal = ?event.signal(), "stopping");
            server.begin_stop();
        })?;
        Ok(())
    }

    /// Resolves `args` again when it is told to reload, by `foreframe ctl reload` or by SIGHUP.
    ///
    /// # Errors
    /// If the main loop cannot watch for the signal.
    pub fn reload_from(&mut self, args: Args, hangup: Signals) -> anyhow::Result<()> {
        self.server.told = Some(args);
        insert(&self.event_loop.handle(), hangup, |_, (), server| {
            if let Err(refused) = server.reload() {
                warn!("{refused}");
            }
        })?;
        Ok(())
    }

    /// Stops the daemon from elsewhere.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        Stopper(self.stop.clone())
    }

    /// Serves clients until it is stopped.
    ///
    /// # Errors
    /// If the main loop cannot wait for events.
    pub fn run(mut self) -> anyhow::Result<()> {
        self.event_loop.run(None, &mut self.server, |_| {}).context("waiting for events")?;
        // The recorder ends with the server, when it has written everything.
        info!("stopped");
        Ok(())
    }
}

/// Signals that end the daemon in good order. Made before any thread is, so that all inherit the
/// mask.
///
/// # Errors
/// If the process has no descriptor left.
pub fn stop_signals() -> anyhow::Result<Signals> {
    Signals::new(&[Signal::SIGINT, Signal::SIGTERM]).context("watching for signals")
}

/// The signal on which the daemon reads its configuration again. Made before any thread is.
///
/// # Errors
/// If the process has no descriptor left.
pub fn reload_signal() -> anyhow::Result<Signals> {
    Signals::new(&[Signal::SIGHUP]).context("watching for signals")
}

impl Server {
    /// Lets no new client in and ends every stream; the loop ends when the last one has.
    fn begin_stop(&mut self) {
        let Some(listener) = self.listener.take() else { return };
        self.handle.remove(listener);
        for stream in self.streams.values_mut() {
            stream.close(EndReason::Stopping);
        }
        // Their sinks have as long to write what they have taken; this is for threads that hang.
        let timer = Timer::from_duration(2 * self.config.stop_within);
        let armed = insert(&self.handle, timer, |_, (), server: &mut Server| {
            warn!(streams = server.streams.len(), "stopping without waiting for the last streams");
            server.finish_stop();
            TimeoutAction::Drop
        });
        if let Err(error) = armed {
            warn!(%error, "stopping without a time limit");
        }
        self.finish_stop_if_idle();
    }

    fn is_stopping(&self) -> bool {
        self.listener.is_none()
    }

    fn finish_stop_if_idle(&mut self) {
        if self.is_stopping() && self.streams.is_empty() {
            self.finish_stop();
        }
    }

    fn finish_stop(&mut self) {
        let sessions: Vec<u32> = self.sessions.keys().copied().collect();
        for session in sessions {
            self.send(session, Goodbye { reason: EndReason::Stopping });
            self.close_session(session);
        }
        self.signal.stop();
    }
}

/// Inserts a source into the main loop.
fn insert<S, F>(
    handle: &LoopHandle<'static, Server>,
    source: S,
    callback: F,
) -> anyhow::Result<RegistrationToken>
where
    S: calloop::EventSource + 'static,
    F: FnMut(S::Event, &mut S::Metadata, &mut Server) -> S::Ret + 'static,
{
    handle
        .insert_source(source, callback)
        .map_err(|error| anyhow::Error::from(error.error).context("watching an event source"))
}

fn session_info(config: &Config, display_origin: MonoTime) -> SessionInfo {
    let name = config.record.as_deref().map(stem).unwrap_or_default();
    let session = SessionInfo::new(name, CaptureSource::Live);
    let session = match config.pixels_per_degree {
        Some(ppd) => session
            .with_config(PIXELS_PER_DEGREE, ppd)
            .with_config(PIXELS_PER_DEGREE_IS_GIVEN, config.is_ppd_given),
        None => session,
    };
    session
        .with_config("method", config.method)
        .with_config("finish", config.finish.mode)
        .with_config("finish_whole", config.finish.is_whole)
        .with_config("refresh_interval_ns", config.refresh_interval.as_ns())
        .with_config(DISPLAY_ORIGIN, display_origin.as_ns())
        .with_config("sink", &config.sink)
        .with_config("threads", config.threads)
}

fn stem(path: &Path) -> String {
    path.file_stem().map(PathBuf::from).unwrap_or_default().display().to_string()
}
