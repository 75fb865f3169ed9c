//! Laws of every message: what is written can be read, has one encoding, and no bytes whatever
//! make the reader panic.

mod arbitrary;
mod packets;
mod samples;

use arbitrary::{any_stream, any_submit};
use foreframe_protocol::message::HEADER_BYTES;
use foreframe_protocol::*;
use packets::{client_packets, daemon_packets};
use proptest::prelude::*;

/// What either side makes of a packet: the packet of the message that was understood.
fn read(packet: &[u8]) -> Result<Vec<u8>> {
    ClientMessage::parse(packet)
        .map(|message| message.to_packet().as_bytes().to_vec())
        .or_else(|_| DaemonMessage::parse(packet).map(|m| m.to_packet().as_bytes().to_vec()))
}

fn all_packets() -> Vec<(String, Vec<u8>)> {
    client_packets().into_iter().chain(daemon_packets()).collect()
}

#[test]
fn every_type_of_message_is_among_the_samples() {
    let names: Vec<String> = all_packets().into_iter().map(|(name, _)| name).collect();
    for kind in MessageKind::ALL {
        assert!(names.iter().any(|name| name == kind.name()), "no sample of {kind}");
    }
}

#[test]
fn every_sample_is_understood_and_has_one_encoding() {
    for (name, packet) in client_packets() {
        let message = ClientMessage::parse(&packet).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(message.to_packet().as_bytes(), packet, "{name}");
        assert!(packet.len() <= limits::MAX_PACKET_BYTES);
    }
    for (name, packet) in daemon_packets() {
        let message = DaemonMessage::parse(&packet).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(message.to_packet().as_bytes(), packet, "{name}");
    }
}

#[test]
fn every_truncation_is_refused() {
    for (name, packet) in all_packets() {
        for length in 0..packet.len() {
            let cut = &packet[..length];
            assert!(read(cut).is_err(), "{name} cut to {length} bytes");
            // Also when the header agrees with the length.
            let mut honest = cut.to_vec();
            if length >= HEADER_BYTES {
                honest[8..12].copy_from_slice(&u32::try_from(length).unwrap().to_le_bytes());
                assert!(read(&honest).is_err(), "{name} of {length} bytes");
            }
        }
    }
}

/// `packet` with an extension behind it.
fn extended(packet: &[u8], tag: u16, length: u16, data: &[u8]) -> Vec<u8> {
    let mut packet = packet.to_vec();
    packet.extend(tag.to_le_bytes());
    packet.extend(length.to_le_bytes());
    packet.extend(data);
    let length = u32::try_from(packet.len()).expect("short");
    packet[8..12].copy_from_slice(&length.to_le_bytes());
    packet
}

#[test]
fn unknown_optional_extensions_are_skipped_and_critical_ones_are_refused() {
    for (name, packet) in all_packets() {
        let optional = extended(&extended(&packet, 7, 3, &[1, 2, 3]), 8, 0, &[]);
        assert_eq!(read(&optional).unwrap(), packet, "{name}");
        let critical = extended(&packet, 0x8007, 3, &[1, 2, 3]);
        assert!(read(&critical).is_err(), "{name}");
        let too_long = extended(&packet, 7, 4, &[1, 2, 3]);
        assert!(read(&too_long).is_err(), "{name}");
    }
}

#[test]
fn a_packet_that_is_too_long_is_refused() {
    for (name, packet) in all_packets() {
        let room = limits::MAX_PACKET_BYTES - packet.len() - 4;
        let longest = extended(&packet, 7, u16::try_from(room).unwrap(), &vec![0; room]);
        assert!(read(&longest).is_ok(), "{name}");
        let longer = extended(&packet, 7, u16::try_from(room + 1).unwrap(), &vec![0; room + 1]);
        assert!(read(&longer).is_err(), "{name}");
    }
}

#[test]
fn each_side_refuses_what_only_the_other_sends() {
    for (name, packet) in client_packets().into_iter().filter(|(name, _)| name != "goodbye") {
        let error = DaemonMessage::parse(&packet).expect_err(&name).to_string();
        assert!(error.contains("a daemon sends"), "{error}");
    }
    for (name, packet) in daemon_packets().into_iter().filter(|(name, _)| name != "goodbye") {
        let error = ClientMessage::parse(&packet).expect_err(&name).to_string();
        assert!(error.contains("a client sends"), "{error}");
    }
}

#[test]
fn another_major_is_refused_but_can_always_say_so() {
    for (name, mut packet) in all_packets() {
        packet[4..6].copy_from_slice(&2_u16.to_le_bytes());
        match read(&packet) {
            Ok(_) => assert_eq!(name, "reject"),
            Err(error) => {
                assert!(matches!(error, Error::Version { expected: 1, found: 2 }), "{error}");
            }
        }
    }
}

#[test]
fn texts_are_cut_between_characters_and_lose_control_characters() {
    let hello = Hello::new("\u{1F3AE}".repeat(20) + "\n");
    let read = Hello::parse(&hello.to_bytes()).unwrap();
    assert_eq!(read.application, "\u{1F3AE}".repeat(16));
    let read = Hello::parse(&Hello::new("a\nb\0c").to_bytes()).unwrap();
    assert_eq!(read.application, "a b c");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn any_stream_can_be_written_and_read(stream in any_stream()) {
        prop_assert_eq!(CreateStream::parse(&stream.to_bytes()).unwrap(), stream);
    }

    #[test]
    fn any_key_frame_can_be_written_and_read(submit in any_submit()) {
        prop_assert_eq!(Submit::parse(&submit.to_bytes()).unwrap(), submit);
    }

    #[test]
    fn arbitrary_bytes_never_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..1100),
    ) {
        prop_assert!(read(&bytes).is_err());
    }

    /// What is understood at all has exactly this encoding, whichever bytes were changed.
    #[test]
    fn damaged_packets_never_panic_and_are_canonical(
        which in any::<proptest::sample::Index>(),
        damage in proptest::collection::vec(
            (any::<proptest::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let packets = all_packets();
        let (name, mut packet) = packets[which.index(packets.len())].clone();
        for (place, byte) in damage {
            let length = packet.len();
            packet[place.index(length)] = byte;
        }
        if let Ok(again) = read(&packet) && name != "reject" {
            prop_assert_eq!(again, packet, "{}", name);
        }
    }

    /// Whatever a submit holds, checking it against a stream never panics, and a plane that passes
    /// lies inside the slot.
    #[test]
    fn a_checked_key_frame_lies_inside_its_slot(
        submit in any_submit(), stream in any_stream(), slot_bytes in 0..1_u64 << 36,
    ) {
        let mut submit = submit;
        // Without this, sizes would almost never agree.
        if let Some(color) = submit.planes.get_mut(PlaneKind::Color) {
            let StreamFormat { width, height, .. } = stream.format;
            color.valid = Rect::full(width, height);
            (color.width, color.height) = (width, height);
        }
        if submit.check(&stream, slot_bytes).is_ok() {
            for (kind, plane) in submit.planes.iter() {
                let pixel = u64::from(stream.format.bytes_per_pixel(kind).unwrap());
                let last_row = u64::from(plane.height - 1) * u64::from(plane.stride);
                let end = plane.offset + last_row + u64::from(plane.width) * pixel;
                prop_assert!(end <= slot_bytes);
            }
        }
    }
}
