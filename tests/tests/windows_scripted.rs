//! Windows of the daemon on a compositor that does what it is told.

mod daemon_fixture;
mod scripted;

use daemon_fixture::child::{LAYOUT, MONITOR, run_if_asked};
use foreframe_engine::MonoSpan;
use foreframe_protocol::{DaemonMessage, DestroyStream, Presented};
use foreframed::clock;
use scripted::stage::{BLACK, KEY, KEY_SEEN, PATIENCE, Stage};
use scripted::{Feedback, Order, Script, Seen};

#[test]
fn child_process() {
    run_if_asked();
}

#[test]
fn a_good_compositor_is_not_called_anything_else() {
    let mut stage = Stage::set(Script::GOOD);
    let shown = stage.show_until(|shown, _| shown.len() > 60);
    assert!(shown.iter().any(|it| it.presented_at_ns != it.present_at_ns), "{shown:?}");
    stage.strike();
    let log = stage.log();
    assert!(!log.contains("another pacing") && !log.contains("rate is measured"), "{log}");
    assert!(!log.contains("make no sense") && !log.contains("kept all buffers"), "{log}");
}

#[test]
fn feedback_that_is_discarded_each_time_gives_way_to_frame_callbacks() {
    let mut stage = Stage::set(Script { feedback: Feedback::Discarded, ..Script::GOOD });
    let shown = stage
        .show_until(|shown, log| log.contains("pacing=\"frame callbacks\"") && shown.len() > 20);
    assert!(shown.is_sorted_by_key(|it| it.presented_at_ns), "{shown:?}");
    stage.strike();
}

#[test]
fn a_compositor_that_answers_nothing_leaves_a_timer_and_frames_go_on() {
    let script = Script { feedback: Feedback::Never, has_callbacks: false, ..Script::GOOD };
    let mut stage = Stage::set(script);
    stage.show_until(|_, log| log.contains("pacing=\"timer\""));
    let handed_over = |log: &str| log.matches("is_taken=true").count();
    let before = handed_over(&stage.log());
    stage.show_until(|_, log| handed_over(log) > before + 50);
    stage.strike();
}

#[test]
fn times_of_the_raw_clock_are_ours_when_they_reach_the_application() {
    let mut stage = Stage::set(Script { is_raw: true, ..Script::GOOD });
    let shown = stage.show_until(|shown, _| shown.len() > 30);
    let now = clock::now().as_ns();
    for it in &shown {
        assert!((it.received_at_ns..now).contains(&it.presented_at_ns), "{it:?}");
    }
    stage.strike();
}

#[test]
fn a_refresh_rate_that_is_a_lie_is_found_out() {
    let interval = MonoSpan::from_ms(25);
    let mut stage = Stage::set(Script { announced_mhz: 60_000, interval, ..Script::GOOD });
    stage.show_until(|_, log| log.contains("the display's rate is measured"));
    stage.strike();
}

#[test]
fn buffers_that_never_come_back_stall_nobody() {
    let mut stage = Stage::set(Script { releases: false, ..Script::GOOD });
    stage.show_until(|_, log| log.matches("is_taken=false").count() > 20);
    // Returns when the slot has come back.
    stage.client.submit(&mut stage.source, [1, 2, 3, 255]);
    stage.strike();
    assert!(stage.log().contains("kept all buffers"), "{}", stage.log());
}

#[test]
fn a_compositor_that_dies_in_the_middle_takes_its_window_alone() {
    let mut stage = Stage::set(Script { dies_after: Some(20), ..Script::GOOD });
    stage.show_until(|_, log| log.contains("window closes"));
    let shown = stage.show_until(|shown, _| shown.len() > 10);
    assert!(!shown.is_empty());
    stage.strike();
}

#[test]
fn a_picture_keeps_its_shape_in_a_window_of_any_size_and_scale() {
    let mut stage = Stage::set(Script::GOOD);
    // 64 x 32 in a square: bars above and below.
    stage.compositor.order(Order::Resize([300, 300]));
    stage.show_until_seen(|seen| {
        seen.iter().any(|it| {
            it.destination == Some([300, 300])
                && it.buffer == [64, 64]
                && it.scale == 1
                && (it.corner, it.middle) == (BLACK, KEY_SEEN)
        })
    });
    // In a longer one they are at the sides, whatever the scale.
    stage.compositor.order(Order::Scale(2));
    stage.compositor.order(Order::Resize([400, 100]));
    stage.show_until_seen(|seen| {
        seen.iter().any(|it| {
            it.destination == Some([400, 100])
                && it.buffer == [128, 32]
                && it.scale == 1
                && (it.corner, it.middle) == (BLACK, KEY_SEEN)
        })
    });
    stage.strike();
}

#[test]
fn where_nobody_stretches_buffers_they_have_the_pixels_of_the_window() {
    let mut stage = Stage::set(Script { has_viewporter: false, ..Script::GOOD });
    stage.compositor.order(Order::Resize([300, 200]));
    let is_drawn = |it: &Seen| (it.corner, it.middle) == (BLACK, KEY_SEEN);
    stage.show_until_seen(|seen| {
        seen.iter().any(|it| it.buffer == [300, 200] && it.scale == 1 && is_drawn(it))
    });
    stage.compositor.order(Order::Scale(2));
    stage.show_until_seen(|seen| {
        seen.iter().any(|it| it.buffer == [600, 400] && it.scale == 2 && is_drawn(it))
    });
    stage.strike();
}

#[test]
fn f_leaves_full_screen_and_enters_it_again_h_goes_through_the_hud_and_q_closes() {
    let mut stage = Stage::set(Script::GOOD);
    stage.show_until_seen(|seen| seen.iter().any(|it| it.fills.is_some()));
    stage.compositor.order(Order::Press('f'));
    stage.show_until_seen(|seen| seen.iter().any(|it| it.fills.is_none()));
    stage.compositor.order(Order::Press('f'));
    stage.show_until_seen(|seen| seen.iter().any(|it| it.fills.is_some()));
    stage.compositor.order(Order::Press('h'));
    stage.show_until(|_, log| log.contains("hud view=stats"));
    stage.compositor.order(Order::Press('q'));
    stage.show_until(|_, log| log.contains("window closes why=ByUser"));
    stage.strike();
}

#[test]
fn a_monitor_is_chosen_by_its_name() {
    for (index, name) in scripted::OUTPUTS.into_iter().enumerate() {
        let mut stage = Stage::set_with(Script::GOOD, &[(MONITOR, name)]);
        stage.show_until_seen(|seen| seen.iter().any(|it| it.fills == Some(Some(index))));
        stage.strike();
    }
}

#[test]
fn a_window_that_nobody_sees_costs_a_few_frames_a_second_until_somebody_does() {
    let mut stage = Stage::set(Script::GOOD);
    stage.show_until(|shown, _| shown.len() > 60);
    stage.compositor.order(Order::Show(false));
    // Before they are found to be in vain, some are.
    stage.commits_in(60);
    let hidden = stage.commits_in(100);
    assert!(hidden < 30, "{hidden} pictures in a second that nobody saw");
    stage.compositor.order(Order::Show(true));
    stage.show_until(|shown, _| shown.len() > 60);
    stage.strike();
}

#[test]
fn another_mode_is_followed_and_the_application_hears_of_it() {
    let mut stage = Stage::set(Script::GOOD);
    stage.show_until(|shown, _| shown.len() > 60);
    stage.compositor.order(Order::Mode(50_000));
    let is_20_ms = |ns: u64| ns.abs_diff(20_000_000) < 600_000;
    let patience = clock::now() + PATIENCE;
    loop {
        assert!(clock::now() < patience, "{}", stage.log());
        stage.client.submit(&mut stage.source, KEY);
        let heard = stage.client.take_waiting();
        if heard
            .iter()
            .any(|it| matches!(it, DaemonMessage::Pacing(it) if is_20_ms(it.refresh_interval_ns)))
        {
            break;
        }
    }
    stage.show_until(|shown, _| shown.len() > 20);
    stage.strike();
    // From what is announced, not because the former rate turned out to be wrong.
    assert!(!stage.log().contains("rate is measured"), "{}", stage.log());
}

#[test]
fn a_compositor_that_is_asleep_for_a_while_stops_nobody_and_is_followed_when_it_wakes() {
    let mut stage = Stage::set(Script::GOOD);
    stage.show_until(|shown, _| shown.len() > 60);
    stage.compositor.order(Order::Freeze(true));
    // Keys come back all the while.
    stage.commits_in(200);
    stage.compositor.order(Order::Freeze(false));
    let woken_at = clock::now().as_ns();
    let is_new = |it: &&Presented| it.presented_at_ns > woken_at;
    stage.show_until(|shown, _| shown.iter().filter(is_new).count() > 60);
    stage.strike();
}

/// Whether a key of this stream was shown, by the compositor's word.
fn is_shown_of(message: &DaemonMessage, stream: u32) -> bool {
    let DaemonMessage::Presented(it) = message else { return false };
    it.stream == stream && it.presented_at_ns != it.present_at_ns
}

const SIDE_BY_SIDE: &[(&str, &str)] = &[(LAYOUT, "side-by-side")];

#[test]
fn two_streams_are_side_by_side_in_one_window_and_the_one_that_is_left_gets_all_of_it() {
    let mut stage = Stage::set_with(Script::GOOD, SIDE_BY_SIDE);
    let mut second = stage.client.open_stream(2, 32, 32);
    stage.compositor.order(Order::Resize([400, 100]));
    let place = |it: &Seen| (it.position, it.destination, it.buffer);
    let halves = [([0, 0], Some([200, 100]), [64, 32]), ([200, 0], Some([200, 100]), [64, 32])];
    let patience = clock::now() + PATIENCE;
    loop {
        let seen = stage.compositor.seen();
        let mut cells: Vec<_> = seen.iter().filter(|it| it.is_cell).collect();
        cells.sort_by_key(|it| it.position);
        if cells.len() == 2
            && [place(cells[0]), place(cells[1])] == halves
            && cells[0].middle == KEY_SEEN
            && (cells[1].corner, cells[1].middle) == (BLACK, [3, 2, 1])
        {
            assert_eq!(seen.len(), 3, "one window for both: {seen:?}");
            break;
        }
        assert!(clock::now() < patience, "{seen:?}: {}", stage.log());
        stage.client.submit(&mut stage.source, KEY);
        stage.client.submit(&mut second, [1, 2, 3, 255]);
        stage.client.take_waiting();
    }
    stage.client.send(DestroyStream { stream: 2 });
    let whole = ([0, 0], Some([400, 100]), [128, 32]);
    stage.show_until_seen(|seen| {
        let mut cells = seen.iter().filter(|it| it.is_cell);
        cells.next().is_some_and(|it| place(it) == whole) && cells.next().is_none()
    });
    stage.strike();
}

#[test]
fn a_stream_whose_frames_are_stuck_does_not_delay_the_one_beside_it() {
    let script = Script { starves_first_cell: true, ..Script::GOOD };
    let mut stage = Stage::set_with(script, SIDE_BY_SIDE);
    stage.show_until(|_, log| log.contains("is_taken=false"));
    let mut second = stage.client.open_stream(2, 64, 32);
    let patience = clock::now() + PATIENCE;
    let mut shown = 0;
    while shown < 60 {
        assert!(clock::now() < patience, "{shown} keys: {}", stage.log());
        stage.client.submit(&mut stage.source, KEY);
        stage.client.submit(&mut second, KEY);
        let heard = stage.client.take_waiting();
        shown += heard.iter().filter(|it| is_shown_of(it, 2)).count();
    }
    stage.strike();
}

#[test]
fn a_stream_that_is_idle_gets_the_place_of_the_one_that_ends_beside_it() {
    let mut stage = Stage::set_with(Script::GOOD, SIDE_BY_SIDE);
    let mut second = stage.client.open_stream(2, 32, 32);
    stage.compositor.order(Order::Resize([400, 100]));
    let place = |it: &Seen| (it.position, it.destination, it.buffer);
    let right = |seen: &[Seen]| {
        let half = ([200, 0], Some([200, 100]), [64, 32]);
        seen.iter().find(|it| it.is_cell && place(it) == half).cloned()
    };
    let patience = clock::now() + PATIENCE;
    while right(&stage.compositor.seen()).is_none() {
        assert!(clock::now() < patience, "{:?}: {}", stage.compositor.seen(), stage.log());
        stage.client.submit(&mut stage.source, KEY);
        stage.client.submit(&mut second, KEY);
        stage.client.take_waiting();
    }
    stage.commits_in(250);
    let idle = right(&stage.compositor.seen());
    stage.commits_in(20);
    assert_eq!(right(&stage.compositor.seen()), idle, "nobody has a picture of it to show");
    stage.client.send(DestroyStream { stream: 1 });
    let whole = ([0, 0], Some([400, 100]), [128, 32]);
    let patience = clock::now() + PATIENCE;
    loop {
        let seen = stage.compositor.seen();
        let mut cells = seen.iter().filter(|it| it.is_cell);
        let is_alone = cells.next().is_some_and(|it| place(it) == whole && it.middle == KEY_SEEN);
        if is_alone && cells.next().is_none() {
            break;
        }
        assert!(clock::now() < patience, "{seen:?}: {}", stage.log());
        std::thread::yield_now();
    }
}

#[test]
fn where_streams_cannot_be_side_by_side_each_gets_a_window() {
    let lacking = [
        ("wp_viewporter", Script { has_viewporter: false, ..Script::GOOD }),
        ("wl_subcompositor", Script { has_subcompositor: false, ..Script::GOOD }),
    ];
    for (name, script) in lacking {
        let mut stage = Stage::set_with(script, SIDE_BY_SIDE);
        let mut second = stage.client.open_stream(2, 64, 32);
        let patience = clock::now() + PATIENCE;
        loop {
            let seen = stage.compositor.seen();
            if seen.iter().filter(|it| !it.is_cell && it.middle == KEY_SEEN).count() == 2 {
                break;
            }
            assert!(clock::now() < patience, "{name}: {seen:?}: {}", stage.log());
            stage.client.submit(&mut stage.source, KEY);
            stage.client.submit(&mut second, KEY);
            stage.client.take_waiting();
        }
        let log = stage.log();
        assert_eq!(log.matches("each gets a window").count(), 1, "{log}");
        assert!(log.contains(name), "{log}");
        stage.strike();
    }
}

#[test]
fn what_is_behind_the_streams_fills_the_window_when_no_buffer_comes_back() {
    let mut stage = Stage::set_with(Script { releases: false, ..Script::GOOD }, SIDE_BY_SIDE);
    // Of one shape, so that its buffers serve all of them, and more than it has.
    for times in 1..=8 {
        let size = [100 * times, 50 * times];
        stage.compositor.order(Order::Resize(size));
        stage.show_until_seen(|seen| {
            seen.iter().any(|it| !it.is_cell && it.fills.is_some() && it.destination == Some(size))
        });
    }
    stage.strike();
}
