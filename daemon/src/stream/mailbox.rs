//! Hands key frames from the main loop to the stream's thread: one place, newest wins. UI planes
//! have a place of their own, beside them.
//!
//! Owns the slots of the stream: to put a key frame in is to submit its slot, to take it out is to
//! latch it. What is in the box when the next one comes was never looked at, and its slot goes
//! back.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use foreframe_engine::MonoTime;
use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::slots::{Holds, SlotTable, SlotUse};
use foreframe_protocol::{Error, LateCamera, Submit, UiPlane};

use super::command::StreamCommand;
use super::outlet::Outlet;
use super::reaper::Reaped;
use crate::clock::Waker;

/// Who gets the output frames of a stream.
pub type Outlets = Arc<[Arc<Reaped<Outlet>>]>;

/// A key frame that lies in a slot, checked, with the memory that it lies in.
#[derive(Clone, Debug)]
pub struct Submission {
    /// What the client sent.
    pub submit: Submit,
    /// When it came in.
    pub arrived_at: MonoTime,
    /// The memory of its slot.
    pub pool: Arc<Reaped<ReadOnlyPool>>,
    /// Bytes from the start of the pool to the slot.
    pub slot_offset: u64,
}

/// A UI plane that lies in a slot, checked, with the memory that it lies in.
#[derive(Clone, Debug)]
pub struct UiSubmission {
    /// What the client sent.
    pub ui: UiPlane,
    /// When it came in.
    pub arrived_at: MonoTime,
    /// The memory of its slot.
    pub pool: Arc<Reaped<ReadOnlyPool>>,
    /// Bytes from the start of the pool to the slot.
    pub slot_offset: u64,
}

/// How many keys there have been.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct KeyCounts {
    /// Put into the box.
    pub received: u64,
    /// Of these, replaced before they were taken out.
    pub superseded: u64,
    /// Of these, with planes that do not fit the stream.
    pub refused: u64,
}

/// What the stream's thread finds.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one lives on the stack at a time")]
pub enum Taken {
    /// A key frame, now latched.
    Key(Submission),
    /// Nothing new.
    Nothing,
    /// The stream ends.
    Closed,
}

/// The box.
#[derive(Debug)]
pub struct Mailbox {
    state: Mutex<State>,
    /// Wakes the stream's thread.
    pub waker: Waker,
}

#[derive(Debug)]
struct State {
    slots: SlotTable,
    /// There whenever a slot is submitted.
    waiting: Option<Submission>,
    /// There whenever a slot with a UI plane is submitted.
    waiting_ui: Option<UiSubmission>,
    /// The pose of the newest content time that was not taken out yet, and when it came in.
    late_camera: Option<(LateCamera, MonoTime)>,
    commands: Vec<StreamCommand>,
    counts: KeyCounts,
    outlets: Outlets,
    is_closed: bool,
}

impl Mailbox {
    /// An empty box for a stream with this many slots.
    #[must_use]
    pub fn new(slots: u32, waker: Waker) -> Self {
        let state = State {
            slots: SlotTable::new(slots),
            waiting: None,
            waiting_ui: None,
            late_camera: None,
            commands: Vec::new(),
            counts: KeyCounts::default(),
            outlets: Arc::default(),
            is_closed: false,
        };
        Self { state: Mutex::new(state), waker }
    }

    /// Puts a key frame in. Gives the older one that it replaces, whose slot is the client's again.
    ///
    /// # Errors
    /// If its slot is not the client's.
    pub fn put(&self, submission: Submission) -> Result<Option<SlotUse>, Error> {
        let superseded = {
            let mut state = self.lock();
            let Submit { slot, key_index, .. } = submission.submit;
            let superseded = state.slots.submit(Holds::Key, slot, key_index)?;
            state.waiting = Some(submission);
            state.counts.received += 1;
            state.counts.superseded += u64::from(superseded.is_some());
            superseded
        };
        self.waker.wake();
        Ok(superseded)
    }

    /// Puts a UI plane in. Gives the older one that it replaces, whose slot is the client's again.
    ///
    /// # Errors
    /// If its slot is not the client's.
    pub fn put_ui(&self, submission: UiSubmission) -> Result<Option<SlotUse>, Error> {
        let superseded = {
            let mut state = self.lock();
            let UiPlane { slot, ui_index, .. } = submission.ui;
            let superseded = state.slots.submit(Holds::Ui, slot, ui_index)?;
            state.waiting_ui = Some(submission);
            superseded
        };
        // A stream that has nothing new to show waits for nothing else.
        self.waker.wake();
        Ok(superseded)
    }

    /// A UI plane does not go in, because it does not fit the stream.
    ///
    /// # Errors
    /// If its slot is not the client's.
    pub fn refuse_ui(&self, ui: &UiPlane) -> Result<(), Error> {
        self.lock().slots.clone().submit(Holds::Ui, ui.slot, ui.ui_index).map(drop)
    }

    /// Whether a UI plane waits to be taken out.
    #[must_use]
    pub fn has_ui(&self) -> bool {
        self.lock().waiting_ui.is_some()
    }

    /// Takes the UI plane out, and latches its slot.
    pub fn take_ui(&self) -> Option<UiSubmission> {
        let mut state = self.lock();
        let submission = state.waiting_ui.take()?;
        state.slots.latch(Holds::Ui);
        Some(submission)
    }

    /// A key frame does not go in, because its planes do not fit the stream.
    ///
    /// # Errors
    /// If its slot is not the client's.
    pub fn refuse(&self, submit: &Submit) -> Result<(), Error> {
        let mut state = self.lock();
        // The slot is asked for and given back at once: on a copy, so that nothing is superseded.
        state.slots.clone().submit(Holds::Key, submit.slot, submit.key_index)?;
        state.counts.received += 1;
        state.counts.refused += 1;
        Ok(())
    }

    /// Takes the key frame out, and latches its slot.
    pub fn take(&self) -> Taken {
        let mut state = self.lock();
        if state.is_closed {
            return Taken::Closed;
        }
        match state.waiting.take() {
            Some(submission) => {
                state.slots.latch(Holds::Key);
                Taken::Key(submission)
            }
            None => Taken::Nothing,
        }
    }

    /// Puts a late camera in; of two the newer content time stays. Nobody is woken: the next
    /// picture looks, and a stream that has none planned waits for its next key.
    pub fn put_late_camera(&self, pose: LateCamera, arrived_at: MonoTime) {
        let mut state = self.lock();
        let is_newer =
            state.late_camera.is_none_or(|(held, _)| pose.content_time_ns > held.content_time_ns);
        if is_newer {
            state.late_camera = Some((pose, arrived_at));
        }
    }

    /// Takes the late camera out, with the time when it came in.
    pub fn take_late_camera(&self) -> Option<(LateCamera, MonoTime)> {
        self.lock().late_camera.take()
    }

    /// Tells the stream to do something differently.
    pub fn command(&self, command: StreamCommand) {
        self.lock().commands.push(command);
        self.waker.wake();
    }

    /// What the stream was told since the last call, in order.
    pub fn take_commands(&self) -> Vec<StreamCommand> {
        std::mem::take(&mut self.lock().commands)
    }

    /// The planes of what was taken out are copied: its slot is the client's again.
    pub fn release(&self, holds: Holds) -> Option<SlotUse> {
        self.lock().slots.release_latched(holds)
    }

    /// Ends the stream. What is in the box goes nowhere.
    pub fn close(&self) {
        {
            let mut state = self.lock();
            state.is_closed = true;
            state.waiting = None;
            state.waiting_ui = None;
        }
        self.waker.wake();
    }

    /// Keys so far.
    #[must_use]
    pub fn counts(&self) -> KeyCounts {
        self.lock().counts
    }

    /// Who gets the output frames.
    #[must_use]
    pub fn outlets(&self) -> Outlets {
        Arc::clone(&self.lock().outlets)
    }

    /// Changes who gets the output frames.
    pub fn set_outlets(&self, outlets: Outlets) {
        self.lock().outlets = outlets;
    }

    /// Nothing that panics is called under the lock, so a poisoned one holds whole state.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
