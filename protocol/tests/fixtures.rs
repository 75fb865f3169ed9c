//! Packets on disk, by what has to become of them: `valid` is understood, `invalid` gives the
//! error in the text beside it, `fuzzed` only must not panic.
//!
//! The files are made by this test; run it with `FOREFRAME_BLESS=1` to write them again, and read
//! the difference. A difference in `valid` means that the layout has changed, and with it the
//! version of the protocol.

mod packets;
mod samples;

use std::path::PathBuf;

use foreframe_protocol::message::HEADER_BYTES;
use foreframe_protocol::wire::stream::DISPLAY_PROFILE_TAG;
use foreframe_protocol::wire::struct_layouts;
use foreframe_protocol::{
    Body, ClientMessage, CreateStream, DaemonMessage, Error, MessageKind, Packet, StreamFormat,
};
use packets::{client_packets, daemon_packets};

/// Compares a file with what it should hold, or writes it.
fn same_or_blessed(folder: &str, file: &str, bytes: &[u8]) {
    let folder =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fixtures/protocol").join(folder);
    let path = folder.join(file);
    if std::env::var_os("FOREFRAME_BLESS").is_some() {
        std::fs::create_dir_all(&folder).expect("the folder can be made");
        std::fs::write(&path, bytes).expect("the fixture can be written");
    }
    let stored = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert!(
        stored == bytes,
        "{} differs; expected\n{}\nfound\n{}",
        path.display(),
        bytes.escape_ascii(),
        stored.escape_ascii()
    );
}

fn files_in(folder: &str) -> usize {
    let folder =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fixtures/protocol").join(folder);
    std::fs::read_dir(folder).expect("the folder is there").count()
}

#[test]
fn valid_packets_are_those_of_this_layout() {
    for (side, packets) in [("client", client_packets()), ("daemon", daemon_packets())] {
        for (name, packet) in packets {
            same_or_blessed("valid", &format!("{side}_{name}.bin"), &packet);
        }
    }
    let extended = with_profile("asus-pg279q");
    same_or_blessed("valid", "client_create_stream_display_profile.bin", &extended);
    assert_eq!(files_in("valid"), client_packets().len() + daemon_packets().len() + 1);
}

/// The stream of the samples, with a display profile.
fn with_profile(name: &str) -> Vec<u8> {
    let mut stream = samples::stream();
    stream.format.display_profile = Some(name.parse().expect("a name"));
    Packet::new(&stream).as_bytes().to_vec()
}

/// The stream of the samples with these extensions behind it, by tag and data.
fn extended(extensions: &[(u16, &[u8])]) -> Vec<u8> {
    let mut body = samples::stream().to_bytes();
    for (tag, data) in extensions {
        body.extend(tag.to_le_bytes());
        body.extend(u16::try_from(data.len()).expect("short").to_le_bytes());
        body.extend(*data);
    }
    Packet::from_body_bytes(MessageKind::CreateStream, &body).as_bytes().to_vec()
}

/// Display profiles that no daemon looks up.
fn bad_profiles() -> Vec<(String, Vec<u8>)> {
    let tag = DISPLAY_PROFILE_TAG;
    [
        ("not_utf8", extended(&[(tag, &[b'a', 0xff])])),
        ("control", extended(&[(tag, b"a\nb")])),
        ("empty", extended(&[(tag, b"")])),
        ("65_bytes", extended(&[(tag, &[b'a'; 65])])),
        ("twice", extended(&[(tag, b"a"), (tag, b"a")])),
    ]
    .map(|(fault, packet)| (format!("create_stream-display_profile-{fault}"), packet))
    .into()
}

#[test]
fn a_display_profile_comes_back_and_others_skip_what_they_do_not_know() {
    let parsed = |packet: &[u8]| match ClientMessage::parse(packet) {
        Ok(ClientMessage::CreateStream(create)) => create,
        other => panic!("{other:?}"),
    };
    let plain = parsed(&extended(&[]));
    assert_eq!(plain.format.display_profile, None);
    let named = parsed(&with_profile("asus-pg279q"));
    assert_eq!(named.format.display_profile.map(|it| it.to_string()).unwrap(), "asus-pg279q");
    // Without the name it is the same stream: what a daemon sees that does not know the tag.
    let format = StreamFormat { display_profile: None, ..named.format };
    assert_eq!(CreateStream { format, ..named }, plain);
    assert_eq!(parsed(&extended(&[(0x7fff, b"later")])), plain);
    assert_eq!(
        parsed(&extended(&[(1, &[b'a'; 64])])).to_bytes(),
        extended(&[(1, &[b'a'; 64])])[16..]
    );
    assert!(ClientMessage::parse(&extended(&[(0x8001, b"critical")])).is_err());
}

fn field(layout: &str, name: &str) -> (usize, usize) {
    let layouts = struct_layouts();
    let layout = layouts.iter().find(|l| l.name == layout).expect("a struct of this name");
    let field = layout.fields.iter().find(|f| f.name == name);
    let field = field.unwrap_or_else(|| panic!("{} has no {name}", layout.name));
    (field.offset, field.size)
}

/// The good packet of `sample` with other bytes in `field`; `plane.stride` is that of the second
/// plane, `gpu_pci.device` that of the address.
fn patched(sample: &str, path: &str, bytes: &[u8]) -> Vec<u8> {
    let all: Vec<_> = client_packets().into_iter().chain(daemon_packets()).collect();
    let (_, packet) = all.into_iter().find(|(name, _)| name == sample).expect("a sample");
    let mut packet = packet;
    let kind = MessageKind::ALL.iter().find(|kind| kind.name() == sample).expect("a type");
    let body = body_name(*kind);
    let offset = match path.split_once('.') {
        None => field(&body, path).0,
        Some(("plane", inner)) if kind == &MessageKind::UiPlane => {
            field(&body, "plane").0 + field("PlaneRaw", inner).0
        }
        Some(("plane", inner)) => field(&body, "planes").0 + 48 + field("PlaneRaw", inner).0,
        Some(("gpu_pci", inner)) => field(&body, "gpu_pci").0 + field("PciAddressRaw", inner).0,
        Some((outer, _)) => panic!("no nested {outer}"),
    };
    packet[HEADER_BYTES + offset..][..bytes.len()].copy_from_slice(bytes);
    packet
}

/// `create_stream` has its body in `CreateStreamRaw`.
fn body_name(kind: MessageKind) -> String {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    kind.name().split('_').map(capital).collect::<String>() + "Raw"
}

/// What has to be refused: the message, the field that is to blame, a word for what is wrong with
/// it, and its bytes.
fn bad_fields() -> Vec<(&'static str, &'static str, &'static str, Vec<u8>)> {
    let u16 = |value: u16| value.to_le_bytes().to_vec();
    let u32 = |value: u32| value.to_le_bytes().to_vec();
    let u64 = |value: u64| value.to_le_bytes().to_vec();
    let f32 = |value: f32| value.to_le_bytes().to_vec();
    vec![
        ("hello", "major", "other", u16(2)),
        ("hello", "application_length", "65", u32(65)),
        ("hello", "application_length", "short", u32(3)),
        ("hello", "application", "not_utf8", vec![0xff]),
        ("hello", "application", "control", vec![7]),
        ("hello", "has_gpu_uuid", "2", u32(2)),
        ("hello", "has_gpu_uuid", "hidden", u32(0)),
        ("hello", "gpu_pci.device", "32", vec![32]),
        ("hello", "gpu_pci.function", "8", vec![8]),
        ("hello", "gpu_pci.is_present", "hidden", u16(0)),
        ("hello", "reserved", "1", u32(1)),
        ("goodbye", "reason", "unknown", u32(99)),
        ("create_stream", "stream", "0", u32(0)),
        ("create_stream", "width", "0", u32(0)),
        ("create_stream", "height", "8193", u32(8193)),
        ("create_stream", "color_format", "0", u32(0)),
        ("create_stream", "color_format", "unknown", u32(77)),
        ("create_stream", "transfer", "unknown", u32(4)),
        ("create_stream", "primaries", "unknown", u32(4)),
        ("create_stream", "white_cd_m2", "nan", f32(f32::NAN)),
        ("create_stream", "white_cd_m2", "negative", f32(-1.0)),
        ("create_stream", "white_cd_m2", "10001", f32(10_001.0)),
        ("create_stream", "valid_rect_use", "unknown", u32(9)),
        ("create_stream", "depth_format", "unknown", u32(5)),
        ("create_stream", "depth_meaning", "0", u32(0)),
        ("create_stream", "depth_meaning", "without_format", u32(0)),
        ("create_stream", "motion_format", "none_but_unit", u32(0)),
        ("create_stream", "motion_direction", "unknown", u32(3)),
        ("create_stream", "motion_unit", "unknown", u32(4)),
        ("create_stream", "camera_motion", "unknown", u32(3)),
        ("create_stream", "motion_scale", "0", f32(0.0)),
        ("create_stream", "motion_scale", "infinite", f32(f32::INFINITY)),
        ("create_stream", "motion_scale", "1e7", f32(1e7)),
        ("create_stream", "ui_format", "unknown", u32(4)),
        ("create_stream", "mask_format", "unknown", u32(2)),
        ("create_stream", "slots", "0", u32(0)),
        ("create_stream", "slots", "9", u32(9)),
        ("create_stream", "max_sizes", "color_smaller", u32(1919)),
        ("create_stream", "reserved", "1", u32(1)),
        ("register_pool", "slots", "0", u32(0)),
        ("register_pool", "slots", "9", u32(9)),
        ("register_pool", "slot_bytes", "0", u64(0)),
        ("register_pool", "slot_bytes", "unaligned", u64(4097)),
        ("register_pool", "slot_bytes", "huge", u64(1 << 40)),
        ("register_pool", "slot_bytes", "2_to_64", u64(u64::MAX - 4095)),
        ("submit", "stream", "0", u32(0)),
        ("submit", "slot", "8", u32(8)),
        ("submit", "content_time_ns", "2_to_63", u64(1 << 63)),
        ("submit", "motion_from_ns", "same_time", u64(2_000_000_000)),
        ("submit", "motion_from_ns", "later", u64(u64::MAX)),
        ("submit", "flags", "unknown", u32(0x1f)),
        ("submit", "flags", "hidden_motion_from", u32(0b1101)),
        ("submit", "flags", "hidden_camera", u32(0b1011)),
        ("submit", "plane_bits", "no_color", u32(0b11110)),
        ("submit", "plane_bits", "unknown", u32(0b111111)),
        ("submit", "plane_bits", "hidden_depth", u32(0b11101)),
        ("submit", "plane.offset", "unaligned", u64(8)),
        ("submit", "plane.width", "0", u32(0)),
        ("submit", "plane.width", "8193", u32(8193)),
        ("submit", "plane.height", "2_to_32", u32(u32::MAX)),
        ("submit", "plane.stride", "huge", u32(u32::MAX)),
        ("submit", "plane.reserved", "1", u32(1)),
        ("submit", "plane.valid_x", "outside", u32(1)),
        ("submit", "plane.valid_y", "overflow", u32(u32::MAX)),
        ("submit", "plane.valid_width", "empty", u32(0)),
        ("submit", "plane.valid_height", "tall", u32(541)),
        ("submit", "plane.jitter", "nan", f32(f32::NAN)),
        ("submit", "plane.jitter", "large", f32(1.5)),
        ("submit", "view", "nan", f32(f32::NAN)),
        ("submit", "view", "infinite", f32(f32::NEG_INFINITY)),
        ("submit", "view", "singular", f32(0.0)),
        ("submit", "projection", "singular", f32(0.0)),
        ("submit", "motion_from_view", "nan", f32(f32::NAN)),
        ("submit", "motion_from_projection", "singular", f32(0.0)),
        ("late_camera", "stream", "0", u32(0)),
        ("late_camera", "content_time_ns", "2_to_63", u64(1 << 63)),
        ("late_camera", "view", "nan", f32(f32::NAN)),
        ("ui_plane", "stream", "0", u32(0)),
        ("ui_plane", "slot", "8", u32(8)),
        ("ui_plane", "x", "8193", u32(8193)),
        ("ui_plane", "y", "lowest", u32(0x8000_0000)),
        ("ui_plane", "reserved", "1", u64(1)),
        ("ui_plane", "plane.width", "0", u32(0)),
        ("ui_plane", "plane.offset", "unaligned", u64(8)),
        ("ui_plane", "plane.stride", "huge", u32(u32::MAX)),
        ("ui_plane", "plane.valid_x", "outside", u32(21)),
        ("ui_plane", "plane.jitter", "some", f32(0.5)),
        ("subscribe", "slots", "0", u32(0)),
        ("subscribe", "slots", "9", u32(9)),
        ("output_released", "slot", "8", u32(8)),
        ("destroy_stream", "stream", "0", u32(0)),
        ("welcome", "clock", "unknown", u32(2)),
        ("welcome", "max_slots", "9", u32(9)),
        ("welcome", "max_width", "0", u32(0)),
        ("welcome", "max_pool_bytes", "0", u64(0)),
        ("welcome", "gpu_kind", "unknown", u32(0)),
        ("slot_released", "reason", "unknown", u32(0)),
        ("slot_released", "slot", "8", u32(8)),
        ("presented", "phase_q12", "above_4", u32(16_385)),
        ("error", "code", "unknown", u32(0)),
        ("error", "expected_length", "225", u32(225)),
        ("hint", "width", "0", u32(0)),
        ("output_pool", "stride", "short", u32(2556)),
        ("output_pool", "stride", "unaligned", u32(2562)),
        ("output_pool", "slot_bytes", "short", u64(4096)),
        ("output_pool", "white_cd_m2", "nan", f32(f32::NAN)),
        ("output_frame", "kind", "unknown", u32(4)),
        ("output_frame", "slot", "8", u32(8)),
        ("output_frame", "phase_q12", "above_4", u32(16_385)),
        ("output_ended", "reason", "unknown", u32(0)),
    ]
}

/// Packets whose header is to blame.
fn bad_headers() -> Vec<(String, Vec<u8>)> {
    let good = || client_packets().swap_remove(5).1;
    let patch = |offset: usize, bytes: &[u8]| {
        let mut packet = good();
        packet[offset..offset + bytes.len()].copy_from_slice(bytes);
        packet
    };
    let case = |name: &str, packet: Vec<u8>| (format!("packet-{name}"), packet);
    vec![
        case("short", good()[..15].to_vec()),
        case("magic", patch(0, b"GET ")),
        case("major", patch(4, &[0, 0])),
        case("kind-unknown", patch(6, &[200, 0])),
        case("length-short", patch(8, &[16, 0])),
        case("length-huge", patch(8, &[255, 255, 255, 255])),
        case("reserved", patch(12, &[1])),
    ]
}

/// The error that a packet gives to the side that would receive it.
fn refused(packet: &[u8]) -> Option<Error> {
    match (ClientMessage::parse(packet), DaemonMessage::parse(packet)) {
        (Ok(_), _) | (_, Ok(_)) => None,
        (Err(Error::Packet { expected, .. }), Err(error)) if expected.contains("client sends") => {
            Some(error)
        }
        (Err(error), _) => Some(error),
    }
}

#[test]
fn invalid_packets_say_what_was_expected_and_found() {
    let mut cases = bad_headers();
    cases.extend(bad_profiles());
    for (sample, path, fault, bytes) in bad_fields() {
        let name = format!("{sample}-{}-{fault}", path.replace('.', "-"));
        cases.push((name, patched(sample, path, &bytes)));
    }
    for (name, packet) in &cases {
        let error = refused(packet).unwrap_or_else(|| panic!("{name} must be refused"));
        let text = error.to_string();
        assert!(text.contains("expected") && text.contains("found"), "{name}: {text}");
        same_or_blessed("invalid", &format!("{name}.bin"), packet);
        same_or_blessed("invalid", &format!("{name}.txt"), format!("{text}\n").as_bytes());
    }
    assert_eq!(files_in("invalid"), 2 * cases.len());
}

#[test]
fn the_error_names_the_field_that_was_damaged() {
    for (sample, path, fault, bytes) in bad_fields() {
        let error = refused(&patched(sample, path, &bytes)).expect("refused");
        // What is hidden is found where it hides, and sizes and rectangles are judged as a whole.
        let is_elsewhere = fault.contains("hidden")
            || ["none_but_unit", "short", "other"].contains(&fault)
            || path.starts_with("plane.");
        let (field, ..) = error.parts();
        assert!(
            is_elsewhere || field.contains(path.trim_end_matches("_length")),
            "{sample} {path} {fault}: {error}"
        );
    }
}

/// Good packets with a few bytes damaged, the same ones on every machine (xorshift64).
fn fuzzed() -> Vec<Vec<u8>> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        usize::try_from(state >> 33).expect("31 bits") % below
    };
    let samples: Vec<_> = client_packets().into_iter().chain(daemon_packets()).collect();
    (0..64)
        .map(|_| {
            let mut packet = samples[random(samples.len())].1.clone();
            for _ in 0..=random(6) {
                let place = random(packet.len());
                packet[place] = u8::try_from(random(256)).expect("a byte");
            }
            packet.truncate(HEADER_BYTES + random(packet.len()));
            packet
        })
        .collect()
}

#[test]
fn fuzzed_packets_do_not_panic() {
    let packets = fuzzed();
    for (number, packet) in packets.iter().enumerate() {
        same_or_blessed("fuzzed", &format!("{number:02}.bin"), packet);
        let _outcome = (ClientMessage::parse(packet), DaemonMessage::parse(packet));
    }
    assert_eq!(files_in("fuzzed"), packets.len());
}
