//! What an eye that follows the motion sees: frames in between come closer to the truth than keys
//! that are held (Didyk et al. 2010, figure 8).

use foreframe_engine::FinishMode;
use foreframe_fixtures::{SceneInfo, Size};

use super::*;
use crate::commands::scenes;
use crate::output::Output;
use crate::recording::capture::CaptureRecording;
use crate::score::retina::RetinaScore;

/// Scores of `methods` on the retina, in their order: keys at 40 Hz of a scene at 120 Hz.
fn scores<const N: usize>(
    scene: &str,
    size: Size,
    methods: [Method; N],
    finish: FinishMode,
) -> [RetinaScore; N] {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.mcap");
    let args = scenes::Args {
        name: Some(SceneInfo::by_name(scene).unwrap()),
        output: Some(path.clone()),
        png: None,
        size,
        rate: 120.0,
        seconds: 0.2,
        field_ratio: 2.0,
    };
    scenes::run(&args, &Output::new(true)).unwrap();
    let options = ScoreOptions {
        ratio: NonZeroUsize::new(3).unwrap(),
        retina: true,
        finish: FinishConfig::new(finish, None, foreframe_engine::MonoSpan::from_hz(120.0)),
        ..options(&methods)
    };
    let mut recording = CaptureRecording::open(&path).unwrap();
    let scored = score_recording(scene, &mut recording, &options, || {}).unwrap();
    let retina = scored.methods.iter().map(|method| method.retina.expect("windows were seen"));
    retina.collect::<Vec<_>>().try_into().unwrap()
}

#[test]
fn on_the_retina_frames_in_between_are_closer_to_the_truth_than_keys_alone_and_held_ones_are_not() {
    let size = Size::new(256, 144);
    for scene in ["pan", "cube-fast", "fighter"] {
        for finish in [FinishMode::Off, FinishMode::On] {
            let methods = [Method::Linear, Method::Auto, Method::Hold];
            let [linear, auto, hold] = scores(scene, size, methods, finish);
            for made in [linear, auto] {
                assert!(made.psnr_rgb_db > made.keys_psnr_rgb_db, "{scene}, {finish}: {made:?}");
                assert!(made.ssim > made.keys_ssim, "{scene}, {finish}: {made:?}");
            }
            // Negative control: 120 pictures a second are not enough, they have to move. Finishing
            // sharpens even held ones, as it shows detail for one refresh of three.
            if finish == FinishMode::Off {
                assert!(hold.psnr_rgb_db < hold.keys_psnr_rgb_db, "{scene}: {hold:?}");
                assert!(hold.ssim < hold.keys_ssim, "{scene}: {hold:?}");
            }
        }
    }
}

#[test]
fn on_the_retina_a_scene_that_stands_still_is_no_worse() {
    let [still] = scores("static", Size::new(96, 54), [Method::Auto], FinishMode::Off);
    assert!(still.psnr_rgb_db >= still.keys_psnr_rgb_db && still.ssim >= still.keys_ssim);
}
