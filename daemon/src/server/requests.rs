//! What each message of a client leads to.
//!
//! A message was checked field by field when it was parsed; here is checked whether it fits what
//! the client has: its streams, slots, pools and quotas. Messages for a stream that has ended are
//! refused without an end of the session: they may have crossed the news.

use std::os::fd::OwnedFd;
use std::sync::Arc;

use foreframe_engine::MonoTime;
use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::{
    ClientMessage, CreateStream, DestroyStream, EndReason, Error, ErrorCode, OutputReleased,
    PoolAccepted, RegisterPool, ReleaseReason, SlotReleased, StreamCreated, Submit, UiPlane,
};

use super::streams::{Pool, stream_cost};
use super::{MAX_STREAMS, Server};
use crate::profiles::UnknownProfile;
use crate::session::Session;
use crate::session::fault::Fault;
use crate::stream::mailbox::{Submission, UiSubmission};

impl Server {
    /// Acts on a message.
    ///
    /// # Errors
    /// What was wrong with it.
    pub(super) fn on_message(
        &mut self,
        id: u32,
        message: ClientMessage,
        fd: Option<OwnedFd>,
        now: MonoTime,
    ) -> Result<(), Fault> {
        match message {
            ClientMessage::Hello(_) => {
                Err(Fault::fatal(ErrorCode::State, "hello", "one hello per session", "another"))
            }
            ClientMessage::Goodbye(_) => {
                self.close_session(id);
                Ok(())
            }
            ClientMessage::CreateStream(create) => self.create_stream(id, &create),
            ClientMessage::RegisterPool(register) => {
                // The socket has seen to it that the descriptor is there.
                let fd = fd.ok_or(Error::Disconnected)?;
                self.register_pool(id, &register, fd).map_err(|it| it.of_stream(register.stream))
            }
            ClientMessage::DestroyStream(DestroyStream { stream }) => {
                let stream = self.stream_of(id, stream)?;
                stream.close(EndReason::Requested);
                Ok(())
            }
            ClientMessage::Submit(submit) => {
                self.submit(id, submit, now).map_err(|it| it.of_stream(submit.stream))
            }
            ClientMessage::UiPlane(ui) => {
                self.submit_ui(id, ui, now).map_err(|it| it.of_stream(ui.stream))
            }
            ClientMessage::LateCamera(camera) => {
                self.stream_of(id, camera.stream)?.mailbox.put_late_camera(camera, now);
                Ok(())
            }
            ClientMessage::Subscribe(subscribe) => self.subscribe(id, subscribe),
            ClientMessage::Unsubscribe(unsubscribe) => self.unsubscribe(id, unsubscribe.stream),
            ClientMessage::OutputReleased(released) => self.on_output_released(id, released),
        }
    }

    fn create_stream(&mut self, id: u32, create: &CreateStream) -> Result<(), Fault> {
        let number = create.stream;
        let memory_per_client = self.config.memory_per_client;
        let is_stopping = self.is_stopping();
        let session = self.open_session(id)?;
        if number <= session.last_stream {
            let expected = format!("a number above {}", session.last_stream);
            return Err(Fault::fatal(ErrorCode::Order, "create_stream.stream", expected, number));
        }
        session.last_stream = number;
        if is_stopping {
            let fault =
                Fault::fatal(ErrorCode::State, "daemon", "a running daemon", "one that stops");
            return Err(fault.tolerated().of_stream(number));
        }
        if session.streams.len() >= MAX_STREAMS as usize {
            let expected = format!("at most {MAX_STREAMS} streams");
            let fault = Fault::fatal(ErrorCode::Quota, "create_stream", expected, "one more");
            return Err(fault.tolerated().of_stream(number));
        }
        let format = &create.format;
        if let Some(ui) = format.ui.filter(|ui| *ui != format.color) {
            let expected = format!("{}, as colour has", format.color);
            let fault =
                Fault::fatal(ErrorCode::Unsupported, "create_stream.ui_format", expected, ui);
            return Err(fault.tolerated().of_stream(number));
        }
        let viewed = self.config.viewed(format.display_profile.as_ref()).map_err(|unknown| {
            let UnknownProfile { expected, found } = unknown;
            let field = "create_stream.display_profile";
            let fault = Fault::fatal(ErrorCode::Unsupported, field, expected, found);
            fault.tolerated().of_stream(number)
        })?;
        let session = self.open_session(id)?;
        let cost = stream_cost(create);
        if session.cost.saturating_add(cost) > memory_per_client {
            let fault = quota_fault("create_stream", memory_per_client, session.cost, cost);
            return Err(fault.tolerated().of_stream(number));
        }
        session.cost += cost;
        match self.start_stream(id, create, viewed, cost) {
            Ok(ordinal) => {
                let session = self.open_session(id)?;
                session.streams.insert(number, ordinal);
                self.send(id, StreamCreated { stream: number, slots: create.slots });
                self.follow_shown_stream();
                Ok(())
            }
            Err(error) => {
                tracing::warn!(session = id, error = format!("{error:#}"), "no stream");
                self.open_session(id)?.cost -= cost;
                let found = format!("{error:#}");
                let fault = Fault::fatal(ErrorCode::Internal, "create_stream", "a stream", found);
                Err(fault.tolerated().of_stream(number))
            }
        }
    }

    fn register_pool(
        &mut self,
        id: u32,
        register: &RegisterPool,
        fd: OwnedFd,
    ) -> Result<(), Fault> {
        let memory_per_client = self.config.memory_per_client;
        let left = memory_per_client.saturating_sub(self.open_session(id)?.cost);
        let reaper = self.reaper.clone();
        let stream = self.stream_of(id, register.stream)?;
        if stream.pool.is_some() {
            let expected = "one pool per stream";
            return Err(Fault::fatal(ErrorCode::State, "register_pool", expected, "another"));
        }
        if register.slots != stream.create.slots {
            let expected = format!("{}, as the stream has", stream.create.slots);
            let found = register.slots;
            return Err(Fault::fatal(ErrorCode::Message, "register_pool.slots", expected, found));
        }
        let bytes = register.pool_bytes();
        if bytes > left {
            let fault =
                quota_fault("register_pool", memory_per_client, memory_per_client - left, bytes);
            return Err(fault.tolerated());
        }
        let memory = ReadOnlyPool::accept(fd, bytes, left)?;
        let memory = Arc::new(reaper.guard(memory));
        stream.pool = Some(Pool { memory, slot_bytes: register.slot_bytes });
        stream.cost += bytes;
        self.open_session(id)?.cost += bytes;
        self.send(id, PoolAccepted { stream: register.stream, pool: register.pool });
        Ok(())
    }

    fn submit(&mut self, id: u32, submit: Submit, now: MonoTime) -> Result<(), Fault> {
        let Submit { stream: number, slot, key_index, .. } = submit;
        let stream = self.stream_of(id, number)?;
        let Some(pool) = &stream.pool else {
            let expected = "a pool for the stream before its first key";
            return Err(Fault::fatal(ErrorCode::State, "submit", expected, "none"));
        };
        match submit.check(&stream.create, pool.slot_bytes) {
            Ok(()) => {}
            Err(error @ Error::Plane { .. }) => {
                stream.mailbox.refuse(&submit)?;
                let reason = ReleaseReason::Refused;
                self.send(id, SlotReleased { stream: number, slot, key_index, reason });
                return Err(Fault::from(error).tolerated());
            }
            Err(error) => return Err(error.into()),
        }
        stream.order.check(&submit)?;
        let superseded = stream.mailbox.put(Submission {
            submit,
            arrived_at: now,
            pool: Arc::clone(&pool.memory),
            slot_offset: u64::from(slot) * pool.slot_bytes,
        })?;
        if let Some(older) = superseded {
            self.send(
                id,
                SlotReleased {
                    stream: number,
                    slot: older.slot,
                    key_index: older.key_index,
                    reason: ReleaseReason::Superseded,
                },
            );
        }
        Ok(())
    }

    fn submit_ui(&mut self, id: u32, ui: UiPlane, now: MonoTime) -> Result<(), Fault> {
        let UiPlane { stream: number, slot, ui_index, .. } = ui;
        let stream = self.stream_of(id, number)?;
        let Some(pool) = &stream.pool else {
            let expected = "a pool for the stream before its first UI plane";
            return Err(Fault::fatal(ErrorCode::State, "ui_plane", expected, "none"));
        };
        let released =
            |slot, key_index, reason| SlotReleased { stream: number, slot, key_index, reason };
        match ui.check(&stream.create, pool.slot_bytes) {
            Ok(()) => {}
            Err(error @ Error::Plane { .. }) => {
                stream.mailbox.refuse_ui(&ui)?;
                self.send(id, released(slot, ui_index, ReleaseReason::Refused));
                return Err(Fault::from(error).tolerated());
            }
            Err(error) => return Err(error.into()),
        }
        stream.ui_order.advance(&ui)?;
        let superseded = stream.mailbox.put_ui(UiSubmission {
            ui,
            arrived_at: now,
            pool: Arc::clone(&pool.memory),
            slot_offset: u64::from(slot) * pool.slot_bytes,
        })?;
        if let Some(older) = superseded {
            self.send(id, released(older.slot, older.key_index, ReleaseReason::Superseded));
        }
        Ok(())
    }

    fn on_output_released(&mut self, id: u32, released: OutputReleased) -> Result<(), Fault> {
        let OutputReleased { pool, slot } = released;
        let session = self.open_session(id)?;
        let outlets = session.subscriptions.iter().filter_map(|it| it.outlet.as_ref());
        let outlet = outlets.map(|(_, outlet)| outlet).find(|outlet| outlet.pool == pool);
        match outlet {
            Some(outlet) => outlet.release(slot).map_err(|_| {
                let expected = "a slot that holds a frame";
                Fault::fatal(ErrorCode::State, "output_released.slot", expected, slot)
            }),
            // The pool has been replaced; the release crossed the news.
            None if (1..=session.last_output_pool).contains(&pool) => Ok(()),
            None => {
                let expected = format!("1 to {}", session.last_output_pool);
                Err(Fault::fatal(ErrorCode::Unknown, "output_released.pool", expected, pool))
            }
        }
    }

    /// The session of a client whose message is being acted on.
    pub(super) fn open_session(&mut self, id: u32) -> Result<&mut Session, Fault> {
        // The session can have ended while its message was acted on: nobody reads the fault then.
        self.sessions.get_mut(&id).ok_or_else(|| Error::Disconnected.into())
    }

    /// A stream of a client, under its own number.
    pub(super) fn stream_of(
        &mut self,
        id: u32,
        number: u32,
    ) -> Result<&mut super::streams::Stream, Fault> {
        let session = self.open_session(id)?;
        let last_stream = session.last_stream;
        let ordinal = session.streams.get(&number).copied();
        let stream = ordinal.and_then(|ordinal| self.streams.get_mut(&ordinal));
        stream.filter(|stream| !stream.is_closed()).ok_or_else(|| {
            let expected = "a stream of this session";
            let fault = Fault::fatal(ErrorCode::Unknown, "stream", expected, number);
            let fault = fault.of_stream(number);
            // One that was refused or has ended: the message crossed the news.
            if (1..=last_stream).contains(&number) { fault.tolerated() } else { fault }
        })
    }
}

/// Says that something costs more than there is left.
pub(super) fn quota_fault(field: &str, granted: u64, used: u64, asked: u64) -> Fault {
    const MIB: u64 = 1 << 20;
    let expected = format!("at most {} MiB more (--memory-mb)", granted.saturating_sub(used) / MIB);
    let found = format!("{} MiB", asked.div_ceil(MIB));
    Fault::fatal(ErrorCode::Quota, field, expected, found)
}
