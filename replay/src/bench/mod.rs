//! Times the engine on built-in scenes, beside plain copies of the bytes that it has to touch.
//!
//! A case is a scene, a size, a method and a backend. Its keys are rendered first; then each is
//! taken in and followed by its in-between frames, as a stream does, often enough for medians.
//! Between them the same threads copy as many bytes as a key and a frame have to move: what the
//! machine allows, measured in the same run, under the same load. `hold` is always among the
//! methods: the whole pipeline where nothing moves.

pub mod chart;
mod copy;
mod keys;
mod measure;
pub mod report;

use std::num::NonZeroUsize;
use std::sync::Arc;

use anyhow::Context as _;
use foreframe_engine::Method;
use foreframe_engine::backend::gpu::Gpu;
use foreframe_fixtures::{SceneInfo, Size};

use crate::output::Output;
use copy::PlainCopy;
use report::{Case, Report};

/// What makes the frames.
#[derive(Clone, Debug)]
pub struct Backend {
    /// `cpu`, or `gpu:` and the name of the adapter.
    pub name: String,
    /// None for the CPU.
    pub gpu: Option<Arc<Gpu>>,
}

/// What to time.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Scenes.
    pub scenes: Vec<&'static SceneInfo>,
    /// Sizes of colour.
    pub sizes: Vec<Size>,
    /// Methods, besides `hold`.
    pub methods: Vec<Method>,
    /// Backends.
    pub backends: Vec<Backend>,
    /// Threads of the engine and of the plain copy.
    pub threads: NonZeroUsize,
    /// Keys that are timed in each case.
    pub keys: NonZeroUsize,
    /// In-between frames after each key.
    pub frames: NonZeroUsize,
    /// Colour is this much larger per axis than depth and motion, 1 to 4.
    pub field_ratio: f64,
}

/// Runs every case, scene by scene and size by size.
///
/// # Errors
/// If the system gives no threads, or the engine refuses its keys.
pub fn run(settings: &Settings, output: &Output) -> anyhow::Result<Report> {
    let methods = with_hold(&settings.methods);
    let keys = settings.scenes.len() * settings.sizes.len();
    let progress =
        output.progress("timing", (keys * settings.backends.len() * methods.len()) as u64);
    let mut cases = Vec::new();
    for scene in &settings.scenes {
        for &size in &settings.sizes {
            progress.set_message(format!("rendering {} {size}", scene.name));
            let keys = keys::RenderedKeys::render(scene, size, settings.field_ratio);
            let bytes = keys.bytes();
            let mut copy = PlainCopy::new(settings.threads, bytes.key().max(bytes.frame()) / 2)?;
            for backend in &settings.backends {
                for &method in &methods {
                    progress.set_message(format!("timing {} {size} {method}", scene.name));
                    let times = measure::time_case(&keys, method, backend, settings, &mut copy)
                        .with_context(|| format!("timing {}", scene.name))?;
                    cases.push(Case::new(scene.name, size, method, &backend.name, &bytes, &times));
                    progress.inc(1);
                }
            }
        }
    }
    progress.finish_and_clear();
    Ok(Report::new(settings, cases))
}

/// `hold` first, then the others.
fn with_hold(methods: &[Method]) -> Vec<Method> {
    let others = methods.iter().copied().filter(|&method| method != Method::Hold);
    std::iter::once(Method::Hold).chain(others).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_has_one_result_per_case_and_each_was_timed_beside_a_copy() {
        let count = |n| NonZeroUsize::new(n).unwrap();
        let settings = Settings {
            scenes: vec![SceneInfo::by_name("pan").unwrap()],
            sizes: vec![Size::new(32, 18), Size::new(48, 26)],
            methods: vec![Method::Linear, Method::Hold],
            backends: vec![Backend { name: "cpu".to_owned(), gpu: None }],
            threads: count(2),
            keys: count(3),
            frames: count(2),
            field_ratio: 2.0,
        };
        let report = run(&settings, &Output::new(true)).unwrap();
        let cases = report.results.iter().map(|case| (case.method, case.width));
        let cases: Vec<_> = cases.collect();
        assert_eq!(cases, [("hold", 32), ("linear", 32), ("hold", 48), ("linear", 48)]);
        for case in &report.results {
            for ms in [case.ms_per_key, case.ms_per_frame, case.copy_ms, case.key_copy_ms] {
                assert!(ms.is_finite() && ms > 0.0, "{case:?}");
            }
        }
    }
}
