//! Where the socket is: a folder that only its owner can enter.

use std::ffi::OsString;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// File name of the socket in its folder.
pub const SOCKET_NAME: &str = "daemon.sock";
const FOLDER_NAME: &str = "foreframe";
/// Access for anybody but the owner.
const FOREIGN_ACCESS: u32 = 0o077;

/// `$XDG_RUNTIME_DIR/foreframe/daemon.sock`.
///
/// # Errors
/// [`Error::RuntimeFolder`] if the variable is not set or not an absolute path.
pub fn default_socket_path() -> Result<PathBuf> {
    socket_path_in(std::env::var_os("XDG_RUNTIME_DIR"))
}

/// The socket's path below this runtime folder, which must be absolute.
///
/// # Errors
/// [`Error::RuntimeFolder`] if it is missing, empty or relative.
pub fn socket_path_in(runtime_folder: Option<OsString>) -> Result<PathBuf> {
    let folder = runtime_folder.map(PathBuf::from);
    match folder {
        Some(folder) if folder.is_absolute() => Ok(folder.join(FOLDER_NAME).join(SOCKET_NAME)),
        Some(folder) => Err(Error::RuntimeFolder { found: format!("`{}`", folder.display()) }),
        None => Err(Error::RuntimeFolder { found: "nothing".to_owned() }),
    }
}

/// Makes the folder of the socket if it is missing, and checks that it is a real folder of this
/// user that nobody else can enter.
pub(super) fn prepare_folder(socket: &Path) -> Result<()> {
    let folder = match socket.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        Some(_) => Path::new("."),
        None => return Err(path_error(socket, "the path of a socket", "the root folder")),
    };
    if let Err(source) = std::fs::DirBuilder::new().mode(0o700).create(folder)
        && source.kind() != std::io::ErrorKind::AlreadyExists
    {
        return Err(path_error(folder, "a folder that can be made for the socket", source));
    }
    let found = std::fs::symlink_metadata(folder)
        .map_err(|source| path_error(folder, "a folder that can be looked at", source))?;
    if !found.is_dir() {
        let expected = "a folder, not a link or a file: remove it";
        return Err(path_error(folder, expected, "something else"));
    }
    let user = rustix::process::geteuid().as_raw();
    if found.uid() != user {
        let expected = "a folder of the user who starts the daemon";
        return Err(path_error(folder, expected, format!("owner {}", found.uid())));
    }
    if found.mode() & FOREIGN_ACCESS != 0 {
        let expected = "a folder that only its owner can enter: chmod 700";
        return Err(path_error(folder, expected, format!("mode {:03o}", found.mode() & 0o777)));
    }
    Ok(())
}

pub(super) fn path_error(path: &Path, expected: &'static str, found: impl ToString) -> Error {
    Error::Path { path: path.to_owned(), expected, found: found.to_string() }
}
