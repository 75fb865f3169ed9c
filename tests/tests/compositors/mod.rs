//! Real compositors without a screen, each on a socket of its own.
//!
//! A compositor is ended when it is dropped, with everything that it started. Without its program a
//! test says so and does nothing, unless `FOREFRAME_REQUIRE_COMPOSITORS` names it or is `1`.

#![allow(dead_code, reason = "each test file uses its own part of the fixture")]
#![expect(clippy::unwrap_used, reason = "a fixture that cannot go on fails its test")]

use std::fs::{self, File};
use std::os::unix::fs::{PermissionsExt as _, chown};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use foreframe_engine::MonoSpan;
use foreframed::clock;
use rustix::process::{Pid, Signal, kill_process_group};
use tempfile::TempDir;

/// Starting takes longer than this only if something is broken.
const PATIENCE: MonoSpan = MonoSpan::from_ms(60_000);
const REQUIRE: &str = "FOREFRAME_REQUIRE_COMPOSITORS";
/// sway refuses to run as root; this is `nobody` everywhere.
const NOBODY: u32 = 65_534;

/// Which one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// Answers all feedback, by the monotonic clock, at the rate that it announces.
    Mutter,
    /// Announces a rate that it does not keep, and tells times by the raw clock.
    Weston,
    /// Never answers feedback without a screen.
    Sway,
    /// An X server: no feedback at all.
    Xvfb,
}

impl Kind {
    pub(crate) fn program(self) -> &'static str {
        match self {
            Self::Mutter => "mutter",
            Self::Weston => "weston",
            Self::Sway => "sway",
            Self::Xvfb => "Xvfb",
        }
    }
}

/// A running compositor.
pub(crate) struct Compositor {
    kind: Kind,
    child: Child,
    folder: TempDir,
    /// What a client's environment needs.
    pub(crate) environment: Vec<(&'static str, String)>,
}

impl Compositor {
    /// With one monitor of this size and rate. None, and a word on standard error, where it is not
    /// installed and need not be.
    pub(crate) fn start(kind: Kind, [width, height]: [u32; 2], hz: u32) -> Option<Self> {
        let program = kind.program();
        if !is_installed(program) {
            let required = std::env::var(REQUIRE).unwrap_or_default();
            let is_required = required == "1" || required.split(',').any(|name| name == program);
            assert!(!is_required, "{REQUIRE}: expected {program} to be installed, found none");
            let name = std::thread::current().name().unwrap_or_default().to_owned();
            eprintln!("skipped (1): {name}: no {program}");
            return None;
        }
        let folder = tempfile::Builder::new()
            .prefix("ff-")
            .permissions(fs::Permissions::from_mode(0o700))
            .tempdir()
            .unwrap();
        let at = folder.path();
        let size = format!("{width}x{height}");
        let mut command = match kind {
            Kind::Mutter => {
                let mut command = Command::new("dbus-run-session");
                let monitor = format!("{size}@{hz}");
                command.args(["--", "mutter", "--headless", "--no-x11", "--wayland"]);
                command.args(["--wayland-display", "wl", "--virtual-monitor", &monitor]);
                command
            }
            Kind::Weston => {
                let mut command = Command::new("weston");
                command.args(["--backend=headless-backend.so", "--socket=wl", "--idle-time=0"]);
                command.args([format!("--width={width}"), format!("--height={height}")]);
                command
            }
            Kind::Sway => {
                let config = at.join("config");
                fs::write(&config, format!("output HEADLESS-1 mode {size}@{hz}Hz\n")).unwrap();
                let mut command = Command::new("sway");
                command.arg("-c").arg(config).envs([
                    ("WLR_BACKENDS", "headless"),
                    ("WLR_RENDERER", "pixman"),
                    ("WLR_LIBINPUT_NO_DEVICES", "1"),
                ]);
                if rustix::process::geteuid().is_root() {
                    chown(at, Some(NOBODY), Some(NOBODY)).unwrap();
                    command.uid(NOBODY).gid(NOBODY);
                }
                command
            }
            Kind::Xvfb => {
                let mut command = Command::new("Xvfb");
                command.args(["-displayfd", "1", "-nolisten", "tcp", "-br"]);
                command.arg("-fbdir").arg(at);
                command.args(["-screen", "0"]).arg(format!("{size}x24"));
                command
            }
        };
        let log = File::create(at.join("log")).unwrap();
        let out = File::create(at.join("out")).unwrap();
        let child = command
            .env("XDG_RUNTIME_DIR", at)
            .env("HOME", at)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("DISPLAY")
            .current_dir(at)
            .process_group(0)
            .stdin(Stdio::null())
            .stdout(out)
            .stderr(log)
            .spawn()
            .unwrap();
        let mut compositor = Self { kind, child, folder, environment: Vec::new() };
        compositor.environment = compositor.wait_until_ready();
        Some(compositor)
    }

    fn wait_until_ready(&mut self) -> Vec<(&'static str, String)> {
        let patience = clock::now() + PATIENCE;
        loop {
            if let Some(environment) = self.environment() {
                return environment;
            }
            assert!(clock::now() < patience, "no socket: {}", self.log());
            assert!(self.child.try_wait().unwrap().is_none(), "it ended: {}", self.log());
            std::thread::yield_now();
        }
    }

    /// Once it listens.
    fn environment(&self) -> Option<Vec<(&'static str, String)>> {
        let at = self.folder.path();
        if self.kind == Kind::Xvfb {
            let display = fs::read_to_string(at.join("out")).ok()?;
            let number = display.strip_suffix('\n')?;
            return Some(vec![
                ("DISPLAY", format!(":{number}")),
                ("WAYLAND_DISPLAY", String::new()),
            ]);
        }
        let name = ["wl", "wayland-1", "wayland-0"]
            .into_iter()
            .find(|name| UnixStream::connect(at.join(name)).is_ok())?;
        Some(vec![
            ("XDG_RUNTIME_DIR", at.display().to_string()),
            ("WAYLAND_DISPLAY", name.to_owned()),
            ("DISPLAY", String::new()),
        ])
    }

    /// Red, green and blue of the X server's screen at a point, from its memory in XWD format.
    pub(crate) fn pixel(&self, [x, y]: [usize; 2]) -> [u8; 3] {
        let screen = fs::read(self.folder.path().join("Xvfb_screen0")).unwrap();
        let number = |index: usize| {
            let field = screen[index * 4..].first_chunk().unwrap();
            usize::try_from(u32::from_be_bytes(*field)).unwrap()
        };
        let [header_len, bits_per_pixel, row_len, colors] = [0, 11, 12, 19].map(number);
        assert_eq!(bits_per_pixel, 32, "the screen is another than was asked for");
        let at = header_len + colors * 12 + y * row_len + x * 4;
        let [blue, green, red, _] = *screen[at..].first_chunk().unwrap();
        [red, green, blue]
    }

    /// Ends it at once.
    pub(crate) fn kill(&mut self) {
        self.signal(Signal::KILL);
        self.child.wait().unwrap();
    }

    /// To it and to all that it started.
    pub(crate) fn signal(&self, signal: Signal) {
        kill_process_group(Pid::from_child(&self.child), signal).unwrap();
    }

    /// Its socket's folder.
    pub(crate) fn folder(&self) -> PathBuf {
        self.folder.path().to_owned()
    }

    fn log(&self) -> String {
        fs::read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }
}

impl Drop for Compositor {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.kill();
        }
    }
}

fn is_installed(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|dir| dir.join(program).exists())
}
