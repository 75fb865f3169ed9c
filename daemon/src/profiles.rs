//! The display profiles that streams may name: the built-in ones, and those of the user.
//!
//! All of them are read once, from files that the user names; a client chooses among them by name
//! and never by path, so that nothing it sends makes the daemon open a file.

use std::fmt;
use std::fs;
use std::path::Path;

use foreframe_engine::FinishConfig;
use foreframe_perception::display::DisplayProfile;
use foreframe_protocol::ProfileName;

use crate::config::UsageError;

/// Bytes that the names there are may take: as many as fit into an
/// [`ErrorMessage`](foreframe_protocol::ErrorMessage).
const LIST_BYTES: usize = 224;

/// Profiles of the user. The built-in ones are always there; one of the user's with the same name
/// stands before it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Profiles {
    own: Vec<DisplayProfile>,
}

/// What is known of the display that a stream is for.
#[derive(Clone, PartialEq, Debug)]
pub struct Viewed {
    /// Name of the profile; None where nobody named one.
    pub name: Option<String>,
    /// Angular size of a pixel.
    pub pixels_per_degree: Option<f32>,
    /// Whether detail moves from in-between frames to their keys, and the display that it is for.
    pub finish: FinishConfig,
}

/// A stream named a profile that nobody has.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("display profile: expected one of {expected}, found `{found}`")]
pub struct UnknownProfile {
    /// The names there are, as many as fit into 224 bytes, and how many more.
    pub expected: String,
    /// The name that was asked for.
    pub found: String,
}

impl Profiles {
    /// The profiles of the files in `folder` whose names end in `.toml`.
    ///
    /// # Errors
    /// If the folder cannot be read, if a file makes no display, if two have the same name, or if
    /// a name is longer than a stream can say.
    pub fn read(folder: &Path) -> Result<Self, UsageError> {
        let wrong = |path: &Path, error: &dyn fmt::Display| {
            UsageError(format!(
                "--profiles: expected a folder of display profiles, files that end in .toml, found \
                 {}: {error}",
                path.display()
            ))
        };
        let entries = fs::read_dir(folder).map_err(|error| wrong(folder, &error))?;
        let entries: Result<Vec<_>, _> = entries.map(|entry| Ok(entry?.path())).collect();
        let mut paths = entries.map_err(|error: std::io::Error| wrong(folder, &error))?;
        paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
        paths.sort();
        let mut profiles = Self::default();
        for path in paths {
            let text = fs::read_to_string(&path).map_err(|error| wrong(&path, &error))?;
            let profile = DisplayProfile::parse(&text).map_err(|error| wrong(&path, &error))?;
            profiles.add(profile).map_err(|error| wrong(&path, &error))?;
        }
        Ok(profiles)
    }

    /// Adds a profile of the user.
    ///
    /// # Errors
    /// If its name is no [`ProfileName`], or another of the user's has it.
    pub fn add(&mut self, profile: DisplayProfile) -> Result<(), UsageError> {
        let name = profile.name();
        ProfileName::new(name).map_err(|error| UsageError(error.to_string()))?;
        if self.own.iter().any(|own| own.name() == name) {
            let text = format!("name: expected one that no other file has, found `{name}`");
            return Err(UsageError(text));
        }
        self.own.push(profile);
        Ok(())
    }

    /// The profile of this name.
    ///
    /// # Errors
    /// Which names there are.
    pub fn named(&self, name: &str) -> Result<DisplayProfile, UnknownProfile> {
        if let Some(own) = self.own.iter().find(|own| own.name() == name) {
            return Ok(own.clone());
        }
        DisplayProfile::builtin(name)
            .map_err(|_| UnknownProfile { expected: listed(&self.names()), found: name.to_owned() })
    }

    /// The user's names, then the built-in ones.
    fn names(&self) -> Vec<&str> {
        let is_left = |name: &str| self.own.iter().all(|own| own.name() != name);
        let own = self.own.iter().map(DisplayProfile::name);
        let builtin = DisplayProfile::builtin_names().filter(|name| is_left(name));
        own.chain(builtin.map(|name| name as &str)).collect()
    }
}

/// As many of the names as there is room for, and how many are left.
fn listed(names: &[&str]) -> String {
    let of_first = |count: usize| {
        let list = names[..count].join(", ");
        match names.len() - count {
            0 => list,
            left => format!("{list} and {left} more"),
        }
    };
    let fitting = (0..=names.len()).rev().map(of_first).find(|list| list.len() <= LIST_BYTES);
    fitting.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIVE: &str = include_str!("../../fixtures/profiles/htc-vive.toml");

    fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (file, text) in files {
            fs::write(folder.path().join(file), text).unwrap();
        }
        folder
    }

    #[test]
    fn a_users_profile_is_found_beside_the_built_in_ones_and_before_its_namesake() {
        let bright = VIVE.replace("peak_luminance = ", "peak_luminance = 1");
        let mine = bright.replace("htc-vive", "mine");
        let folder = folder_with(&[("a.toml", &mine), ("b.toml", &bright), ("readme", "no TOML")]);
        let profiles = Profiles::read(folder.path()).unwrap();
        let peak = |profiles: &Profiles, name| profiles.named(name).unwrap().peak_luminance();
        let builtin = peak(&Profiles::default(), "htc-vive");
        assert!(peak(&profiles, "mine") > builtin);
        assert!(peak(&profiles, "htc-vive") > builtin);
        assert_eq!(profiles.named("asus-pg279q").unwrap().name(), "asus-pg279q");
        let error = profiles.named("crt").unwrap_err();
        assert!(error.expected.starts_with("mine, htc-vive, asus-pg279q"), "{error}");
        assert_eq!(error.expected.matches("htc-vive").count(), 1);
        assert!(Profiles::default().named("mine").is_err(), "it is nobody else's");
    }

    #[test]
    fn a_list_of_names_that_is_too_long_for_an_error_ends_with_how_many_are_left() {
        let names: Vec<_> = (10..60).map(|index| format!("profile-{index}")).collect();
        for count in 0..names.len() {
            let some: Vec<_> = names[..count].iter().map(String::as_str).collect();
            let list = listed(&some);
            assert!(list.len() <= LIST_BYTES, "{list}");
            let (told, left) = list.rsplit_once(" and ").unwrap_or((&list, "0 more"));
            let told = told.split(", ").filter(|name| !name.is_empty()).count();
            let left = left.strip_suffix(" more").and_then(|left| left.parse().ok());
            assert_eq!(left, Some(count - told), "{list}");
            assert_eq!(count <= 18, told == count, "{list}");
            assert!(told == count || told > 15, "{list}");
        }
    }

    #[test]
    fn a_folder_that_does_not_make_sense_is_refused_with_the_file() {
        let long = VIVE.replace("\"htc-vive\"", &format!("\"{}\"", "x".repeat(65)));
        for (files, told) in [
            (vec![("a.toml", VIVE), ("b.toml", VIVE)], "b.toml"),
            (vec![("a.toml", "name = 1")], "a.toml"),
            (vec![("a.toml", &long)], "64 bytes"),
        ] {
            let error = Profiles::read(folder_with(&files).path()).unwrap_err().to_string();
            assert!(error.contains(told) && error.contains("expected"), "{error}");
        }
        assert!(Profiles::read(Path::new("/nowhere")).is_err());
    }
}
