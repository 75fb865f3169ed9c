//! Flags, files, and what comes of both.

use std::io::Write as _;

use clap::Parser;

use super::*;

#[derive(Parser, Debug)]
struct Command {
    #[command(flatten)]
    args: Args,
}

fn flags(line: &str) -> Args {
    Command::parse_from(std::iter::once("foreframed").chain(line.split_whitespace())).args
}

fn with_file(line: &str, toml: &str) -> Result<Config, UsageError> {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(toml.as_bytes()).unwrap();
    Args { config: Some(file.path().to_owned()), ..flags(line) }.resolve()
}

/// Folder of the built-in profiles, as somebody's own.
const PROFILES: &str = "../fixtures/profiles";

/// Every option with a value that is not its default, by the name that flag and file share.
const EVERY_OPTION: [(&str, &str, &str); 21] = [
    ("socket", "/run/x", "'/run/x'"),
    ("sink", "png:out", "'png:out'"),
    ("fullscreen", "", "true"),
    ("monitor", "DP-1", "'DP-1'"),
    ("layout", "side-by-side", "'side-by-side'"),
    ("refresh", "144", "144"),
    ("backend", "cpu", "'cpu'"),
    ("method", "hold", "'hold'"),
    ("cap", "50", "50"),
    ("least-step", "0.5", "0.5"),
    ("hud", "grid", "'grid'"),
    ("record", "a.mcap", "'a.mcap'"),
    ("threads", "3", "3"),
    ("ppd", "56", "56"),
    ("finish", "auto", "'auto'"),
    ("finish-whole", "", "true"),
    ("profile", "htc-vive", "'htc-vive'"),
    ("profiles", PROFILES, "'../fixtures/profiles'"),
    ("log", "trace", "'trace'"),
    ("max-clients", "2", "2"),
    ("memory-mb", "64", "64"),
];

#[test]
fn what_is_no_number_is_told_what_was_expected() {
    for option in ["refresh", "cap", "least-step", "ppd", "max-clients", "memory-mb", "threads"] {
        let line = ["foreframed".to_owned(), format!("--{option}"), "some".to_owned()];
        let error = Command::try_parse_from(line).unwrap_err().to_string();
        let is_told = error.contains("expected a ")
            && error.contains("number")
            && error.contains("found `some`");
        assert!(is_told, "{error}");
    }
    let line = ["foreframed", "--memory-mb", "99999999999999999999"];
    let error = Command::try_parse_from(line).unwrap_err().to_string();
    assert!(error.contains("expected a smaller number, found `9999"), "{error}");
}

#[test]
fn a_cap_is_a_whole_number_of_refreshes() {
    for (line, expected_hz) in [
        ("--refresh 120", 120.0),
        ("--refresh 120 --cap 144", 120.0),
        ("--refresh 120 --cap 120", 120.0),
        ("--refresh 120 --cap 90", 60.0),
        ("--refresh 120 --cap 59.94", 60.0),
        ("--refresh 144 --cap 50", 48.0),
    ] {
        let interval = flags(line).resolve().unwrap().frame_interval();
        let hz = 1e9 / interval.as_ns() as f64;
        assert!((hz - expected_hz).abs() < 0.01, "{line}: {hz}");
    }
    let error = flags("--cap 60 --sink y4m:x").resolve().unwrap_err();
    assert!(error.to_string().contains("rate of its own"), "{error}");
}

#[test]
fn every_option_that_differs_can_change_in_place_or_needs_a_restart() {
    let default = flags("").resolve().unwrap();
    for (name, on_line, _) in EVERY_OPTION {
        let changed = flags(&format!("--{name} {on_line}")).resolve().unwrap();
        let named = default.needs_restart(&changed);
        let in_place = ["method", "cap", "hud", "record"].contains(&name);
        // A profile also says how large a pixel is.
        assert_eq!(named.contains(&name), !in_place, "{name}: {named:?}");
        assert!(!in_place || named.is_empty(), "{name}: {named:?}");
    }
}

#[test]
fn every_option_means_the_same_in_the_file_as_on_the_command_line() {
    let default = flags("").resolve().unwrap();
    for (name, on_line, in_file) in EVERY_OPTION {
        let from_flag = flags(&format!("--{name} {on_line}")).resolve().unwrap();
        let from_file = with_file("", &format!("{name} = {in_file}")).unwrap();
        assert_eq!(from_flag, from_file, "{name}");
        assert_ne!(from_flag, default, "{name} has no effect");
    }
}

#[test]
fn the_table_of_options_is_complete() {
    use clap::CommandFactory as _;
    let command = Command::command();
    let mut names: Vec<_> =
        command.get_arguments().map(|argument| argument.get_id().as_str()).collect();
    names.retain(|name| !["config", "help"].contains(name));
    let table: Vec<_> = EVERY_OPTION.map(|(name, ..)| name.replace('-', "_")).into();
    assert_eq!(names, table);
}

#[test]
fn a_flag_wins_over_the_file() {
    let config = with_file("--refresh 60", "refresh = 144\nmethod = 'grid'").unwrap();
    assert_eq!(config.refresh_interval, MonoSpan::from_hz(60.0));
    assert_eq!(config.method, Method::Grid);
}

#[test]
fn a_profile_says_how_large_a_pixel_is_unless_that_is_said_too() {
    let headset = flags("--profile htc-vive").resolve().unwrap();
    assert!(headset.pixels_per_degree.is_some_and(|ppd| ppd < 30.0));
    let screen = flags("--profile asus-pg279q").resolve().unwrap();
    assert!(screen.pixels_per_degree.is_some_and(|ppd| (40.0..60.0).contains(&ppd)));
    assert_eq!(screen.finish.peak_cd_m2, Some(155.2));
    let both = flags("--profile asus-pg279q --ppd 70").resolve().unwrap();
    assert_eq!(both.pixels_per_degree, Some(70.0));
}

#[test]
fn the_profile_of_a_stream_wins_over_the_daemons_but_not_over_a_given_size() {
    let vive = ProfileName::new("htc-vive").unwrap();
    let config = flags("--profile asus-pg279q --finish on").resolve().unwrap();
    let own = config.viewed(None).unwrap();
    assert_eq!((own.name.as_deref(), own.finish.peak_cd_m2), (Some("asus-pg279q"), Some(155.2)));
    let named = config.viewed(Some(&vive)).unwrap();
    assert_eq!(named.name.as_deref(), Some("htc-vive"));
    assert_ne!(named.finish, own.finish);
    assert_eq!(named.finish.mode, own.finish.mode);
    assert!(named.pixels_per_degree.is_some_and(|ppd| ppd < 30.0));
    let given = flags("--ppd 70").resolve().unwrap().viewed(Some(&vive)).unwrap();
    assert_eq!(given.pixels_per_degree, Some(70.0));
    assert_eq!(given.finish.peak_cd_m2, named.finish.peak_cd_m2);
    let error = config.viewed(Some(&ProfileName::new("crt").unwrap())).unwrap_err();
    assert!(error.expected.contains("asus-pg279q"), "{error}");
}

#[test]
fn a_stream_may_name_the_file_that_the_user_gave() {
    let file = "../fixtures/profiles/htc-vive.toml";
    let text = fs::read_to_string(file).unwrap().replace("htc-vive", "mine");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.toml");
    fs::write(&path, text).unwrap();
    let config = flags(&format!("--profile {}", path.display())).resolve().unwrap();
    let mine = ProfileName::new("mine").unwrap();
    assert_eq!(config.viewed(Some(&mine)).unwrap(), config.viewed(None).unwrap());
    assert!(flags("").resolve().unwrap().viewed(Some(&mine)).is_err());
    // A path is no name.
    let hostile = ProfileName::new(&path.display().to_string()).unwrap();
    assert!(config.viewed(Some(&hostile)).is_err());
}

#[test]
fn an_unknown_name_in_the_file_is_named_with_its_line() {
    let error = with_file("", "refresh = 60\nsinc = 'null'").unwrap_err().to_string();
    assert!(error.contains("line 2") && error.contains("`sinc`"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
}

#[test]
fn values_out_of_range_say_what_was_expected_and_found() {
    for (line, found) in [
        ("--refresh 0", "found 0"),
        ("--refresh nan", "found NaN"),
        ("--refresh 1001", "found 1001"),
        ("--ppd 0", "found 0"),
        ("--profile crt", "found `crt`"),
        ("--max-clients 0", "found 0"),
        ("--memory-mb 0", "found 0"),
        ("--memory-mb 99999999", "found 99999999"),
        ("--log loud=very", "found `loud=very`"),
        ("--config none.toml", "found none.toml"),
    ] {
        let error = flags(line).resolve().unwrap_err().to_string();
        assert!(error.contains("expected") && error.contains(found), "{line}: {error}");
    }
}

#[test]
fn sinks_read_back_what_they_print() {
    for spec in ["null", "shm", "png:a/b", "y4m:x.y4m", "-", "window"] {
        assert_eq!(spec.parse::<SinkSpec>().unwrap().to_string(), spec);
    }
    for spec in ["", "png", "png:", "y4m:", "window:x", "shm:x"] {
        let error = spec.parse::<SinkSpec>().unwrap_err();
        assert!(error.contains(&format!("found `{spec}`")), "{error}");
    }
}
