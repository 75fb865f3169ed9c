//! Compares what the engine makes of a capture with what it made before.
//!
//! A [`Baseline`] is a small file that lies beside the source code of whoever depends on the
//! pictures: digests and quality of a few methods on one capture. The same capture, told by a hash
//! of all that was recorded, gives the same bytes on every machine, so another digest is a change
//! of the engine, and [`Metric::loss`] says whether it is one for the worse.

mod baseline;
mod junit;
mod metric;
#[cfg(test)]
mod tests;

use serde::Serialize;

pub use baseline::{Baseline, MethodBaseline};
pub use junit::junit;
pub use metric::{Metric, Quality};

/// What may differ.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Demand {
    /// Nothing: every frame has the same bytes.
    SameBytes,
    /// Bytes may, quality may not be lost.
    Quality,
}

/// What became of a capture.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Comparison {
    /// Whether nothing regressed.
    pub passed: bool,
    /// Name of what was recorded.
    pub capture: String,
    /// Frames from key to key.
    pub ratio: usize,
    /// One entry per method of the baseline.
    pub methods: Vec<MethodComparison>,
}

/// What became of one method.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MethodComparison {
    /// Name of the method.
    pub name: String,
    /// The digest of all its frames.
    pub digest: DigestComparison,
    /// One entry per metric.
    pub quality: Vec<MetricComparison>,
}

/// Whether all frames have the bytes that they had.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct DigestComparison {
    /// Whether they have to.
    pub is_asked: bool,
    /// Whether they have, or need not.
    pub passed: bool,
    /// That of the baseline, 32 hexadecimal digits.
    pub baseline: String,
    /// That of now; None where the method was not run.
    pub found: Option<String>,
}

/// Whether one metric is as good as it was.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MetricComparison {
    /// Whether it is.
    pub passed: bool,
    /// Its name in `score --json`.
    pub metric: Metric,
    /// That of the baseline.
    pub baseline: f64,
    /// That of now; None where the method was not run.
    pub found: Option<f64>,
    /// By how much it may be worse.
    pub tolerance: f64,
}

impl Comparison {
    /// Of what `found` has with what `baseline` has, which is of the same capture and ratio.
    #[must_use]
    pub fn new(baseline: &Baseline, found: &Baseline, demand: Demand) -> Self {
        let methods: Vec<_> = baseline
            .methods
            .iter()
            .map(|was| {
                let is = found.methods.iter().find(|is| is.name == was.name);
                MethodComparison::new(was, is, demand)
            })
            .collect();
        Self {
            passed: methods.iter().all(|method| method.failures() == 0),
            capture: baseline.capture.clone(),
            ratio: baseline.ratio,
            methods,
        }
    }

    /// How many digests and metrics were compared, and how many of them failed.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        let of =
            |method: &MethodComparison| usize::from(method.digest.is_asked) + method.quality.len();
        let compared = self.methods.iter().map(of).sum();
        (compared, self.methods.iter().map(MethodComparison::failures).sum())
    }

    /// A table for people.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!("{}: 1 of {} frames is a key\n", self.capture, self.ratio);
        let verdict = |passed: bool| if passed { "ok" } else { "FAILED" };
        for MethodComparison { name, digest, quality } in &self.methods {
            text += &format!("\n{name}\n");
            let mut line = |verdict: &str, name: &str, said: &str| {
                text += &format!("  {verdict:<7} {name:<19} {said}\n");
            };
            let of_digest = if digest.is_asked { verdict(digest.passed) } else { "skipped" };
            line(of_digest, "digest", &digest.to_text());
            for metric in quality {
                line(verdict(metric.passed), metric.metric.name(), &metric.to_text());
            }
        }
        text
    }
}

impl MethodComparison {
    fn new(was: &MethodBaseline, is: Option<&MethodBaseline>, demand: Demand) -> Self {
        let is_asked = demand == Demand::SameBytes;
        let found = is.map(|is| is.digest.clone());
        let digest = DigestComparison {
            is_asked,
            passed: !is_asked || found.as_ref() == Some(&was.digest),
            baseline: was.digest.clone(),
            found,
        };
        let quality = Metric::ALL.map(|metric| {
            let (baseline, tolerance) = (was.quality.of(metric), metric.tolerance());
            let found = is.map(|is| is.quality.of(metric));
            // Written so that NaN fails it.
            let passed = found.is_some_and(|found| metric.loss(baseline, found) <= tolerance);
            MetricComparison { passed, metric, baseline, found, tolerance }
        });
        Self { name: was.name.clone(), digest, quality: quality.into() }
    }

    fn failures(&self) -> usize {
        let metrics = self.quality.iter().filter(|metric| !metric.passed).count();
        metrics + usize::from(!self.digest.passed)
    }
}

impl DigestComparison {
    /// What was expected and what was found.
    #[must_use]
    pub fn to_text(&self) -> String {
        let Self { passed, baseline, found, .. } = self;
        let found = found.as_deref().unwrap_or("none");
        match (baseline == found, passed) {
            (true, _) => found.to_owned(),
            (false, true) => format!("{found}, was {baseline}"),
            (false, false) => format!("expected {baseline}, found {found}"),
        }
    }
}

impl MetricComparison {
    /// What was expected and what was found.
    #[must_use]
    pub fn to_text(&self) -> String {
        let Self { passed, baseline, found, tolerance, .. } = self;
        match found {
            Some(found) if *passed => format!("{found:.4} ({:+.4})", found - baseline),
            Some(found) => {
                format!("expected {baseline:.4} to within {tolerance}, found {found:.4}")
            }
            None => format!("expected {baseline:.4}, found nothing to measure"),
        }
    }
}
