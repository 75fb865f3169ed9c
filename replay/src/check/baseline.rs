//! The file that a capture is compared with: JSON with one line per value, for version control.

use std::fs::{self, File};
use std::io::{BufReader, ErrorKind};
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
    /// [`foreframed::capture::Capture::content_hash`], 32 hexadecimal digits: what tells one
    /// capture from another.
    pub content: String,
    /// One entry per method.
    pub methods: Vec<MethodBaseline>,
}

/// What one method made of it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodBaseline {
    /// Name of the method.
    pub name: String,
    /// The digest of all frames that it predicted, 32 hexadecimal digits.
    pub digest: String,
    /// How good they are.
    pub quality: Quality,
}

/// What every version says of itself.
#[derive(Deserialize)]
struct Head {
    foreframe_baseline: u32,
}

impl Baseline {
    /// What `score` found in the capture of this content; None where no frame was predicted.
    #[must_use]
    pub fn new(score: &CaptureScore, content: String) -> Option<Self> {
        let methods = score.methods.iter().map(|method| {
            Some(MethodBaseline {
                name: method.name.to_owned(),
                digest: method.digest.clone(),
                quality: Quality::new(method)?,
            })
        });
        Some(Self {
            foreframe_baseline: FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            capture: score.name.clone(),
            ratio: score.ratio,
            frames: score.methods.first()?.frames,
            content,
            methods: methods.collect::<Option<_>>()?,
        })
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
        for (i, MethodBaseline { name, .. }) in baseline.methods.iter().enumerate() {
            let is_new = baseline.methods[..i].iter().all(|other| other.name != *name);
            ensure!(is_new, "expected each method once, found `{name}` twice");
        }
        Ok(baseline)
    }

    /// That nothing at `path` would be lost but a baseline.
    ///
    /// # Errors
    /// If something else is there.
    pub fn ensure_replaceable(path: &Path) -> anyhow::Result<()> {
        let is_baseline = match fs::metadata(path) {
            Err(error) => error.kind() == ErrorKind::NotFound,
            // Of a device there may be no end, and of a capture the first byte tells.
            Ok(found) => {
                let file = found.is_file().then(|| File::open(path).ok()).flatten();
                let head = |file| serde_json::from_reader::<_, Head>(BufReader::new(file));
                file.is_some_and(|file| head(file).is_ok())
            }
        };
        ensure!(is_baseline, "{}: expected a baseline or no file: it stays", path.display());
        Ok(())
    }

    /// The file, as it is written.
    ///
    /// # Errors
    /// Never: numbers and texts become JSON.
    pub fn to_text(&self) -> anyhow::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
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
            (self.frames, &self.content) == (found.frames, &found.content),
            "expected the capture that the baseline is of, {:?} with {} frames to predict and content \
             {}, found {:?} with {} and {}: --write makes a baseline of this one",
            self.capture,
            self.frames,
            self.content,
            found.capture,
            found.frames,
            found.content
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn baseline() -> Baseline {
        let quality = Quality {
            psnr_rgb_db: 31.25,
            psnr_y_db: 31.5,
            ssim: 0.1,
            flip: 0.25,
            worst_tile_psnr_db: 9.0,
            error_flicker: 1.0,
        };
        let method = MethodBaseline { name: "auto".into(), digest: "0f".repeat(16), quality };
        Baseline {
            foreframe_baseline: FORMAT,
            version: "0.1.0".into(),
            capture: "cart".into(),
            ratio: 4,
            frames: 36,
            content: "ab".repeat(16),
            methods: vec![method],
        }
    }

    #[test]
    fn what_was_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cart.json");
        fs::write(&path, baseline().to_text().unwrap()).unwrap();
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
        let twice =
            Baseline { methods: [baseline().methods, baseline().methods].concat(), ..baseline() };
        let misspelt = written.replace("psnr_rgb_db", "psnr_rgb");
        let absent = written.replace("\"ssim\":0.1,", "");
        for (text, expected) in [
            (None, "found no such file: --write makes one"),
            (Some("no JSON"), "expected a baseline: expected ident"),
            (Some("{}"), "missing field `foreframe_baseline`"),
            (Some(&newer), "expected format 1, found 2: --write makes it anew"),
            (Some(&serde_json::to_string(&none).unwrap()), "expected a method or more"),
            (Some(&serde_json::to_string(&twice).unwrap()), "found `auto` twice"),
            (Some(&misspelt), "unknown field `psnr_rgb`"),
            (Some(&absent), "missing field `ssim`"),
        ] {
            let said = said(text);
            assert!(said.contains(expected) && said.contains("x.json"), "{said}");
        }
    }

    #[test]
    fn nothing_but_a_baseline_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cart.mcap");
        Baseline::ensure_replaceable(&path).unwrap();
        fs::write(&path, baseline().to_text().unwrap()).unwrap();
        Baseline::ensure_replaceable(&path).unwrap();
        for other in ["", "{}", "\u{89}MCAP0"] {
            fs::write(&path, other).unwrap();
            let said = Baseline::ensure_replaceable(&path).unwrap_err().to_string();
            assert!(said.contains("expected a baseline or no file"), "{said}");
        }
        for other in [folder.path(), Path::new("/dev/zero")] {
            assert!(Baseline::ensure_replaceable(other).is_err(), "{}", other.display());
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
        let other = Baseline { content: "cd".repeat(16), ..baseline() };
        let said = baseline().ensure_same_capture(&other).unwrap_err().to_string();
        assert!(said.contains(&"ab".repeat(16)) && said.contains(&"cd".repeat(16)), "{said}");
    }
}
