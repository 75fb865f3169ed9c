//! What a running stream can be told to do differently.

use foreframe_engine::{Method, MonoSpan};

use crate::hud::HudView;
use crate::recorder::StreamRecorder;

/// A change that the stream's thread makes before it does anything else.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "commands are rare, and moved once or twice")]
pub enum StreamCommand {
    /// Make in-between frames by this method from the next picture on.
    Method(Method),
    /// Record from the next key on, or no longer.
    Record(Option<StreamRecorder>),
    /// Plan pictures this far apart, a whole number of refreshes. Only on a timer.
    Interval(MonoSpan),
    /// Draw this into the pictures of the window.
    Hud(HudView),
}
