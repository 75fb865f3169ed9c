//! What the daemon was told: flags, and a TOML file with the same names.
//!
//! [`Args`] is both: clap reads it from the command line, serde from the file. A flag wins over the
//! file. [`Config`] is what the two together mean, with every default filled in and every value
//! checked; nothing else in the daemon looks at [`Args`].

use std::fmt;
use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use foreframe_engine::backend::choice::BackendChoice;
use foreframe_engine::{FinishConfig, FinishMode, Method, MonoSpan};
use foreframe_perception::display::DisplayProfile;
use foreframe_protocol::ProfileName;
use serde::{Deserialize, Deserializer};
use tracing_subscriber::EnvFilter;

use crate::hud::HudView;
use crate::profiles::{Profiles, UnknownProfile, Viewed};
use crate::sink::window::{Layout, WindowOptions};

/// Arguments of `foreframed` and of `foreframe serve`.
#[derive(clap::Args, Deserialize, Clone, PartialEq, Debug, Default)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[group(id = "daemon")]
pub struct Args {
    /// Socket to listen on [default: foreframe/daemon.sock in XDG_RUNTIME_DIR]
    #[arg(long, value_name = "PATH")]
    pub socket: Option<PathBuf>,
    /// Where output frames go: window, null, shm, png:DIR, y4m:PATH, or - for y4m on standard
    /// output [default: shm]
    #[arg(long)]
    pub sink: Option<SinkSpec>,
    /// Windows are as large as the monitor
    #[arg(long)]
    #[serde(default)]
    pub fullscreen: bool,
    /// Monitor for windows, by its name; one that is not full screen opens there on X11 alone
    #[arg(long, value_name = "NAME")]
    pub monitor: Option<String>,
    /// Where several streams are shown: single, each in a window of its own, or side-by-side, all
    /// in one; Wayland needs wp_viewporter and wl_subcompositor for that [default: single]
    #[arg(long)]
    #[serde(default, deserialize_with = "from_name")]
    pub layout: Option<Layout>,
    /// Refresh rate of the output, 1 to 1000; a window has its display's [default: 120]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = parse_real::<f64>)]
    pub refresh: Option<f64>,
    /// What makes the pictures: auto, cpu, gpu or gpu:NAME; `foreframe adapters` says what auto
    /// takes [default: auto]
    #[arg(long)]
    #[serde(default, deserialize_with = "from_name")]
    pub backend: Option<BackendChoice>,
    /// How in-between frames are made: hold, blend, voxel, gather, grid, linear,
    /// global, affine, quadratic, world, flow or auto [default: linear]
    #[arg(long)]
    #[serde(default, deserialize_with = "from_name")]
    pub method: Option<Method>,
    /// Show at most so many frames a second, 1 to 1000, for a sink without a rate of its own
    /// [default: every refresh]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = parse_real::<f64>)]
    pub cap: Option<f64>,
    /// Leave out in-between frames until something has moved by so many pixels, 0 to 16: fewer
    /// frames where little moves [default: 0, none are left out]
    #[arg(long, value_name = "PX", allow_negative_numbers = true, value_parser = parse_real::<f32>)]
    pub least_step: Option<f32>,
    /// What to draw into the pictures of windows: off, stats, motion, grid, rungs, disocclusion,
    /// tear, only-real or only-synthesised; `h` in a window goes through them [default: off]
    #[arg(long, value_name = "VIEW")]
    #[serde(default, deserialize_with = "from_name")]
    pub hud: Option<HudView>,
    /// Record what the applications send into this capture
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Threads that share the work of one stream [default: as many as there are processors]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = parse_count)]
    pub threads: Option<NonZeroUsize>,
    /// Pixels per degree of visual angle, 1 to 1000; turns on damping of motion that no eye can
    /// follow
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = parse_real::<f32>)]
    pub ppd: Option<f32>,
    /// Blur in in-between frames, made up for in their keys: off, on, or auto, as far as no flicker
    /// is seen [default: off]
    #[arg(long)]
    #[serde(default, deserialize_with = "from_name")]
    pub finish: Option<FinishMode>,
    /// Where pictures are finished, blur all of an in-between frame, not only where its motion is
    /// not to be relied on; sharper where things move
    #[arg(long)]
    #[serde(default)]
    pub finish_whole: bool,
    /// Display that shows the output: a built-in profile (`foreframe perception displays`) or a
    /// file that ends in .toml. Where there is no --ppd it gives that too, from 65 cm before a
    /// screen. A stream that names a profile is for that display instead
    #[arg(long, value_name = "NAME")]
    pub profile: Option<String>,
    /// Folder of display profiles, files that end in .toml, which streams may name beside the
    /// built-in ones
    #[arg(long, value_name = "DIR")]
    pub profiles: Option<PathBuf>,
    /// What to log on standard error: error, warn, info, debug, trace, or a filter such as
    /// foreframed::session=debug [default: info]
    #[arg(long, value_name = "LEVEL")]
    pub log: Option<String>,
    /// Clients that may be connected at once, 1 to 256 [default: 16]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = parse_whole::<usize>)]
    pub max_clients: Option<usize>,
    /// Memory that the streams of one client may cost, in MiB [default: 2048]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = parse_whole::<u64>)]
    pub memory_mb: Option<u64>,
    /// TOML file with the same names as these options; an option given here wins
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub config: Option<PathBuf>,
}

/// Where output frames go.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum SinkSpec {
    /// Frames are made and thrown away. Nobody can subscribe.
    Null,
    /// Subscribers get the frames in shared memory, and nobody else.
    #[default]
    Shm,
    /// `frame_000000.png` and so on in this folder.
    Png(PathBuf),
    /// A y4m stream in this file or pipe.
    Y4m(PathBuf),
    /// A y4m stream on standard output.
    Y4mStdout,
    /// A window of each stream, paced by what the display says. Subscribers get frames too.
    Window,
}

impl SinkSpec {
    /// Whether frames reach a file or a pipe, so that a copy of them is worth its price.
    #[must_use]
    pub fn keeps_frames(&self) -> bool {
        !matches!(self, Self::Null | Self::Shm | Self::Window)
    }

    /// Whether frames have to come at a rate that is not ours to change: a file's, or a display's.
    #[must_use]
    pub fn has_own_rate(&self) -> bool {
        self.keeps_frames() || *self == Self::Window
    }
}

impl FromStr for SinkSpec {
    type Err = String;

    fn from_str(spec: &str) -> Result<Self, String> {
        match spec.split_once(':') {
            Some(("png", dir)) if !dir.is_empty() => Ok(Self::Png(dir.into())),
            Some(("y4m", "-")) => Ok(Self::Y4mStdout),
            Some(("y4m", path)) if !path.is_empty() => Ok(Self::Y4m(path.into())),
            None if spec == "null" => Ok(Self::Null),
            None if spec == "shm" => Ok(Self::Shm),
            None if spec == "-" => Ok(Self::Y4mStdout),
            None if spec == "window" => Ok(Self::Window),
            _ => Err(format!("expected window, null, shm, png:DIR, y4m:PATH or -, found `{spec}`")),
        }
    }
}

impl fmt::Display for SinkSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Null => f.write_str("null"),
            Self::Shm => f.write_str("shm"),
            Self::Png(dir) => write!(f, "png:{}", dir.display()),
            Self::Y4m(path) => write!(f, "y4m:{}", path.display()),
            Self::Y4mStdout => f.write_str("-"),
            Self::Window => f.write_str("window"),
        }
    }
}

impl<'de> Deserialize<'de> for SinkSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// A display profile by its name, or from a file whose name ends in `.toml`.
///
/// # Errors
/// Which names there are, or what is wrong with the file.
pub fn read_profile(name: &str) -> Result<DisplayProfile, UsageError> {
    let wrong = |error: &dyn fmt::Display| UsageError(format!("profile {name}: {error}"));
    if !name.ends_with(".toml") {
        return DisplayProfile::builtin(name).map_err(|error| wrong(&error));
    }
    let text = fs::read_to_string(name).map_err(|error| wrong(&error))?;
    DisplayProfile::parse(&text).map_err(|error| wrong(&error))
}

/// Pixels per degree of a display: of a headset, or of a screen from [`VIEWING_CM`]. None where the
/// profile does not say how large it is.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "an angular size needs no more digits")]
pub fn profile_ppd(profile: &DisplayProfile) -> Option<f32> {
    profile.ppd(VIEWING_CM).ok().map(|ppd| (ppd as f32).clamp(1.0, 1000.0))
}

/// From how far a screen is seen where nobody says, cm (Denes 2020, section 7.2).
pub const VIEWING_CM: f64 = 65.0;

/// A count of things of which there is at least one.
///
/// # Errors
/// What was expected and what was found.
pub fn parse_count(text: &str) -> Result<NonZeroUsize, String> {
    text.parse().map_err(|_| format!("expected a whole number of 1 or more, found `{text}`"))
}

/// Reads a number; which ones may be is checked with all else.
fn parse_real<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("expected a number, found `{text}`"))
}

/// Reads a whole number; which ones may be is checked with all else.
///
/// # Errors
/// What was expected and what was found.
pub fn parse_whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| {
        let is_whole = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        let expected = if is_whole { "a smaller number" } else { "a whole number of 0 or more" };
        format!("expected {expected}, found `{text}`")
    })
}

fn from_name<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: FromStr<Err: fmt::Display>,
{
    let name = String::deserialize(deserializer)?;
    name.parse().map(Some).map_err(serde::de::Error::custom)
}

/// A value on the command line or in the file that cannot be: for the programs, exit code 2. The
/// text names the option, what was expected and what was found.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{0}")]
pub struct UsageError(pub String);

/// Fails with a [`UsageError`] unless `is_so`.
fn ensure(is_so: bool, text: impl FnOnce() -> String) -> Result<(), UsageError> {
    if is_so { Ok(()) } else { Err(UsageError(text())) }
}

/// Everything the daemon needs to know, checked.
#[derive(Clone, PartialEq, Debug)]
pub struct Config {
    /// Where to listen; None for the place that clients look at first.
    pub socket: Option<PathBuf>,
    /// Where output frames go.
    pub sink: SinkSpec,
    /// How windows open.
    pub window: WindowOptions,
    /// Period of the output, except of windows.
    pub refresh_interval: MonoSpan,
    /// What makes the pictures.
    pub backend: BackendChoice,
    /// How in-between frames are made.
    pub method: Method,
    /// Most frames shown a second, Hz.
    pub cap: Option<f64>,
    /// In-between frames are left out until something has moved by so many pixels.
    pub least_step_px: f32,
    /// What is drawn into the pictures of windows.
    pub hud: HudView,
    /// Capture to write.
    pub record: Option<PathBuf>,
    /// Threads per stream.
    pub threads: NonZeroUsize,
    /// Angular size of a pixel, which turns on damping.
    pub pixels_per_degree: Option<f32>,
    /// Whether the user said that size, which then holds whatever display a stream is for.
    pub is_ppd_given: bool,
    /// Whether detail moves from in-between frames to their keys, and the display that it is for.
    pub finish: FinishConfig,
    /// Name of that display.
    pub profile: Option<String>,
    /// Displays that a stream may name.
    pub profiles: Profiles,
    /// Filter of the log.
    pub log: String,
    /// Clients at once.
    pub max_clients: usize,
    /// Bytes that the pools and the engines of one client may take.
    pub memory_per_client: u64,
    /// How long the end of a stream waits for its sink, and the end of the daemon for the
    /// recording, before what is not written is given up. No option: nobody should have to think
    /// of it.
    pub stop_within: Duration,
}

/// Ample for a few frames on a slow disk, and short of what makes people reach for `kill -9`.
const STOP_WITHIN: Duration = Duration::from_secs(5);

impl Args {
    /// Reads the file that `--config` names, fills in the defaults and checks every value.
    ///
    /// # Errors
    /// If the file cannot be read or holds an unknown name, or a value is out of its range.
    pub fn resolve(self) -> Result<Config, UsageError> {
        let args = match &self.config {
            Some(path) => {
                let file = read_file(path)?;
                self.or(file)
            }
            None => self,
        };
        args.check()
    }

    /// These values, and where there is none the one of `file`.
    fn or(self, file: Self) -> Self {
        Self {
            socket: self.socket.or(file.socket),
            sink: self.sink.or(file.sink),
            fullscreen: self.fullscreen || file.fullscreen,
            monitor: self.monitor.or(file.monitor),
            layout: self.layout.or(file.layout),
            refresh: self.refresh.or(file.refresh),
            backend: self.backend.or(file.backend),
            method: self.method.or(file.method),
            cap: self.cap.or(file.cap),
            least_step: self.least_step.or(file.least_step),
            hud: self.hud.or(file.hud),
            record: self.record.or(file.record),
            threads: self.threads.or(file.threads),
            ppd: self.ppd.or(file.ppd),
            finish: self.finish.or(file.finish),
            finish_whole: self.finish_whole || file.finish_whole,
            profile: self.profile.or(file.profile),
            profiles: self.profiles.or(file.profiles),
            log: self.log.or(file.log),
            max_clients: self.max_clients.or(file.max_clients),
            memory_mb: self.memory_mb.or(file.memory_mb),
            config: self.config,
        }
    }

    fn check(self) -> Result<Config, UsageError> {
        let refresh = self.refresh.unwrap_or(120.0);
        ensure((1.0..=1000.0).contains(&refresh), || {
            format!("--refresh: expected 1 to 1000 Hz, found {refresh}")
        })?;
        if let Some(cap) = self.cap {
            ensure((1.0..=1000.0).contains(&cap), || {
                format!("--cap: expected 1 to 1000 Hz, found {cap}")
            })?;
            let sink = self.sink.clone().unwrap_or_default();
            ensure(!sink.has_own_rate(), || {
                format!("--cap: expected a sink without a rate of its own, found {sink}")
            })?;
        }
        if let Some(ppd) = self.ppd {
            ensure((1.0..=1000.0).contains(&ppd), || {
                format!("--ppd: expected 1 to 1000 pixels per degree, found {ppd}")
            })?;
        }
        let mut profiles = self.profiles.as_deref().map(Profiles::read).transpose()?;
        let profile = self.profile.as_deref().map(read_profile).transpose()?;
        if let Some(own) = self.profile.as_deref().filter(|name| name.ends_with(".toml"))
            && let Some(profile) = &profile
            && profiles.as_ref().is_none_or(|profiles| profiles.named(profile.name()).is_err())
        {
            let added = profiles.get_or_insert_default().add(profile.clone());
            added.map_err(|error| UsageError(format!("profile {own}: {error}")))?;
        }
        let max_clients = self.max_clients.unwrap_or(16);
        ensure((1..=256).contains(&max_clients), || {
            format!("--max-clients: expected 1 to 256, found {max_clients}")
        })?;
        let memory_mb = self.memory_mb.unwrap_or(2048);
        ensure((1..=1 << 20).contains(&memory_mb), || {
            format!("--memory-mb: expected 1 to 1048576, found {memory_mb}")
        })?;
        let least_step_px = self.least_step.unwrap_or(0.0);
        ensure((0.0..=16.0).contains(&least_step_px), || {
            format!("--least-step: expected 0 to 16 pixels, found {least_step_px}")
        })?;
        let log = self.log.unwrap_or_else(|| "info".to_owned());
        ensure(EnvFilter::try_new(&log).is_ok(), || {
            format!("--log: expected a level, or a filter such as foreframed=debug, found `{log}`")
        })?;
        let processors = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let refresh_interval = MonoSpan::from_hz(refresh);
        let mode = self.finish.unwrap_or_default();
        Ok(Config {
            socket: self.socket,
            sink: self.sink.unwrap_or_default(),
            window: WindowOptions {
                is_fullscreen: self.fullscreen,
                monitor: self.monitor,
                layout: self.layout.unwrap_or_default(),
            },
            refresh_interval,
            backend: self.backend.unwrap_or(BackendChoice::Auto),
            method: self.method.unwrap_or_default(),
            cap: self.cap,
            least_step_px,
            hud: self.hud.unwrap_or_default(),
            record: self.record,
            threads: self.threads.unwrap_or(processors),
            pixels_per_degree: self.ppd.or_else(|| profile.as_ref().and_then(profile_ppd)),
            is_ppd_given: self.ppd.is_some(),
            finish: FinishConfig::new(mode, profile.as_ref(), refresh_interval)
                .whole(self.finish_whole),
            profile: profile.map(|profile| profile.name().to_owned()),
            profiles: profiles.unwrap_or_default(),
            log,
            max_clients,
            memory_per_client: memory_mb << 20,
            stop_within: STOP_WITHIN,
        })
    }
}

impl Config {
    /// Time from one planned picture to the next: as many refreshes as the cap asks for.
    #[must_use]
    pub fn frame_interval(&self) -> MonoSpan {
        let Some(cap) = self.cap else { return self.refresh_interval };
        let refreshes = 1e9 / cap / self.refresh_interval.as_ns() as f64;
        // A cap of 59.94 on a display of 120 Hz means every second refresh.
        #[expect(clippy::cast_possible_truncation, reason = "at most a thousand")]
        let refreshes = (refreshes - 0.01).ceil().max(1.0) as i64;
        self.refresh_interval.scale(refreshes, 1)
    }

    /// What is known of the display of a stream that names `profile`: it wins over the daemon's
    /// own, but not over an angular size that the user said.
    ///
    /// # Errors
    /// Which names there are.
    pub fn viewed(&self, profile: Option<&ProfileName>) -> Result<Viewed, UnknownProfile> {
        let Some(name) = profile else {
            return Ok(Viewed {
                name: self.profile.clone(),
                pixels_per_degree: self.pixels_per_degree,
                finish: self.finish,
            });
        };
        let profile = self.profiles.named(name.as_str())?;
        let FinishConfig { mode, is_whole, refresh_interval, .. } = self.finish;
        let given = self.pixels_per_degree.filter(|_| self.is_ppd_given);
        Ok(Viewed {
            name: Some(profile.name().to_owned()),
            pixels_per_degree: given.or_else(|| profile_ppd(&profile)),
            finish: FinishConfig::new(mode, Some(&profile), refresh_interval).whole(is_whole),
        })
    }

    /// Names of the options that differ in `new` and that running streams cannot take over.
    #[must_use]
    pub fn needs_restart(&self, new: &Self) -> Vec<&'static str> {
        let differs = [
            ("socket", self.socket != new.socket),
            ("sink", self.sink != new.sink),
            ("fullscreen", self.window.is_fullscreen != new.window.is_fullscreen),
            ("monitor", self.window.monitor != new.window.monitor),
            ("layout", self.window.layout != new.window.layout),
            ("refresh", self.refresh_interval != new.refresh_interval),
            ("backend", self.backend != new.backend),
            ("least-step", self.least_step_px.to_bits() != new.least_step_px.to_bits()),
            ("threads", self.threads != new.threads),
            ("ppd", self.pixels_per_degree != new.pixels_per_degree),
            ("finish", self.finish.mode != new.finish.mode),
            ("finish-whole", self.finish.is_whole != new.finish.is_whole),
            ("profile", self.profile != new.profile),
            ("profiles", self.profiles != new.profiles),
            ("log", self.log != new.log),
            ("max-clients", self.max_clients != new.max_clients),
            ("memory-mb", self.memory_per_client != new.memory_per_client),
        ];
        differs.into_iter().filter_map(|(name, differs)| differs.then_some(name)).collect()
    }
}

fn read_file(path: &Path) -> Result<Args, UsageError> {
    let name = path.display();
    let text = fs::read_to_string(path).map_err(|error| {
        UsageError(format!("--config: expected a file that can be read, found {name}: {error}"))
    })?;
    toml::from_str(&text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start.min(text.len()));
        let line = text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count() + 1;
        UsageError(format!("{name}, line {line}: {}", error.message().replace('\n', ", ")))
    })
}

#[cfg(test)]
mod tests;
