//! The file that a capture is compared with: JSON with one line per value, for version control.

use std::fs;
use std::io::ErrorKind;
use std::num::NonZeroUsize;
use std::path::Path;

use anyhow::{Context as _, bail, ensure};
use foreframe_engine::Method;
use serde::{Deserialize, Serialize};

use super::Quality;
use crate::score::report::CaptureScore;

/// The version of the file that is written, and the only one that is read.
const FORMAT: u32 = 1;

/// What the engine made of a capture.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// [`FORMAT`].
    pub foreframe_baseline: u32,
    /// The version of Foreframe that wrote it, for people.
    pub version: String,
    /// Name of what was recorded.
    pub capture: String,
    /// Frames from key to key.
    pub ratio: usize,
    /// Predicted frames.
    pub frames: u64,
    /// The digest of the true frames, 32 hexadecimal digits: what tells one capture from another.
    pub truth: String,
    /// One entry per method.
    pub methods: Vec<MethodBaseline>,
}

/// What one method made of it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct MethodBaseline {
    /// Name of the method.
    pub name: String,
    /// The digest of all frames that it predicted, 32 hexadecimal digits.
    pub digest: String,
    /// How good they are.
    #[serde(flatten)]
    pub quality: Quality,
}

/// What every version says of itself.
#[derive(Deserialize)]
struct Head {
    foreframe_baseline: u32,
}

impl Baseline {
    /// What `score` found.
    #[must_use]
    pub fn new(score: &CaptureScore) -> Self {
        let methods = score.methods.iter().map(|method| MethodBaseline {
            name: method.name.to_owned(),
            digest: method.digest.clone(),
            quality: Quality::new(method),
        });
        Self {
            foreframe_baseline: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            capture: score.name.clone(),
            ratio: score.ratio,
            frames: score.methods.first().map_or(0, |method| method.frames),
            truth: score.truth_digest.clone(),
            methods: methods.collect(),
        }
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// What was expected, what was found, and how such a file is made.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = path.display();
        let text = match fs::read_to_string(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                bail!("{name}: expected a baseline, found no such file: --write makes one")
            }
            other => other.with_context(|| format!("reading {name}"))?,
        };
        Self::parse(&text).with_context(|| format!("{name}: expected a baseline"))
    }

    fn parse(text: &str) -> anyhow::Result<Self> {
        let head: Head = serde_json::from_str(text)?;
        let found = head.foreframe_baseline;
        ensure!(found == FORMAT, "expected format {FORMAT}, found {found}: --write makes it anew");
        let baseline: Self = serde_json::from_str(text)?;
        ensure!(!baseline.methods.is_empty(), "expected a method or more, found none");
        Ok(baseline)
    }

    /// Writes the file at `path`, in place of what was there.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        fs::write(path, text).with_context(|| format!("writing {}", path.display()))
    }

    /// Frames from key to key and methods, as `score` takes them.
    ///
    /// # Errors
    /// If there is no such ratio or method.
    pub fn asks_for(&self) -> anyhow::Result<(NonZeroUsize, Vec<Method>)> {
        let ratio = NonZeroUsize::new(self.ratio).filter(|ratio| ratio.get() > 1);
        let ratio = ratio
            .with_context(|| format!("expected a ratio of 2 or more, found {}", self.ratio))?;
        let methods = self.methods.iter().map(|method| Ok(method.name.parse()?));
        Ok((ratio, methods.collect::<anyhow::Result<_>>()?))
    }

    /// That `found` is of the capture that this is of.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn ensure_same_capture(&self, found: &Self) -> anyhow::Result<()> {
        ensure!(
            (self.frames, &self.truth) == (found.frames, &found.truth),
            "expected the capture that the baseline is of, `{}` with {} frames to predict of digest \
             {}, found `{}` with {} of digest {}: --write makes a baseline of this one",
            self.capture,
            self.frames,
            self.truth,
            found.capture,
            found.frames,
            found.truth
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn baseline() -> Baseline {
        let quality = Quality { psnr_rgb_db: Some(31.25), ssim: Some(0.1), ..Quality::default() };
        let method = MethodBaseline { name: "auto".into(), digest: "0f".repeat(16), quality };
        Baseline {
            foreframe_baseline: FORMAT,
            version: "0.1.0".into(),
            capture: "cart".into(),
            ratio: 4,
            frames: 36,
            truth: "ab".repeat(16),
            methods: vec![method],
        }
    }

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cart.json");
        baseline().write(&path).unwrap();
        assert_eq!(Baseline::read(&path).unwrap(), baseline());
    }

    #[test]
    fn what_is_no_baseline_is_told_with_what_was_found() {
        let folder = tempfile::tempdir().unwrap();
        let said = |text: Option<&str>| {
            let path = folder.path().join("x.json");
            match text {
                Some(text) => fs::write(&path, text).unwrap(),
                None => drop(fs::remove_file(&path)),
            }
            format!("{:#}", Baseline::read(&path).unwrap_err())
        };
        let written = serde_json::to_string(&baseline()).unwrap();
        let newer = written.replace("\"foreframe_baseline\":1", "\"foreframe_baseline\":2");
        let none = Baseline { methods: Vec::new(), ..baseline() };
        for (text, expected) in [
            (None, "found no such file: --write makes one"),
            (Some("no JSON"), "expected a baseline: expected ident"),
            (Some("{}"), "missing field `foreframe_baseline`"),
            (Some(&newer), "expected format 1, found 2: --write makes it anew"),
            (Some(&serde_json::to_string(&none).unwrap()), "expected a method or more"),
        ] {
            let said = said(text);
            assert!(said.contains(expected) && said.contains("x.json"), "{said}");
        }
    }

    #[test]
    fn a_method_or_ratio_that_there_is_not_is_told() {
        let said = |baseline: Baseline| baseline.asks_for().unwrap_err().to_string();
        let [mut unknown, mut none] = [baseline(), baseline()];
        assert_eq!(unknown.asks_for().unwrap().1, [Method::Auto]);
        unknown.methods[0].name = "voxels".into();
        assert!(said(unknown).contains("found `voxels`"));
        none.ratio = 1;
        assert!(said(none).contains("expected a ratio of 2 or more, found 1"));
    }

    #[test]
    fn another_capture_is_told_apart_by_its_frames_and_not_by_its_name() {
        let renamed = Baseline { capture: "kart".into(), ..baseline() };
        baseline().ensure_same_capture(&renamed).unwrap();
        let other = Baseline { truth: "cd".repeat(16), ..baseline() };
        let said = baseline().ensure_same_capture(&other).unwrap_err().to_string();
        assert!(said.contains(&"ab".repeat(16)) && said.contains(&"cd".repeat(16)), "{said}");
    }
}
