//! Where plots go.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;

use crate::draw::Drawing;

/// Reads the name of a plot: it ends in `.svg` or `.png`.
pub(crate) fn parse_plot(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_known = path.extension().is_some_and(|ending| ending == "svg" || ending == "png");
    if is_known { Ok(path) } else { Err(format!("expected FILE.svg or FILE.png, found `{text}`")) }
}

/// Writes a drawing in the form that the name asks for.
pub(crate) fn write(drawing: &Drawing, path: &Path) -> anyhow::Result<()> {
    let writing = || format!("writing {}", path.display());
    if path.extension().is_some_and(|ending| ending == "svg") {
        return fs::write(path, drawing.to_svg()).with_context(writing);
    }
    let pixmap = drawing.to_pixmap().context("the plot does not fit the memory")?;
    let png = pixmap.encode_png().with_context(writing)?;
    fs::write(path, png).with_context(writing)
}
