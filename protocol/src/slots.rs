//! Who may touch a slot when, and which key frame may follow which: the state machine of
//! `PROTOCOL.md` as the daemon keeps it. A client only has to know which slots are its own.
//!
//! ```text
//! client --submit--> submitted --latch--> latched --release--> client
//!                        \---- superseded, stream ended ----> client
//! ```
//!
//! At most one slot of a stream is submitted, and at most one is latched, whenever a call returns:
//! a newer key frame takes the place of one that was not latched yet. So it is with UI planes,
//! which lie in slots of the same pool and are counted apart ([`Holds`]).

use crate::error::{Error, Result};
use crate::limits::MAX_SLOTS;
use crate::wire::submit::Submit;
use crate::wire::ui::UiPlane;

/// What lies in a slot that the daemon has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Holds {
    /// A key frame.
    Key,
    /// A UI plane between key frames.
    Ui,
}

/// Where a slot is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SlotState {
    /// The client may write it.
    Client,
    /// Something lies in it that the daemon has not begun to read.
    Submitted(Holds, u64),
    /// The daemon copies it.
    Latched(Holds, u64),
}

/// A slot that changed hands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SlotUse {
    /// The slot.
    pub slot: u32,
    /// The key frame in it, or `ui_index` of the UI plane.
    pub key_index: u64,
}

/// The slots of one stream.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SlotTable {
    states: Vec<SlotState>,
}

impl SlotTable {
    /// `slots` slots that all belong to the client.
    #[must_use]
    pub fn new(slots: u32) -> Self {
        Self { states: vec![SlotState::Client; slots.min(MAX_SLOTS) as usize] }
    }

    /// State of every slot.
    #[must_use]
    pub fn states(&self) -> &[SlotState] {
        &self.states
    }

    /// A key frame or a UI plane was submitted. Gives the older one that it supersedes, whose slot
    /// belongs to the client again.
    ///
    /// # Errors
    /// [`Error::Slot`] if there is no such slot or it is not the client's. Nothing changes then.
    pub fn submit(&mut self, holds: Holds, slot: u32, index: u64) -> Result<Option<SlotUse>> {
        match self.states.get(slot as usize) {
            Some(SlotState::Client) => {}
            Some(state) => {
                let expected = "a slot of the client's";
                return Err(Error::Slot { slot, expected, found: format!("{state:?}") });
            }
            None => {
                let found = format!("{} slots in the pool", self.states.len());
                return Err(Error::Slot { slot, expected: "a slot of the pool", found });
            }
        }
        let superseded = self.submitted(holds);
        if let Some(older) = superseded {
            self.states[older.slot as usize] = SlotState::Client;
        }
        self.states[slot as usize] = SlotState::Submitted(holds, index);
        Ok(superseded)
    }

    /// The newest that waits.
    #[must_use]
    pub fn submitted(&self, holds: Holds) -> Option<SlotUse> {
        self.find(|state| match state {
            SlotState::Submitted(what, index) => Some(index).filter(|_| what == holds),
            _ => None,
        })
    }

    /// The one that is being copied.
    #[must_use]
    pub fn latched(&self, holds: Holds) -> Option<SlotUse> {
        self.find(|state| match state {
            SlotState::Latched(what, index) => Some(index).filter(|_| what == holds),
            _ => None,
        })
    }

    /// The daemon begins to read the newest; None where none waits or one is being read.
    pub fn latch(&mut self, holds: Holds) -> Option<SlotUse> {
        if self.latched(holds).is_some() {
            return None;
        }
        let newest = self.submitted(holds)?;
        self.states[newest.slot as usize] = SlotState::Latched(holds, newest.key_index);
        Some(newest)
    }

    /// The daemon has its copy: the slot belongs to the client again.
    pub fn release_latched(&mut self, holds: Holds) -> Option<SlotUse> {
        let latched = self.latched(holds)?;
        self.states[latched.slot as usize] = SlotState::Client;
        Some(latched)
    }

    fn find(&self, key_of: impl Fn(SlotState) -> Option<u64>) -> Option<SlotUse> {
        (0..)
            .zip(&self.states)
            .find_map(|(slot, &state)| key_of(state).map(|key_index| SlotUse { slot, key_index }))
    }
}

/// Holds that indices and content times of a stream's key frames only increase.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct KeyOrder {
    last: Option<(u64, u64)>,
}

impl KeyOrder {
    /// Takes note of the next key frame.
    ///
    /// # Errors
    /// [`Error::Order`] if its index or its content time is not above the last one's. Nothing
    /// changes then.
    pub fn advance(&mut self, submit: &Submit) -> Result<()> {
        if let Some((key_index, content_time_ns)) = self.last {
            let pairs = [
                ("key_index", key_index, submit.key_index),
                ("content_time_ns", content_time_ns, submit.content_time_ns),
            ];
            for (field, last, found) in pairs {
                if found <= last {
                    return Err(Error::Order { field, last, found });
                }
            }
        }
        self.last = Some((submit.key_index, submit.content_time_ns));
        Ok(())
    }
}

/// Holds that indices of a stream's UI planes only increase.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct UiOrder {
    last: Option<u64>,
}

impl UiOrder {
    /// Takes note of the next UI plane.
    ///
    /// # Errors
    /// [`Error::Order`] if its index is not above the last one's. Nothing changes then.
    pub fn advance(&mut self, ui: &UiPlane) -> Result<()> {
        match self.last.filter(|&last| ui.ui_index <= last) {
            Some(last) => Err(Error::Order { field: "ui_index", last, found: ui.ui_index }),
            None => {
                self.last = Some(ui.ui_index);
                Ok(())
            }
        }
    }
}
