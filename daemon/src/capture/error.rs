//! What can be wrong with a capture, or with what is to be written to one.

use std::path::PathBuf;

/// An error of the capture reader or writer. Every message says what was expected and found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The file could not be opened or created. Callers say which one.
    #[error("cannot open the file")]
    Open {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// There is no file to read.
    #[error(
        "expected a capture, found no such file: `foreframe scenes NAME -o FILE.mcap` makes one of a \
         built-in scene, `foreframe serve --record FILE.mcap` of an application"
    )]
    Missing,
    /// A folder where a file should be.
    #[error(
        "expected a capture, found a folder: `foreframe import` makes a capture of EXR frames in one"
    )]
    Folder,
    /// Reading or writing the file failed.
    #[error("{doing}")]
    Io {
        /// What was being done.
        doing: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// The container layer refused to write.
    #[error("writing the MCAP container")]
    Container(#[from] mcap::McapError),
    /// The file is no MCAP file at all.
    #[error("expected an MCAP file (it starts with {expected:02x?}), found {found:02x?}")]
    NotMcap {
        /// The magic bytes.
        expected: [u8; 8],
        /// The first bytes of the file, at most eight.
        found: Vec<u8>,
    },
    /// An MCAP file that holds something else.
    #[error(
        "expected an MCAP file of profile `{expected}...`, found profile `{found}`: this is no Foreframe capture"
    )]
    Foreign {
        /// The profile of captures, without its version.
        expected: &'static str,
        /// The profile in the file.
        found: String,
    },
    /// A capture of a version that this program cannot read.
    #[error(
        "expected capture version {expected}, found {found}: read it with the program that wrote it"
    )]
    Version {
        /// The version that is understood.
        expected: u32,
        /// The version in the file.
        found: String,
    },
    /// A value is not what the format says.
    #[error("{what} at byte {at}: expected {expected}, found {found}")]
    Damaged {
        /// What is damaged.
        what: &'static str,
        /// Offset in the file.
        at: u64,
        /// What the format asks for.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The bytes of a plane are not those that were recorded.
    #[error("{plane} plane of frame {frame}: expected {expected}, found {found}")]
    Plane {
        /// Which plane.
        plane: &'static str,
        /// Number of the frame in the file, from 0.
        frame: usize,
        /// What was recorded.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The file ends before the first stream was described.
    #[error(
        "expected a session and a stream at the start of the capture, found the end after {len} bytes: nothing was recorded"
    )]
    Empty {
        /// Bytes in the file.
        len: u64,
    },
    /// A frame number that the capture does not have.
    #[error("expected a frame below {frames}, found {found}")]
    NoSuchFrame {
        /// Frames in the capture.
        frames: usize,
        /// What was asked for.
        found: usize,
    },
    /// The caller handed the writer something that cannot be recorded.
    #[error("cannot record {what}: expected {expected}, found {found}")]
    Unrecordable {
        /// What was handed over.
        what: &'static str,
        /// What the writer needs.
        expected: String,
        /// What it got.
        found: String,
    },
}
