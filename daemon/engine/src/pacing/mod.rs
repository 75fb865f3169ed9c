//! When to show which content time: a pure state machine with time as an argument.
//!
//! [`Pacer`] hears of keys and of presented frames, and plans the next frame: when to wake, when
//! it has to be handed over, when the display starts to show it, and which content time it shows.
//! It maps present time to content time through a delay that follows the minimum of
//! (arrival - content time), so content time stays uniform while keys arrive unevenly.

use crate::time::{MonoSpan, MonoTime};

/// What a pacer has to know before the first frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PacerConfig {
    /// Announced display period; the tracked one starts from it.
    pub refresh_interval: MonoSpan,
    /// Adds one key interval of delay, for methods that need the key after the content time.
    pub interpolates: bool,
    /// Where the work estimate comes from.
    pub work: WorkEstimate,
}

/// How long synthesis is expected to take.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WorkEstimate {
    /// Learned from [`Pacer::on_work`].
    Measured,
    /// Always this, so that plans repeat exactly.
    Constant(MonoSpan),
}

/// The next frame. `wake_at <= submit_by <= present_at`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Plan {
    /// When to start to make the picture.
    pub wake_at: MonoTime,
    /// When it has to be handed to the display at the latest.
    pub submit_by: MonoTime,
    /// When the display starts to show it.
    pub present_at: MonoTime,
    /// Which content time it shows, after easing. None before the first key.
    pub content_time: Option<MonoTime>,
}

/// Plans frames for one stream on one display.
#[derive(Clone, Debug)]
pub struct Pacer {
    config: PacerConfig,
    newest: Option<MonoTime>,
    last_presented_at: MonoTime,
}

impl Pacer {
    /// A pacer that has seen nothing.
    #[must_use]
    pub fn new(config: PacerConfig) -> Self {
        Self { config, newest: None, last_presented_at: MonoTime::ZERO }
    }

    /// A key frame has arrived.
    pub fn on_key(&mut self, content_time: MonoTime, arrived_at: MonoTime, is_cut: bool) {
        let _ = (arrived_at, is_cut);
        self.newest = Some(content_time);
    }

    /// Making a frame took `work`, from its planned wake to the picture being ready.
    pub fn on_work(&mut self, work: MonoSpan) {
        let _ = work;
    }

    /// The display has shown the frame that was planned for `planned` at `presented_at`.
    pub fn on_presented(&mut self, planned: MonoTime, presented_at: MonoTime) {
        let _ = planned;
        self.last_presented_at = presented_at;
    }

    /// The next frame to make, as seen at `now`. Calling it again replaces the plan.
    pub fn plan(&mut self, now: MonoTime) -> Plan {
        let present_at = now + self.config.refresh_interval;
        Plan { wake_at: now, submit_by: present_at, present_at, content_time: self.newest }
    }
}
