//! What fails a comparison, and what does not.

use super::*;

fn method(name: &str, digest: char, psnr: f64, flip: f64) -> MethodBaseline {
    let quality = Quality {
        psnr_rgb_db: psnr,
        psnr_y_db: 31.0,
        ssim: 0.9,
        flip,
        worst_tile_psnr_db: 12.0,
        error_flicker: 1.0,
    };
    MethodBaseline { name: name.into(), digest: digest.to_string().repeat(32), quality }
}

fn baseline(methods: &[MethodBaseline]) -> Baseline {
    Baseline {
        foreframe_baseline: 1,
        version: "0.1.0".into(),
        capture: "a <cart> & \"co\"\u{1b}".into(),
        ratio: 4,
        frames: 36,
        content: "ab".repeat(16),
        methods: methods.to_vec(),
    }
}

fn compared(found: &[MethodBaseline], demand: Demand) -> Comparison {
    let was = baseline(&[method("linear", 'a', 30.0, 0.1), method("auto", 'b', 32.0, 0.09)]);
    Comparison::new(&was, &baseline(found), demand)
}

fn failed(comparison: &Comparison) -> Vec<String> {
    let of = |method: &MethodComparison| {
        let digest = (!method.digest.passed).then(|| format!("{} digest", method.name));
        let metrics = method.quality.iter().filter(|metric| !metric.passed);
        let metrics = metrics.map(|metric| format!("{} {}", method.name, metric.metric.name()));
        digest.into_iter().chain(metrics).collect::<Vec<_>>()
    };
    comparison.methods.iter().flat_map(of).collect()
}

#[test]
fn the_same_passes_and_what_the_baseline_lacks_is_not_asked() {
    let same = [
        method("auto", 'b', 32.0, 0.09),
        method("hold", 'c', 20.0, 0.3),
        method("linear", 'a', 30.0, 0.1),
    ];
    let comparison = compared(&same, Demand::SameBytes);
    assert!(comparison.passed);
    assert_eq!(comparison.counts(), (14, 0));
}

#[test]
fn other_bytes_fail_unless_quality_alone_is_asked_for() {
    let other = [method("linear", 'a', 30.0, 0.1), method("auto", 'c', 33.0, 0.08)];
    let strict = compared(&other, Demand::SameBytes);
    assert_eq!((strict.passed, failed(&strict)), (false, vec!["auto digest".to_owned()]));
    let lenient = compared(&other, Demand::Quality);
    assert!(lenient.passed && lenient.methods[1].digest.found.as_ref().unwrap().starts_with('c'));
    assert_eq!(lenient.counts(), (12, 0), "digests are not asked for");
    assert!(lenient.to_text().contains("skipped digest"), "{}", lenient.to_text());
}

#[test]
fn quality_may_be_lost_by_the_tolerance_and_no_more_in_its_own_direction() {
    let by = |psnr: f64, flip: f64| {
        let found =
            [method("linear", 'a', 30.0 + psnr, 0.1 + flip), method("auto", 'b', 32.0, 0.09)];
        failed(&compared(&found, Demand::Quality))
    };
    for (psnr, flip) in [(-0.04, 0.0009), (9.0, -0.05)] {
        assert_eq!(by(psnr, flip), Vec::<String>::new());
    }
    assert_eq!(by(-0.06, 0.0), ["linear psnr_rgb_db"]);
    assert_eq!(by(0.0, 0.0011), ["linear flip"]);
    assert_eq!(by(f64::NAN, 0.0), ["linear psnr_rgb_db"]);
}

#[test]
fn what_nobody_sees_of_a_nearly_exact_picture_is_no_loss() {
    let loss = |was: f64, is: f64| Metric::PsnrRgbDb.loss(was, is);
    assert_eq!((loss(100.0, 68.0), loss(100.0, 49.0), loss(30.0, 100.0)), (0.0, 1.0, -20.0));
    assert!(loss(100.0, f64::NAN).is_nan());
}

#[test]
fn a_method_that_was_not_run_fails() {
    let comparison = compared(&[method("linear", 'a', 30.0, 0.1)], Demand::Quality);
    assert!(!comparison.passed);
    assert_eq!(failed(&comparison).len(), 6);
    assert!(comparison.to_text().contains("found nothing to measure"));
}

#[test]
fn junit_has_a_case_for_each_and_says_what_failed_with_names_escaped() {
    let found = [method("linear", 'a', 29.0, 0.1), method("auto", 'c', 32.0, 0.09)];
    let xml = junit(&compared(&found, Demand::SameBytes)).unwrap();
    let suite = "<testsuite name=\"a &lt;cart&gt; &amp; &quot;co&quot;\" tests=\"14\" failures=\"2\" skipped=\"0\">";
    assert!(xml.contains(suite), "{xml}");
    assert_eq!(xml.matches("<testcase ").count(), 14);
    assert_eq!(xml.matches("</failure>").count(), 2);
    assert!(xml.contains("expected 30.0000 to within 0.05, found 29.0000"), "{xml}");
    let passed = junit(&compared(&found, Demand::Quality)).unwrap();
    let count = |tag: &str| passed.matches(tag).count();
    assert_eq!((count("</failure>"), count("<skipped/>"), count("skipped=\"2\"")), (1, 2, 1));
}

#[test]
fn a_table_names_every_method_and_what_became_of_it() {
    let found = [method("linear", 'a', 29.0, 0.1), method("auto", 'b', 32.5, 0.09)];
    let text = compared(&found, Demand::SameBytes).to_text();
    assert!(
        text.contains("FAILED  psnr_rgb_db         expected 30.0000 to within 0.05, found 29.0000"),
        "{text}"
    );
    assert!(text.contains("ok      psnr_rgb_db         32.5000 (+0.5000)"), "{text}");
}
