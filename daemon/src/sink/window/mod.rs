//! A window of each stream on the desktop, and what the display says about each frame.
//!
//! A thread of the daemon's own ([`WindowSystem`]) makes windows and hears what users do with them.
//! The stream's thread opens one [`Window`] and gives it pictures with [`Window::present`], which
//! never waits for the display. A GPU adapter that makes the pictures draws them on a surface of its
//! own ([`surface`]). Without one, on Wayland ([`wayland`]) a picture is copied into a shared-memory
//! buffer that is free, elsewhere ([`software`]) it is left to a thread that paints. On Wayland
//! presentation feedback is asked for just before each commit. What happens to a window and to its
//! frames comes as [`WindowEvent`]s, and each wakes the stream. What the desktop calls a window can
//! be shared by several streams ([`host`]); each has its part of it as if that were a window.
//!
//! What a display lacks is done without, and named ([`Feedback`]): without presentation feedback,
//! or with one that never answers, frames are paced by frame callbacks, and without those by a
//! timer at the announced rate. A display that is gone leaves the daemon and its streams as they
//! are.

mod easel;
mod handle;
mod host;
mod pane;
mod placement;
mod shared;
mod software;
mod surface;
mod system;
mod texels;
mod wayland;

use std::str::FromStr;
use std::{fmt, io};

use foreframe_engine::StreamFormat;

use crate::stream::core::Told;

pub use handle::Window;
pub use system::{WindowOpener, WindowSystem};

/// Where and how windows open.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct WindowOptions {
    /// As large as the monitor. A key press changes it.
    pub is_fullscreen: bool,
    /// Name of the monitor to be shown on. A window that is not full screen opens there where the
    /// window system lets applications choose, which Wayland does not.
    pub monitor: Option<String>,
    /// Where several streams are shown.
    pub layout: Layout,
}

/// Where several streams are shown.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Layout {
    /// Each in a window of its own.
    #[default]
    Single,
    /// All in one window, in columns of the same width. On Wayland it needs `wp_viewporter` and
    /// `wl_subcompositor`: without these each gets a window.
    SideBySide,
}

impl Layout {
    /// Name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::SideBySide => "side-by-side",
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Layout {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let all = [Self::Single, Self::SideBySide];
        let found = all.into_iter().find(|layout| layout.name() == name);
        found.ok_or_else(|| format!("expected single or side-by-side, found `{name}`"))
    }
}

/// One window to open.
#[derive(Clone, Debug)]
pub struct WindowConfig {
    /// Pictures that it is to show.
    pub format: StreamFormat,
    /// What the desktop calls it.
    pub title: String,
    /// In a window that several share, those with a lower number are to the left.
    pub ordinal: u64,
}

/// Where a window knows from when its frames were shown.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Feedback {
    /// The display tells the time of each.
    Presentation,
    /// It asks for the next one when it has shown one; good to a millisecond or so.
    FrameCallbacks,
    /// Nothing: frames are handed over at the announced rate.
    Timer,
}

impl Feedback {
    /// Name in status and logs.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Presentation => "presentation feedback",
            Self::FrameCallbacks => "frame callbacks",
            Self::Timer => "timer",
        }
    }
}

/// Why a window is closed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Closed {
    /// Somebody has closed it.
    ByUser,
    /// The display is gone.
    WithDisplay,
}

/// What happened to a window.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WindowEvent {
    /// What the pacer has to know.
    Told(Told),
    /// Frames are paced by this from now on.
    Feedback(Feedback),
    /// A key was pressed that the window has no use for itself: its character, in lower case.
    Key(char),
    /// It shows nothing any more.
    Closed(Closed),
}

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// No display, or one that does not work.
    #[error("expected a display to open windows on, found none: {0}")]
    NoDisplay(String),
    /// The display did not answer in time, or is gone.
    #[error("expected a display that answers, found {0}")]
    NoAnswer(&'static str),
    /// The display has no monitor of the wanted name.
    #[error("expected a monitor named `{wanted}`, found {found}")]
    NoMonitor {
        /// The name that was asked for.
        wanted: String,
        /// Names of those that there are.
        found: String,
    },
    /// The display refuses.
    #[error("expected a window, found: {0}")]
    Refused(String),
    /// The display lacks something that cannot be done without.
    #[error("expected a display with {0}, found one without")]
    Lacks(&'static str),
    /// Memory or a thread could not be had.
    #[error("opening a window: {0}")]
    Io(#[from] io::Error),
}
