//! Display profiles: the constants of one display, read from TOML.
//!
//! Seven measured ones are built in, with the numbers as printed by Denes 2020, appendix A, from
//! `fixtures/profiles`. A user's own profile is the same format. A profile that makes no display is
//! refused as a whole.

use serde::Deserialize;

use super::geometry::Viewing;
use super::{GainOffsetGamma, LcdModel};
use crate::PerceptionError;

const BUILTIN: [(&str, &str); 7] = [
    profile("asus-pg279q", include_str!("../../../../fixtures/profiles/asus-pg279q.toml")),
    profile(
        "dell-inspiron-17r",
        include_str!("../../../../fixtures/profiles/dell-inspiron-17r.toml"),
    ),
    profile("htc-vive", include_str!("../../../../fixtures/profiles/htc-vive.toml")),
    profile(
        "huawei-mate-9-pro",
        include_str!("../../../../fixtures/profiles/huawei-mate-9-pro.toml"),
    ),
    profile(
        "huawei-mate-9-pro-vr",
        include_str!("../../../../fixtures/profiles/huawei-mate-9-pro-vr.toml"),
    ),
    profile("oculus-rift-cv1", include_str!("../../../../fixtures/profiles/oculus-rift-cv1.toml")),
    profile(
        "samsung-syncmaster-2233",
        include_str!("../../../../fixtures/profiles/samsung-syncmaster-2233.toml"),
    ),
];

const fn profile(name: &'static str, text: &'static str) -> (&'static str, &'static str) {
    (name, text)
}

/// How a display makes its light.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Technology {
    /// Liquid crystals before a backlight.
    Lcd,
    /// Pixels that emit.
    Oled,
}

/// A display at one refresh rate, with the memory of its crystals.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HighRefresh {
    /// The rate at which it was measured, Hz.
    pub refresh_hz: f64,
    /// Codes to light.
    pub model: GainOffsetGamma,
    /// Pairs of codes to one.
    pub lcd: LcdModel,
}

/// One display.
#[derive(Clone, PartialEq, Debug)]
pub struct DisplayProfile {
    text: ProfileText,
    model: GainOffsetGamma,
    high_refresh: Vec<HighRefresh>,
}

/// The file, before it is known to make sense.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ProfileText {
    name: String,
    title: String,
    source: String,
    technology: Technology,
    size_px: [u32; 2],
    diagonal_inch: Option<f64>,
    field_of_view_deg: Option<f64>,
    refresh_hz: f64,
    #[serde(default = "hold")]
    persistence: f64,
    peak_luminance: f64,
    dynamic_range: f64,
    model: ModelText,
    #[serde(default)]
    high_refresh: Vec<HighRefreshText>,
}

#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelText {
    gamma: [f64; 3],
    black_xyz: [f64; 3],
    rgb_from_xyz: [[f64; 3]; 3],
}

#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct HighRefreshText {
    refresh_hz: f64,
    gamma: [f64; 3],
    black_xyz: [f64; 3],
    rgb_from_xyz: [[f64; 3]; 3],
    lcd: [[f64; 4]; 3],
}

/// Persistence of a display that holds each frame until the next.
fn hold() -> f64 {
    1.0
}

impl DisplayProfile {
    /// Reads a profile.
    ///
    /// # Errors
    /// What a profile has, and what this text has instead.
    pub fn parse(text: &str) -> Result<Self, PerceptionError> {
        let text: ProfileText = toml::from_str(text).map_err(|error| PerceptionError::Profile {
            expected: "the fields of a profile in TOML".to_owned(),
            found: error.to_string().trim_end().replace('\n', "; "),
        })?;
        for (what, value) in [
            ("refresh_hz", text.refresh_hz),
            ("peak_luminance", text.peak_luminance),
            ("dynamic_range", text.dynamic_range),
            ("size_px", text.size_px[0].into()),
            ("size_px", text.size_px[1].into()),
            ("diagonal_inch", text.diagonal_inch.unwrap_or(1.0)),
            ("field_of_view_deg", text.field_of_view_deg.unwrap_or(1.0)),
        ] {
            PerceptionError::check_positive(what, value)?;
        }
        let persistence = text.persistence;
        let is_inside = persistence > 0.0 && persistence <= 1.0;
        PerceptionError::check("persistence", "above 0, up to 1", persistence, is_inside)?;
        let ModelText { gamma, black_xyz, rgb_from_xyz } = text.model;
        let model = GainOffsetGamma::new(gamma, black_xyz, rgb_from_xyz)?;
        let high_refresh =
            text.high_refresh.iter().map(HighRefreshText::build).collect::<Result<_, _>>()?;
        Ok(Self { text, model, high_refresh })
    }

    /// A built-in profile.
    ///
    /// # Errors
    /// Which there are, and what was found.
    pub fn builtin(name: &str) -> Result<Self, PerceptionError> {
        let unknown = || PerceptionError::UnknownProfile {
            expected: Self::builtin_names().collect::<Vec<_>>().join(", "),
            found: name.to_owned(),
        };
        let (_, text) = BUILTIN.iter().find(|(builtin, _)| *builtin == name).ok_or_else(unknown)?;
        Self::parse(text)
    }

    /// Names of the built-in profiles, in order of the alphabet.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        BUILTIN.iter().map(|(name, _)| *name)
    }

    /// The built-in profiles, in the order of their names.
    ///
    /// # Panics
    /// Never: a test reads them all.
    pub fn builtins() -> impl Iterator<Item = Self> {
        let read = |text| Self::parse(text).expect("built-in profiles are read by a test");
        BUILTIN.iter().map(move |(_, text)| read(text))
    }

    /// Short name, as typed.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.text.name
    }

    /// Name for people.
    #[must_use]
    pub fn title(&self) -> &str {
        &self.text.title
    }

    /// Where the numbers come from.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.text.source
    }

    /// How it makes light.
    #[must_use]
    pub fn technology(&self) -> Technology {
        self.text.technology
    }

    /// Columns and rows (of one eye, for a headset).
    #[must_use]
    pub fn size_px(&self) -> [u32; 2] {
        self.text.size_px
    }

    /// The highest refresh rate, Hz.
    #[must_use]
    pub fn refresh_hz(&self) -> f64 {
        self.text.refresh_hz
    }

    /// Share of a frame during which it is lit, above 0 up to 1. 1 is a display that holds.
    #[must_use]
    pub fn persistence(&self) -> f64 {
        self.text.persistence
    }

    /// Measured luminance of white, cd/m2.
    #[must_use]
    pub fn peak_luminance(&self) -> f64 {
        self.text.peak_luminance
    }

    /// Measured luminance of white over that of black.
    #[must_use]
    pub fn dynamic_range(&self) -> f64 {
        self.text.dynamic_range
    }

    /// Codes to light.
    #[must_use]
    pub fn model(&self) -> &GainOffsetGamma {
        &self.model
    }

    /// The rates at which the memory of its crystals was measured.
    #[must_use]
    pub fn high_refresh(&self) -> &[HighRefresh] {
        &self.high_refresh
    }

    /// Pixels per degree: of a headset, from its field of view; of a screen, in its middle from
    /// `distance_cm`.
    ///
    /// # Errors
    /// If the profile has neither a diagonal nor a field of view, or the distance is not above 0.
    pub fn ppd(&self, distance_cm: f64) -> Result<f64, PerceptionError> {
        let columns = f64::from(self.text.size_px[0]);
        match (self.text.field_of_view_deg, self.text.diagonal_inch) {
            (Some(degrees), _) => Ok(columns / degrees),
            (None, Some(inches)) => {
                Ok(Viewing::new(self.text.size_px, inches, distance_cm)?.ppd_at_centre())
            }
            (None, None) => Err(PerceptionError::Profile {
                expected: "diagonal_inch or field_of_view_deg".to_owned(),
                found: "neither".to_owned(),
            }),
        }
    }
}

impl HighRefreshText {
    fn build(&self) -> Result<HighRefresh, PerceptionError> {
        let refresh_hz = PerceptionError::check_positive("refresh_hz", self.refresh_hz)?;
        let model = GainOffsetGamma::new(self.gamma, self.black_xyz, self.rgb_from_xyz)?;
        Ok(HighRefresh { refresh_hz, model, lcd: LcdModel::new(self.lcd)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_profile_is_read_and_has_the_name_of_its_file() {
        let names: Vec<_> = DisplayProfile::builtin_names().collect();
        let read: Vec<_> =
            DisplayProfile::builtins().map(|profile| profile.name().to_owned()).collect();
        assert_eq!(names, read);
        assert!(names.is_sorted() && names.len() == 7);
    }

    #[test]
    fn white_by_the_model_is_the_measured_peak_as_far_as_four_decimals_allow() {
        // Denes 2020, table 4.1. The matrices are printed to four decimals, two to three digits:
        // their inverses, and so white, are good to a few percent and no more.
        for profile in DisplayProfile::builtins() {
            let white = profile.model().luminance([1.0; 3]);
            let ratio = white / profile.peak_luminance();
            assert!((0.99..1.06).contains(&ratio), "{}: {white} cd/m2", profile.name());
        }
    }

    #[test]
    fn headsets_have_the_published_resolution_and_screens_need_a_distance() {
        // Denes 2020, section 4.1: 1080 columns over 110 degrees and over 95 degrees.
        let vive = DisplayProfile::builtin("htc-vive").unwrap();
        assert!((vive.ppd(1.0).unwrap() - 9.818).abs() < 1e-3);
        let asus = DisplayProfile::builtin("asus-pg279q").unwrap();
        assert!((asus.ppd(75.0).unwrap() - 56.0).abs() < 0.5);
        assert!(asus.ppd(0.0).is_err());
    }

    #[test]
    fn what_is_no_profile_is_refused_with_what_was_found() {
        let text = BUILTIN[0].1;
        for (from, to, told) in [
            ("gamma = [2.10, 2.10, 2.12]", "gamma = [2.10, 2.10]", "profile"),
            ("gamma = [2.10, 2.10, 2.12]", "gamma = [2.10, -2.10, 2.12]", "gamma"),
            ("refresh_hz = 165.0\npeak", "refresh_hz = 0.0\npeak", "refresh_hz"),
            ("peak_luminance", "peak_brightness", "profile"),
            ("technology = \"lcd\"", "technology = \"crt\"", "profile"),
            (
                "refresh_hz = 165.0\npeak",
                "persistence = 1.5\nrefresh_hz = 165.0\npeak",
                "persistence",
            ),
        ] {
            let changed = text.replacen(from, to, 1);
            assert_ne!(changed, text, "{from} is in the profile");
            let error = DisplayProfile::parse(&changed).unwrap_err().to_string();
            assert!(error.contains(told), "{to}: {error}");
        }
        let error = DisplayProfile::builtin("crt").unwrap_err().to_string();
        assert!(error.contains("asus-pg279q") && error.contains("`crt`"), "{error}");
    }
}
