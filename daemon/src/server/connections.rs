//! Connections: accept, handshake, read, end.

use std::rc::Rc;
use std::time::Duration;

use calloop::generic::Generic;
use calloop::timer::{TimeoutAction, Timer};
use calloop::{Interest, Mode, PostAction, Readiness};
use foreframe_protocol::limits::HANDSHAKE_TIMEOUT_NS;
use foreframe_protocol::socket::{Channel, Listener, Received};
use foreframe_protocol::{DaemonMessage, EndReason, Error, ErrorCode, Reject, RejectCode};
use rustix::net::Shutdown;
use tracing::{debug, info, warn};

use super::{Server, insert};
use crate::clock;
use crate::session::fault::Fault;
use crate::session::flood::MESSAGES_PER_SECOND;
use crate::session::outbox::Unsendable;
use crate::session::{Session, Stage, Subscription};

/// Messages of one client that are read in a row; then the others have their turn.
const MESSAGES_PER_TURN: usize = 32;
/// Packets that are read and thrown away when a session ends with an error.
const MAX_DRAINED: usize = 1024;
/// Time for which nobody is accepted when the process has no descriptor left.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

impl Server {
    /// Accepts everybody who waits.
    pub(super) fn accept_all(&mut self, listener: &Listener) {
        loop {
            match listener.accept() {
                Ok(Some(channel)) => self.connect(channel),
                Ok(None) => return,
                Err(error) => {
                    warn!(%error, "nobody is accepted for a moment");
                    return self.pause_accepting();
                }
            }
        }
    }

    /// The waiting connection would wake the main loop over and over.
    fn pause_accepting(&mut self) {
        let Some(listener) = self.listener else { return };
        if let Err(error) = self.handle.disable(&listener) {
            warn!(%error, "the socket cannot be paused");
            return;
        }
        let resumed = insert(&self.handle, Timer::from_duration(ACCEPT_PAUSE), |_, (), server| {
            if let Some(listener) = server.listener
                && let Err(error) = server.handle.enable(&listener)
            {
                warn!(%error, "nobody can connect any more");
            }
            TimeoutAction::Drop
        });
        if let Err(error) = resumed {
            warn!(%error, "nobody can connect any more");
        }
    }

    fn connect(&mut self, channel: Channel) {
        let refusal = match channel.check_same_user() {
            Err(error) => Some((RejectCode::User, error.to_string())),
            Ok(()) if self.sessions.len() >= self.config.max_clients => {
                let max = self.config.max_clients;
                let text = format!("expected fewer than {max} clients, found {max}: --max-clients");
                Some((RejectCode::Sessions, text))
            }
            Ok(()) => None,
        };
        if let Some((code, text)) = refusal {
            return refuse(&channel, code, text);
        }
        self.last_session += 1;
        let session = Session::new(self.last_session, channel, clock::now());
        if let Err(error) = self.watch(session) {
            warn!(%error, "a client cannot be served");
        }
    }

    /// Puts a session under the eyes of the main loop.
    fn watch(&mut self, mut session: Session) -> anyhow::Result<()> {
        let id = session.id;
        session.watch = Some(self.watch_socket(&session.channel, id, Interest::READ)?);
        let timeout = Timer::from_duration(Duration::from_nanos(HANDSHAKE_TIMEOUT_NS));
        let armed = insert(&self.handle, timeout, move |_, (), server| {
            server.on_handshake_timeout(id);
            TimeoutAction::Drop
        });
        session.deadline = armed.ok();
        self.sessions.insert(id, session);
        Ok(())
    }

    fn watch_socket(
        &self,
        channel: &Rc<Channel>,
        id: u32,
        interest: Interest,
    ) -> anyhow::Result<calloop::RegistrationToken> {
        let source = Generic::new(Rc::clone(channel), interest, Mode::Level);
        insert(&self.handle, source, move |readiness, _, server: &mut Server| {
            server.on_ready(id, readiness);
            Ok(PostAction::Continue)
        })
    }

    fn on_handshake_timeout(&mut self, id: u32) {
        let Some(session) = self.sessions.get_mut(&id) else { return };
        session.deadline = None;
        if session.stage == Stage::Connected {
            let text = "expected hello within 2 s, found nothing";
            refuse(&session.channel, RejectCode::Timeout, text.to_owned());
            debug!(session = id, "no hello");
            self.close_session(id);
        }
    }

    fn on_ready(&mut self, id: u32, readiness: Readiness) {
        if readiness.writable
            && let Some(session) = self.sessions.get_mut(&id)
        {
            let flushed = session.flush();
            self.after_send(id, flushed);
        }
        if readiness.readable || readiness.error {
            self.read_some(id);
        }
    }

    fn read_some(&mut self, id: u32) {
        for _ in 0..MESSAGES_PER_TURN {
            // It may have ended with the message before.
            let Some(session) = self.sessions.get_mut(&id) else { return };
            let packet = match session.channel.receive() {
                Ok(Received::Packet(packet)) => packet,
                Ok(Received::WouldBlock) => return,
                Ok(Received::Closed) => {
                    debug!(session = id, "the client has gone");
                    return self.close_session(id);
                }
                Err(error) => return self.fail(id, error.into()),
            };
            let now = clock::now();
            if !session.gate.admits(now) {
                let expected = format!("at most {MESSAGES_PER_SECOND} messages a second");
                let fault = Fault::fatal(ErrorCode::Quota, "session", expected, "more");
                return self.fail(id, fault);
            }
            match session.stage {
                Stage::Connected => match self.terms.greet(packet) {
                    Ok(hello) => {
                        info!(session = id, application = hello.application, "client connected");
                        session.stage = Stage::Open;
                        let chosen = self.gpus.choose_for(hello.gpu_pci);
                        session.adapter = chosen.adapter;
                        let adapter = chosen.adapter.map(|index| &self.gpus.facts()[index]);
                        let backend = adapter.map_or("cpu", |facts| &facts.name);
                        info!(session = id, backend, why = chosen.why, "backend chosen");
                        let welcome = self.terms.welcome(&hello, adapter, id, now);
                        self.send(id, welcome);
                    }
                    Err(reject) => return self.reject(id, &reject),
                },
                Stage::Open => match packet.parse_client() {
                    Ok((message, fd)) => {
                        if let Err(fault) = self.on_message(id, message, fd, now) {
                            self.fail(id, fault);
                        }
                    }
                    Err(error) => return self.fail(id, error.into()),
                },
            }
        }
    }

    fn reject(&mut self, id: u32, reject: &Reject) {
        warn!(session = id, reason = reject.text, "client rejected");
        self.send(id, reject.clone());
        self.drain(id);
        self.close_session(id);
    }

    /// Tells a client what it did wrong, and ends its session if that is fatal.
    pub(super) fn fail(&mut self, id: u32, fault: Fault) {
        let is_fatal = fault.is_fatal();
        let message = fault.into_message();
        let (field, expected, found) = (&message.field, &message.expected, &message.found);
        if is_fatal {
            warn!(session = id, field, expected, found, "session ends with an error");
        } else {
            info!(session = id, field, expected, found, "request refused");
        }
        self.send(id, message);
        if is_fatal {
            self.drain(id);
            self.close_session(id);
        }
    }

    /// Reads and throws away what a client has sent: a socket that closes with unread packets takes
    /// the error message that explains it away from the peer.
    fn drain(&mut self, id: u32) {
        let Some(session) = self.sessions.get_mut(&id) else { return };
        if let Err(error) = rustix::net::shutdown(&session.channel, Shutdown::Read) {
            debug!(session = id, %error, "the client went first");
        }
        for _ in 0..MAX_DRAINED {
            if matches!(session.channel.receive(), Ok(Received::WouldBlock | Received::Closed)) {
                return;
            }
        }
    }

    /// Ends a session and everything that it has.
    pub(super) fn close_session(&mut self, id: u32) {
        let Some(session) = self.sessions.remove(&id) else { return };
        for token in session.watch.into_iter().chain(session.deadline) {
            self.handle.remove(token);
        }
        for ordinal in session.streams.values() {
            if let Some(stream) = self.streams.get_mut(ordinal) {
                stream.close(EndReason::SourceEnded);
            }
        }
        if session.stage == Stage::Open {
            info!(session = id, "session ended");
        }
        let followed: Vec<u64> =
            session.subscriptions.iter().filter_map(Subscription::followed).collect();
        for ordinal in followed {
            self.refresh_outlets(ordinal);
        }
    }

    /// Sends what a client has to get.
    pub(super) fn send(&mut self, id: u32, message: impl Into<DaemonMessage>) {
        let Some(session) = self.sessions.get_mut(&id) else { return };
        let sent = session.send(message);
        self.after_send(id, sent);
    }

    /// Sends what a client can do without; false if it was left out.
    pub(super) fn offer(&mut self, id: u32, message: impl Into<DaemonMessage>) -> bool {
        let Some(session) = self.sessions.get_mut(&id) else { return false };
        match session.offer(message) {
            Ok(is_sent) => is_sent,
            Err(error) => {
                self.after_send(id, Err(error));
                false
            }
        }
    }

    /// Ends a session that nothing can be sent to, and watches for room in a socket that is full.
    pub(super) fn after_send(&mut self, id: u32, sent: Result<(), Unsendable>) {
        match sent {
            Ok(()) => {}
            // What it sent before it went is still to be read; the end follows.
            Err(Unsendable::Gone(Error::Disconnected)) => return,
            Err(Unsendable::Gone(error)) => {
                warn!(session = id, %error, "a client cannot be reached");
                return self.close_session(id);
            }
            Err(Unsendable::NotReading { waiting }) => {
                warn!(session = id, waiting, "a client does not read its messages");
                return self.close_session(id);
            }
        }
        let Some(session) = self.sessions.get(&id) else { return };
        let is_behind = session.is_behind();
        if session.watches_for_room == is_behind {
            return;
        }
        let interest = if is_behind { Interest::BOTH } else { Interest::READ };
        let channel = Rc::clone(&session.channel);
        let watch = session.watch;
        if let Some(token) = watch {
            self.handle.remove(token);
        }
        match self.watch_socket(&channel, id, interest) {
            Ok(token) => {
                if let Some(session) = self.sessions.get_mut(&id) {
                    session.watch = Some(token);
                    session.watches_for_room = is_behind;
                }
            }
            Err(error) => {
                warn!(session = id, %error, "a client cannot be watched");
                self.close_session(id);
            }
        }
    }
}

/// Says no to somebody who never becomes a session.
fn refuse(channel: &Channel, code: RejectCode, text: String) {
    warn!(reason = text, "client refused");
    let packet = DaemonMessage::from(Reject::new(code, text)).to_packet();
    if let Err(error) = channel.send(&packet, None) {
        debug!(%error, "a refused client went first");
    }
}
