//! The demo's audience: subscribes to the output and compares every frame with the truth.
//!
//! It shares its two cores with the daemon that it watches. So while the show goes on it copies
//! what it will compare, one row in [`ROW_STEP`] of each frame that has a truth, and the whole of
//! the few frames that the contact sheet shows. It compares when the stream has ended. Successive
//! frames take turns in which rows they show it, so that none is left out for good. The memory for
//! this is bounded as the number of truths is: at 1280x720, 400 frames of 0.46 MB.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::Context as _;
use foreframe_client::{Client, ConnectOptions, Event, OutputFrame, OutputKind, OutputSource};
use foreframe_engine::MonoTime;

use super::CONNECT_TIMEOUT;
use super::rehearsal::Rehearsal;

/// Slots of the subscription: one is looked at while the next ones are written.
const SLOTS: u32 = 6;
/// Time between two looks at whether the show is over.
const PATIENCE: Duration = Duration::from_millis(50);
/// Pixels that are compared in one go.
const RUN: usize = 256;
/// Of so many rows of a frame one is compared.
pub const ROW_STEP: u32 = 8;
/// Where in the show the frames are that are kept for the contact sheet, as shares of its length.
const KEPT_AT: [f64; 4] = [0.37, 0.55, 0.73, 0.91];

/// One output frame as it was received.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shown {
    /// How it came to be.
    pub kind: OutputKind,
    /// The key that it was made from.
    pub key_index: u64,
    /// Position after that key.
    pub phase: f64,
    /// Simulation time that it shows, nanoseconds after the first key.
    pub content_ns: u64,
    /// When it was planned to be shown.
    pub present_at: MonoTime,
    /// Frames before it that were made while all slots of the subscription were in use.
    pub not_received: u64,
    /// Against the truth of its content time, if that was rendered.
    pub psnr_rgb_db: Option<f64>,
}

/// An in-between frame that is kept to be looked at.
#[derive(Clone, PartialEq, Debug)]
pub struct Kept {
    /// What it is.
    pub shown: Shown,
    /// Red, green, blue, alpha of its pixels.
    pub rgba: Vec<u8>,
}

/// Everything that the audience saw.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Seen {
    /// Every frame, in order.
    pub frames: Vec<Shown>,
    /// A few in-between frames.
    pub kept: Vec<Kept>,
}

/// A client that watches.
#[derive(Debug)]
pub struct Audience {
    client: Client,
    base: MonoTime,
}

impl Audience {
    /// Connects and subscribes to whatever the daemon shows. The first key is due at `base`.
    ///
    /// # Errors
    /// If the daemon refuses.
    pub fn connect(options: &ConnectOptions, base: MonoTime) -> anyhow::Result<Self> {
        let mut client = options.connect(CONNECT_TIMEOUT).context("connecting as the audience")?;
        client.subscribe(OutputSource::Display, SLOTS).context("subscribing to the output")?;
        Ok(Self { client, base })
    }

    /// Watches until `is_over`, which the application sets when its stream has ended.
    ///
    /// # Errors
    /// If the daemon goes away.
    pub fn watch(mut self, rehearsal: &Rehearsal, is_over: &AtomicBool) -> anyhow::Result<Seen> {
        let mut seen = Seen::default();
        let mut samples = Vec::new();
        while !is_over.load(Ordering::Relaxed) {
            self.client.wait(PATIENCE).context("waiting for output frames")?;
            while let Some(event) = self.client.next_event() {
                if let Event::Output(frame) = event {
                    samples.extend(self.take(&frame, rehearsal, &mut seen)?);
                }
            }
        }
        for sample in samples {
            sample.compare(rehearsal, &mut seen.frames);
        }
        Ok(seen)
    }

    /// Keeps what is to be known of a frame, and the rows of it that are to be compared.
    fn take(
        &mut self,
        frame: &OutputFrame,
        rehearsal: &Rehearsal,
        seen: &mut Seen,
    ) -> anyhow::Result<Option<Sample>> {
        let content_ns = frame.content_time_ns().saturating_sub(self.base.as_ns());
        let shown = Shown {
            kind: frame.kind(),
            key_index: frame.key_index(),
            phase: f64::from(frame.phase_q12()) / 4096.0,
            content_ns,
            present_at: MonoTime::from_ns(frame.present_at_ns()),
            not_received: frame.skipped(),
            psnr_rgb_db: None,
        };
        let index = seen.frames.len();
        seen.frames.push(shown);
        if is_wanted(&shown, rehearsal, seen.kept.len()) {
            let mut rgba = Vec::new();
            frame.copy_to_vec(&mut rgba).context("copying an output frame")?;
            seen.kept.push(Kept { shown, rgba });
        }
        if rehearsal.rendered_truth(content_ns).is_none() {
            return Ok(None);
        }
        let first_row = index as u32 % ROW_STEP.min(frame.height().max(1));
        let mut rgba = Vec::new();
        let copied = frame.copy_rows_to_vec(first_row, ROW_STEP, &mut rgba);
        copied.context("copying rows of an output frame")?;
        Ok(Some(Sample { index, first_row, width: frame.width(), rgba }))
    }
}

/// Some rows of a frame.
#[derive(Debug)]
struct Sample {
    /// Number of the frame in [`Seen::frames`].
    index: usize,
    /// The first of the rows. [`ROW_STEP`] leads to the next.
    first_row: u32,
    /// Pixels per row.
    width: u32,
    /// Red, green, blue, alpha of their pixels.
    rgba: Vec<u8>,
}

impl Sample {
    fn compare(&self, rehearsal: &Rehearsal, frames: &mut [Shown]) {
        let shown = &mut frames[self.index];
        let truth = rehearsal.rendered_truth(shown.content_ns);
        shown.psnr_rgb_db = truth.map(|truth| {
            let rows = truth.chunks_exact(3 * self.width as usize).skip(self.first_row as usize);
            let truth: Vec<u8> = rows.step_by(ROW_STEP as usize).flatten().copied().collect();
            psnr_rgb_db(&self.rgba, &truth)
        });
    }
}

/// Whether a frame is the next one for the contact sheet, which has `kept` so far.
#[expect(clippy::cast_precision_loss, reason = "a show lasts seconds, far below 2^53 ns")]
fn is_wanted(shown: &Shown, rehearsal: &Rehearsal, kept: usize) -> bool {
    let Some(due) = KEPT_AT.get(kept).filter(|_| shown.kind == OutputKind::Synthesised) else {
        return false;
    };
    let duration_ns = rehearsal.key_interval_ns * rehearsal.keys.len() as u64;
    // Rows take turns between the frames right after a key and the last ones before the next, if
    // such a frame comes within a few keys.
    let wants_late = kept % 2 == 1;
    let late_by_ns = shown.content_ns as f64 - due * duration_ns as f64;
    let is_its_turn = (shown.phase >= 0.5) == wants_late;
    late_by_ns >= 0.0 && (is_its_turn || late_by_ns > 3.0 * rehearsal.key_interval_ns as f64)
}

/// Peak signal-to-noise ratio in dB of `rgba` against `rgb`, all three channels together, 8-bit
/// sRGB-encoded; 100 where they are equal.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "sums of a picture are far below 2^53")]
pub fn psnr_rgb_db(rgba: &[u8], rgb: &[u8]) -> f64 {
    let runs = rgba.chunks(4 * RUN).zip(rgb.chunks(3 * RUN));
    let (sum, count) = runs.fold((0, 0), |(sum, count), (rgba, rgb)| {
        (sum + u64::from(squared_error(rgba, rgb)), count + rgb.len())
    });
    if sum == 0 {
        return 100.0;
    }
    let mean = sum as f64 / count as f64;
    10.0 * (255.0 * 255.0 / mean).log10()
}

/// Sum over at most [`RUN`] pixels: below 2^26.
fn squared_error(rgba: &[u8], rgb: &[u8]) -> u32 {
    let pixels = rgba.as_chunks::<4>().0.iter().zip(rgb.as_chunks::<3>().0);
    let square = |a: u8, b: u8| u32::from(a.abs_diff(b)) * u32::from(a.abs_diff(b));
    pixels.map(|(a, b)| square(a[0], b[0]) + square(a[1], b[1]) + square(a[2], b[2])).sum()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use foreframe_engine::Method;
    use foreframe_fixtures::{SceneInfo, Size};

    use super::*;
    use crate::demo::Settings;
    use crate::output::Output;

    #[test]
    fn equal_pictures_count_as_100_db_and_one_level_everywhere_as_48() {
        let rgba = [10, 20, 30, 255].repeat(5000);
        let rgb = [10, 20, 30].repeat(5000);
        assert_eq!(psnr_rgb_db(&rgba, &rgb).to_bits(), 100.0_f64.to_bits());
        let off = [11, 19, 31].repeat(5000);
        assert!((psnr_rgb_db(&rgba, &off) - 48.1308).abs() < 1e-3, "20 log10 255");
    }

    #[test]
    fn a_sample_is_compared_with_the_rows_of_the_truth_that_it_was_copied_from() {
        let settings = Settings {
            scene: SceneInfo::by_name("pan").expect("a scene of the table"),
            size: Size::new(48, 27),
            seconds: 0.1,
            key_rate_hz: 40.0,
            refresh_hz: 120.0,
            backend: foreframe_engine::backend::choice::BackendChoice::Cpu,
            method: Method::Linear,
            sink: foreframed::config::SinkSpec::Null,
            window: foreframed::sink::window::WindowOptions::default(),
            hud: foreframed::hud::HudView::Off,
            out: PathBuf::new(),
        };
        let rehearsal = Rehearsal::render(&settings, &Output::new(true));
        let truth = rehearsal.render_truth(0);
        let first = Shown {
            kind: OutputKind::Real,
            key_index: 0,
            phase: 0.0,
            content_ns: 0,
            present_at: MonoTime::ZERO,
            not_received: 0,
            psnr_rgb_db: None,
        };
        let db = |first_row: u32| {
            let rows = truth.chunks_exact(4 * 48).skip(3).step_by(ROW_STEP as usize);
            let rgba = rows.flatten().copied().collect();
            let mut frames = [first];
            Sample { index: 0, first_row, width: 48, rgba }.compare(&rehearsal, &mut frames);
            frames[0].psnr_rgb_db.expect("the truth of the first key is rendered")
        };
        assert_eq!(db(3).to_bits(), 100.0_f64.to_bits());
        assert!(db(4) < 60.0, "expected another row to differ, found {} dB", db(4));
    }
}
