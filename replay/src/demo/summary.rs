//! What happened, in numbers ([`Summary`]), in ten lines ([`Summary::text`]), and in pictures.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use foreframe_client::OutputKind;
use foreframe_engine::MonoSpan;
use foreframed::config::SinkSpec;
use foreframed::sink::png::PngSink;
use serde::Serialize;

use super::Settings;
use super::application::Submissions;
use super::audience::{Kept, ROW_STEP, Seen, Shown, psnr_rgb_db};
use super::refreshes::{content_judder, meaning_of_gaps, timeline_events};
use super::rehearsal::Rehearsal;
use crate::draw::Rgba8Image;
use crate::pictures::{ContactSheetRow, PresentKind, contact_sheet, timeline};

const CONTACT_SHEET: &str = "contact-sheet.png";
const TIMELINE: &str = "timeline.png";
const NUMBERS: &str = "summary.json";

/// Makes the folder, and removes what an earlier demo left in it and in the folder of the sink:
/// nobody shall take its pictures for those of this one.
///
/// # Errors
/// If the folder cannot be made or a file not removed.
pub fn prepare(out: &Path, sink: &SinkSpec) -> anyhow::Result<()> {
    fs::create_dir_all(out).with_context(|| format!("making {}", out.display()))?;
    let mut stale: Vec<_> = [CONTACT_SHEET, TIMELINE, NUMBERS].map(|name| out.join(name)).into();
    if let SinkSpec::Png(dir) = sink {
        stale.extend(PngSink::files_in(dir).with_context(|| format!("reading {}", dir.display()))?);
    }
    for path in stale {
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(error).with_context(|| format!("removing {}", path.display()));
            }
            _ => {}
        }
    }
    Ok(())
}

/// The demo's result. Times in milliseconds are medians unless their name says otherwise.
#[derive(Serialize, Clone, PartialEq, Debug)]
pub struct Summary {
    /// Keys that were submitted.
    pub key_frames: u64,
    /// Keys that were left out because no slot was free.
    pub skipped_keys: u64,
    /// Output frames that were shown.
    pub presented: u64,
    /// Of these, keys as they came.
    pub real: u64,
    /// Of these, in-between frames.
    pub synthesised: u64,
    /// Of these, pictures shown before.
    pub repeated: u64,
    /// Frames that were not ready in time.
    pub dropped: u64,
    /// Of these, after the first second.
    pub dropped_after_first_second: u64,
    /// Share of planned in-between frames that were dropped after the first second, percent.
    pub dropped_percent: f64,
    /// Standard deviation of the content-time step over the refresh interval. None without steps.
    pub content_judder: Option<f64>,
    /// Mean over the in-between frames whose truth was rendered. None where there are none.
    pub psnr_rgb_db: Option<f64>,
    /// The worst of them.
    pub psnr_rgb_min_db: Option<f64>,
    /// In-between frames that were compared.
    pub compared: u64,
    /// Of so many rows of each of them one was compared. None where none was.
    pub compared_row_step: Option<u32>,
    /// Real frames that differ from their key in one row of [`ROW_STEP`].
    pub real_frames_changed: u64,
    /// Time to fill a slot and submit it. None without keys.
    pub fill_and_submit_ms: Option<f64>,
    /// Time to make an in-between frame, mean of the daemon. None where it made none.
    pub synthesis_ms: Option<f64>,
    /// Where the engine ran, as the daemon said.
    pub backend: String,
    /// How in-between frames were made.
    pub method: &'static str,
    /// The scene.
    pub scene: &'static str,
    /// Columns of a frame.
    pub width: u32,
    /// Rows of a frame.
    pub height: u32,
    /// Keys per second.
    pub key_rate_hz: f64,
    /// Refreshes per second; of a window, as the daemon tracked them.
    pub refresh_hz: f64,
    /// Where the pictures are.
    pub out: PathBuf,
    /// Pictures that were written there: without in-between frames there is nothing to draw.
    pub pictures: Vec<&'static str>,
    /// Where the daemon wrote every frame that was shown, if it was asked to.
    pub output_frames: Option<String>,
}

impl Summary {
    /// Counts what was submitted and seen.
    #[must_use]
    pub fn new(
        settings: &Settings,
        rehearsal: &Rehearsal,
        submissions: &Submissions,
        seen: &Seen,
    ) -> Self {
        let statistics = submissions.statistics;
        let count =
            |field: fn(&foreframe_client::Statistics) -> u64| statistics.as_ref().map_or(0, field);
        let settled = |field: fn(&foreframe_client::Statistics) -> u64| {
            count(field) - submissions.settled.as_ref().map_or(0, field).min(count(field))
        };
        let dropped = settled(|counts| counts.dropped);
        let planned = settled(|counts| counts.synthesised) + dropped;
        let Compared { db: compared, row_step } = Compared::new(seen, rehearsal);
        let refresh_hz = match (&settings.sink, submissions.refresh_interval) {
            (SinkSpec::Window, Some(tracked)) => 1.0 / tracked.as_secs_f64(),
            _ => settings.refresh_hz,
        };
        Self {
            key_frames: submissions.sent.len() as u64,
            skipped_keys: submissions.skipped,
            presented: count(|counts| counts.presented),
            real: count(|counts| counts.real),
            synthesised: count(|counts| counts.synthesised),
            repeated: count(|counts| counts.repeated),
            dropped: count(|counts| counts.dropped),
            dropped_after_first_second: dropped,
            dropped_percent: 100.0 * ratio(dropped, planned),
            content_judder: content_judder(&seen.frames, MonoSpan::from_hz(refresh_hz)),
            psnr_rgb_db: mean(&compared),
            psnr_rgb_min_db: compared.iter().copied().min_by(f64::total_cmp),
            compared: compared.len() as u64,
            compared_row_step: row_step,
            real_frames_changed: changed_real_frames(seen),
            fill_and_submit_ms: median_ms(&submissions.work),
            synthesis_ms: (count(|counts| counts.synthesised + counts.dropped) > 0)
                .then(|| count(|counts| counts.synthesis_mean_ns) as f64 / 1e6),
            backend: submissions.backend.clone(),
            method: settings.method.name(),
            scene: settings.scene.name,
            width: settings.size.width,
            height: settings.size.height,
            key_rate_hz: settings.key_rate_hz,
            refresh_hz,
            out: settings.out.clone(),
            pictures: Vec::new(),
            output_frames: settings.sink.keeps_frames().then(|| settings.sink.to_string()),
        }
    }

    /// What happened, in ten lines.
    #[must_use]
    pub fn text(&self) -> String {
        let Self { key_frames, presented, real, synthesised, repeated, dropped, .. } = self;
        let out = self.out.display();
        let pictures: Vec<_> = self.pictures.iter().map(|name| format!("{out}/{name}")).collect();
        let pictures = match pictures.is_empty() {
            true => "nothing: no picture was shown".to_owned(),
            false => pictures.join(" and "),
        };
        [
            format!(
                "`{}` at {} Hz went to a daemon in a second process and came out at {} Hz, {}x{}.",
                self.scene, self.key_rate_hz, self.refresh_hz, self.width, self.height
            ),
            format!("keys submitted      {key_frames}, {} skipped", self.skipped_keys),
            format!("frames shown        {presented}: {real} real, {synthesised} synthesised ({}), {repeated} repeated", self.method),
            format!(
                "frames dropped      {dropped}; after the first second {} ({:.2} % of the in-betweens)",
                self.dropped_after_first_second, self.dropped_percent
            ),
            format!("content judder      {}", or_none(self.content_judder, 4, " of a refresh interval")),
            format!(
                "error               {} PSNR on average, {} at worst, {} of {} in-betweens compared{}",
                or_none(self.psnr_rgb_db, 1, " dB"),
                or_none(self.psnr_rgb_min_db, 1, " dB"),
                self.compared,
                self.synthesised,
                match self.compared_row_step {
                    None => String::new(),
                    Some(1) => ", all rows".to_owned(),
                    Some(step) => format!(", 1 row in {step}"),
                }
            ),
            format!("real frames changed {}", self.real_frames_changed),
            format!(
                "time                {} to fill and submit a key, {} to make an in-between on {}",
                or_none(self.fill_and_submit_ms, 2, " ms"),
                or_none(self.synthesis_ms, 2, " ms"),
                self.backend
            ),
            format!("look at             {pictures}{}", match &self.output_frames {
                Some(sink) => format!("; every frame that was shown went to {sink}"),
                None => String::new(),
            }),
            format!("numbers             {out}/{NUMBERS}"),
        ]
        .join("\n")
    }

    /// Writes the contact sheet, the timeline and the numbers, and notes which there are.
    ///
    /// # Errors
    /// If one cannot be drawn or written.
    pub fn write(
        &mut self,
        settings: &Settings,
        rehearsal: &Rehearsal,
        submissions: &Submissions,
        seen: &Seen,
    ) -> anyhow::Result<()> {
        let out = &settings.out;
        if let Some(sheet) = self.draw_contact_sheet(rehearsal, &seen.kept)? {
            save(&sheet, &out.join(CONTACT_SHEET))?;
            self.pictures.push(CONTACT_SHEET);
        }
        let interval = MonoSpan::from_hz(self.refresh_hz);
        let events = timeline_events(
            submissions,
            seen,
            rehearsal.key_interval_ns,
            interval,
            self.unshown_kind(),
        );
        if !events.is_empty() {
            let title = format!(
                "{} at {} Hz to {} Hz, {}{}",
                self.scene,
                self.key_rate_hz,
                self.refresh_hz,
                self.method,
                meaning_of_gaps(&seen.frames)
            );
            save(&timeline(&title, &events)?, &out.join(TIMELINE))?;
            self.pictures.push(TIMELINE);
        }
        let json = serde_json::to_string_pretty(self)?;
        let path = out.join(NUMBERS);
        fs::write(&path, json + "\n").with_context(|| format!("writing {}", path.display()))
    }

    /// What a refresh without a new picture was. The audience cannot tell a picture that was not
    /// ready from one that was not wanted; the daemon counts them.
    fn unshown_kind(&self) -> PresentKind {
        match (self.repeated, self.dropped) {
            (0, 1..) => PresentKind::Dropped,
            _ => PresentKind::Repeated,
        }
    }

    fn draw_contact_sheet(
        &self,
        rehearsal: &Rehearsal,
        kept: &[Kept],
    ) -> anyhow::Result<Option<tiny_skia::Pixmap>> {
        let truths: Vec<Vec<u8>> =
            kept.iter().map(|kept| rehearsal.render_truth(kept.shown.content_ns)).collect();
        let image = |pixels| Rgba8Image::new(self.width, self.height, pixels);
        let rows = kept.iter().zip(&truths).filter_map(|(kept, truth)| {
            let shown = &kept.shown;
            let key = rehearsal.keys.get(usize::try_from(shown.key_index).ok()?)?;
            Some(ContactSheetRow {
                label: format!("key {}, phase {:.2}", shown.key_index, shown.phase),
                detail: format!("{:.1} dB", psnr_rgb_db(&kept.rgba, &without_alpha(truth))),
                key: image(&key.color.rgba)?,
                in_between: image(&kept.rgba)?,
                truth: image(truth)?,
            })
        });
        let rows: Vec<_> = rows.collect();
        if rows.is_empty() {
            return Ok(None);
        }
        let title = format!("{}, {}: in-between frames as shown", self.scene, self.method);
        Ok(Some(contact_sheet(&title, &rows)?))
    }
}

fn save(picture: &tiny_skia::Pixmap, path: &Path) -> anyhow::Result<()> {
    picture.save_png(path).with_context(|| format!("writing {}", path.display()))
}

fn without_alpha(rgba: &[u8]) -> Vec<u8> {
    rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// What the in-between frames have of the truth.
struct Compared {
    /// Decibels of every in-between frame that has a truth.
    db: Vec<f64>,
    /// Of so many rows one was compared.
    row_step: Option<u32>,
}

impl Compared {
    /// Those that fell on a refresh of the rehearsal, or else those kept for the sheet, all of
    /// whose rows there are and whose truth is rendered for it.
    fn new(seen: &Seen, rehearsal: &Rehearsal) -> Self {
        let is_made = |shown: &&Shown| shown.kind == OutputKind::Synthesised;
        let on_grid = seen.frames.iter().filter(is_made).filter_map(|shown| shown.psnr_rgb_db);
        let (mut db, mut row_step) = (on_grid.collect::<Vec<_>>(), ROW_STEP);
        if db.is_empty() {
            row_step = 1;
            db.extend(seen.kept.iter().map(|kept| {
                let truth = rehearsal.render_truth(kept.shown.content_ns);
                psnr_rgb_db(&kept.rgba, &without_alpha(&truth))
            }));
        }
        let row_step = (!db.is_empty()).then_some(row_step);
        Self { db, row_step }
    }
}

fn changed_real_frames(seen: &Seen) -> u64 {
    let is_changed = |shown: &&Shown| {
        shown.kind == OutputKind::Real && shown.psnr_rgb_db.is_some_and(|db| db < 100.0)
    };
    seen.frames.iter().filter(is_changed).count() as u64
}

/// None of nothing.
fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// A number with its unit, for people.
fn or_none(value: Option<f64>, digits: usize, unit: &str) -> String {
    value.map_or_else(|| "none".to_owned(), |value| format!("{value:.digits$}{unit}"))
}

fn ratio(part: u64, whole: u64) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

fn median_ms(spans: &[MonoSpan]) -> Option<f64> {
    let mut sorted = spans.to_vec();
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).map(|span| span.as_ms_f64())
}

#[cfg(test)]
mod tests {
    use super::*;
    use foreframe_engine::MonoTime;
    use foreframe_engine::backend::choice::BackendChoice;

    fn settings(out: &Path) -> Settings {
        Settings {
            scene: foreframe_fixtures::SceneInfo::by_name("static").unwrap(),
            size: foreframe_fixtures::Size::new(32, 18),
            seconds: 0.1,
            key_rate_hz: 40.0,
            refresh_hz: 120.0,
            backend: BackendChoice::Cpu,
            method: foreframe_engine::Method::Linear,
            sink: SinkSpec::Shm,
            window: foreframed::sink::window::WindowOptions::default(),
            hud: foreframed::hud::HudView::Off,
            out: out.to_owned(),
        }
    }

    #[test]
    fn a_show_of_which_nothing_was_seen_has_no_numbers_and_no_old_pictures() {
        let folder = tempfile::tempdir().unwrap();
        for name in [CONTACT_SHEET, TIMELINE, NUMBERS, "mine.txt"] {
            fs::write(folder.path().join(name), "old").unwrap();
        }
        let settings = settings(folder.path());
        prepare(&settings.out, &settings.sink).unwrap();
        let rehearsal = Rehearsal::render(&settings, &crate::output::Output::new(true));
        let (submissions, seen) = (Submissions::default(), Seen::default());
        let mut summary = Summary::new(&settings, &rehearsal, &submissions, &seen);
        summary.write(&settings, &rehearsal, &submissions, &seen).unwrap();
        let names = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<_> = names.collect();
        names.sort();
        assert_eq!(names, ["mine.txt", NUMBERS]);
        let json = fs::read_to_string(folder.path().join(NUMBERS)).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        for number in ["psnr_rgb_db", "psnr_rgb_min_db", "content_judder", "synthesis_ms"] {
            assert!(json[number].is_null(), "{number}: {}", json[number]);
        }
        let text = summary.text();
        assert!(text.contains("none PSNR") && !text.contains(".png"), "{text}");
    }

    #[test]
    fn frames_of_an_earlier_sink_are_removed_and_those_of_this_one_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let frames = folder.path().join("frames");
        fs::create_dir(&frames).unwrap();
        for name in ["frame_000000.png", "frame_000361.png", "frame_7.png", "mine.png"] {
            fs::write(frames.join(name), "old").unwrap();
        }
        let sink = SinkSpec::Png(frames.clone());
        prepare(&folder.path().join("out"), &sink).unwrap();
        let names = fs::read_dir(&frames).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<_> = names.collect();
        names.sort();
        assert_eq!(names, ["frame_7.png", "mine.png"]);
        prepare(&folder.path().join("out"), &SinkSpec::Png(folder.path().join("none yet")))
            .unwrap();
        let settings = Settings { sink, ..settings(folder.path()) };
        let rehearsal = Rehearsal::render(&settings, &crate::output::Output::new(true));
        let summary =
            Summary::new(&settings, &rehearsal, &Submissions::default(), &Seen::default());
        let named = format!("png:{}", frames.display());
        assert!(summary.text().contains(&named), "{}", summary.text());
    }

    #[test]
    fn what_was_compared_is_told_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let settings = settings(folder.path());
        let rehearsal = Rehearsal::render(&settings, &crate::output::Output::new(true));
        let shown = Shown {
            kind: OutputKind::Synthesised,
            key_index: 0,
            phase: 0.4,
            content_ns: 10_000_000,
            present_at: MonoTime::ZERO,
            not_received: 0,
            psnr_rgb_db: None,
        };
        let kept = vec![Kept { shown, rgba: rehearsal.render_truth(shown.content_ns) }];
        let on_grid = Shown { psnr_rgb_db: Some(30.0), ..shown };
        for (frames, kept, expected) in [
            (
                vec![on_grid],
                kept.clone(),
                "30.0 dB PSNR on average, 30.0 dB at worst, 1 of 0 in-betweens compared, 1 row in 8",
            ),
            (
                vec![shown],
                kept,
                "100.0 dB PSNR on average, 100.0 dB at worst, 1 of 0 in-betweens compared, all rows",
            ),
            (
                vec![shown],
                Vec::new(),
                "none PSNR on average, none at worst, 0 of 0 in-betweens compared",
            ),
        ] {
            let seen = Seen { frames, kept };
            let summary = Summary::new(&settings, &rehearsal, &Submissions::default(), &seen);
            let text = summary.text();
            assert!(
                text.lines().any(|line| line == format!("error               {expected}")),
                "{text}"
            );
        }
    }

    #[test]
    fn a_refresh_without_a_new_picture_is_what_the_daemon_counted() {
        let folder = tempfile::tempdir().unwrap();
        let settings = settings(folder.path());
        let rehearsal = Rehearsal::render(&settings, &crate::output::Output::new(true));
        let kind = |repeated, dropped| {
            let summary =
                Summary::new(&settings, &rehearsal, &Submissions::default(), &Seen::default());
            Summary { repeated, dropped, ..summary }.unshown_kind()
        };
        assert_eq!(kind(0, 3), PresentKind::Dropped);
        assert_eq!(kind(3, 0), PresentKind::Repeated);
        assert_eq!(kind(3, 1), PresentKind::Repeated, "either way the one before was shown again");
    }
}
