//! This test program again, as a second process that can be killed.
//!
//! A file that uses it has a test named `child_process` that calls [`run_if_asked`]. In an ordinary
//! run that does nothing; in a child it becomes the daemon, or the client, that the environment
//! asks for.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};

use foreframe_engine::MonoSpan;
use foreframe_engine::backend::gpu::test_adapters::test_adapters;
use foreframed::{Args, clock};
use rustix::process::{Pid, Signal, kill_process};

use super::Client;

const ROLE: &str = "FOREFRAME_TEST_ROLE";
const SOCKET: &str = "FOREFRAME_TEST_SOCKET";
const RECORD: &str = "FOREFRAME_TEST_RECORD";
const SINK: &str = "FOREFRAME_TEST_SINK";
/// `--monitor NAME`, `--layout NAME` or `--backend NAME`, if it is to have one of them.
pub(crate) const MONITOR: &str = "FOREFRAME_TEST_MONITOR";
pub(crate) const LAYOUT: &str = "FOREFRAME_TEST_LAYOUT";
pub(crate) const BACKEND: &str = "FOREFRAME_TEST_BACKEND";
const REFRESH: &str = "FOREFRAME_TEST_REFRESH";
/// What a daemon with windows logs.
const LOG: &str = "info,foreframed::stream::display=trace";
const READY: &str = "the child is ready";

/// What a child does.
#[derive(Clone, Copy)]
pub(crate) enum Role {
    Daemon,
    /// Opens a stream, submits keys, and waits for its end.
    Client,
    /// Nothing but to wait for its end.
    Bystander,
}

impl Role {
    const fn name(self) -> &'static str {
        match self {
            Self::Daemon => "daemon",
            Self::Client => "client",
            Self::Bystander => "bystander",
        }
    }
}

pub(crate) struct ChildProcess {
    pub(crate) child: Child,
}

/// Becomes what the environment asks for, and does not come back.
pub(crate) fn run_if_asked() {
    let Ok(role) = std::env::var(ROLE) else { return };
    let socket = std::env::var_os(SOCKET).map(std::path::PathBuf::from);
    let code = match role.as_str() {
        "daemon" => {
            let record = std::env::var_os(RECORD).map(Into::into);
            let sink = std::env::var(SINK).ok().map(|sink| sink.parse().unwrap());
            let log = Some(if sink.is_some() { LOG } else { "warn" }.to_owned());
            let fullscreen = sink.is_some();
            let refresh = std::env::var(REFRESH).ok().map(|hz| hz.parse().unwrap());
            let args = Args {
                socket,
                record,
                sink,
                log,
                fullscreen,
                refresh,
                monitor: std::env::var(MONITOR).ok(),
                layout: std::env::var(LAYOUT).ok().map(|layout| layout.parse().unwrap()),
                backend: std::env::var(BACKEND).ok().map(|backend| backend.parse().unwrap()),
                ..Args::default()
            };
            match foreframed::run(args) {
                Ok(()) => 0,
                Err(error) => {
                    eprintln!("foreframed: {error:#}");
                    1
                }
            }
        }
        "client" => {
            let mut client = Client::connect(&socket.unwrap());
            let mut source = client.open_stream(1, 320, 200);
            let _screen = client.subscribe(1, 2);
            for _ in 0..3 {
                client.submit(&mut source, [1, 2, 3, 255]);
            }
            wait_for_the_end()
        }
        _ => wait_for_the_end(),
    };
    std::process::exit(code);
}

/// Says that everything is set up, and waits until the parent hangs up or kills.
fn wait_for_the_end() -> i32 {
    println!("{READY}");
    drop(std::io::stdin().read(&mut [0]));
    0
}

/// The adapter that presents without a GPU, as a backend; None, and a word of it, where it is not
/// installed.
pub(crate) fn lavapipe() -> Option<&'static str> {
    installed("llvmpipe").then_some("gpu:llvmpipe")
}

/// Another driver that needs no GPU, the same.
pub(crate) fn swiftshader() -> Option<&'static str> {
    installed("swiftshader").then_some("gpu:swiftshader")
}

fn installed(adapter: &str) -> bool {
    let test = std::thread::current().name().unwrap_or_default().to_owned();
    let is_it = |name: &str| name.to_lowercase().contains(adapter);
    let found = test_adapters(&test).iter().any(|it| is_it(&it.facts.name));
    if !found {
        eprintln!("skipped (1): {test}: no {adapter}");
    }
    found
}

impl ChildProcess {
    pub(crate) fn spawn(role: Role, socket: &Path, record: Option<&Path>) -> Self {
        let mut command = Self::command(role, socket);
        if let Some(record) = record {
            command.env(RECORD, record);
        }
        Self { child: command.spawn().unwrap() }
    }

    fn command(role: Role, socket: &Path) -> Command {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command
            .args(["child_process", "--exact", "--nocapture"])
            .env(ROLE, role.name())
            .env(SOCKET, socket)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// A daemon that shows windows on the display that `environment` leads to, and writes its log
    /// to a file.
    pub(crate) fn daemon_with_windows(
        socket: &Path,
        environment: &[(&'static str, String)],
        log: &Path,
    ) -> Self {
        Self::daemon_that_ends(socket, environment, log).listening(socket)
    }

    /// The same, where it will not get as far as listening.
    pub(crate) fn daemon_that_ends(
        socket: &Path,
        environment: &[(&'static str, String)],
        log: &Path,
    ) -> Self {
        let mut command = Self::command(Role::Daemon, socket);
        command.env(SINK, "window").envs(environment.iter().map(|(name, value)| (name, value)));
        command.stderr(std::fs::File::create(log).unwrap());
        Self { child: command.spawn().unwrap() }
    }

    /// A daemon that makes frames at this rate and throws them away.
    pub(crate) fn daemon_without_windows(socket: &Path, hz: u32) -> Self {
        let mut command = Self::command(Role::Daemon, socket);
        command.env(SINK, "null").env(REFRESH, hz.to_string()).stderr(Stdio::null());
        Self { child: command.spawn().unwrap() }.listening(socket)
    }

    /// A daemon that listens.
    pub(crate) fn daemon(socket: &Path, record: Option<&Path>) -> Self {
        Self::spawn(Role::Daemon, socket, record).listening(socket)
    }

    fn listening(self, socket: &Path) -> Self {
        let mut child = self;
        let patience = clock::now() + MonoSpan::from_ms(60_000);
        while foreframe_protocol::socket::Channel::connect(socket).is_err() {
            assert!(clock::now() < patience, "the daemon does not listen");
            assert!(child.child.try_wait().unwrap().is_none(), "{}", child.errors());
            std::thread::yield_now();
        }
        child
    }

    /// A child that has said that it is ready.
    pub(crate) fn ready(role: Role, socket: &Path) -> Self {
        let mut child = Self::spawn(role, socket, None);
        let out: ChildStdout = child.child.stdout.take().unwrap();
        let is_ready = BufReader::new(out).lines().any(|line| line.unwrap().contains(READY));
        assert!(is_ready, "{}", child.errors());
        child
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).unwrap();
    }

    pub(crate) fn kill(&mut self) {
        self.signal(Signal::KILL);
        self.child.wait().unwrap();
    }

    /// Waits for its end, a minute at most: how it ended, and what it wrote to standard error.
    pub(crate) fn end(&mut self) -> (ExitStatus, String) {
        let patience = clock::now() + MonoSpan::from_ms(60_000);
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return (status, self.errors());
            }
            assert!(clock::now() < patience, "it goes on");
            std::thread::yield_now();
        }
    }

    fn errors(&mut self) -> String {
        let mut errors = String::new();
        if let Some(mut stderr) = self.child.stderr.take() {
            stderr.read_to_string(&mut errors).unwrap();
        }
        errors
    }

    /// A line of `/proc/PID/status`.
    pub(crate) fn status_line(&self, name: &str) -> String {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap();
        line.trim_start_matches(':').trim().to_owned()
    }

    pub(crate) fn count_fds(&self) -> usize {
        std::fs::read_dir(format!("/proc/{}/fd", self.child.id())).unwrap().count()
    }

    pub(crate) fn count_maps_of(&self, name: &str) -> usize {
        let maps = std::fs::read_to_string(format!("/proc/{}/maps", self.child.id())).unwrap();
        maps.lines().filter(|line| line.contains(name)).count()
    }
}

impl Drop for ChildProcess {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            drop(self.child.kill());
            drop(self.child.wait());
        }
    }
}
