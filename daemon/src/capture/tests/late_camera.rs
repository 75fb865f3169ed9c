//! Poses that arrive after their keys: recorded whole, or known to be damaged.

use foreframe_protocol::LateCamera;

use super::*;

fn pose(stream: u32, number: u32) -> CapturedPose {
    let content_time_ns = 1_000_000_000 + u64::from(number) * INTERVAL_NS / 3;
    let pose = LateCamera { stream, content_time_ns, view: camera(0.5 + number as f32).view };
    CapturedPose { stream: 0, arrived_at_ns: content_time_ns + 77, pose }
}

/// A frame, two poses, a frame, a pose.
fn written() -> Vec<u8> {
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    writer.add_stream(&create(1)).unwrap();
    for (frame, poses) in [(0, 0..2), (1, 2..3)] {
        Sample::new(1, frame).write(&mut writer).unwrap();
        for number in poses {
            let pose = pose(1, number);
            writer.late_camera(pose.arrived_at_ns, &pose.pose).unwrap();
        }
    }
    writer.finish().unwrap()
}

#[test]
fn poses_come_back_between_the_frames_as_they_were_written() {
    let bytes = written();
    let capture = open(&bytes).unwrap();
    assert_eq!(capture.late_cameras(), [0, 1, 2].map(|number| pose(1, number)));
    assert_eq!(capture.frame_count(), 2);
    let info = capture.info().unwrap();
    assert_eq!(info.streams[0].late_cameras, 3);
    assert!(!info.is_truncated() && info.damaged.is_empty());
}

#[test]
fn a_pose_of_a_stream_that_was_not_added_is_refused() {
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    writer.add_stream(&create(1)).unwrap();
    let error = writer.late_camera(5, &pose(2, 0).pose).unwrap_err().to_string();
    assert!(error.contains("a stream that was added"), "{error}");
}

#[test]
fn a_file_cut_off_anywhere_keeps_the_poses_before_the_cut() {
    let bytes = written();
    let mut most = 0;
    for len in 0..bytes.len() {
        let Ok(capture) = open(&bytes[..len]) else { continue };
        let poses = capture.late_cameras();
        assert!(poses.len() >= most, "{} poses at {len}, {most} before", poses.len());
        most = poses.len();
        for (number, found) in (0..).zip(poses) {
            assert_eq!(*found, pose(1, number));
        }
    }
    assert_eq!(most, 3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn no_flipped_bit_changes_a_pose_in_silence(place: prop::sample::Index, bit in 0_u8..8) {
        let mut bytes = written();
        let at = place.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        if let Ok(capture) = open(&bytes) {
            let known = [0, 1, 2].map(|number| pose(1, number));
            let found = capture.late_cameras();
            prop_assert!(found.iter().all(|pose| known.contains(pose)), "byte {at}: {found:?}");
            let noticed = capture
                .info()
                .is_ok_and(|info| info.is_truncated() || !info.damaged.is_empty());
            prop_assert!(noticed || found.len() == 3, "a pose was lost in silence, byte {at}");
        }
    }
}
