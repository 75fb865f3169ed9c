//! What people ask of the daemon while it runs: the server's side of [`crate::control`].
//!
//! A change goes to every stream as a [`StreamCommand`] and into the configuration that new streams
//! start with. Nothing waits: the threads of the streams pick the commands up, and a recording that
//! ends is finished by a thread of its own.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use calloop::generic::Generic;
use calloop::{Interest, Mode, PostAction};
use foreframe_engine::{Method, MonoSpan};
use tracing::{info, warn};

use super::{Server, insert, session_info};
use crate::clock;
use crate::config::{Config, SinkSpec};
use crate::control::{
    ControlConnection, ControlListener, DaemonStatus, Request, Response, StreamStatus,
};
use crate::hud::HudView;
use crate::recorder::Recorder;
use crate::stream::command::StreamCommand;

/// Connections to the control socket at once: some people with some terminals.
const MAX_CONTROLLERS: usize = 16;
/// A stream that has reported nothing for so long is idle.
const IDLE_AFTER: MonoSpan = MonoSpan::from_ms(1000);

impl Server {
    /// Listens for people beside the socket of the applications.
    pub(super) fn listen_for_control(&mut self, socket: &Path) -> anyhow::Result<()> {
        let listener = ControlListener::bind(socket).context("making the control socket")?;
        let source = Generic::new(listener, Interest::READ, Mode::Level);
        insert(&self.handle, source, |_, listener, server: &mut Server| {
            loop {
                match listener.accept() {
                    Ok(Some(connection)) => server.admit(connection),
                    Ok(None) => break,
                    Err(error) => {
                        warn!(%error, "a controller cannot be served");
                        break;
                    }
                }
            }
            Ok(PostAction::Continue)
        })?;
        Ok(())
    }

    fn admit(&mut self, connection: ControlConnection) {
        if self.controllers >= MAX_CONTROLLERS {
            warn!(expected = MAX_CONTROLLERS, "too many controllers: one more is turned away");
            return;
        }
        let source = Generic::new(connection, Interest::READ, Mode::Level);
        let watched = insert(&self.handle, source, |_, connection, server: &mut Server| {
            if connection.serve(|request| server.answer(request)).is_ok() {
                return Ok(PostAction::Continue);
            }
            server.controllers -= 1;
            Ok(PostAction::Remove)
        });
        match watched {
            Ok(_) => self.controllers += 1,
            Err(error) => warn!(%error, "a controller cannot be served"),
        }
    }

    fn answer(&mut self, request: Request) -> Response {
        let done = match request {
            Request::Status => return Response::Status(Box::new(self.status())),
            Request::Method { method } => self.change_method(&method),
            Request::Record { file } => self.change_recording(file),
            Request::Cap { hz } => self.change_cap(hz),
            Request::Hud { view } => self.change_hud(&view),
            Request::Reload => self.reload(),
            Request::Stop => {
                info!("stopping on request");
                self.begin_stop();
                Ok(vec!["the daemon stops".to_owned()])
            }
        };
        match done {
            Ok(done) => Response::Done(done),
            Err(refused) => Response::Refused(refused),
        }
    }

    fn status(&self) -> DaemonStatus {
        let now = clock::now();
        let config = &self.config;
        let streams = self.streams.iter().map(|(&number, stream)| StreamStatus {
            number,
            session: stream.session,
            width: stream.create.format.width,
            height: stream.create.format.height,
            display: stream.display.clone(),
            is_idle: stream.reported_at.is_none_or(|at| now - at > IDLE_AFTER),
            ..stream.report.clone()
        });
        DaemonStatus {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            socket: self.socket.clone(),
            uptime_s: (now - self.display_origin).as_ms_f64() / 1e3,
            method: config.method.name().to_owned(),
            sink: config.sink.to_string(),
            refresh_hz: hz(config.refresh_interval),
            cap_hz: config.cap,
            recording: self.running_recording().map(Path::to_owned),
            clients: self.sessions.len(),
            streams: streams.collect(),
        }
    }

    fn change_method(&mut self, name: &str) -> Result<Vec<String>, String> {
        let method: Method = name.parse().map_err(|error| format!("{error}"))?;
        if method == self.config.method {
            return Ok(vec![]);
        }
        self.config.method = method;
        self.tell_streams(|_| StreamCommand::Method(method));
        Ok(vec![format!("method {method}")])
    }

    fn change_hud(&mut self, name: &str) -> Result<Vec<String>, String> {
        let view: HudView = name.parse().map_err(|error| format!("hud: {error}"))?;
        if self.config.sink != SinkSpec::Window {
            let sink = &self.config.sink;
            return Err(format!("hud: expected a daemon that shows windows, found sink `{sink}`"));
        }
        self.config.hud = view;
        self.tell_streams(|_| StreamCommand::Hud(view));
        Ok(vec![format!("hud {view}")])
    }

    fn change_cap(&mut self, cap: Option<f64>) -> Result<Vec<String>, String> {
        if let Some(hz) = cap.filter(|hz| !(1.0..=1000.0).contains(hz)) {
            return Err(format!("cap: expected 1 to 1000 Hz, found {hz}"));
        }
        if self.config.sink.has_own_rate() {
            let sink = &self.config.sink;
            return Err(format!(
                "cap: expected a sink without a rate of its own, found `{sink}`: use shm or null"
            ));
        }
        if cap == self.config.cap {
            return Ok(vec![]);
        }
        self.config.cap = cap;
        let interval = self.config.frame_interval();
        self.tell_streams(|_| StreamCommand::Interval(interval));
        Ok(vec![format!("at most {:.4} frames a second", hz(interval))])
    }

    fn change_recording(&mut self, file: Option<PathBuf>) -> Result<Vec<String>, String> {
        if let (Some(new), Some(running)) = (&file, self.running_recording())
            && is_same_file(new, running)
        {
            let new = new.display();
            return Err(format!("record: expected another file, found the running one, {new}"));
        }
        let started = match &file {
            Some(path) if !path.is_absolute() => {
                let path = path.display();
                return Err(format!("record: expected a path from the root, found `{path}`"));
            }
            Some(path) => {
                let config = Config { record: file.clone(), ..self.config.clone() };
                let session = session_info(&config, self.display_origin);
                let started = Recorder::start(path, &session, config.stop_within);
                Some(started.map_err(|error| format!("record: {error:#}"))?)
            }
            None => None,
        };
        let ended = std::mem::replace(&mut self.recorder, started);
        self.config.record = file;
        // In a file of its own a stream keeps the number that it has in the daemon.
        self.tell_streams(|ordinal| {
            let number = u32::try_from(ordinal + 1).unwrap_or(u32::MAX);
            StreamCommand::Record(self.recorder.as_ref().map(|it| it.stream(number)))
        });
        let mut done = Vec::new();
        if let Some(ended) = ended {
            done.push("the recording before is finished".to_owned());
            // Its end waits for the disk.
            let finish = std::thread::Builder::new().name("foreframe-finish".to_owned());
            if let Err(error) = finish.spawn(move || drop(ended)) {
                warn!(%error, "the recording was finished on the main loop");
            }
        }
        if let Some(path) = &self.config.record {
            done.push(format!("recording to {}", path.display()));
        }
        Ok(done)
    }

    fn running_recording(&self) -> Option<&Path> {
        self.recorder.as_ref().and(self.config.record.as_deref())
    }

    /// Takes over what can change while streams run, and names what cannot. A recording is left as
    /// it is: to go back to a file that was written before would overwrite it.
    pub(super) fn reload(&mut self) -> Result<Vec<String>, String> {
        let Some(told) = self.told.clone() else {
            return Err(
                "reload: expected a daemon that runs on its own, found one inside a program".into(),
            );
        };
        let new = told.resolve().map_err(|error| format!("reload: {error}"))?;
        let mut done = self.change_method(new.method.name())?;
        if new.hud != self.config.hud {
            done.extend(self.change_hud(new.hud.name())?);
        }
        if new.cap != self.config.cap {
            done.extend(self.change_cap(new.cap)?);
        }
        done.extend(
            self.config
                .needs_restart(&new)
                .into_iter()
                .map(|name| format!("{name} has changed and needs a restart")),
        );
        for line in &done {
            info!("reloaded: {line}");
        }
        Ok(done)
    }

    fn tell_streams(&self, command: impl Fn(u64) -> StreamCommand) {
        for (&ordinal, stream) in &self.streams {
            stream.mailbox.command(command(ordinal));
        }
    }
}

/// Whether both are one file that exists, by whatever path.
fn is_same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}

fn hz(interval: MonoSpan) -> f64 {
    1e9 / interval.as_ns() as f64
}
