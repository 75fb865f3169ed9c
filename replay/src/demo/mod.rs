//! The demo: a scene at a low rate through a real daemon, and what came out, checked.
//!
//! Keys and truth are rendered before the clock starts ([`rehearsal`]). The daemon runs as a second
//! process on a private socket ([`daemon_process`]). The application and its audience are two
//! clients on threads of their own ([`application`], [`audience`]). [`summary`] says what happened,
//! in numbers and in pictures.

pub mod application;
pub mod audience;
pub mod daemon_process;
mod refreshes;
pub mod rehearsal;
pub mod summary;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::anyhow;
use foreframe_client::ConnectOptions;
use foreframe_engine::backend::choice::BackendChoice;
use foreframe_engine::{Method, MonoSpan};
use foreframe_fixtures::{SceneInfo, Size};
use foreframed::clock;
use foreframed::config::SinkSpec;
use foreframed::hud::HudView;
use foreframed::sink::window::WindowOptions;

use crate::output::Output;
use application::Application;
use audience::Audience;
use daemon_process::DaemonProcess;
use rehearsal::Rehearsal;
use summary::Summary;

/// How long a client waits for the daemon's answer.
pub(crate) const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// Head start of the clients before the first key is due.
const HEAD_START: MonoSpan = MonoSpan::from_ms(300);

/// What to show.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The scene.
    pub scene: &'static SceneInfo,
    /// Columns and rows.
    pub size: Size,
    /// Length of the show.
    pub seconds: f64,
    /// Keys per second.
    pub key_rate_hz: f64,
    /// Output frames per second.
    pub refresh_hz: f64,
    /// How in-between frames are made.
    pub method: Method,
    /// What makes them.
    pub backend: BackendChoice,
    /// Sink of the daemon.
    pub sink: SinkSpec,
    /// How its window opens, if that is the sink.
    pub window: WindowOptions,
    /// What is drawn into the pictures of its window.
    pub hud: HudView,
    /// Where the pictures and the summary go.
    pub out: PathBuf,
}

/// Runs the demo.
///
/// # Errors
/// If the daemon cannot be started, a client is refused, or a picture cannot be written.
pub fn run(settings: &Settings, output: &Output) -> anyhow::Result<Summary> {
    summary::prepare(&settings.out, &settings.sink)?;
    let rehearsal = Rehearsal::render(settings, output);
    let daemon = DaemonProcess::start(settings)?;
    let base = clock::now() + HEAD_START;
    let connect = || ConnectOptions::new("foreframe demo").socket(daemon.socket());

    let audience = Audience::connect(&connect(), base)?;
    let application = Application::connect(&connect(), settings.size, base)?;
    let show = output.progress("showing", rehearsal.keys.len() as u64);
    let is_over = AtomicBool::new(false);
    let (submissions, shown) = thread::scope(|scope| {
        let is_over = &is_over;
        let audience = scope.spawn(|| audience.watch(&rehearsal, is_over));
        let submissions = application.play(&rehearsal, &show);
        is_over.store(true, Ordering::Relaxed);
        let shown = audience.join().map_err(|_| anyhow!("the audience's thread panicked"))?;
        anyhow::Ok((submissions?, shown?))
    })?;
    show.finish_and_clear();
    daemon.stop()?;
    let mut summary = Summary::new(settings, &rehearsal, &submissions, &shown);
    summary.write(settings, &rehearsal, &submissions, &shown)?;
    Ok(summary)
}
