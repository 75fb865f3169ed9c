//! Times the engine on built-in scenes, beside plain copies of the bytes that it has to touch.
//!
//! A case is a scene, a size, a method and a number of threads. Its keys are rendered first; then
//! each is taken in and followed by its in-between frames, as a stream does, often enough for
//! medians. Between them the same threads copy as many bytes as a key and a frame have to move:
//! what the machine allows, measured in the same run, under the same load.

mod keys;
mod measure;
pub mod report;

use std::num::NonZeroUsize;

use anyhow::Context as _;
use foreframe_engine::Method;
use foreframe_fixtures::{SceneInfo, Size};

use crate::output::Output;
use report::{CaseReport, Report};

/// What to time.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Scenes.
    pub scenes: Vec<&'static SceneInfo>,
    /// Sizes of colour.
    pub sizes: Vec<Size>,
    /// Methods.
    pub methods: Vec<Method>,
    /// Threads of the engine and of the plain copy.
    pub threads: NonZeroUsize,
    /// Keys that are timed in each case.
    pub keys: NonZeroUsize,
    /// In-between frames after each key.
    pub frames: NonZeroUsize,
    /// Colour is this much larger per axis than depth and motion, 1 to 4.
    pub field_ratio: f64,
}

/// Runs every case, smallest size first.
///
/// # Errors
/// If the system gives no threads, or the engine refuses its keys.
pub fn run(settings: &Settings, output: &Output) -> anyhow::Result<Report> {
    let cases = settings.scenes.len() * settings.sizes.len() * settings.methods.len();
    let progress = output.progress("timing", cases as u64);
    let mut reports = Vec::new();
    for scene in &settings.scenes {
        for size in &settings.sizes {
            let keys = keys::RenderedKeys::render(scene, *size, settings.field_ratio);
            for method in &settings.methods {
                progress.set_message(format!(
                    "timing {} {}x{} {method}",
                    scene.name, size.width, size.height
                ));
                let times = measure::time_case(&keys, *method, settings)
                    .with_context(|| format!("timing {}", scene.name))?;
                reports.push(CaseReport::new(scene.name, *size, *method, &keys.bytes(), &times));
                progress.inc(1);
            }
        }
    }
    progress.finish_and_clear();
    Ok(Report::new(settings, reports))
}
