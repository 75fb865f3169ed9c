//! Values on the command line: what they may be, said where they are read.
//!
//! Everything that can be known to be wrong without opening a file is refused here, by clap, which
//! names the option and ends with exit code 2.

use std::num::NonZeroUsize;

use foreframe_fixtures::SceneInfo;

pub use foreframed::config::{parse_count, parse_whole};

/// Reads a number of `least` to `most`.
pub fn number(
    least: f64,
    most: f64,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| {
        let fail = || format!("expected a number of {least} to {most}, found `{text}`");
        let value: f64 = text.parse().map_err(|_| fail())?;
        if (least..=most).contains(&value) { Ok(value) } else { Err(fail()) }
    }
}

/// Reads a whole number of `least` to `most`.
pub fn whole(
    least: i32,
    most: i32,
) -> impl Fn(&str) -> Result<i32, String> + Clone + Send + Sync + 'static {
    move |text| {
        let fail = || format!("expected a whole number of {least} to {most}, found `{text}`");
        let value = text.parse().map_err(|_| fail())?;
        if (least..=most).contains(&value) { Ok(value) } else { Err(fail()) }
    }
}

/// Reads the distance between two keys where there must be frames between them.
///
/// # Errors
/// What was expected and what was found.
pub fn parse_ratio(text: &str) -> Result<NonZeroUsize, String> {
    let fail =
        || format!("expected 2 or more, so that there is a frame to predict, found `{text}`");
    text.parse().ok().filter(|ratio: &NonZeroUsize| ratio.get() > 1).ok_or_else(fail)
}

/// Reads the name of a built-in scene.
///
/// # Errors
/// Which there are, and what was found.
pub fn parse_scene(name: &str) -> Result<&'static SceneInfo, String> {
    SceneInfo::by_name(name).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_belong_to_the_range_and_what_lies_outside_is_named() {
        let percent = number(0.0, 100.0);
        assert_eq!((percent("0"), percent("100")), (Ok(0.0), Ok(100.0)));
        for text in ["-0.1", "100.1", "nan", "inf", "ten", ""] {
            let error = percent(text).unwrap_err();
            assert_eq!(error, format!("expected a number of 0 to 100, found `{text}`"));
        }
        let ppm = whole(-1000, 1000);
        assert_eq!((ppm("-1000"), ppm("1000")), (Ok(-1000), Ok(1000)));
        assert!(ppm("1001").is_err() && ppm("1.5").is_err());
    }

    #[test]
    fn ratios_and_counts_have_a_least() {
        assert_eq!(parse_count("1").unwrap().get(), 1);
        assert_eq!(parse_ratio("2").unwrap().get(), 2);
        assert!(parse_count("0").unwrap_err().contains("found `0`"));
        assert!(parse_ratio("1").unwrap_err().contains("found `1`"));
        assert!(parse_ratio("-4").unwrap_err().contains("found `-4`"));
    }
}
