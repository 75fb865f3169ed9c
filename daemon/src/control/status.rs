//! What a daemon says of itself: the answer to a status request. Names are part of the interface.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A daemon and its streams.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct DaemonStatus {
    /// Of the program.
    pub version: String,
    /// Where applications connect.
    pub socket: PathBuf,
    /// Since it listens, seconds.
    pub uptime_s: f64,
    /// How new streams make their in-between frames.
    pub method: String,
    /// Where output frames go.
    pub sink: String,
    /// Rate of the output, Hz.
    pub refresh_hz: f64,
    /// Most frames shown a second, if that is less.
    pub cap_hz: Option<f64>,
    /// The capture that is being written.
    pub recording: Option<PathBuf>,
    /// Connected applications and subscribers.
    pub clients: usize,
    /// Streams that run, oldest first.
    pub streams: Vec<StreamStatus>,
}

/// One stream, over the last quarter of a second unless it says otherwise.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct StreamStatus {
    /// Number of the stream in the daemon.
    pub number: u64,
    /// Number of its client's session.
    pub session: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// How in-between frames are made.
    pub method: String,
    /// What makes them: `cpu`, or `gpu:` and the adapter.
    pub backend: String,
    /// What says when its frames are shown: `timer`, `presentation feedback`, `frame callbacks`.
    pub paced_by: String,
    /// How pictures get into its window, and why not otherwise; empty without a window.
    #[serde(default)]
    pub drawn_by: String,
    /// Name of the display profile that it is for; None where nobody named one.
    #[serde(default)]
    pub display: Option<String>,
    /// No key has come for a while, and nothing is made.
    pub is_idle: bool,
    /// Refreshes and keys per second.
    pub rates_hz: Rates,
    /// Planned pictures that were shown at their refresh, percent.
    pub on_target_percent: f64,
    /// Where the time of a key goes, milliseconds.
    pub latency_ms: Stages,
    /// How long before its refresh a picture was ready: of the last 128 pictures, how many fall
    /// below 0 ms (late), 1, 2, 4, 8 and above.
    pub ready_before_refresh: [u32; 6],
    /// Keys since the start: received, replaced by a newer one before a picture of
    /// them was handed to the display, refused.
    pub keys: [u64; 3],
    /// Refreshes since the start: real, synthesised, repeated, dropped.
    pub frames: [u64; 4],
    /// Which part of the picture goes on by which model, percent, the largest first.
    pub models_percent: Vec<(String, f64)>,
    /// What somebody should look at, one line each.
    pub warnings: Vec<String>,
}

/// Per second.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Rates {
    /// Keys taken in.
    pub keys: f64,
    /// Refreshes that showed a key.
    pub real: f64,
    /// Refreshes that showed a made picture.
    pub synthesised: f64,
    /// Refreshes that showed the picture before again.
    pub repeated: f64,
    /// Refreshes that did so because theirs was not ready.
    pub dropped: f64,
}

/// From the arrival of a key to the refresh that first shows it, stage by stage.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Stages {
    /// Waiting for the stream's thread.
    pub waited: Spread,
    /// Copied, converted, and its trajectories worked out.
    pub taken_in: Spread,
    /// Waiting for the wake of the picture, and making it.
    pub made: Spread,
    /// Of that, waiting for the wake, so that the picture is shown when it is due.
    #[serde(default)]
    pub paced: Spread,
    /// From the arrival until the picture was handed to the display; without a window, until it was
    /// ready.
    #[serde(default)]
    pub handed_over: Spread,
    /// From being ready to its refresh.
    pub until_shown: Spread,
    /// All of it.
    pub whole: Spread,
    /// Making one in-between frame.
    pub synthesis: Spread,
}

/// Of the last 128 values.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Spread {
    /// Half of the values are below.
    pub p50: f64,
    /// 95 % of them are.
    pub p95: f64,
}
