//! Prints what finishing adds to a picture, and what the gate of flicker costs.
//!
//! Usage: `cargo run --release -p foreframe-engine --example time_finish [-- THREADS]`
//!
//! Pictures of 1024x1024 rgba8: flat patches with texture on them, and noise, which is the worst
//! there is for tables. Three frames share the light of a key, of which all is blurred, or what is
//! selected where a twentieth of the picture moves over the rest. The gate is all in the tables:
//! with it the same kernels run, and what it costs is making the tables of a stream, once.

use std::num::NonZeroUsize;
use std::time::Instant;

use foreframe_engine::color::Rgba8;
use foreframe_engine::field::FieldMap;
use foreframe_engine::finish::{Finish, FinishConfig, FinishMode, Part};
use foreframe_engine::key::{KeyFrame, Velocity};
use foreframe_engine::{ColorPlane, MonoSpan, Phase, Plane, Rect, StreamFormat};
use foreframe_perception::display::DisplayProfile;

const SIZE: u32 = 1024;
const ROUNDS: usize = 60;

#[expect(clippy::disallowed_methods, reason = "an example that measures has to read a clock")]
fn timed(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64() * 1e3
}

fn picture(is_noise: bool) -> ColorPlane {
    let pixel = |x: u32, y: u32| {
        let mix = |a: u32, b: u32| {
            let h = (a.wrapping_mul(0x9e37_79b1) ^ b).wrapping_mul(0x85eb_ca77);
            (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d) >> 7
        };
        if is_noise {
            return Rgba8(mix(x, y));
        }
        let patch = mix(x / 90, y / 70) & 0x7f_7f_7f;
        Rgba8(patch + 0x20_20_20 + (mix(x, y) & 0x0f_0f_0f))
    };
    let pixels = (0..SIZE * SIZE).map(|i| pixel(i % SIZE, i / SIZE)).collect();
    ColorPlane::Rgba8(Plane::from_vec(SIZE, SIZE, pixels))
}

/// A key of `picture` in which a patch of 230x230 pixels moves by 12, with a field of half its
/// size.
fn patch(picture: &ColorPlane) -> (KeyFrame, FieldMap) {
    let cells = SIZE / 2;
    let inside = |cell: u32| (200..315).contains(&cell);
    let velocity = (0..cells * cells).map(|i| match (inside(i % cells), inside(i / cells)) {
        (true, true) => Velocity { x: 12 * 32, y: 0 },
        _ => Velocity::default(),
    });
    let valid = Rect::full(SIZE, SIZE);
    let velocity = Plane::from_vec(cells, cells, velocity.collect());
    let mut map = FieldMap::default();
    map.update(valid, [cells; 2], [0; 2]);
    (KeyFrame { color: picture.clone(), valid, velocity, ..KeyFrame::default() }, map)
}

fn median(mut times: Vec<f64>) -> [f64; 2] {
    times.sort_by(f64::total_cmp);
    [times[times.len() / 2], times[0]]
}

fn main() {
    let threads = std::env::args().nth(1).and_then(|threads| threads.parse().ok());
    let threads: NonZeroUsize = threads.unwrap_or(NonZeroUsize::MIN.saturating_add(1));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build();
    let pool = pool.expect("a machine that runs this starts some threads more");
    let profile = DisplayProfile::builtin("asus-pg279q").expect("a profile that is built in");
    let valid = Rect::full(SIZE, SIZE);
    println!("threads {threads}; {SIZE}x{SIZE} rgba8, ms: median and minimum");
    for mode in [FinishMode::On, FinishMode::Auto] {
        let config = FinishConfig::new(mode, Some(&profile), MonoSpan::from_hz(120.0));
        let format = StreamFormat::rgba8(SIZE, SIZE);
        let mut first = Vec::new();
        for _ in 0..9 {
            let small = Rect::full(8, 8);
            let mut out = picture(false);
            first.push(timed(|| {
                let mut finish = Finish::new(&format, &config, Some(56.0)).expect("it is not off");
                pool.install(|| finish.apply(&pool, Part::Key { frames: 3 }, small, &mut out));
            }));
        }
        let [middle, least] = median(first);
        println!("{mode:5} tables, once per stream  {middle:6.3} {least:6.3}");
        for (name, is_noise, is_whole) in [
            ("texture", false, true),
            ("noise", true, true),
            ("texture, selected", false, false),
            ("noise, selected", true, false),
        ] {
            let original = picture(is_noise);
            let config = config.whole(is_whole);
            let mut finish = Finish::new(&format, &config, Some(56.0)).expect("it is not off");
            let (key, map) = patch(&original);
            let mut times = Vec::new();
            for _ in 0..ROUNDS {
                times.push(timed(|| {
                    pool.install(|| finish.take_key(&pool, &key, None, &map, None));
                }));
            }
            if !is_whole {
                let [middle, least] = median(times);
                println!("{mode:5} {name:17} selection  {middle:6.3} {least:6.3}");
            }
            let mut out = original.clone();
            let mut mean = [0.0; 2];
            for (part, share) in
                [(Part::Key { frames: 3 }, 1.0), (Part::InBetween { frames: 3 }, 2.0)]
            {
                let mut times = Vec::new();
                for _ in 0..ROUNDS {
                    out.copy_from(&original);
                    times.push(timed(|| {
                        pool.install(|| {
                            finish.turn_to(Phase::from_f64(0.33), 0);
                            finish.apply(&pool, part, valid, &mut out);
                        });
                    }));
                }
                let times = median(times);
                mean = [0, 1].map(|i| mean[i] + share * times[i] / 3.0);
                let [middle, least] = times;
                println!("{mode:5} {name:17} {part:?}  {middle:6.3} {least:6.3}");
            }
            let [middle, least] = mean;
            println!("{mode:5} {name:17} mean of three frames  {middle:6.3} {least:6.3}");
        }
    }
}
