//! Windows that a GPU adapter draws, on a compositor that does what it is told. The adapter is one
//! that needs no GPU; without it these tests say so and do nothing (TESTING.md).

#![expect(clippy::unwrap_used, reason = "a child that cannot go on fails its test")]

mod daemon_fixture;
mod rendered;
mod scripted;

use std::io::Read as _;
use std::num::NonZeroUsize;
use std::process::{Command, Stdio};
use std::sync::Arc;

use daemon_fixture::child::{BACKEND, LAYOUT, lavapipe, run_if_asked, swiftshader};
use foreframe_engine::backend::gpu::{Gpu, adapters};
use foreframe_engine::{ColorPlane, Engine, EngineConfig, Method, MonoTime, StreamFormat};
use foreframe_fixtures::{SCENES, Size};
use foreframe_protocol::{DaemonMessage, Presented};
use foreframed::clock;
use foreframed::sink::window::{Window, WindowConfig, WindowEvent, WindowOptions, WindowSystem};
use foreframed::stream::core::Told;
use rendered::{INTERVAL, Rendered};
use scripted::stage::{BLACK, KEY, KEY_SEEN, PATIENCE, Stage};
use scripted::{Order, Script, Scripted, Seen};

/// What a child with a window of its own does.
const PART: &str = "FOREFRAME_TEST_PART";
const WAY: &str = "way=\"a surface of llvmpipe";

#[test]
fn child_process() {
    run_if_asked();
    match std::env::var(PART).as_deref() {
        Ok("lose") => lose_the_device(),
        Ok("keep") => show_kept_pictures(),
        Ok("again") => lose_the_surface(),
        _ => {}
    }
}

fn stage(script: Script, more: &[(&'static str, &str)]) -> Option<Stage> {
    let backend = lavapipe()?;
    let mut environment = vec![(BACKEND, backend)];
    environment.extend(more);
    Some(Stage::set_with(script, &environment))
}

/// Ends the stream. It was drawn by the adapter all the time.
fn strike(mut stage: Stage) {
    stage.strike();
    let log = stage.log();
    assert!(log.contains(WAY) && !log.contains("another way"), "{log}");
}

#[test]
fn frames_of_a_surface_are_shown_and_told_of() {
    let Some(mut stage) = stage(Script::GOOD, &[]) else { return };
    let shown = stage.show_until(|shown, _| shown.len() > 60);
    assert!(shown.iter().any(|it| it.presented_at_ns != it.present_at_ns), "{shown:?}");
    let seen = stage.compositor.seen();
    assert!(seen.iter().any(|it| it.middle == KEY_SEEN), "{seen:?}");
    assert!(!stage.log().contains("another pacing"), "{}", stage.log());
    strike(stage);
}

#[test]
fn a_surface_keeps_the_shape_of_the_picture_in_a_window_of_any_size_and_scale() {
    let Some(mut stage) = stage(Script::GOOD, &[]) else { return };
    let is_so = |seen: &[Seen], destination, buffer| {
        seen.iter().any(|it| {
            (it.destination, it.buffer, it.scale) == (Some(destination), buffer, 1)
                && (it.corner, it.middle) == (BLACK, KEY_SEEN)
        })
    };
    stage.compositor.order(Order::Resize([300, 300]));
    stage.show_until_seen(|seen| is_so(seen, [300, 300], [64, 64]));
    // With bars alone it would be 64x2400.
    stage.compositor.order(Order::Resize([16, 600]));
    stage.show_until_seen(|seen| is_so(seen, [16, 600], [16, 600]));
    stage.compositor.order(Order::Scale(2));
    stage.compositor.order(Order::Resize([400, 100]));
    stage.show_until_seen(|seen| is_so(seen, [400, 100], [128, 32]));
    strike(stage);
}

#[test]
fn where_nobody_stretches_buffers_a_surface_has_the_pixels_of_the_window() {
    let script = Script { has_viewporter: false, ..Script::GOOD };
    let Some(mut stage) = stage(script, &[]) else { return };
    let is_so = |seen: &[Seen], buffer, scale| {
        let is_drawn = |it: &Seen| (it.corner, it.middle) == (BLACK, KEY_SEEN);
        seen.iter().any(|it| (it.buffer, it.scale) == (buffer, scale) && is_drawn(it))
    };
    stage.compositor.order(Order::Resize([300, 200]));
    stage.show_until_seen(|seen| is_so(seen, [300, 200], 1));
    stage.compositor.order(Order::Scale(2));
    stage.show_until_seen(|seen| is_so(seen, [600, 400], 2));
    strike(stage);
}

#[test]
fn a_surface_follows_its_window_out_of_full_screen_and_back() {
    let Some(mut stage) = stage(Script::GOOD, &[]) else { return };
    for (fills, size) in [(false, [320, 200]), (true, [640, 360])] {
        stage.show_until_seen(|seen| seen.iter().any(|it| it.fills.is_some() != fills));
        stage.compositor.order(Order::Press('f'));
        stage.compositor.order(Order::Resize(size));
        stage.show_until_seen(|seen| {
            // A window that is not full screen has a frame.
            let is_near = |[width, _]: [i32; 2]| (size[0] - 20..=size[0]).contains(&width);
            let is_there =
                |it: &Seen| it.fills.is_some() == fills && it.destination.is_some_and(is_near);
            seen.iter().any(|it| is_there(it) && it.middle == KEY_SEEN)
        });
    }
    strike(stage);
}

#[test]
fn a_surface_that_nobody_sees_costs_a_few_frames_a_second_until_somebody_does() {
    let Some(mut stage) = stage(Script::GOOD, &[]) else { return };
    stage.show_until(|shown, _| shown.len() > 60);
    stage.compositor.order(Order::Show(false));
    stage.commits_in(100);
    let hidden = stage.commits_in(100);
    assert!(hidden < 30, "{hidden} pictures in a second that nobody saw");
    stage.compositor.order(Order::Show(true));
    stage.show_until(|shown, _| shown.len() > 60);
    strike(stage);
}

#[test]
fn a_compositor_that_is_asleep_stops_no_stream_whose_surface_it_has() {
    let Some(mut stage) = stage(Script::GOOD, &[]) else { return };
    stage.show_until(|shown, _| shown.len() > 60);
    stage.compositor.order(Order::Freeze(true));
    // Keys come back all the while.
    stage.commits_in(200);
    stage.compositor.order(Order::Freeze(false));
    let woken_at = clock::now().as_ns();
    let is_new = |it: &&Presented| it.presented_at_ns > woken_at;
    stage.show_until(|shown, _| shown.iter().filter(is_new).count() > 60);
    strike(stage);
}

#[test]
fn images_that_never_come_back_stall_nobody() {
    let Some(mut stage) = stage(Script { releases: false, ..Script::GOOD }, &[]) else { return };
    stage.show_until(|_, log| log.matches("discarded planned").count() > 20);
    // Returns when the slot has come back.
    stage.client.submit(&mut stage.source, [1, 2, 3, 255]);
    strike(stage);
}

#[test]
fn a_compositor_that_dies_takes_the_surface_and_no_stream() {
    let script = Script { dies_after: Some(20), ..Script::GOOD };
    let Some(mut stage) = stage(script, &[]) else { return };
    stage.show_until(|_, log| log.contains("window closes"));
    let shown = stage.show_until(|shown, _| shown.len() > 10);
    assert!(!shown.is_empty());
    stage.strike();
}

#[test]
fn a_stuck_surface_does_not_delay_the_one_beside_it_on_the_same_device() {
    let script = Script { starves_first_cell: true, ..Script::GOOD };
    let Some(mut stage) = stage(script, &[(LAYOUT, "side-by-side")]) else { return };
    stage.show_until(|_, log| log.contains("discarded planned"));
    let mut second = stage.client.open_stream(2, 64, 32);
    let patience = clock::now() + PATIENCE;
    let mut shown = 0;
    while shown < 60 {
        assert!(clock::now() < patience, "{shown} keys: {}", stage.log());
        stage.client.submit(&mut stage.source, KEY);
        stage.client.submit(&mut second, KEY);
        let is_shown = |it: &DaemonMessage| match it {
            DaemonMessage::Presented(it) => {
                it.stream == 2 && it.presented_at_ns != it.present_at_ns
            }
            _ => false,
        };
        shown += stage.client.take_waiting().iter().filter(|it| is_shown(it)).count();
    }
    strike(stage);
}

#[test]
fn another_driver_has_a_surface_as_well() {
    let Some(backend) = swiftshader() else { return };
    let mut stage = Stage::set_with(Script::GOOD, &[(BACKEND, backend)]);
    stage.show_until(|shown, _| shown.len() > 20);
    stage.show_until_seen(|seen| seen.iter().any(|it| it.middle == KEY_SEEN));
    stage.strike();
    let log = stage.log();
    assert!(log.contains("way=\"a surface of SwiftShader"), "{log}");
    assert!(!log.contains("another way"), "{log}");
}

/// A window of a child on a device of its own.
struct Player {
    gpu: Arc<Gpu>,
    window: Window,
    _system: WindowSystem,
}

impl Player {
    fn new(format: StreamFormat) -> Self {
        let adapters = adapters();
        let adapter = adapters.iter().find(|it| it.facts.name.contains("llvmpipe")).unwrap();
        let gpu = Gpu::open(adapter).unwrap();
        let system = WindowSystem::start(&WindowOptions::default()).unwrap();
        let config = WindowConfig { format, title: "player".to_owned(), ordinal: 0 };
        let window = Window::open(&system.opener(), &config, Some(&gpu), || {}).unwrap();
        println!("{}", window.way());
        Self { gpu, window, _system: system }
    }

    /// Hands pictures over until 20 were shown, each after word of the one before.
    fn show(&mut self, mut present: impl FnMut(&mut Window, MonoTime) -> bool) {
        let mut shown = 0;
        while shown < 20 {
            let mut is_answered = !present(&mut self.window, clock::now());
            while !is_answered {
                for event in self.window.take_events() {
                    let WindowEvent::Told(told) = event else { continue };
                    let is_shown = matches!(told, Told::Presented { .. });
                    shown += u32::from(is_shown);
                    is_answered |= is_shown || matches!(told, Told::Discarded { .. });
                }
                std::thread::yield_now();
            }
        }
    }
}

/// Runs a child with this part on a scripted compositor: what it said, and what that has seen.
fn run(part: &str) -> (String, Vec<Seen>) {
    let compositor = Scripted::start(Script::GOOD);
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["child_process", "--exact", "--nocapture"])
        .env(PART, part)
        .envs(compositor.environment())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = String::new();
    child.stdout.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(child.wait().unwrap().success(), "{said}");
    assert!(said.contains("a surface of llvmpipe"), "{said}");
    (said, compositor.seen())
}

fn lose_the_device() {
    let format = StreamFormat::rgba8(64, 32);
    let mut player = Player::new(format);
    let mut frame = ColorPlane::new(format.color, 64, 32);
    frame.as_mut_bytes().as_chunks_mut::<4>().0.fill([1, 2, 3, 255]);
    player.show(|window, planned| window.present(planned, &frame));
    player.gpu.lose();
    frame.as_mut_bytes().as_chunks_mut::<4>().0.fill(KEY);
    player.show(|window, planned| window.present(planned, &frame));
    println!("{}", player.window.way());
    std::process::exit(0);
}

#[test]
fn a_device_that_is_lost_leaves_the_window_to_the_cpu() {
    if lavapipe().is_none() {
        return;
    }
    let (said, seen) = run("lose");
    assert!(said.contains("wl_shm: the GPU device was lost"), "{said}");
    assert!(seen.iter().any(|it| it.middle == KEY_SEEN), "{seen:?}");
}

fn lose_the_surface() {
    let format = StreamFormat::rgba8(64, 32);
    let mut player = Player::new(format);
    let mut frame = ColorPlane::new(format.color, 64, 32);
    frame.as_mut_bytes().as_chunks_mut::<4>().0.fill([1, 2, 3, 255]);
    player.show(|window, planned| window.present(planned, &frame));
    for wait in ["250.000 ms", "1000.000 ms"] {
        player.window.lose_surface();
        player.show(|window, planned| window.present(planned, &frame));
        println!("without: {wait}: {}", player.window.way());
        let patience = clock::now() + PATIENCE;
        while !player.window.takes_kept_pictures() {
            assert!(clock::now() < patience, "no surface is made again");
            player.show(|window, planned| window.present(planned, &frame));
        }
    }
    frame.as_mut_bytes().as_chunks_mut::<4>().0.fill(KEY);
    player.show(|window, planned| window.present(planned, &frame));
    println!("again: {}", player.window.way());
    std::process::exit(0);
}

#[test]
fn a_surface_that_is_lost_is_made_again_and_the_cpu_draws_meanwhile() {
    if lavapipe().is_none() {
        return;
    }
    let (said, seen) = run("again");
    let without: Vec<_> = said.lines().filter_map(|it| it.strip_prefix("without: ")).collect();
    assert_eq!(without.len(), 2, "{said}");
    for line in without {
        let (wait, way) = line.split_once(": ").unwrap();
        assert!(way.starts_with("wl_shm: expected an image of the surface"), "{said}");
        assert!(way.ends_with(&format!("another is made after {wait}")), "{said}");
    }
    assert!(said.contains("again: a surface of llvmpipe"), "{said}");
    assert!(seen.iter().any(|it| it.middle == KEY_SEEN), "{seen:?}");
}

/// Makes a picture on the CPU, says what it is like in two places, and shows the same as made by
/// the adapter, which never leaves it.
fn show_kept_pictures() {
    let size = Size { width: 96, height: 54 };
    let rendered = Rendered::new(&SCENES[0], size, [2.0; 2], 2);
    let mut player = Player::new(rendered.format);
    let config = EngineConfig::new(Method::Linear, NonZeroUsize::MIN);
    let mut engines = [0, 1].map(|_| Engine::new(rendered.format, config));
    engines[1].use_gpu(&player.gpu);
    for key in 0..2 {
        let content_time = MonoTime::ZERO + INTERVAL.scale(key + 1, 1);
        rendered.with_input(key as usize, content_time, |input| {
            for engine in &mut engines {
                engine.push_key(input).unwrap();
            }
        });
    }
    let [on_cpu, on_gpu] = &mut engines;
    let (mut picture, mut unused) = (ColorPlane::default(), ColorPlane::default());
    let shown_at = MonoTime::ZERO + INTERVAL.scale(5, 2);
    on_cpu.synthesise(shown_at, &mut picture).unwrap();
    for [x, y] in [[0, 0], [size.width / 2, size.height / 2]] {
        let at = (y * size.width + x) as usize * 4;
        let [red, green, blue] = [0, 1, 2].map(|it| picture.as_bytes()[at + it]);
        println!("{:?}", [blue, green, red]);
    }
    assert!(player.window.takes_kept_pictures());
    player.show(|window, planned| {
        let (_, kept) = on_gpu.synthesise_kept(shown_at, &mut unused).unwrap();
        window.present_kept(planned, kept.expect("made by the adapter"))
    });
    // What is a key as it is has never been there alone.
    let at_a_key = MonoTime::ZERO + INTERVAL.scale(2, 1);
    assert!(on_gpu.synthesise_kept(at_a_key, &mut unused).unwrap().1.is_none());
    std::process::exit(0);
}

#[test]
fn a_picture_that_never_leaves_its_device_is_shown_as_the_cpu_makes_it() {
    if lavapipe().is_none() {
        return;
    }
    let (said, seen) = run("keep");
    let is_it =
        |it: &Seen| [it.corner, it.middle].iter().all(|it| said.contains(&format!("{it:?}")));
    assert!(seen.iter().any(|it| it.buffer == [96, 54] && is_it(it)), "{said} {seen:?}");
}
