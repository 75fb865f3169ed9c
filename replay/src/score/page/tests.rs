//! The page without a browser, then in one.

use foreframe_engine::{Method, MonoTime};
use std::num::NonZeroUsize;

use super::*;
use crate::draw::palette::HUES;
use crate::html::browser::in_browser;
use crate::recording::memory::MemoryRecording;
use crate::score::run::{ScoreOptions, score_recording};

fn report() -> Report {
    let options = ScoreOptions {
        methods: vec![Method::Hold, Method::Linear],
        ratio: NonZeroUsize::new(4).unwrap(),
        backends: vec![None],
        threads: NonZeroUsize::MIN,
        timer: || MonoTime::ZERO,
        retina: false,
        finish: foreframe_engine::FinishConfig::default(),
        kept_frames: 3,
        late_camera: false,
    };
    let score = |name: &str| {
        let mut recording = MemoryRecording::moving_patch(13, [3, 1], &[4]);
        score_recording(name, &mut recording, &options, || {}).unwrap()
    };
    Report::new(1, vec![score("first"), score("second")])
}

#[test]
fn the_page_needs_nothing_from_elsewhere_and_says_what_it_leaves_out() {
    let html = page(&report()).unwrap();
    for outside in ["src=\"http", "href=", "@import", "fetch("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.contains("6 of 18 predicted frames are here"), "what is left out is said");
    // Two captures, each with its error over time and its tile classes.
    assert_eq!(html.matches("error over time").count(), 2);
    assert_eq!(html.matches("4x4 tiles by PSNR_Y").count(), 2);
    assert_eq!(
        html.matches("data:image/png").count(),
        2 * 3 * 5,
        "a truth, and of two methods each a picture and a map"
    );
    // The clock of this test stands still: without times there is no chart, and the page says so.
    assert!(html.contains("No chart:"), "{}", &html[..2000]);
}

#[test]
fn frames_are_kept_for_few_captures_more_than_for_many() {
    assert_eq!([1, 2, 100].map(|captures| frames_to_keep(captures, 11)), [6, 4, 2]);
    assert_eq!(frames_to_keep(0, 0), 6);
}

/// What the viewer says and the colours of a pixel inside the patch after `keys` were pressed; a
/// number moves the slider there instead.
fn after_keys(keys: &[&str]) -> Option<(String, [u8; 3])> {
    // Pixel (30, 24) of every picture; each key is pressed when the one before has been drawn.
    let script = format!(
        "(async () => {{
          const canvas = document.querySelector('.flip canvas');
          const drawn = async (before) => {{
            while (!canvas.dataset.shown || canvas.dataset.shown === before)
              await new Promise((resolve) => setTimeout(resolve, 1));
          }};
          await drawn();
          for (const key of {}) {{
            const before = canvas.dataset.shown;
            const slider = document.querySelector('.flip [name=frame]');
            if (Number.isNaN(parseInt(key))) {{
              document.dispatchEvent(new KeyboardEvent('keydown', {{ key, bubbles: true }}));
            }} else {{
              slider.value = key;
              slider.dispatchEvent(new Event('input', {{ bubbles: true }}));
            }}
            await drawn(before);
          }}
          const pixel = canvas.getContext('2d').getImageData(30, 24, 1, 1).data;
          document.body.innerHTML = `<pre id=found>${{canvas.dataset.shown}}|${{pixel.slice(0, 3)}}</pre>`;
        }})();",
        serde_json::to_string(keys).unwrap()
    );
    let dom = in_browser("the flip viewer", &page(&report()).unwrap(), &script)?;
    let found = dom.split("<pre id=\"found\">").nth(1).and_then(|rest| rest.split("</pre>").next());
    let (shown, pixel) = found.expect("the script ends within its budget").split_once('|').unwrap();
    let pixel: Vec<u8> = pixel.split(',').map(|level| level.parse().unwrap()).collect();
    Some((shown.to_owned(), pixel.try_into().unwrap()))
}

#[test]
fn keys_flip_between_truth_prediction_error_and_rungs_of_every_frame_and_method() {
    let report = report();
    let at = |picture: &Srgb8| picture.at(30, 24);
    let flip = &report.captures[0].flips[0];
    let Some((shown, pixel)) = after_keys(&[]) else { return };
    assert_eq!(shown, format!("first, frame {}: hold, predicted", flip.frame));
    assert_eq!(pixel, at(&flip.shown[0]));
    assert_ne!(at(&flip.shown[0]), at(&flip.truth), "the patch has moved on by then");

    let (shown, pixel) = after_keys(&[" "]).unwrap();
    assert_eq!((shown.as_str(), pixel), ("first, frame 2: truth", at(&flip.truth)));

    let (shown, pixel) = after_keys(&["e"]).unwrap();
    let worst = (0..3).map(|c| at(&flip.shown[0])[c].abs_diff(at(&flip.truth)[c])).max().unwrap();
    assert_eq!(shown, "first, frame 2: hold, error");
    assert_eq!(pixel, heat(worst.saturating_mul(4)));

    let grey = |[red, green, blue]: Rgb| {
        let [red, green, blue] = [red, green, blue].map(u32::from);
        (red + 2 * green + blue) >> 2
    };
    let truth = grey(at(&flip.truth));
    let (shown, pixel) = after_keys(&["r"]).unwrap();
    assert_eq!(shown, "first, frame 2: hold, rung map");
    assert_eq!(pixel.map(u32::from), [truth; 3], "what is held has no colour");
    let (shown, pixel) = after_keys(&["r", "ArrowDown"]).unwrap();
    assert_eq!(shown, "first, frame 2: linear, rung map");
    assert_eq!(pixel.map(u32::from), HUES[0].map(|hue| (176 * u32::from(hue) + 80 * truth) >> 8));
    let (shown, _) = after_keys(&["r", "2"]).unwrap();
    assert_eq!(shown, "first, frame 10: hold, rung map", "the slider keeps the view");
    let (shown, _) = after_keys(&["r", "r"]).unwrap();
    assert_eq!(shown, "first, frame 2: hold, predicted");

    let (shown, pixel) = after_keys(&["c", "ArrowRight", "ArrowRight", "ArrowDown"]).unwrap();
    let last = &report.captures[1].flips[2];
    assert_eq!(shown, format!("second, frame {}: linear, predicted", last.frame));
    assert_eq!(pixel, at(&last.shown[1]));
}
