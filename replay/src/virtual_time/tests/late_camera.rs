//! Poses that arrive after their keys.

use foreframe_engine::key::Camera;

use super::*;

const IDENTITY: [f32; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

/// A camera that looks down -z, 90 degrees wide, moved `x` metres to the right.
fn camera(x: f32) -> Camera {
    let mut view = IDENTITY;
    view[12] = -x;
    let (near, far) = (0.1_f32, 100.0_f32);
    let (a, b) = (far / (near - far), far * near / (near - far));
    let projection = [1., 0., 0., 0., 0., 2., 0., 0., 0., 0., a, -1., 0., 0., b, 0.];
    Camera { view, projection }
}

/// What `world` shows of a still world under a camera that stands still, with these late poses.
fn shown(late_cameras: Vec<TimedPose>, threads: usize) -> Vec<(OutputFrame, String)> {
    let mut recording = MemoryRecording::moving_patch(25, [0, 0], &[4]);
    let plan = Plan::new(&recording.heads, count(4));
    let reader = KeyReader::new(recording.format(), &plan).unwrap();
    let config = ReplayConfig {
        method: Method::World,
        gpu: None,
        threads: count(threads),
        refresh_interval: MonoSpan::from_hz(120.0),
        display_origin: None,
        pixels_per_degree: None,
        finish: FinishConfig::default(),
        least_step_px: 0.0,
        late_cameras,
    };
    let keys = timed_keys(&mut recording, &reader, &plan, KeyTiming::AsRecorded).map(|key| {
        let mut key = key?;
        key.frame.camera = Some(camera(0.0));
        key.frame.motion_from_camera = Some(camera(0.0));
        Ok(key)
    });
    let (mut digester, mut frames) = (FrameDigester::default(), Vec::new());
    replay(*reader.format(), &config, keys, [], |frame, picture| {
        frames.push((*frame, digester.add(picture)));
        Ok(())
    })
    .unwrap();
    frames
}

#[test]
fn a_pose_leads_the_pictures_that_are_made_after_it_arrived_and_no_others() {
    let still = shown(Vec::new(), 1);
    let heads = recording().heads;
    // Between the fourth key and the fifth, when the fourth has been shown.
    let arrives_at = heads[12].arrived_at + MonoSpan::from_ms(10);
    let content_time = heads[12].content_time + MonoSpan::from_ms(20);
    let pose = TimedPose { arrives_at, content_time, view: camera(0.2).view };
    let led = shown(vec![pose], 1);
    let times = |frames: &[(OutputFrame, String)]| {
        frames.iter().map(|(frame, _)| (frame.present_at, frame.content_time)).collect::<Vec<_>>()
    };
    assert_eq!(times(&led), times(&still), "a pose changes pictures, not times");
    let changed: Vec<_> = led
        .iter()
        .zip(&still)
        .filter(|((_, led), (_, still))| led != still)
        .map(|((frame, _), _)| frame)
        .collect();
    assert!(!changed.is_empty(), "nothing was led");
    for frame in changed {
        assert!(frame.present_at > arrives_at && frame.key == 12, "{frame:?}");
    }
    for threads in [2, 5] {
        assert_eq!(shown(vec![pose], threads), led);
    }
}
