//! A daemon with windows on a scripted compositor, and a client that submits keys to it.

use std::fs;
use std::path::PathBuf;

use foreframe_engine::MonoSpan;
use foreframe_protocol::{DaemonMessage, DestroyStream, Presented};
use foreframed::clock;
use tempfile::TempDir;

use super::{Script, Scripted, Seen};
use crate::daemon_fixture::child::ChildProcess;
use crate::daemon_fixture::{Client, KeySource, private_folder};

/// Colour of the keys, red first, and as the compositor has it.
pub(crate) const KEY: [u8; 4] = [200, 100, 50, 255];
pub(crate) const KEY_SEEN: [u8; 3] = [50, 100, 200];
pub(crate) const BLACK: [u8; 3] = [0; 3];
/// Waiting this long means that something is broken.
pub(crate) const PATIENCE: MonoSpan = MonoSpan::from_ms(60_000);

/// A daemon with windows on a scripted compositor, and a client with a stream.
pub(crate) struct Stage {
    pub(crate) compositor: Scripted,
    _daemon: ChildProcess,
    pub(crate) client: Client,
    pub(crate) source: KeySource,
    log: PathBuf,
    folder: TempDir,
}

impl Stage {
    pub(crate) fn set(script: Script) -> Self {
        Self::set_with(script, &[])
    }

    pub(crate) fn set_with(script: Script, more: &[(&'static str, &str)]) -> Self {
        let compositor = Scripted::start(script);
        let folder = private_folder();
        let [socket, log] = ["daemon.sock", "log"].map(|name| folder.path().join(name));
        let mut environment = compositor.environment();
        environment.extend(more.iter().map(|&(name, value)| (name, value.to_owned())));
        let daemon = ChildProcess::daemon_with_windows(&socket, &environment, &log);
        let mut client = Client::connect(&socket);
        let source = client.open_stream(1, 64, 32);
        Self { compositor, _daemon: daemon, client, source, log, folder }
    }

    /// Submits keys until the compositor has seen what is wanted.
    pub(crate) fn show_until_seen(&mut self, is_wanted: impl Fn(&[Seen]) -> bool) {
        let patience = clock::now() + PATIENCE;
        loop {
            let seen = self.compositor.seen();
            if is_wanted(&seen) {
                return;
            }
            assert!(clock::now() < patience, "{seen:?}: {}", self.log());
            self.client.submit(&mut self.source, KEY);
            self.client.take_waiting();
        }
    }

    /// Submits keys for so many refreshes, and says how many pictures were committed meanwhile.
    pub(crate) fn commits_in(&mut self, refreshes: u64) -> u32 {
        let commits =
            |stage: &Self| stage.compositor.seen().iter().map(|it| it.commits).sum::<u32>();
        let (from, before) = (self.compositor.ticks(), commits(self));
        while self.compositor.ticks() < from + refreshes {
            self.client.submit(&mut self.source, KEY);
            self.client.take_waiting();
        }
        commits(self) - before
    }

    /// Submits keys until `is_enough` of those that were shown, or the log, and gives the former.
    pub(crate) fn show_until(
        &mut self,
        is_enough: impl Fn(&[Presented], &str) -> bool,
    ) -> Vec<Presented> {
        let patience = clock::now() + PATIENCE;
        let mut shown = Vec::new();
        while !is_enough(&shown, &self.log()) {
            assert!(clock::now() < patience, "{} keys: {}", shown.len(), self.log());
            self.client.submit(&mut self.source, KEY);
            shown.extend(self.client.take_waiting().into_iter().filter_map(|it| match it {
                DaemonMessage::Presented(presented) => Some(presented),
                _ => None,
            }));
        }
        shown
    }

    pub(crate) fn log(&self) -> String {
        fs::read_to_string(&self.log).expect("the daemon writes it")
    }

    /// Ends the stream, and its window with it; the daemon takes the next.
    pub(crate) fn strike(&mut self) {
        self.client.send(DestroyStream { stream: 1 });
        self.client.expect("the stream's end", |message| match message {
            DaemonMessage::StreamEnded(ended) => (ended.stream == 1).then_some(()),
            _ => None,
        });
        Client::connect(&self.folder.path().join("daemon.sock")).open_stream(1, 64, 64);
    }
}
