//! Where output frames go: image files, a y4m stream, or nowhere.
//!
//! [`Sink`] takes frames in and does nothing else: no thread, no clock. Deterministic replay drives
//! it directly. The daemon puts the slow ones behind a [`worker`] with a bounded queue, so that a
//! slow disk costs frames in the file and never a frame on the display. Subscribers are served by
//! the stream itself: a frame for them is a copy into shared memory, not a write. A [`window`] is
//! more than a sink: it says when it showed what, and the stream is paced by that.

pub mod png;
pub mod srgb;
pub mod window;
pub mod worker;
pub mod y4m;

use std::ffi::OsString;
use std::fs::{self, File};
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
            SinkSpec::Null | SinkSpec::Shm | SinkSpec::Window => return Ok(Self::Null),
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

    /// Takes `refreshes` in a row that showed the last frame again. Only a constant-rate file has
    /// to know.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn repeat(&mut self, refreshes: u64) -> io::Result<()> {
        match self {
            Self::Null | Self::Png(_) => Ok(()),
            Self::Y4m(sink) => sink.repeat(refreshes),
        }
    }
}

/// Looks whether the place that `spec` names can take frames, and makes its folder. Opens nothing:
/// to open a pipe waits for its reader. Windows are looked for by who starts their thread.
///
/// # Errors
/// What was expected and what was found.
pub fn prepare(spec: &SinkSpec) -> io::Result<()> {
    match spec {
        SinkSpec::Null | SinkSpec::Shm | SinkSpec::Y4mStdout | SinkSpec::Window => Ok(()),
        SinkSpec::Png(dir) => {
            let made = fs::create_dir_all(dir).and_then(|()| is_writable(dir));
            made.map_err(|error| wrong(spec, "a folder for pictures", &error))
        }
        SinkSpec::Y4m(path) => {
            let looked = match fs::metadata(path) {
                Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
                Ok(_) => is_writable(path),
                Err(_) => match path.parent() {
                    Some(dir) if !dir.as_os_str().is_empty() => is_writable(dir),
                    _ => is_writable(Path::new(".")),
                },
            };
            looked.map_err(|error| wrong(spec, "a file or pipe that can be written", &error))
        }
    }
}

fn is_writable(path: &Path) -> io::Result<()> {
    rustix::fs::access(path, rustix::fs::Access::WRITE_OK).map_err(io::Error::from)
}

fn wrong(spec: &SinkSpec, expected: &str, found: &io::Error) -> io::Error {
    io::Error::other(format!("--sink {spec}: expected {expected}, found: {found}"))
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
    fn a_place_that_cannot_take_frames_is_told_beforehand() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        fs::write(&file, "").unwrap();
        let [dir, file] = [dir.path(), &file].map(|path| path.display().to_string());
        for spec in [
            format!("png:{file}"),
            format!("png:{file}/frames"),
            format!("y4m:{dir}"),
            format!("y4m:{dir}/none/out.y4m"),
        ] {
            let error = prepare(&spec.parse().unwrap()).expect_err(&spec).to_string();
            assert!(error.contains(&format!("--sink {spec}: expected ")), "{error}");
            assert_eq!(error.lines().count(), 1, "{error}");
        }
        for spec in [
            "null".to_owned(),
            "shm".to_owned(),
            "-".to_owned(),
            format!("y4m:{file}"),
            format!("y4m:{dir}/new.y4m"),
            format!("png:{dir}/a/b"),
        ] {
            prepare(&spec.parse().unwrap()).expect(&spec);
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
