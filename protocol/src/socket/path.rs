//! Where the socket is: a folder that only its owner can enter.

use std::ffi::OsString;
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use rustix::fs::Access;
use rustix::net::SocketAddrUnix;

use crate::error::{Error, Result};

/// File name of the socket in its folder.
pub const SOCKET_NAME: &str = "daemon.sock";
const FOLDER_NAME: &str = "foreframe";
const FOLDER_EXPECTED: &str = "a folder that can be made for the socket";
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

/// Whether a daemon could listen at `socket`, as far as that can be told without making anything.
///
/// # Errors
/// [`Error::Path`] with what it would be told.
pub fn check_socket_path(socket: &Path) -> Result<()> {
    let folder = folder_of(socket)?;
    address_of(socket)?;
    match std::fs::symlink_metadata(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
            let may_make = Access::WRITE_OK | Access::EXEC_OK;
            rustix::fs::access(parent.unwrap_or(Path::new(".")), may_make)
                .map_err(|errno| path_error(folder, FOLDER_EXPECTED, errno))
        }
        _ => {
            check_folder(folder)?;
            check_place(socket).map(drop)
        }
    }
}

/// Makes the folder of the socket if it is missing, and checks that it is a real folder of this
/// user that nobody else can enter.
pub(super) fn prepare_folder(socket: &Path) -> Result<()> {
    let folder = folder_of(socket)?;
    if let Err(source) = std::fs::DirBuilder::new().mode(0o700).create(folder)
        && source.kind() != ErrorKind::AlreadyExists
    {
        return Err(path_error(folder, FOLDER_EXPECTED, source));
    }
    check_folder(folder)
}

fn folder_of(socket: &Path) -> Result<&Path> {
    match socket.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => Ok(folder),
        Some(_) => Ok(Path::new(".")),
        None => Err(path_error(socket, "the path of a socket", "the root folder")),
    }
}

fn check_folder(folder: &Path) -> Result<()> {
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

/// Whether a socket lies at `socket` already; anything else there is an error.
pub(super) fn check_place(socket: &Path) -> Result<bool> {
    match std::fs::symlink_metadata(socket) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(path_error(socket, "a place for a socket", error)),
        Ok(found) if found.file_type().is_socket() => Ok(true),
        Ok(_) => Err(path_error(socket, "a socket or nothing: remove it", "another file")),
    }
}

pub(super) fn address_of(socket: &Path) -> Result<SocketAddrUnix> {
    SocketAddrUnix::new(socket).map_err(|_| {
        let found = format!("{} bytes", socket.as_os_str().len());
        path_error(socket, "a path of at most 107 bytes", found)
    })
}

pub(super) fn path_error(path: &Path, expected: &'static str, found: impl ToString) -> Error {
    Error::Path { path: path.to_owned(), expected, found: found.to_string() }
}
