//! A key frame against its stream: geometry, declared planes, order, and whose each slot is.

mod samples;

use foreframe_protocol::slots::{Holds, KeyOrder, SlotState, SlotTable, SlotUse, UiOrder};
use foreframe_protocol::{Error, PlaneDescriptor, PlaneKind, PlaneSize, Rect, Submit, UiPlane};
use samples::{SLOT_BYTES, output_pool, stream, submit, ui_plane};

fn check(submit: &Submit) -> Result<(), String> {
    submit.check(&stream(), SLOT_BYTES).map_err(|error| error.to_string())
}

/// What becomes of the sample when one of its planes is changed.
fn changed(kind: PlaneKind, change: impl FnOnce(&mut PlaneDescriptor)) -> Result<(), String> {
    let mut submit = submit();
    change(submit.planes.get_mut(kind).expect("the sample has every plane"));
    check(&submit)
}

#[test]
fn planes_in_other_ratios_and_with_padding_fit() {
    assert_eq!(check(&submit()), Ok(()));
    let resized = |width: u32, height: u32| {
        changed(PlaneKind::Depth, |depth| {
            (depth.width, depth.height) = (width, height);
            depth.valid = Rect::full(width, height);
        })
    };
    assert_eq!(resized(480, 270), Ok(()), "1/4");
    assert_eq!(resized(901, 507), Ok(()), "no whole ratio");
    assert_eq!(resized(960, 270), Ok(()), "another ratio per axis");
    assert!(resized(479, 270).unwrap_err().contains("1/4 to 1/1 of colour's 1920x1080"));
    assert!(resized(961, 540).unwrap_err().contains("at most 960x540 as declared"));
}

#[test]
fn strides_have_to_hold_whole_pixels_of_a_whole_row() {
    let strided = |stride: u32| changed(PlaneKind::Depth, |depth| depth.stride = stride);
    assert_eq!(strided(960 * 4), Ok(()));
    for stride in [0, 960 * 4 - 4, 960 * 4 + 2] {
        assert!(
            strided(stride).unwrap_err().contains("at least 3840, a multiple of 4"),
            "{stride}"
        );
    }
}

#[test]
fn planes_lie_inside_the_slot_to_the_last_byte() {
    let only_color = |offset: u64, slot_bytes: u64| {
        let mut submit = submit();
        for kind in [PlaneKind::Depth, PlaneKind::Motion, PlaneKind::Ui, PlaneKind::Mask] {
            submit.planes.set(kind, None);
        }
        submit.planes.get_mut(PlaneKind::Color).unwrap().offset = offset;
        submit.check(&stream(), slot_bytes)
    };
    let bytes = 1920 * 1080 * 4;
    assert!(only_color(16, bytes + 16).is_ok());
    assert!(only_color(16, bytes + 15).is_err());
    assert!(only_color(0, 0).is_err());
    assert!(only_color(u64::MAX - 15, u64::MAX).is_err(), "the end is beyond 2^64");
}

#[test]
fn planes_do_not_share_a_byte() {
    let mut submit = submit();
    let color = *submit.planes.get(PlaneKind::Color).unwrap();
    let end = color.byte_len(4);
    let motion = submit.planes.get_mut(PlaneKind::Motion).unwrap();
    motion.offset = end - 16;
    assert!(check(&submit).unwrap_err().contains("the end of the color plane"));
}

#[test]
fn colour_has_the_size_of_the_stream_and_undeclared_planes_are_refused() {
    let smaller = changed(PlaneKind::Color, |color| {
        color.width = 1919;
        color.valid.width = 1919;
    });
    assert!(smaller.unwrap_err().contains("1920x1080, the size of the stream"));

    let mut plain = stream();
    plain.format.mask = None;
    plain.max_sizes.set(PlaneKind::Mask, None);
    let error = submit().check(&plain, SLOT_BYTES).unwrap_err().to_string();
    assert!(error.contains("expected color, depth, motion, ui, found mask"), "{error}");
    let mut slots = stream();
    slots.slots = 2;
    let error = submit().check(&slots, SLOT_BYTES).unwrap_err().to_string();
    assert!(error.contains("slot: expected 0 to 1, found 2"), "{error}");
}

#[test]
fn indices_and_content_times_only_increase() {
    let mut order = KeyOrder::default();
    let key =
        |key_index: u64, content_time_ns: u64| Submit { key_index, content_time_ns, ..submit() };
    order.advance(&key(5, 100)).unwrap();
    for bad in [key(5, 200), key(4, 200), key(6, 100), key(6, 99), key(u64::MAX, 0)] {
        assert!(matches!(order.advance(&bad), Err(Error::Order { .. })), "{bad:?}");
    }
    order.advance(&key(6, 101)).expect("what was refused left no trace");
    order.advance(&key(u64::MAX, 102)).expect("indices may jump");
}

#[test]
fn newest_key_frame_wins_until_it_is_latched() {
    let mut slots = SlotTable::new(3);
    assert_eq!(slots.submit(Holds::Key, 0, 10).unwrap(), None);
    assert_eq!(slots.submit(Holds::Key, 1, 11).unwrap(), Some(SlotUse { slot: 0, key_index: 10 }));
    assert_eq!(slots.latch(Holds::Key), Some(SlotUse { slot: 1, key_index: 11 }));
    // A latched one is not superseded, and only one is latched at a time.
    assert_eq!(slots.submit(Holds::Key, 0, 12).unwrap(), None);
    assert_eq!(slots.latch(Holds::Key), None);
    assert_eq!(slots.release_latched(Holds::Key), Some(SlotUse { slot: 1, key_index: 11 }));
    assert_eq!(slots.release_latched(Holds::Key), None);
    assert_eq!(slots.latch(Holds::Key), Some(SlotUse { slot: 0, key_index: 12 }));
}

#[test]
fn a_slot_that_the_daemon_has_cannot_be_submitted_again() {
    let mut slots = SlotTable::new(2);
    slots.submit(Holds::Key, 0, 1).unwrap();
    assert!(matches!(slots.submit(Holds::Key, 0, 2), Err(Error::Slot { slot: 0, .. })));
    assert_eq!(slots.states()[0], SlotState::Submitted(Holds::Key, 1), "nothing has changed");
    slots.latch(Holds::Key);
    assert!(matches!(slots.submit(Holds::Key, 0, 2), Err(Error::Slot { slot: 0, .. })));
    assert!(matches!(slots.submit(Holds::Key, 2, 2), Err(Error::Slot { slot: 2, .. })));
    assert!(matches!(slots.submit(Holds::Key, u32::MAX, 2), Err(Error::Slot { .. })));
}

#[test]
fn ui_planes_wait_beside_key_frames_in_slots_of_the_same_pool() {
    let mut slots = SlotTable::new(3);
    slots.submit(Holds::Key, 0, 10).unwrap();
    assert_eq!(slots.submit(Holds::Ui, 1, 5).unwrap(), None, "a key is not superseded by it");
    assert!(slots.submit(Holds::Ui, 0, 6).is_err(), "a key frame lies there");
    let older = slots.submit(Holds::Ui, 2, 6).unwrap();
    assert_eq!(older, Some(SlotUse { slot: 1, key_index: 5 }));
    assert_eq!(slots.latch(Holds::Ui), Some(SlotUse { slot: 2, key_index: 6 }));
    assert_eq!(slots.latch(Holds::Key), Some(SlotUse { slot: 0, key_index: 10 }));
    assert_eq!(slots.release_latched(Holds::Ui), Some(SlotUse { slot: 2, key_index: 6 }));
    assert_eq!(slots.release_latched(Holds::Ui), None);
    assert_eq!(slots.latched(Holds::Key), Some(SlotUse { slot: 0, key_index: 10 }));
}

#[test]
fn a_ui_plane_fits_what_its_stream_declares_and_its_slot() {
    let (ui, mut stream) = (ui_plane(), stream());
    ui.check(&stream, SLOT_BYTES).unwrap();
    let end = ui.plane.offset + ui.plane.byte_len(4);
    assert!(ui.check(&stream, end).is_ok());
    let error = ui.check(&stream, end - 1).unwrap_err();
    assert!(matches!(error, Error::Plane { plane: PlaneKind::Ui, field: "end", .. }), "{error}");
    assert!(UiPlane { slot: stream.slots, ..ui }.check(&stream, SLOT_BYTES).is_err());
    let small = PlaneSize { width: 319, height: 64 };
    stream.max_sizes.set(PlaneKind::Ui, Some(small));
    assert!(ui.check(&stream, SLOT_BYTES).is_err(), "larger than declared");
    stream.format.ui = None;
    stream.max_sizes.set(PlaneKind::Ui, None);
    let error = ui.check(&stream, SLOT_BYTES).unwrap_err().to_string();
    assert!(error.contains("a stream that declares UI planes"), "{error}");
}

#[test]
fn indices_of_ui_planes_only_increase() {
    let mut order = UiOrder::default();
    order.advance(&UiPlane { ui_index: 4, ..ui_plane() }).unwrap();
    for bad in [4, 3, 0] {
        assert!(order.advance(&UiPlane { ui_index: bad, ..ui_plane() }).is_err(), "{bad}");
    }
    order.advance(&UiPlane { ui_index: 5, ..ui_plane() }).unwrap();
}

#[test]
fn sample_of_an_output_pool_holds_its_frames() {
    let pool = output_pool();
    assert!(u64::from(pool.stride) * u64::from(pool.height) <= pool.slot_bytes);
}
