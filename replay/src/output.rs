//! What a command tells: text for people, or one JSON object, and progress on a terminal.

use std::io::{self, IsTerminal as _, Write as _};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

/// Where a command's results go.
#[derive(Debug)]
pub struct Output {
    json: bool,
}

impl Output {
    /// Text, or JSON with `--json`.
    #[must_use]
    pub fn new(json: bool) -> Self {
        Self { json }
    }

    /// Whether `--json` was given.
    #[must_use]
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Prints a result: `text` for people, or `value` as one JSON object.
    ///
    /// # Errors
    /// If standard output cannot be written. A closed pipe is not an error: the reader had enough.
    pub fn result<T: Serialize>(&self, value: &T, text: &str) -> anyhow::Result<()> {
        let line =
            if self.json { serde_json::to_string(value)? } else { text.trim_end().to_owned() };
        match writeln!(io::stdout().lock(), "{line}") {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => Ok(other?),
        }
    }

    /// A progress bar over `steps` steps on standard error; invisible where that is no terminal.
    ///
    /// # Panics
    /// Never: the template is a constant that a test parses.
    #[must_use]
    pub fn progress(&self, what: &str, steps: u64) -> ProgressBar {
        let target = if io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let style = ProgressStyle::with_template("{msg:24} [{bar:40}] {pos}/{len} {eta} left")
            .expect("the template is valid")
            .progress_chars("=> ");
        ProgressBar::with_draw_target(Some(steps), target)
            .with_style(style)
            .with_message(what.to_owned())
    }
}
