//! Whether pictures are finished, and what is known of the display.

use std::fmt;
use std::str::FromStr;

use foreframe_perception::display::DisplayProfile;

use crate::time::MonoSpan;

/// When pictures are finished.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum FinishMode {
    /// Never.
    #[default]
    Off,
    /// Always.
    On,
    /// As far as the model of flicker says that nobody sees it.
    Auto,
}

impl FinishMode {
    /// Every mode.
    pub const ALL: [Self; 3] = [Self::Off, Self::On, Self::Auto];

    /// Name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::On => "on",
            Self::Auto => "auto",
        }
    }
}

impl fmt::Display for FinishMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A mode that does not exist.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected one of {}, found `{found}`", FinishMode::ALL.map(FinishMode::name).join(", "))]
pub struct UnknownFinish {
    /// What was asked for.
    pub found: String,
}

impl FromStr for FinishMode {
    type Err = UnknownFinish;

    fn from_str(name: &str) -> Result<Self, UnknownFinish> {
        let found = Self::ALL.into_iter().find(|mode| mode.name() == name);
        found.ok_or_else(|| UnknownFinish { found: name.to_owned() })
    }
}

/// What finishing has to know.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FinishConfig {
    /// When pictures are finished.
    pub mode: FinishMode,
    /// Whether all of a picture is blurred, and not only where what was foreseen of it is not to be
    /// relied on.
    pub is_whole: bool,
    /// Gamma of red, green and blue of the display; None where it follows the stream's transfer.
    pub gamma: Option<[f64; 3]>,
    /// Luminance of white, cd/m2; None where it is not known.
    pub peak_cd_m2: Option<f64>,
    /// Time from one picture to the next. 0 where it is not known: then [`FinishMode::Auto`] does
    /// nothing.
    pub refresh_interval: MonoSpan,
}

impl Default for FinishConfig {
    /// Off.
    fn default() -> Self {
        let refresh_interval = MonoSpan::ZERO;
        Self {
            mode: FinishMode::Off,
            is_whole: false,
            gamma: None,
            peak_cd_m2: None,
            refresh_interval,
        }
    }
}

impl FinishConfig {
    /// The same, where all of a picture is blurred if `is_whole`.
    #[must_use]
    pub fn whole(self, is_whole: bool) -> Self {
        Self { is_whole, ..self }
    }

    /// For a display of `profile`, of which one picture lasts `refresh_interval`.
    #[must_use]
    pub fn new(
        mode: FinishMode,
        profile: Option<&DisplayProfile>,
        refresh_interval: MonoSpan,
    ) -> Self {
        Self {
            mode,
            is_whole: false,
            gamma: profile.map(|profile| profile.model().gamma()),
            peak_cd_m2: profile.map(DisplayProfile::peak_luminance),
            refresh_interval,
        }
    }
}
