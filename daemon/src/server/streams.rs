//! Streams: start, the events of their threads, end.

use std::sync::Arc;
use std::thread::JoinHandle;

use anyhow::Context as _;
use foreframe_engine::{EngineConfig, MonoTime, StreamFormat as EngineFormat};
use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::slots::UiOrder;
use foreframe_protocol::{
    CreateStream, EndReason, ErrorCode, ErrorMessage, Hint, OutputFrame, Pacing, PlaneKind,
    Presented, ReleaseReason, SlotReleased, Statistics, StreamEnded,
};
use tracing::{debug, error, info};

use super::Server;
use crate::clock::{self, Waker};
use crate::control::StreamStatus;
use crate::ingest::{self, KeyOrder};
use crate::profiles::Viewed;
use crate::session::fault::Fault;
use crate::sink::Sink;
use crate::sink::window::{WindowConfig, WindowOpener, WindowSystem};
use crate::sink::worker::SinkWorker;
use crate::stream::core::CoreConfig;
use crate::stream::mailbox::Mailbox;
use crate::stream::real_time;
use crate::stream::reaper::Reaped;
use crate::stream::thread::{self, StreamParts};
use crate::stream::{FromStream, StreamEvent};

/// Keys of a stream that are looked at for what is wrong with their motion: a fifth of a second.
const KEYS_TO_CHECK: u32 = 8;

/// A stream whose thread runs.
#[derive(Debug)]
pub(super) struct Stream {
    /// Session of its client.
    pub(super) session: u32,
    /// What the client declared, with its own number of the stream.
    pub(super) create: CreateStream,
    pub(super) mailbox: Arc<Mailbox>,
    pub(super) order: KeyOrder,
    pub(super) ui_order: UiOrder,
    pub(super) pool: Option<Pool>,
    /// Bytes that it costs its client, pool included.
    pub(super) cost: u64,
    /// What it reported last, and when.
    pub(super) report: StreamStatus,
    pub(super) reported_at: Option<MonoTime>,
    /// Name of the display that it is for.
    pub(super) display: Option<String>,
    /// There once it has been told to end.
    end: Option<EndReason>,
    thread: Option<JoinHandle<()>>,
}

/// The memory of a stream's key frames.
#[derive(Debug)]
pub(super) struct Pool {
    pub(super) memory: Arc<Reaped<ReadOnlyPool>>,
    pub(super) slot_bytes: u64,
}

impl Stream {
    /// Tells the thread to end. The first reason stays.
    pub(super) fn close(&mut self, reason: EndReason) {
        if self.end.is_none() {
            self.end = Some(reason);
            self.mailbox.close();
        }
        self.pool = None;
    }

    pub(super) fn is_closed(&self) -> bool {
        self.end.is_some()
    }
}

/// Bytes of private memory that a stream may take: eight pictures (two keys, a copy, the one being
/// made, four on the way to a sink), 48 bytes a pixel of depth, motion and what the warp needs, and
/// a user interface and a mask.
pub(super) fn stream_cost(create: &CreateStream) -> u64 {
    let bytes_per_pixel = u64::from(create.format.color.bytes_per_pixel());
    let area = |kind| {
        let size = create.max_sizes.get(kind);
        size.map_or(0, |size| u64::from(size.width) * u64::from(size.height))
    };
    let others = area(PlaneKind::Ui) * bytes_per_pixel + area(PlaneKind::Mask);
    area(PlaneKind::Color) * (8 * bytes_per_pixel + 48) + others
}

impl Server {
    /// Starts the thread of a stream. Gives its number in this process.
    pub(super) fn start_stream(
        &mut self,
        session: u32,
        create: &CreateStream,
        viewed: Viewed,
        cost: u64,
    ) -> anyhow::Result<u64> {
        let ordinal = self.next_ordinal;
        let config = &self.config;
        let format = ingest::stream_format(&create.format);
        let sink = match config.sink.keeps_frames() {
            true => {
                let (spec, interval) = (config.sink.clone(), config.refresh_interval);
                let open = move || Sink::open(&spec, &format, interval, ordinal);
                let worker = SinkWorker::spawn(open, config.stop_within);
                Some(worker.context("starting the sink's thread")?)
            }
            false => None,
        };
        let waker = Waker::new().context("making a waker")?;
        let mailbox = Arc::new(Mailbox::new(create.slots, waker));
        let chosen = self.sessions.get(&session).and_then(|session| session.adapter);
        let number_in_file = u32::try_from(ordinal + 1).context("numbering the stream")?;
        let thread = thread::start(StreamParts {
            ordinal,
            create: *create,
            core: CoreConfig {
                engine: EngineConfig {
                    pixels_per_degree: viewed.pixels_per_degree,
                    finish: viewed.finish,
                    keys_to_check: KEYS_TO_CHECK,
                    timer: clock::now,
                    worker_started: real_time::ask_for_work,
                    ..EngineConfig::new(config.method, config.threads)
                },
                refresh_interval: config.frame_interval(),
                display_origin: self.display_origin,
                least_step_px: config.least_step_px,
            },
            gpu: chosen.map(|index| (Arc::clone(&self.gpus), index)),
            mailbox: Arc::clone(&mailbox),
            events: self.events.clone(),
            sink,
            window: self.window(&format, ordinal),
            hud: config.hud,
            recorder: self.recorder.as_ref().map(|it| it.stream(number_in_file)),
        })
        .context("starting the stream's thread")?;
        self.next_ordinal += 1;
        let (width, height) = (create.format.width, create.format.height);
        info!(session, stream = create.stream, width, height, "stream started");
        self.streams.insert(
            ordinal,
            Stream {
                session,
                create: *create,
                mailbox,
                order: KeyOrder::default(),
                ui_order: UiOrder::default(),
                pool: None,
                cost,
                report: StreamStatus::default(),
                display: viewed.name,
                reported_at: None,
                end: None,
                thread: Some(thread),
            },
        );
        Ok(ordinal)
    }

    /// What a stream opens its window with, if the daemon shows windows.
    fn window(&self, format: &EngineFormat, ordinal: u64) -> Option<(WindowOpener, WindowConfig)> {
        let opener = self.windows.as_ref().map(WindowSystem::opener)?;
        let title = format!("Foreframe {}", ordinal + 1);
        Some((opener, WindowConfig { format: *format, title, ordinal }))
    }

    /// Passes on what a stream's thread tells.
    pub(super) fn on_stream_event(&mut self, FromStream { ordinal, event }: FromStream) {
        let Some(stream) = self.streams.get_mut(&ordinal) else { return };
        let (session, number) = (stream.session, stream.create.stream);
        match event {
            StreamEvent::SlotCopied(slot) => self.send(
                session,
                SlotReleased {
                    stream: number,
                    slot: slot.slot,
                    key_index: slot.key_index,
                    reason: ReleaseReason::Copied,
                },
            ),
            StreamEvent::KeyRefused(message) => {
                self.fail(session, Fault::from(message).of_stream(number));
            }
            StreamEvent::Noticed(message) => {
                self.send(session, ErrorMessage { stream: Some(number), ..message });
            }
            StreamEvent::Presented(presented) => {
                self.offer(session, Presented { stream: number, ..presented });
            }
            StreamEvent::Statistics(statistics) => {
                debug!(session, ?statistics, "statistics");
                self.offer(session, Statistics { stream: number, ..statistics });
            }
            StreamEvent::Pacing(pacing) => {
                self.offer(session, Pacing { stream: number, ..pacing });
            }
            StreamEvent::Hint(hint) => {
                debug!(session, ?hint, "hint");
                self.offer(session, Hint { stream: number, ..hint });
            }
            StreamEvent::Report(report) => {
                stream.report = *report;
                stream.reported_at = Some(clock::now());
            }
            StreamEvent::Output(subscriber, frame) => self.on_output(ordinal, subscriber, frame),
            StreamEvent::Ended { has_panicked } => self.on_stream_ended(ordinal, has_panicked),
        }
    }

    fn on_output(&mut self, ordinal: u64, subscriber: u32, frame: OutputFrame) {
        if self.offer(subscriber, frame) {
            return;
        }
        // The subscriber will not hear of this frame, so it cannot give the slot back either.
        let Some(session) = self.sessions.get(&subscriber) else { return };
        let outlets = session.subscriptions.iter().filter_map(|it| it.outlet.as_ref());
        for (followed, outlet) in outlets {
            if *followed == ordinal && outlet.pool == frame.pool {
                outlet.take_back(frame.slot);
            }
        }
    }

    fn on_stream_ended(&mut self, ordinal: u64, has_panicked: bool) {
        let Some(mut stream) = self.streams.remove(&ordinal) else { return };
        if let Some(thread) = stream.thread.take()
            && thread.join().is_err()
        {
            error!(stream = ordinal, "the stream's thread panicked");
        }
        let number = stream.create.stream;
        let reason =
            if has_panicked { EndReason::Error } else { stream.end.unwrap_or(EndReason::Error) };
        info!(session = stream.session, stream = number, %reason, "stream ended");
        if let Some(session) = self.sessions.get_mut(&stream.session) {
            session.streams.remove(&number);
            session.cost = session.cost.saturating_sub(stream.cost);
        }
        if stream.end.is_none() {
            let fault =
                Fault::fatal(ErrorCode::Internal, "stream", "a stream that goes on", "its end");
            self.fail(stream.session, fault.tolerated().of_stream(number));
        }
        self.send(stream.session, StreamEnded { stream: number, reason });
        self.on_source_ended(ordinal, stream.session, number, reason);
        self.follow_shown_stream();
        self.finish_stop_if_idle();
    }
}
