//! `foreframe demo`.

use std::path::PathBuf;

use foreframe_engine::Method;
use foreframe_engine::backend::choice::BackendChoice;
use foreframe_fixtures::{SceneInfo, Size};
use foreframed::config::SinkSpec;
use foreframed::hud::HudView;
use foreframed::sink::window::WindowOptions;

use crate::demo::{self, Settings};
use crate::options::{number, parse_scene};
use crate::output::Output;

/// Arguments of `foreframe demo`.
#[derive(clap::Args, Debug)]
#[command(after_help = "\
Leaves contact-sheet.png (key, in-between, truth, error), timeline.png (when keys came and what was
shown) and summary.json in the folder, and removes what an earlier demo left there or as
frame_NNNNNN.png in the folder of --sink png. Needs about 2 GB of memory at 1280x720 for 3 seconds.")]
pub struct Args {
    /// Scene to show; `foreframe scenes` lists them
    #[arg(long, value_name = "NAME", default_value = "atrium", value_parser = parse_scene)]
    pub scene: &'static SceneInfo,
    /// Length of the show in seconds, 0.5 to 10
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = number(0.5, 10.0))]
    #[arg(allow_negative_numbers = true)]
    pub seconds: f64,
    /// Columns and rows of a frame
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub size: Size,
    /// Keys per second, 10 to 240
    #[arg(long, value_name = "HZ", default_value_t = 40.0, value_parser = number(10.0, 240.0))]
    #[arg(allow_negative_numbers = true)]
    pub key_rate: f64,
    /// Refreshes per second, 10 to 480; a window has its display's
    #[arg(long, value_name = "HZ", default_value_t = 120.0, value_parser = number(10.0, 480.0))]
    #[arg(allow_negative_numbers = true)]
    pub refresh: f64,
    /// How in-between frames are made
    #[arg(long, value_name = "NAME", default_value_t = Method::Linear)]
    pub method: Method,
    /// What makes them: auto, cpu, gpu or gpu:NAME
    #[arg(long, default_value_t = BackendChoice::Cpu)]
    pub backend: BackendChoice,
    /// Where the daemon sends frames besides: shm (the demo alone), window, png:DIR or y4m:PATH
    #[arg(long, default_value_t = SinkSpec::Shm, value_parser = parse_sink)]
    pub sink: SinkSpec,
    /// With --sink window: as large as the monitor
    #[arg(long, requires = "sink")]
    pub fullscreen: bool,
    /// With --sink window: the monitor, by its name
    #[arg(long, value_name = "NAME", requires = "sink")]
    pub monitor: Option<String>,
    /// With --sink window: what to draw into the pictures, as for `foreframed`; `h` in the window
    /// goes through the views
    #[arg(long, value_name = "VIEW", default_value_t = HudView::Off, requires = "sink")]
    pub hud: HudView,
    /// Folder for the pictures and the numbers
    #[arg(long, value_name = "DIR", default_value = "foreframe-demo")]
    pub out: PathBuf,
}

impl Args {
    /// What is for a window needs one.
    fn check(&self) -> anyhow::Result<()> {
        let of_a_window = [
            ("--fullscreen", self.fullscreen),
            ("--monitor", self.monitor.is_some()),
            ("--hud", self.hud != HudView::Off),
        ];
        match of_a_window.into_iter().find(|(_, is_given)| *is_given) {
            Some((name, _)) if self.sink != SinkSpec::Window => {
                anyhow::bail!("{name}: expected --sink window with it, found --sink {}", self.sink)
            }
            _ => Ok(()),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// If the daemon does not start, or a file cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    args.check()?;
    let settings = Settings {
        scene: args.scene,
        size: args.size,
        seconds: args.seconds,
        key_rate_hz: args.key_rate,
        refresh_hz: args.refresh,
        method: args.method,
        backend: args.backend.clone(),
        sink: args.sink.clone(),
        window: WindowOptions {
            is_fullscreen: args.fullscreen,
            monitor: args.monitor.clone(),
            ..WindowOptions::default()
        },
        hud: args.hud,
        out: args.out.clone(),
    };
    let summary = demo::run(&settings, output)?;
    output.result(&summary, &summary.text())
}

/// The demo has to see the frames, and prints its results on standard output.
fn parse_sink(spec: &str) -> Result<SinkSpec, String> {
    match spec.parse()? {
        SinkSpec::Null | SinkSpec::Y4mStdout => {
            Err(format!("expected shm, window, png:DIR or y4m:PATH, found `{spec}`"))
        }
        sink => Ok(sink),
    }
}

fn parse_size(text: &str) -> Result<Size, String> {
    let fail = || format!("expected WIDTHxHEIGHT, each 16 to {}, found `{text}`", Size::MAX);
    let (width, height) = text.split_once('x').ok_or_else(fail)?;
    let side = |side: &str| {
        side.parse().ok().filter(|side| (16..=Size::MAX).contains(side)).ok_or_else(fail)
    };
    Ok(Size::new(side(width)?, side(height)?))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;

    #[derive(clap::Parser, Debug)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    fn refused(words: &[&str]) -> Option<String> {
        let words = ["demo"].iter().chain(words);
        match Command::try_parse_from(words) {
            Err(error) => Some(error.to_string()),
            Ok(Command { args }) => args.check().err().map(|error| error.to_string()),
        }
    }

    #[test]
    fn what_is_for_a_window_is_refused_without_one() {
        for of_a_window in [&["--fullscreen"][..], &["--monitor", "DP-1"], &["--hud", "stats"]] {
            let said = refused(of_a_window).expect("there is no window");
            assert!(said.contains("--sink"), "{said}");
            let elsewhere = [of_a_window, &["--sink", "png:frames"]].concat();
            let said = refused(&elsewhere).expect("there is no window");
            assert!(said.contains("found --sink png:frames"), "{said}");
            assert_eq!(refused(&[of_a_window, &["--sink", "window"]].concat()), None);
        }
        assert_eq!(refused(&[]), None);
        assert_eq!(refused(&["--sink", "png:frames"]), None);
    }
}
