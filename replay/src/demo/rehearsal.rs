//! Everything that is rendered before the clock starts: keys, and the truth at every refresh.

use foreframe_fixtures::{Footage, FootageOptions, Renderer, Sampling};

use super::Settings;
use crate::output::Output;

/// Depth and motion at half the resolution of colour per axis: what an application should send.
const FIELD_RATIO: f64 = 2.0;
/// The truth of so many frames is kept, 1.1 GB at 1280x720; later ones are not compared.
const MOST_TRUTHS: u64 = 400;
const NS_PER_S: f64 = 1e9;

/// Keys, truth, and the means to render more of it.
#[derive(Debug)]
pub struct Rehearsal {
    /// The keys.
    pub footage: Footage,
    /// Red, green, blue of the truth at every refresh, counted from the first key.
    truth: Vec<Vec<u8>>,
    truth_interval_ns: u64,
    renderer: Renderer,
}

impl Rehearsal {
    /// Renders keys and truth.
    #[must_use]
    pub fn render(settings: &Settings, output: &Output) -> Self {
        let key_interval_ns = nanoseconds(NS_PER_S / settings.key_rate_hz);
        let truth_interval_ns = nanoseconds(NS_PER_S / settings.refresh_hz);
        let duration_ns = nanoseconds(settings.seconds * NS_PER_S);
        let keys = (duration_ns / key_interval_ns).max(2);
        let options = FootageOptions {
            size: settings.size,
            field_ratio: FIELD_RATIO,
            key_interval_ns,
            keys: u32::try_from(keys).unwrap_or(u32::MAX),
            sampling: Sampling::Four,
        };
        let truths = (keys * key_interval_ns / truth_interval_ns).min(MOST_TRUTHS);
        let bar = output.progress("rendering", keys + truths);
        let renderer = Renderer::new((settings.scene.build)());
        let footage = options.render(&renderer, || bar.inc(1));
        let truth = (0..truths).map(|index| {
            bar.inc(1);
            rgb(&options.truth(&renderer, index * truth_interval_ns).rgba)
        });
        let truth = truth.collect();
        bar.finish_and_clear();
        Self { footage, truth, truth_interval_ns, renderer }
    }

    /// Red, green, blue of the truth at `content_ns` after the first key, if it was rendered. Times
    /// within 1/64 of a refresh interval of a rendered one count as the same.
    #[must_use]
    pub fn rendered_truth(&self, content_ns: u64) -> Option<&[u8]> {
        let interval = self.truth_interval_ns;
        let index = (content_ns + interval / 2) / interval;
        let off = content_ns.abs_diff(index * interval);
        let at = usize::try_from(index).ok()?;
        (off <= interval / 64).then(|| self.truth.get(at).map(Vec::as_slice)).flatten()
    }

    /// Red, green, blue, alpha of the truth at `content_ns` after the first key, rendered now.
    #[must_use]
    pub fn render_truth(&self, content_ns: u64) -> Vec<u8> {
        self.footage.options.truth(&self.renderer, content_ns).rgba
    }
}

#[expect(clippy::cast_possible_truncation, reason = "float to int casts saturate")]
#[expect(clippy::cast_sign_loss, reason = "float to int casts saturate")]
fn nanoseconds(value: f64) -> u64 {
    value.round().max(1.0) as u64
}

fn rgb(rgba: &[u8]) -> Vec<u8> {
    rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}
