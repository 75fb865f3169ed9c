//! Planes of a key frame: declared, resized, left out, and written where the daemon looks.

use crate::fake_daemon::connect;
use foreframe_client::{
    ColorFormat, Depth, DepthFormat, DepthMeaning, Error, Key, Motion, MotionFormat, MotionUnit,
    PlaneKind, Rect, StreamOptions,
};
use foreframe_protocol::{ClientMessage, PlaneSize, ReleaseReason, SlotReleased, UiPlane};

/// Colour, depth 1.5 times smaller, motion 4 times smaller, UI of its own size, mask.
fn options() -> StreamOptions {
    StreamOptions::rgba8(97, 61)
        .depth(Depth::new(DepthFormat::F16, DepthMeaning::Standard).ratio(1.5))
        .motion(
            Motion::new(MotionFormat::Rg32f).unit(MotionUnit::Ndc).scale([1.0, -1.0]).ratio(4.0),
        )
        .ui(ColorFormat::Rgba8, 200, 30)
        .mask(1.0)
        .row_align(64)
}

#[test]
fn everything_that_was_declared_arrives() {
    let (mut client, mut daemon) = connect();
    client.create_stream(&options()).unwrap();
    let Some(ClientMessage::CreateStream(create)) = daemon.next() else { panic!("a stream") };
    let size = |kind| *create.max_sizes.get(kind).unwrap();
    assert_eq!(size(PlaneKind::Depth), PlaneSize { width: 65, height: 41 });
    assert_eq!(size(PlaneKind::Motion), PlaneSize { width: 24, height: 15 });
    assert_eq!(size(PlaneKind::Ui), PlaneSize { width: 200, height: 30 });
    assert_eq!(size(PlaneKind::Mask), PlaneSize { width: 97, height: 61 });
    let motion = create.format.motion.unwrap();
    assert_eq!((motion.unit, motion.scale), (MotionUnit::Ndc, [1.0, -1.0]));
}

#[test]
fn every_plane_lies_where_its_descriptor_says() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &options());
    let mut frame = client.acquire(stream).unwrap();
    for &kind in PlaneKind::ALL {
        let mut plane = frame.plane_mut(kind).unwrap();
        assert_eq!(plane.stride % 64, 0, "{kind}");
        for y in 0..plane.height {
            plane.row_mut(y).fill(u8::try_from(kind.code() + 1).unwrap());
        }
    }
    client.submit(frame, Key::new(1, 1)).unwrap();

    let submit = daemon.next_submit();
    let pool = daemon.pool.as_ref().unwrap();
    let slot = u64::from(submit.slot) * (pool.len() / 3);
    let bytes_per_pixel = [4, 2, 8, 4, 1];
    for (kind, plane) in submit.planes.iter() {
        let row_bytes = plane.width * bytes_per_pixel[kind.code() as usize];
        let mut pixels = Vec::new();
        let (start, rows) = (slot + plane.offset, plane.height);
        pool.copy_rows_to_vec(start, plane.stride, row_bytes, rows, &mut pixels).unwrap();
        let value = u8::try_from(kind.code() + 1).unwrap();
        assert!(pixels.iter().all(|&byte| byte == value), "{kind}");
    }
}

#[test]
fn planes_may_change_size_and_be_left_out_from_key_to_key() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &options());
    let mut frame = client.acquire(stream).unwrap();
    frame.resize(PlaneKind::Depth, 50, 31).unwrap();
    frame.set_valid(PlaneKind::Color, Rect { x: 1, y: 2, width: 90, height: 50 }).unwrap();
    frame.set_jitter(PlaneKind::Depth, [0.25, -0.5]).unwrap();
    frame.omit(PlaneKind::Motion).unwrap();
    assert!(frame.plane_mut(PlaneKind::Motion).is_none());
    client.submit(frame, Key::new(1, 1)).unwrap();

    let submit = daemon.next_submit();
    let depth = submit.planes.get(PlaneKind::Depth).unwrap();
    assert_eq!((depth.width, depth.height, depth.jitter), (50, 31, [0.25, -0.5]));
    assert_eq!(submit.planes.get(PlaneKind::Color).unwrap().valid.width, 90);
    assert!(submit.planes.get(PlaneKind::Motion).is_none());

    // The next one starts from what the stream declares again.
    let frame = client.acquire(stream).unwrap();
    assert_eq!(frame.plane(PlaneKind::Depth).unwrap().width, 65);
    assert!(frame.plane(PlaneKind::Motion).is_some());
}

#[test]
fn planes_that_do_not_fit_are_refused_before_they_are_written() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &options());
    let mut frame = client.acquire(stream).unwrap();
    assert!(frame.resize(PlaneKind::Depth, 66, 41).is_err(), "larger than declared");
    assert!(frame.resize(PlaneKind::Depth, 0, 41).is_err());
    assert!(frame.resize(PlaneKind::Color, 90, 61).is_err(), "colour keeps its size");
    assert!(frame.omit(PlaneKind::Color).is_err());
    let outside = Rect { x: 60, y: 0, width: 6, height: 1 };
    assert!(frame.set_valid(PlaneKind::Depth, outside).is_err());
    client.submit(frame, Key::new(1, 1)).expect("what was refused changed nothing");
    daemon.next_submit();

    let mut frame = client.acquire(stream).unwrap();
    frame.resize(PlaneKind::Depth, 23, 41).expect("judged when it is submitted, beside colour");
    let error = client.submit(frame, Key::new(2, 2)).expect_err("below 1/4").to_string();
    assert!(error.contains("1/4 to 1/1"), "{error}");
    let mut frame = client.acquire(stream).unwrap();
    frame.set_jitter(PlaneKind::Depth, [f32::NAN, 0.0]).unwrap();
    assert!(client.submit(frame, Key::new(2, 2)).is_err());
    assert!(daemon.next().is_none(), "nothing that is wrong is sent");
}

#[test]
fn streams_that_contradict_themselves_or_the_daemon_are_refused_here() {
    let (mut client, mut daemon) = connect();
    let depth = |ratio| Depth::new(DepthFormat::F32, DepthMeaning::Reversed).ratio(ratio);
    let bad = [
        StreamOptions::rgba8(0, 10),
        StreamOptions::rgba8(8193, 10),
        StreamOptions::rgba8(64, 64).slots(0),
        StreamOptions::rgba8(64, 64).slots(9),
        StreamOptions::rgba8(64, 64).depth(depth(4.5)),
        StreamOptions::rgba8(64, 64).depth(depth(0.5)),
        StreamOptions::rgba8(64, 64).depth(depth(f64::NAN)),
        StreamOptions::rgba8(64, 64).depth(depth(0.0)),
        StreamOptions::rgba8(64, 64).row_align(3),
        StreamOptions::rgba8(64, 64).white_cd_m2(f32::NAN),
        StreamOptions::rgba8(64, 64).motion(Motion::new(MotionFormat::Rg16f).scale([0.0, 1.0])),
    ];
    for options in bad {
        let error = client.create_stream(&options).expect_err("bad options").to_string();
        assert!(error.contains("expected"), "{error}");
    }
    assert!(daemon.next().is_none(), "nothing was sent");
    for _ in 0..4 {
        client.create_stream(&StreamOptions::rgba8(8, 8)).expect("as many as the daemon grants");
    }
    let fifth = client.create_stream(&StreamOptions::rgba8(8, 8));
    assert!(matches!(fifth, Err(Error::Option { option: "streams", .. })), "{fifth:?}");
}

#[test]
fn a_user_interface_goes_by_itself_where_it_is_placed_and_leaves_a_slot_to_keys() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &options());
    let mut sent = Vec::new();
    for number in 0..2_u8 {
        let mut ui = client.acquire_ui(stream).unwrap();
        ui.resize(PlaneSize { width: 20, height: 10 }).unwrap();
        ui.set_place(-3, i32::from(number));
        let mut pixels = ui.pixels_mut();
        for y in 0..10 {
            pixels.row_mut(y).fill(200 + number);
        }
        client.submit_ui(ui).unwrap();
        let Some(ClientMessage::UiPlane(ui)) = daemon.next() else { panic!("a UI plane") };
        assert_eq!((ui.ui_index, ui.place), (u64::from(number), [-3, i32::from(number)]));
        assert_eq!((ui.plane.width, ui.plane.height, ui.plane.stride), (20, 10, 128));
        let (pool, slot_bytes) =
            (daemon.pool.as_ref().unwrap(), daemon.stream.unwrap().1.slot_bytes);
        let offset = u64::from(ui.slot) * slot_bytes + ui.plane.offset;
        let mut pixels = Vec::new();
        pool.copy_rows_to_vec(offset, ui.plane.stride, 80, 10, &mut pixels).unwrap();
        assert!(pixels.iter().all(|&byte| byte == 200 + number));
        sent.push(ui);
    }
    assert!(matches!(client.acquire_ui(stream), Err(Error::WouldBlock)), "the last one is a key's");
    let key = client.acquire(stream).unwrap();
    drop(key);
    let UiPlane { stream: number, slot, ui_index: key_index, .. } = sent[0];
    let reason = ReleaseReason::Superseded;
    daemon.send(&SlotReleased { stream: number, slot, key_index, reason });
    client.dispatch().unwrap();
    client.acquire_ui(stream).expect("its slot is free again");
}

#[test]
fn a_stream_without_ui_planes_has_none_to_acquire() {
    let (mut client, mut daemon) = connect();
    let stream = daemon.accept_stream(&mut client, &StreamOptions::rgba8(8, 8));
    let error = client.acquire_ui(stream).unwrap_err();
    assert!(matches!(error, Error::NoPlane { plane: PlaneKind::Ui }), "{error}");
    assert!(daemon.next().is_none());
}
