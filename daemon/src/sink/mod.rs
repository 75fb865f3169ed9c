//! Where output frames go: image files, a y4m stream, or nowhere.
//!
//! [`Sink`] takes frames in and does nothing else: no thread, no clock. Deterministic replay drives
//! it directly. The daemon puts the slow ones behind a [`worker`] with a bounded queue, so that a
//! slow disk costs frames in the file and never a frame on the display. Subscribers are served by
//! the stream itself: a frame for them is a copy into shared memory, not a write.

pub mod png;
pub mod srgb;
pub mod worker;
pub mod y4m;

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use foreframe_engine::{ColorPlane, MonoSpan, StreamFormat};

use crate::config::SinkSpec;
use png::PngSink;
use y4m::Y4mSink;

/// An open sink for one stream.
pub enum Sink {
    /// Throws frames away.
    Null,
    /// Numbered image files.
    Png(PngSink),
    /// A y4m stream.
    Y4m(Y4mSink<Box<dyn Write + Send>>),
}

impl std::fmt::Debug for Sink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Null => "Sink::Null",
            Self::Png(_) => "Sink::Png",
            Self::Y4m(_) => "Sink::Y4m",
        })
    }
}

impl Sink {
    /// Opens what `spec` asks for, for stream number `ordinal` of this process, from 0: the first
    /// stream gets the place that was asked for, later ones a place beside it ([`beside`]).
    ///
    /// # Errors
    /// If the file or folder cannot be made, or standard output is taken by an earlier stream.
    pub fn open(
        spec: &SinkSpec,
        format: &StreamFormat,
        interval: MonoSpan,
        ordinal: u64,
    ) -> io::Result<Self> {
        let out: Box<dyn Write + Send> = match spec {
            SinkSpec::Null | SinkSpec::Shm => return Ok(Self::Null),
            SinkSpec::Png(dir) => {
                return PngSink::create(&beside(dir, ordinal), format).map(Self::Png);
            }
            SinkSpec::Y4m(path) => Box::new(BufWriter::new(File::create(beside(path, ordinal))?)),
            SinkSpec::Y4mStdout if ordinal == 0 => Box::new(BufWriter::new(io::stdout())),
            SinkSpec::Y4mStdout => {
                return Err(io::Error::other("standard output holds one stream, and it had one"));
            }
        };
        Y4mSink::create(out, format, interval).map(Self::Y4m)
    }

    /// Whether frames reach anything, so that a copy of them is worth its price.
    #[must_use]
    pub fn keeps_frames(&self) -> bool {
        !matches!(self, Self::Null)
    }

    /// Takes output frame number `index`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, index: u64, frame: &ColorPlane) -> io::Result<()> {
        match self {
            Self::Null => Ok(()),
            Self::Png(sink) => sink.write(index, frame),
            Self::Y4m(sink) => sink.write(frame),
        }
    }

    /// Takes a refresh that showed the last frame again. Only a constant-rate file has to know.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn repeat(&mut self) -> io::Result<()> {
        match self {
            Self::Null | Self::Png(_) => Ok(()),
            Self::Y4m(sink) => sink.repeat(),
        }
    }
}

/// The place for stream number `ordinal` beside `path`: `out.y4m`, `out-1.y4m`, `out-2.y4m`.
#[must_use]
pub fn beside(path: &Path, ordinal: u64) -> PathBuf {
    if ordinal == 0 {
        return path.to_owned();
    }
    let mut name = path.file_stem().map_or_else(OsString::new, OsString::from);
    name.push(format!("-{ordinal}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_streams_get_a_name_of_their_own() {
        for (path, ordinal, expected) in [
            ("a/out.y4m", 0, "a/out.y4m"),
            ("a/out.y4m", 1, "a/out-1.y4m"),
            ("frames", 2, "frames-2"),
            ("a.b/c.d.mcap", 3, "a.b/c.d-3.mcap"),
        ] {
            assert_eq!(beside(Path::new(path), ordinal), Path::new(expected));
        }
    }

    #[test]
    fn standard_output_is_given_to_one_stream_only() {
        let format = StreamFormat::rgba8(1, 1);
        let interval = MonoSpan::from_hz(60.0);
        let error = Sink::open(&SinkSpec::Y4mStdout, &format, interval, 1).unwrap_err();
        assert!(error.to_string().contains("one stream"), "{error}");
    }
}
