//! JSON side-cars: one `frame_NNNN.json` per frame, naming its image files, time and camera.
//!
//! Matrices are lists of rows, clip = projection * `world_to_camera` * p with OpenGL's clip space.
//! Fields that are not listed here are someone else's and are left alone. What [`super::export`]
//! adds stands in one object of its own, `foreframe`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use foreframe_protocol::Camera;
use serde::{Deserialize, Serialize};

use super::exported::Exported;

/// A matrix as a list of rows.
pub type Rows = [[f64; 4]; 4];

/// What is known of one frame besides its pixels.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Sidecar {
    /// Number of the frame.
    pub frame: u64,
    /// Simulation time that it shows, seconds.
    pub time: f64,
    /// Frames per second of the sequence; frame N - 1 was 1 / `fps` earlier.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Name of what was recorded.
    #[serde(default, alias = "scene", skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Image files in the same folder, by what is in them.
    pub files: BTreeMap<String, String>,
    /// World to camera; the camera looks along its -z, y up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world_to_camera: Option<Rows>,
    /// Camera to clip.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub projection: Option<Rows>,
    /// Nothing before this frame relates to it.
    #[serde(default)]
    pub is_first_frame_after_cut: bool,
    /// What only a capture of this program knows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foreframe: Option<Exported>,
}

impl Sidecar {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// If it cannot be read or is no side-car.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = path.display();
        let text = fs::read_to_string(path).with_context(|| format!("reading {name}"))?;
        let sidecar: Self = serde_json::from_str(&text)
            .with_context(|| format!("{name}: expected the side-car of a frame"))?;
        sidecar.check().with_context(|| format!("{name}"))?;
        Ok(sidecar)
    }

    fn check(&self) -> anyhow::Result<()> {
        for file in self.files.values() {
            let is_plain = Path::new(file).file_name().is_some_and(|name| name == file.as_str());
            ensure!(is_plain, "expected a file name without a folder, found `{file}`");
        }
        ensure!(
            self.time.is_finite() && (0.0..1e9).contains(&self.time),
            "expected a time of 0 to 1e9 seconds, found {}",
            self.time
        );
        Ok(())
    }

    /// View and projection, if both are there and can be used.
    ///
    /// # Errors
    /// If an element is not finite.
    pub fn camera(&self) -> anyhow::Result<Option<Camera>> {
        let (Some(view), Some(projection)) = (&self.world_to_camera, &self.projection) else {
            return Ok(None);
        };
        Ok(Some(Camera { view: column_major(view)?, projection: column_major(projection)? }))
    }

    /// Time of the frame, nanoseconds after that of time 0.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "below 1e18, as `read` checks")]
    #[expect(clippy::cast_sign_loss, reason = "not negative, as `read` checks")]
    pub fn time_ns(&self) -> u64 {
        (self.time * 1e9).round() as u64
    }
}

#[expect(clippy::cast_possible_truncation, reason = "matrices are f32; files print them as f64")]
fn column_major(rows: &Rows) -> anyhow::Result<[f32; 16]> {
    let matrix: [f32; 16] = std::array::from_fn(|index| rows[index % 4][index / 4] as f32);
    match matrix.iter().find(|element| !element.is_finite()) {
        Some(element) => bail!("expected a matrix of finite numbers, found {element}"),
        None => Ok(matrix),
    }
}

/// Inverse of [`Sidecar::camera`] for one matrix.
#[must_use]
pub fn rows(matrix: &[f32; 16]) -> Rows {
    std::array::from_fn(|row| std::array::from_fn(|column| f64::from(matrix[column * 4 + row])))
}

/// The side-cars in `folder`, by number of frame.
///
/// # Errors
/// If the folder cannot be read, has no `frame_NNNN.json`, or two of one number.
pub fn list(folder: &Path) -> anyhow::Result<BTreeMap<u64, PathBuf>> {
    let name = folder.display();
    let mut found = BTreeMap::new();
    let entries = fs::read_dir(folder).with_context(|| format!("reading the folder {name}"))?;
    for entry in entries {
        let path = entry.with_context(|| format!("reading the folder {name}"))?.path();
        let Some(number) = frame_number(&path) else { continue };
        if let Some(other) = found.insert(number, path.clone()) {
            let (one, two) = (path.display(), other.display());
            bail!("expected one side-car for frame {number}, found {one} and {two}");
        }
    }
    if found.is_empty() {
        bail!("{name}: expected frames with side-cars frame_NNNN.json, found none");
    }
    Ok(found)
}

fn frame_number(path: &Path) -> Option<u64> {
    let name = path.file_name()?.to_str()?;
    name.strip_prefix("frame_")?.strip_suffix(".json")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_go_from_rows_to_columns_and_back() {
        let rows_in: Rows =
            std::array::from_fn(|row| std::array::from_fn(|column| (row * 4 + column) as f64));
        let columns = column_major(&rows_in).unwrap();
        assert_eq!(columns[..4], [0.0, 4.0, 8.0, 12.0], "the first column");
        assert_eq!(rows(&columns), rows_in);
    }

    #[test]
    fn a_side_car_that_points_out_of_its_folder_is_refused() {
        let with = |file: &str| {
            let text = format!(
                r#"{{"frame":0,"time":0.0,"width":1,"height":1,"files":{{"color":"{file}"}}}}"#
            );
            serde_json::from_str::<Sidecar>(&text).unwrap().check()
        };
        with("frame_0000.exr").unwrap();
        for file in ["../frame.exr", "/etc/passwd", "a/b.exr", "..", ""] {
            let error = with(file).unwrap_err().to_string();
            assert!(error.contains("expected a file name"), "{error}");
        }
    }

    #[test]
    fn only_side_cars_of_frames_are_listed() {
        for (name, number) in [
            ("frame_0042.json", Some(42)),
            ("frame_0042.exr", None),
            ("object_ids.json", None),
            ("frame_x.json", None),
        ] {
            assert_eq!(frame_number(Path::new(name)), number, "{name}");
        }
    }
}
