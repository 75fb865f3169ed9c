//! What a capture says about itself: session and gaps. JSON in the file, for people and tools.

use std::collections::BTreeMap;

use foreframe_protocol::limits;
use serde::{Deserialize, Serialize};

use super::schema;

/// Name of the setting that a replay needs to see what was seen: pixels per degree of visual angle.
pub const PIXELS_PER_DEGREE: &str = "pixels_per_degree";

/// Name of the setting that says whether the user gave that number (`true`), so that it held for
/// streams that named a display profile too.
pub const PIXELS_PER_DEGREE_IS_GIVEN: &str = "pixels_per_degree_is_given";

/// Name of the setting that says where refreshes of the display lay: an instant of one, nanoseconds
/// of the monotonic clock.
pub const DISPLAY_ORIGIN: &str = "display_origin_ns";

/// Where the frames of a capture come from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CaptureSource {
    /// A running application, through the daemon.
    Live,
    /// Image files.
    Import,
    /// A built-in scene.
    Scene,
}

/// The session message: what was recorded and by what.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct SessionInfo {
    /// Version of the capture format.
    pub format_version: u32,
    /// Name of what was recorded.
    pub name: String,
    /// Where the frames come from.
    pub source: CaptureSource,
    /// Program and version that wrote the file.
    pub software: String,
    /// Version of the protocol whose bodies are inside.
    pub protocol: String,
    /// Settings of the recording program, by name.
    #[serde(default)]
    pub config: BTreeMap<String, String>,
}

impl SessionInfo {
    /// A session of this program, of the current format.
    #[must_use]
    pub fn new(name: impl Into<String>, source: CaptureSource) -> Self {
        Self {
            format_version: schema::VERSION,
            name: name.into(),
            source,
            software: concat!("foreframe ", env!("CARGO_PKG_VERSION")).to_owned(),
            protocol: protocol_version(),
            config: BTreeMap::new(),
        }
    }

    /// With a setting to remember.
    #[must_use]
    pub fn with_config(mut self, name: impl Into<String>, value: impl ToString) -> Self {
        self.config.insert(name.into(), value.to_string());
        self
    }
}

fn protocol_version() -> String {
    format!("{}.{}", limits::MAJOR, limits::MINOR)
}

/// Key frames, or UI planes between them, that arrived and were not recorded.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Gap {
    /// Stream that lacks them.
    pub stream: u32,
    /// How many.
    pub count: u64,
    /// Arrival of the first one, nanoseconds of the monotonic clock.
    pub from_ns: u64,
    /// Arrival of the last one.
    pub to_ns: u64,
    /// Why.
    pub reason: String,
}
