//! The demo's daemon: a second process on a private socket. It ends with the demo, even if that is
//! killed, and the demo does not wait for it for ever.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::{Context as _, bail};
use foreframe_engine::MonoSpan;
use foreframed::clock;
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

use super::Settings;

/// Time that the daemon has to open its socket.
const START_TIMEOUT: MonoSpan = MonoSpan::from_ms(10_000);
/// Time between two looks for the socket.
const POLL: MonoSpan = MonoSpan::from_ms(5);

/// Time that the daemon has to end: longer than it waits for a sink that is stuck.
const STOP_TIMEOUT: MonoSpan = MonoSpan::from_ms(15_000);

/// A running daemon. Killed when dropped.
#[derive(Debug)]
pub struct DaemonProcess {
    child: Child,
    folder: TempDir,
}

impl DaemonProcess {
    /// Starts this very program as `serve` and waits for its socket.
    ///
    /// # Errors
    /// If it cannot be started or ends at once; it has then said why on standard error.
    pub fn start(settings: &Settings) -> anyhow::Result<Self> {
        let program = std::env::current_exe().context("finding this program")?;
        let folder = tempfile::Builder::new()
            .prefix("foreframe-demo-")
            .tempdir()
            .context("making a folder for the demo's socket")?;
        let mut command = Command::new(&program);
        command.arg("serve");
        if settings.window.is_fullscreen {
            command.arg("--fullscreen");
        }
        if let Some(monitor) = &settings.window.monitor {
            command.args(["--monitor", monitor]);
        }
        let child = command
            .arg("--socket")
            .arg(socket_in(folder.path()))
            .args(["--sink", &settings.sink.to_string()])
            .args(["--refresh", &settings.refresh_hz.to_string()])
            .args(["--method", settings.method.name()])
            .args(["--backend", &settings.backend.to_string()])
            .args(["--hud", settings.hud.name()])
            .args(["--log", "warn"])
            .args(["--with-parent", &std::process::id().to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .with_context(|| format!("starting {}", program.display()))?;
        let mut daemon = Self { child, folder };
        let give_up_at = clock::now() + START_TIMEOUT;
        while !daemon.socket().exists() {
            if let Some(status) = daemon.child.try_wait()? {
                bail!("expected the daemon to listen, found that it ended with {status}");
            }
            if clock::now() > give_up_at {
                bail!("expected the daemon's socket within {START_TIMEOUT}, found none");
            }
            clock::sleep_until(clock::now() + POLL);
        }
        Ok(daemon)
    }

    /// Where it listens.
    #[must_use]
    pub fn socket(&self) -> PathBuf {
        socket_in(self.folder.path())
    }

    /// Asks it to end and waits until it has. One that does not end in time is killed.
    ///
    /// # Errors
    /// If it ends with anything but success, or does not end.
    pub fn stop(self) -> anyhow::Result<()> {
        self.stop_within(STOP_TIMEOUT)
    }

    fn stop_within(mut self, patience: MonoSpan) -> anyhow::Result<()> {
        let id = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let pid = id.context("the daemon has no process id")?;
        kill_process(pid, Signal::TERM).context("asking the daemon to end")?;
        let give_up_at = clock::now() + patience;
        let status = loop {
            if let Some(status) = self.child.try_wait().context("waiting for the daemon")? {
                break status;
            }
            if clock::now() > give_up_at {
                bail!("expected the daemon to end within {patience}, found that it runs: killed");
            }
            clock::sleep_until(clock::now() + POLL);
        };
        if !status.success() {
            bail!("expected the daemon to end well, found {status}");
        }
        Ok(())
    }
}

impl Drop for DaemonProcess {
    fn drop(&mut self) {
        // It has ended already unless something went wrong, and then that is what gets reported.
        let _killed = self.child.kill();
        let _status = self.child.wait();
    }
}

/// In a folder that the daemon makes, for its owner alone.
fn socket_in(folder: &Path) -> PathBuf {
    folder.join("private").join("daemon.sock")
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    #[test]
    fn a_daemon_that_does_not_end_is_killed_and_told() {
        let mut child = Command::new("sh")
            .args(["-c", "trap '' TERM; echo ready; while :; do read line || sleep 1; done"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut out = child.stdout.take().unwrap();
        out.read_exact(&mut [0; 6]).unwrap();
        let id = child.id();
        let daemon = DaemonProcess { child, folder: tempfile::tempdir().unwrap() };
        let error = daemon.stop_within(MonoSpan::from_ms(20)).unwrap_err().to_string();
        assert!(error.contains("killed"), "{error}");
        assert!(!Path::new(&format!("/proc/{id}")).exists(), "nothing is left of it");
    }
}
