use foreframe_fixtures::probes;

use super::*;
use crate::stability::spoil::Spoil;
use crate::stability::sweeps::Calm;

const METHODS: [Method; 3] = [Method::Hold, Method::Blend, Method::Linear];

/// Six keys of boards that slide by whole pixels, the fourth spoilt as `spoil` says.
fn case(spoil: Option<Spoil>, dropped: Vec<usize>) -> Case {
    let keys: Vec<_> =
        (0..6).map(|key| KeyRecipe::new(f64::from(key), f64::from(key) - 1.0)).collect();
    Case {
        probe: Box::new(|| probes::sliding(8.0)),
        keys: keys.clone(),
        frames: Frames::Quarters,
        spoil: spoil.map(|spoil| (spoil, 3..4)),
        dropped,
        measured: 3..4,
        sound_again: vec![4],
        calm: Some(Calm { probe: None, keys }),
    }
}

fn of(points: &[MethodPoint], method: Method) -> &MethodPoint {
    points.iter().find(|point| point.name == method.name()).unwrap()
}

#[test]
fn without_motion_a_method_that_needs_it_estimates_it_and_recovers_with_the_next() {
    let sound = run_case(&case(None, Vec::new()), &METHODS).unwrap();
    let blind = run_case(&case(Some(Spoil::MotionMissing), Vec::new()), &METHODS).unwrap();
    let [hold, linear] = [Method::Hold, Method::Linear];
    let gain =
        |points: &[MethodPoint]| of(points, linear).psnr_rgb_db - of(points, hold).psnr_rgb_db;
    assert!(gain(&sound) > 5.0);
    assert!((2.0..gain(&sound)).contains(&gain(&blind)), "{} dB", gain(&blind));
    assert_eq!(of(&blind, linear).keys_to_recover, Some(1));
    assert_eq!(of(&blind, hold), of(&sound, hold), "hold looks at no motion");
}

#[test]
fn a_mask_lets_a_reflection_move_that_no_vector_tells_of() {
    let case = |has_mask| {
        let mut keys: Vec<_> =
            (0..6).map(|key| KeyRecipe::new(f64::from(key), f64::from(key) - 1.0)).collect();
        keys.iter_mut().for_each(|key| key.has_mask = has_mask);
        Case { probe: Box::new(|| probes::mirror(4.0)), keys, calm: None, ..case(None, Vec::new()) }
    };
    let methods = [Method::Hold, Method::Linear];
    let plain = run_case(&case(false), &methods).unwrap();
    let masked = run_case(&case(true), &methods).unwrap();
    let psnr = |points: &[MethodPoint], method| of(points, method).psnr_rgb_db;
    assert!((psnr(&plain, Method::Linear) - psnr(&plain, Method::Hold)).abs() < 0.1);
    assert!(psnr(&masked, Method::Linear) > psnr(&plain, Method::Linear) + 3.0);
    assert!((psnr(&masked, Method::Hold) - psnr(&plain, Method::Hold)).abs() < 1e-9);
}

#[test]
fn a_key_that_never_arrives_is_predicted_too_and_from_the_key_before_it() {
    let sound = run_case(&case(None, Vec::new()), &METHODS).unwrap();
    let dropped = run_case(&case(None, vec![3]), &METHODS).unwrap();
    for method in METHODS {
        assert!(
            of(&dropped, method).psnr_rgb_db < of(&sound, method).psnr_rgb_db - 0.3,
            "{method}"
        );
    }
    let probe = probes::sliding(8.0);
    let case = case(None, vec![3]);
    let sequence = sequence_of(&case, &probe, &shoot(&probe, &case.keys));
    assert_eq!(sequence.keys.iter().map(|key| key.index).collect::<Vec<_>>(), [0, 1, 2, 4, 5]);
    let newest: Vec<_> = sequence.outputs.iter().map(|output| output.newest).collect();
    assert_eq!(newest, [0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3]);
}

#[test]
fn methods_that_interpolate_have_no_part_in_extrapolating_ever_farther() {
    let far = Case { frames: Frames::After(0.5), ..case(None, Vec::new()) };
    let names: Vec<_> = run_case(&far, &METHODS).unwrap().iter().map(|point| point.name).collect();
    assert_eq!(names, ["hold", "linear"]);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let sweep = Sweep::by_name("missing").unwrap();
        pool.install(|| run_sweep(sweep, &[Method::Hold, Method::Linear], || ()).unwrap())
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn recovery_counts_sound_keys_up_to_the_first_interval_that_is_as_good_as_without_the_event() {
    let of = |made: [f64; 6], sound_again: &[usize]| {
        let some = |values: [f64; 6]| values.map(Some);
        let case = Case { sound_again: sound_again.to_vec(), ..case(None, Vec::new()) };
        keys_to_recover(&some(made), &some([30.0; 6]), &case)
    };
    assert_eq!(of([30.0, 30.0, 20.0, 30.0, 30.0, 30.0], &[3]), Some(1));
    assert_eq!(of([30.0, 30.0, 20.0, 29.4, 29.6, 30.0], &[3]), Some(2));
    assert_eq!(of([30.0, 30.0, 20.0, 20.0, 20.0, 20.0], &[3]), None);
    assert_eq!(of([20.0, 30.0, 20.0, 20.0, 20.0, 30.0], &[1, 4]), Some(2), "the most counts");
    assert_eq!(of([20.0, 20.0, 20.0, 30.0, 30.0, 30.0], &[1, 3]), None, "not before the next");
}
