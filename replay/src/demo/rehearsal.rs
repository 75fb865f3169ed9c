//! Everything that is rendered before the clock starts: keys, and the truth at every refresh.

use foreframe_fixtures::{Recipe, RenderedKey, Renderer};

use super::Settings;
use crate::output::Output;

/// The truth of so many frames is kept, 1.1 GB at 1280x720; later ones are not compared.
const MOST_TRUTHS: u64 = 400;
const NS_PER_S: f64 = 1e9;

/// Keys, truth, and the means to render more of it.
#[derive(Debug)]
pub struct Rehearsal {
    /// The keys, depth and motion at half the resolution of colour per axis.
    pub keys: Vec<RenderedKey>,
    /// Content time from one key to the next.
    pub key_interval_ns: u64,
    /// Red, green, blue of the truth at every refresh, counted from the first key.
    truth: Vec<Vec<u8>>,
    truth_interval_ns: u64,
    renderer: Renderer,
    recipe: Recipe,
}

impl Rehearsal {
    /// Renders keys and truth.
    #[must_use]
    pub fn render(settings: &Settings, output: &Output) -> Self {
        let key_interval_ns = nanoseconds(NS_PER_S / settings.key_rate_hz);
        let truth_interval_ns = nanoseconds(NS_PER_S / settings.refresh_hz);
        let duration_ns = nanoseconds(settings.seconds * NS_PER_S);
        let keys = (duration_ns / key_interval_ns).max(2);
        let truths = (keys * key_interval_ns / truth_interval_ns).min(MOST_TRUTHS);
        let bar = output.progress("rendering", keys + truths);
        let mut rehearsal = Self {
            keys: Vec::new(),
            key_interval_ns,
            truth: Vec::new(),
            truth_interval_ns,
            renderer: Renderer::new((settings.scene.build)()),
            recipe: Recipe::new(settings.size),
        };
        for index in 0..keys {
            let time = rehearsal.scene_time(index * key_interval_ns);
            let motion_from = time - rehearsal.scene_time(0);
            let key =
                RenderedKey::render(&rehearsal.renderer, &rehearsal.recipe, time, motion_from);
            rehearsal.keys.push(key);
            bar.inc(1);
        }
        for index in 0..truths {
            let content_ns = index * truth_interval_ns;
            let rendered = rehearsal.key_at(content_ns).map(|key| rgb(&key.color.rgba));
            let truth = rendered.unwrap_or_else(|| rgb(&rehearsal.render_truth(content_ns)));
            rehearsal.truth.push(truth);
            bar.inc(1);
        }
        bar.finish_and_clear();
        rehearsal
    }

    /// Time in the scene, in seconds, of `content_ns` after the first key. The scene has run for
    /// one key interval by then, so that the first key, too, has motion behind it.
    #[expect(clippy::cast_precision_loss, reason = "a show lasts seconds, far below 2^53 ns")]
    fn scene_time(&self, content_ns: u64) -> f64 {
        (content_ns + self.key_interval_ns) as f64 / NS_PER_S
    }

    /// The key that shows `content_ns` after the first, within a few nanoseconds of rounding.
    fn key_at(&self, content_ns: u64) -> Option<&RenderedKey> {
        let index = (content_ns + self.key_interval_ns / 2) / self.key_interval_ns;
        let is_same = content_ns.abs_diff(index * self.key_interval_ns) < 1000;
        is_same.then(|| self.keys.get(usize::try_from(index).ok()?)).flatten()
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
        let time = self.scene_time(content_ns);
        self.renderer.color(time, self.recipe.size, self.recipe.sampling).rgba
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
