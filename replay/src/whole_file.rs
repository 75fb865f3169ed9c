//! A file that takes the place of another once it is whole: who is ended halfway leaves the old one.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use anyhow::Context as _;
use tempfile::NamedTempFile;

/// A new file beside `target`, which is gone with this value unless it is [`put`].
///
/// # Errors
/// If none can be made there.
pub fn beside(target: &Path) -> anyhow::Result<NamedTempFile> {
    let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty());
    tempfile::Builder::new()
        // Less what the user's mask takes away, as for any other file.
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(parent.unwrap_or(Path::new(".")))
        .with_context(|| format!("making a file beside {}", target.display()))
}

/// Puts `file` in the place of `target`.
///
/// # Errors
/// If it cannot be put there.
pub fn put(file: NamedTempFile, target: &Path) -> anyhow::Result<()> {
    let put = file.persist(target).map_err(|failed| failed.error);
    put.map(drop).with_context(|| format!("writing {}", target.display()))
}
