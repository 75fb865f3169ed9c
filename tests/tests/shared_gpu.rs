//! Several streams on one GPU adapter: each has its share of it. Counts alone are compared, not
//! times: how many pictures one stream gets while another gets so many.

mod rendered;

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Barrier, Mutex, PoisonError};
use std::thread;

use foreframe_engine::backend::gpu::Gpu;
use foreframe_engine::backend::gpu::test_adapters::test_gpus;
use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method, MonoTime};
use foreframe_fixtures::{SCENES, Size};
use rendered::{INTERVAL, Rendered};

const SMALL: Size = Size { width: 96, height: 54 };
const LARGE: Size = Size { width: 640, height: 360 };

/// Software adapters all work on the same few cores: one test has them at a time.
static CORES: Mutex<()> = Mutex::new(());

/// Says that it is over when its thread ends, however that ends.
struct Ending<'a>(&'a AtomicBool);

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// An engine on `gpu` that has taken in two keys.
fn engine_with_keys(gpu: &Arc<Gpu>, size: Size) -> Engine {
    let rendered = Rendered::new(&SCENES[0], size, [2.0; 2], 2);
    let config = EngineConfig::new(Method::Linear, NonZeroUsize::MIN);
    let mut engine = Engine::new(rendered.format, config);
    engine.use_gpu(gpu);
    for key in 0..2 {
        let content_time = MonoTime::ZERO + INTERVAL.scale(key + 1, 1);
        rendered.with_input(key as usize, content_time, |input| {
            engine.push_key(input).expect("the key is as declared");
        });
    }
    engine
}

/// How many pictures each of two streams gets until the second has `enough`, and how many the other
/// one got meanwhile, picture by picture.
fn pictures(gpu: &Arc<Gpu>, sizes: [Size; 2], enough: u32) -> ([u32; 2], [Vec<u32>; 2]) {
    let counts = [0, 0].map(AtomicU32::new);
    let meanwhile: [Mutex<Vec<u32>>; 2] = Default::default();
    let is_over = AtomicBool::new(false);
    let start = Barrier::new(2);
    let _alone = CORES.lock().unwrap_or_else(PoisonError::into_inner);
    // Whoever comes to the barrier has nothing left to fail at before it.
    let engines = sizes.map(|size| engine_with_keys(gpu, size));
    thread::scope(|scope| {
        for (index, mut engine) in engines.into_iter().enumerate() {
            let (counts, meanwhile, is_over, start) = (&counts, &meanwhile, &is_over, &start);
            scope.spawn(move || {
                let _ending = Ending(is_over);
                let mut picture = ColorPlane::default();
                start.wait();
                let mut phase = 0;
                while !is_over.load(Ordering::Relaxed) {
                    phase = phase % 60 + 1;
                    let shown_at = MonoTime::ZERO + INTERVAL.scale(120 + phase, 60);
                    let before = counts[1 - index].load(Ordering::Relaxed);
                    engine.synthesise(shown_at, &mut picture).expect("a key was taken in");
                    let others = counts[1 - index].load(Ordering::Relaxed) - before;
                    meanwhile[index].lock().expect("nobody failed with it").push(others);
                    let count = counts[index].fetch_add(1, Ordering::Relaxed) + 1;
                    if index == 1 && count == enough {
                        is_over.store(true, Ordering::Relaxed);
                    }
                }
                assert_eq!(engine.backend().fell_back, None);
                assert_eq!(engine.backend().name, format!("gpu:{}", gpu.name()));
            });
        }
    });
    let lists = meanwhile.map(|list| list.into_inner().expect("nobody failed with it"));
    (counts.map(AtomicU32::into_inner), lists)
}

#[test]
fn equal_streams_on_one_adapter_take_turns() {
    for gpu in test_gpus("equal_streams_on_one_adapter_take_turns") {
        let (_, meanwhile) = pictures(&gpu, [SMALL; 2], 90);
        // Alone on two cores it is one for one; beside other work a thread does not always run when
        // its picture is there, and sums over a run say little.
        for mut others in meanwhile {
            others.sort_unstable();
            assert!(!others.is_empty(), "a stream got no picture on {}", gpu.name());
            let median = others[others.len() / 2];
            assert!(median <= 8, "{median} pictures of the other for one on {}", gpu.name());
        }
    }
}

#[test]
fn a_large_stream_leaves_a_small_one_at_least_as_many_pictures_as_it_gets() {
    for gpu in test_gpus("a_large_stream_leaves_a_small_one_at_least_as_many_pictures_as_it_gets") {
        let ([small, large], _) = pictures(&gpu, [SMALL, LARGE], 40);
        assert!(small >= large, "{small} beside {large} on {}", gpu.name());
    }
}
