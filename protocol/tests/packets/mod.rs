//! One packet of each type that is good in every field.

use foreframe_protocol::*;

use crate::samples::{IDENTITY, SLOT_BYTES, output_pool, stream, submit, ui_plane};

fn hello() -> Hello {
    Hello {
        gpu_pci: Some(PciAddress { domain: 0, bus: 1, device: 2, function: 3 }),
        gpu_uuid: Some([5; 16]),
        ..Hello::new("a game")
    }
}

fn welcome() -> Welcome {
    Welcome {
        major: 1,
        minor: 0,
        session: 9,
        features: Features::OUTPUT,
        clock: Clock::Monotonic,
        clock_now_ns: 123_456_789,
        max_streams: 4,
        max_slots: 8,
        max_width: 8192,
        max_height: 8192,
        max_pool_bytes: 1 << 30,
        refresh_interval_ns: 8_333_333,
        gpu_kind: GpuKind::Integrated,
        gpu_name: "a GPU".to_owned(),
        gpu_pci: Some(PciAddress { domain: 0, bus: 0, device: 2, function: 0 }),
    }
}

/// Name and bytes of one good packet of every type that a client sends.
pub(crate) fn client_packets() -> Vec<(String, Vec<u8>)> {
    let messages: Vec<ClientMessage> = vec![
        hello().into(),
        Goodbye { reason: EndReason::Requested }.into(),
        stream().into(),
        RegisterPool { stream: 1, pool: 1, slots: 3, slot_bytes: SLOT_BYTES }.into(),
        DestroyStream { stream: 1 }.into(),
        submit().into(),
        LateCamera { stream: 1, content_time_ns: 2_000_000_000, view: IDENTITY }.into(),
        ui_plane().into(),
        Subscribe { stream: 0, slots: 3 }.into(),
        Unsubscribe { stream: 0 }.into(),
        OutputReleased { pool: 4, slot: 1 }.into(),
    ];
    messages.iter().map(|m| (m.kind().to_string(), m.to_packet().as_bytes().to_vec())).collect()
}

/// Name and bytes of one good packet of every type that a daemon sends.
pub(crate) fn daemon_packets() -> Vec<(String, Vec<u8>)> {
    let (stream, key_index) = (1, 77);
    let messages: Vec<DaemonMessage> = vec![
        Reject::new(RejectCode::Version, "expected major 1, found 2").into(),
        welcome().into(),
        Goodbye { reason: EndReason::Stopping }.into(),
        ErrorMessage {
            code: ErrorCode::Plane,
            is_fatal: true,
            stream: Some(stream),
            field: "depth plane, stride".to_owned(),
            expected: "at least 3840".to_owned(),
            found: "0".to_owned(),
        }
        .into(),
        StreamCreated { stream, slots: 3 }.into(),
        PoolAccepted { stream, pool: 1 }.into(),
        StreamEnded { stream, reason: EndReason::Requested }.into(),
        SlotReleased { stream, slot: 2, key_index, reason: ReleaseReason::Copied }.into(),
        Presented {
            stream,
            phase_q12: 1365,
            key_index,
            content_time_ns: 2_008_000_000,
            received_at_ns: 2_001_000_000,
            present_at_ns: 2_010_000_000,
            presented_at_ns: 2_010_100_000,
        }
        .into(),
        Statistics {
            stream,
            keys_received: 40,
            keys_superseded: 1,
            keys_refused: 2,
            presented: 120,
            real: 37,
            synthesised: 80,
            repeated: 3,
            dropped: 4,
            synthesis_mean_ns: 3_000_000,
        }
        .into(),
        Pacing {
            stream,
            key_index,
            refresh_interval_ns: 8_333_333,
            slack_ns: -100,
            phase_error_ns: 2000,
        }
        .into(),
        Hint { stream, width: 1600, height: 900, key_interval_ns: 20_000_000 }.into(),
        output_pool().into(),
        OutputFrame {
            stream: 0,
            pool: 4,
            slot: 1,
            kind: OutputKind::Synthesised,
            phase_q12: 4096,
            sequence: 231,
            key_index,
            content_time_ns: 2_008_000_000,
            present_at_ns: 2_010_000_000,
            skipped: 5,
        }
        .into(),
        OutputEnded { stream: 0, reason: EndReason::SourceEnded }.into(),
    ];
    messages.iter().map(|m| (m.kind().to_string(), m.to_packet().as_bytes().to_vec())).collect()
}
