//! Who may touch a slot when, and which key frame may follow which: the state machine of
//! `PROTOCOL.md` as the daemon keeps it. A client only has to know which slots are its own.
//!
//! ```text
//! client --submit--> submitted --latch--> latched --release--> client
//!                        \---- superseded, stream ended ----> client
//! ```
//!
//! At most one slot of a stream is submitted, and at most one is latched, whenever a call returns:
//! a newer key frame takes the place of one that was not latched yet.

use crate::error::{Error, Result};
use crate::limits::MAX_SLOTS;
use crate::wire::submit::Submit;

/// Where a slot is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SlotState {
    /// The client may write it.
    Client,
    /// A key frame lies in it that the daemon has not begun to read.
    Submitted {
        /// The key frame.
        key_index: u64,
    },
    /// The daemon copies its planes.
    Latched {
        /// The key frame.
        key_index: u64,
    },
}

/// A slot that changed hands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SlotUse {
    /// The slot.
    pub slot: u32,
    /// The key frame in it.
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

    /// A key frame was submitted. Gives the older one that it supersedes, whose slot belongs to the
    /// client again.
    ///
    /// # Errors
    /// [`Error::Slot`] if there is no such slot or it is not the client's. Nothing changes then.
    pub fn submit(&mut self, slot: u32, key_index: u64) -> Result<Option<SlotUse>> {
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
        let superseded = self.submitted();
        if let Some(older) = superseded {
            self.states[older.slot as usize] = SlotState::Client;
        }
        self.states[slot as usize] = SlotState::Submitted { key_index };
        Ok(superseded)
    }

    /// The newest key frame that waits.
    #[must_use]
    pub fn submitted(&self) -> Option<SlotUse> {
        self.find(|state| match state {
            SlotState::Submitted { key_index } => Some(key_index),
            _ => None,
        })
    }

    /// The key frame whose planes are being copied.
    #[must_use]
    pub fn latched(&self) -> Option<SlotUse> {
        self.find(|state| match state {
            SlotState::Latched { key_index } => Some(key_index),
            _ => None,
        })
    }

    /// The daemon begins to read the newest key frame; None where none waits or one is being read.
    pub fn latch(&mut self) -> Option<SlotUse> {
        if self.latched().is_some() {
            return None;
        }
        let newest = self.submitted()?;
        self.states[newest.slot as usize] = SlotState::Latched { key_index: newest.key_index };
        Some(newest)
    }

    /// The daemon has its copy: the slot belongs to the client again.
    pub fn release_latched(&mut self) -> Option<SlotUse> {
        let latched = self.latched()?;
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
