//! Which display a capture is replayed for.
//!
//! The rule of the daemon, with what the user of the tool says before what the capture says: a
//! profile on the command line, else the one that the application named, else none. The angular
//! size of a pixel: from the command line, its number before its profile; else what the daemon
//! worked with.

use std::path::Path;

use anyhow::Context as _;
use foreframe_perception::display::DisplayProfile;
use foreframe_protocol::ProfileName;
use foreframed::config::{profile_ppd, read_profile};
use foreframed::profiles::Profiles;

use super::capture::CaptureRecording;

/// What the command line says of the display.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct DisplayOptions {
    /// `--ppd`.
    pub pixels_per_degree: Option<f32>,
    /// `--profile`.
    pub profile: Option<DisplayProfile>,
    /// `--profiles`: what a capture may name beside the built-in ones.
    pub profiles: Profiles,
}

/// A display, as far as it is known.
#[derive(Clone, PartialEq, Debug)]
pub struct Display {
    /// Angular size of a pixel.
    pub pixels_per_degree: Option<f32>,
    /// What it makes of levels.
    pub profile: Option<DisplayProfile>,
}

impl DisplayOptions {
    /// Reads what `--profile` and `--profiles` name.
    ///
    /// # Errors
    /// If a file makes no display, or a name is unknown.
    pub fn read(profile: Option<&str>, profiles: Option<&Path>) -> anyhow::Result<Self> {
        Ok(Self {
            pixels_per_degree: None,
            profile: profile.map(read_profile).transpose()?,
            profiles: profiles.map(Profiles::read).transpose()?.unwrap_or_default(),
        })
    }

    /// The display that `recording` is replayed for.
    ///
    /// # Errors
    /// If the capture names a profile that nobody has and the command line names none, or its
    /// angular size is no number.
    pub fn of(&self, recording: &CaptureRecording) -> anyhow::Result<Display> {
        let recorded = recording.pixels_per_degree()?;
        let given = recorded.filter(|_| recording.is_ppd_given());
        self.resolve(recording.display_profile(), given, recorded)
    }

    fn resolve(
        &self,
        named: Option<ProfileName>,
        given: Option<f32>,
        recorded: Option<f32>,
    ) -> anyhow::Result<Display> {
        let own = self.profile.as_ref();
        let profile = match (own, named) {
            (Some(own), _) => Some(own.clone()),
            (None, Some(name)) => Some(self.profiles.named(name.as_str()).context(
                "the capture is for a display that is not known here: say --profile or --profiles",
            )?),
            (None, None) => None,
        };
        let of_profile = profile.as_ref().and_then(profile_ppd);
        let ppd = if own.is_some() { of_profile } else { given.or(of_profile).or(recorded) };
        Ok(Display { pixels_per_degree: self.pixels_per_degree.or(ppd), profile })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(ppd: Option<f32>, profile: Option<&str>) -> DisplayOptions {
        let read = DisplayOptions::read(profile, None).unwrap();
        DisplayOptions { pixels_per_degree: ppd, ..read }
    }

    #[test]
    fn the_command_line_wins_over_the_capture_and_the_streams_display_over_the_daemons() {
        let vive = Some(ProfileName::new("htc-vive").unwrap());
        let ppd_of = |name: &str| profile_ppd(&DisplayProfile::builtin(name).unwrap());
        let asus = Some("asus-pg279q");
        for (said, named, given, recorded, expected) in [
            (options(None, None), None, None, None, (None, None)),
            (options(None, None), None, None, Some(40.0), (None, Some(40.0))),
            (options(None, None), vive, None, Some(40.0), (Some("htc-vive"), ppd_of("htc-vive"))),
            (options(None, None), vive, Some(50.0), Some(50.0), (Some("htc-vive"), Some(50.0))),
            (options(None, asus), vive, Some(50.0), Some(50.0), (asus, ppd_of("asus-pg279q"))),
            (options(Some(60.0), asus), vive, Some(50.0), None, (asus, Some(60.0))),
        ] {
            let display = said.resolve(named, given, recorded).unwrap();
            let found =
                (display.profile.as_ref().map(DisplayProfile::name), display.pixels_per_degree);
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn a_display_that_nobody_knows_is_asked_for_and_not_passed_over() {
        let named = Some(ProfileName::new("mine").unwrap());
        let error = format!("{:#}", options(None, None).resolve(named, None, None).unwrap_err());
        assert!(error.contains("--profile") && error.contains("`mine`"), "{error}");
        assert!(options(None, Some("htc-vive")).resolve(named, None, None).is_ok());
    }
}
