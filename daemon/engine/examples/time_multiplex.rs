//! Prints what multiplexing adds to a key in full and to a reduced one.
//!
//! Usage: `cargo run --release -p foreframe-engine --example time_multiplex [-- THREADS]`
//!
//! Keys of 1024x1024 rgba8 in turn with keys of half the columns and rows: flat patches with
//! texture on them, and noise, most of which clips.

use std::num::NonZeroUsize;
use std::time::Instant;

use foreframe_engine::color::Rgba8;
use foreframe_engine::finish::FinishConfig;
use foreframe_engine::format::ValidRectUse;
use foreframe_engine::key::KeyFrame;
use foreframe_engine::multiplex::Multiplex;
use foreframe_engine::{ColorPlane, Plane, Rect, StreamFormat};

const SIZE: u32 = 1024;
const ROUNDS: usize = 41;

#[expect(clippy::disallowed_methods, reason = "an example that measures has to read a clock")]
fn timed(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64() * 1e3
}

fn picture(is_noise: bool) -> ColorPlane {
    let mix = |a: u32, b: u32| {
        let h = (a.wrapping_mul(0x9e37_79b1) ^ b).wrapping_mul(0x85eb_ca77);
        (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d) >> 7
    };
    let pixel = |x: u32, y: u32| {
        let patch = mix(x / 90, y / 70) & 0x7f_7f_7f;
        let texture = Rgba8(patch + 0x20_20_20 + (mix(x, y) & 0x0f_0f_0f));
        if is_noise { Rgba8(mix(x, y)) } else { texture }
    };
    let pixels = (0..SIZE * SIZE).map(|i| pixel(i % SIZE, i / SIZE)).collect();
    ColorPlane::Rgba8(Plane::from_vec(SIZE, SIZE, pixels))
}

fn main() {
    let threads = std::env::args().nth(1).and_then(|threads| threads.parse().ok());
    let threads: NonZeroUsize = threads.unwrap_or(NonZeroUsize::MIN.saturating_add(1));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build();
    let pool = pool.expect("a machine that runs this starts some threads more");
    let part = Rect::full(SIZE / 2, SIZE / 2);
    let format =
        StreamFormat { valid_rect_use: ValidRectUse::Multiplex, ..StreamFormat::rgba8(SIZE, SIZE) };
    println!("threads {threads}; {SIZE}x{SIZE} rgba8, ms: median and minimum");
    for (name, is_noise) in [("texture", false), ("noise", true)] {
        let full = picture(is_noise);
        let multiplex = Multiplex::new(&format, &FinishConfig::default());
        let mut multiplex = multiplex.expect("the stream multiplexes");
        let mut times = [Vec::new(), Vec::new()];
        let mut older = KeyFrame::default();
        for index in 0..2 * ROUNDS {
            let mut key = KeyFrame { color: full.clone(), ..KeyFrame::default() };
            let is_full = !index.is_multiple_of(2);
            let reduced = (!is_full).then_some((&full, part));
            times[usize::from(is_full)].push(timed(|| {
                pool.install(|| multiplex.take_key(&pool, reduced, Some(&older), &mut key));
            }));
            older = key;
        }
        for (kind, mut times) in ["reduced", "full"].into_iter().zip(times) {
            times.sort_by(f64::total_cmp);
            println!("{name:8} {kind:8} {:6.3} {:6.3}", times[times.len() / 2], times[0]);
        }
    }
}
