//! Output frames for a subscriber.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use foreframe_protocol::memory::ReadOnlyPool;
use foreframe_protocol::{
    ColorFormat, OutputFrame as FrameMessage, OutputKind, OutputPool, OutputReleased, Primaries,
    Transfer,
};

use crate::client::StreamId;
use crate::error::Result;

/// Whose output frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum OutputSource {
    /// Whatever the daemon shows, whichever client it comes from.
    Display,
    /// One of this client's own streams.
    Stream(StreamId),
}

impl OutputSource {
    pub(crate) fn number(self) -> u32 {
        match self {
            Self::Display => 0,
            Self::Stream(stream) => stream.number(),
        }
    }

    pub(crate) fn from_number(stream: u32) -> Self {
        if stream == 0 { Self::Display } else { Self::Stream(StreamId::new(stream)) }
    }
}

/// A pool of output frames, mapped read-only.
#[derive(Debug)]
pub(crate) struct MappedPool {
    pub(crate) about: OutputPool,
    pub(crate) memory: ReadOnlyPool,
}

/// One output frame. The daemon does not touch it until it is dropped; the release is told with
/// the next [`Client::dispatch`](crate::Client::dispatch).
#[derive(Debug)]
pub struct OutputFrame {
    about: FrameMessage,
    pool: Arc<MappedPool>,
    home: Sender<OutputReleased>,
}

impl OutputFrame {
    pub(crate) fn new(
        about: FrameMessage,
        pool: Arc<MappedPool>,
        home: Sender<OutputReleased>,
    ) -> Self {
        Self { about, pool, home }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.pool.about.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.pool.about.height
    }

    /// How colour is stored and encoded.
    #[must_use]
    pub fn color(&self) -> (ColorFormat, Transfer, Primaries) {
        let OutputPool { color, transfer, primaries, .. } = self.pool.about;
        (color, transfer, primaries)
    }

    /// Luminance of (1, 1, 1) in cd/m2; 0 where it is not stated.
    #[must_use]
    pub fn white_cd_m2(&self) -> f32 {
        self.pool.about.white_cd_m2
    }

    /// Where it comes from.
    #[must_use]
    pub fn source(&self) -> OutputSource {
        OutputSource::from_number(self.about.stream)
    }

    /// How it came to be.
    #[must_use]
    pub fn kind(&self) -> OutputKind {
        self.about.kind
    }

    /// Phase in 1/4096: 0 at its key frame, 4096 one motion span later.
    #[must_use]
    pub fn phase_q12(&self) -> u32 {
        self.about.phase_q12
    }

    /// Counts the output frames of the stream, those that were skipped included.
    #[must_use]
    pub fn sequence(&self) -> u64 {
        self.about.sequence
    }

    /// The key frame that it was made from.
    #[must_use]
    pub fn key_index(&self) -> u64 {
        self.about.key_index
    }

    /// Simulation time that it shows.
    #[must_use]
    pub fn content_time_ns(&self) -> u64 {
        self.about.content_time_ns
    }

    /// Planned start of display.
    #[must_use]
    pub fn present_at_ns(&self) -> u64 {
        self.about.present_at_ns
    }

    /// Frames since the subscription that found no free slot.
    #[must_use]
    pub fn skipped(&self) -> u64 {
        self.about.skipped
    }

    /// Copies all pixels, row by row without padding. `out` is emptied first and keeps its memory.
    /// The pixels are the daemon's to write, so they can be copied but not borrowed.
    ///
    /// # Errors
    /// If the daemon described a frame that leaves its pool.
    pub fn copy_to_vec(&self, out: &mut Vec<u8>) -> Result<()> {
        self.copy_rows_to_vec(0, 1, out)
    }

    /// As [`copy_to_vec`](Self::copy_to_vec), but only row `first` and every `step`-th after it,
    /// for those who look at a sample. A `step` of 0 counts as 1.
    ///
    /// # Errors
    /// If the daemon described a frame that leaves its pool.
    pub fn copy_rows_to_vec(&self, first: u32, step: u32, out: &mut Vec<u8>) -> Result<()> {
        let OutputPool { width, height, stride, color, slot_bytes, .. } = self.pool.about;
        let rows = height.saturating_sub(first).div_ceil(step.max(1));
        let offset = u64::from(self.about.slot) * slot_bytes
            + u64::from(first.min(height)) * u64::from(stride);
        let stride = stride.saturating_mul(step.max(1));
        let row_bytes = width * color.bytes_per_pixel();
        Ok(self.pool.memory.copy_rows_to_vec(offset, stride, row_bytes, rows, out)?)
    }
}

impl Drop for OutputFrame {
    fn drop(&mut self) {
        let Self { about, home, .. } = self;
        // Without a client there is nobody left to tell.
        home.send(OutputReleased { pool: about.pool, slot: about.slot }).unwrap_or_default();
    }
}
