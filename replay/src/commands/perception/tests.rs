//! Every model is asked through the command line, with the fixed names of its JSON.

use std::fs;

use clap::{CommandFactory as _, Parser as _};
use image::Rgb;

use super::*;

#[derive(clap::Parser, Debug)]
struct Line {
    #[command(flatten)]
    args: Args,
}

fn parse(line: &str) -> Result<Args, clap::Error> {
    let words = std::iter::once("perception").chain(line.split_whitespace());
    Ok(Line::try_parse_from(words)?.args)
}

fn succeeds(line: &str) {
    run(&parse(line).unwrap(), &Output::new(true))
        .unwrap_or_else(|error| panic!("{line}: {error:#}"));
}

#[test]
fn every_model_answers_and_draws_in_both_forms() {
    let dir = tempfile::tempdir().unwrap();
    for (name, line) in [
        ("quality", "quality --refresh 120 --ppd 56 --velocity 30 --than-refresh 60"),
        ("schedule", "schedule --budget-mpps 55 --velocity 20 --motion unpredictable --table"),
        ("banding", "banding --from 0.2,0.2,0.2 --to 0.8,0.8,0.8 --ppd 56 --width-px 600"),
        ("multiplex", "multiplex --motion-px 4"),
        ("window", "window --technique trm"),
    ] {
        for ending in ["svg", "png"] {
            let path = dir.path().join(format!("{name}.{ending}"));
            succeeds(&format!("{line} --plot {}", path.display()));
            let bytes = fs::read(&path).unwrap();
            let is_right = match ending {
                "svg" => bytes.starts_with(b"<svg "),
                _ => image::load_from_memory(&bytes).is_ok(),
            };
            assert!(is_right, "{name}.{ending}");
        }
    }
    succeeds("displays");
}

#[test]
fn frames_are_read_and_maps_and_retinal_images_written() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    for (name, code) in [("a.png", 40_u8), ("b.png", 230)] {
        let image = RgbImage::from_pixel(24, 16, Rgb([code; 3]));
        image.save(dir.path().join(name)).unwrap();
    }
    let (a, b) = (path("a.png"), path("b.png"));
    let (map, out) = (path("map.png"), path("out.png"));
    succeeds(&format!("flicker {a} {b} --refresh 60 --ppd 8 --map {map}"));
    assert!(image::open(&map).unwrap().to_rgb8().get_pixel(12, 8).0[2] < 60, "it flickers");
    let line = format!("retina {a} {b} {a} {b} --refresh 120 --velocity 240,0 --out {out}");
    succeeds(&format!("{line} --window-ms 16.6667"));
    let mean = image::open(&out).unwrap().to_rgb8().get_pixel(12, 8).0[0];
    // Half of the light of either, in codes of gamma 2.1.
    assert!((166..=168).contains(&mean), "{mean}");
    succeeds(&format!("{line} --reference {out} --motion predictable --ppd 20"));
    let short = parse(&format!("retina {a} --refresh 120")).unwrap();
    let error = run(&short, &Output::new(true)).unwrap_err().to_string();
    assert!(error.contains("25.0 ms") && error.contains("8.3 ms"), "{error}");
}

#[test]
fn a_profile_of_ones_own_is_a_file_and_an_unknown_name_lists_those_there_are() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("mine.toml");
    let text = include_str!("../../../../fixtures/profiles/htc-vive.toml");
    fs::write(&path, text.replace("htc-vive", "mine")).unwrap();
    assert_eq!(read_profile(path.to_str().unwrap()).unwrap().name(), "mine");
    let error = read_profile("mine").unwrap_err().to_string();
    assert!(error.contains("htc-vive") && error.contains("`mine`"), "{error}");
    assert!(read_profile("nowhere.toml").is_err());
}

#[test]
fn what_is_out_of_range_is_refused_by_name() {
    for (line, option) in [
        ("quality --refresh 0 --ppd 56 --velocity 30 --than-refresh 60", "--refresh"),
        ("quality --refresh 60 --ppd 56 --velocity -1 --than-refresh 60", "--velocity"),
        ("schedule --budget-mpps 0 --velocity 1", "--budget-mpps"),
        ("schedule --budget-mpps 1 --velocity 1 --max-refresh 49", "--max-refresh"),
        ("banding --from 0,0,2 --to 1,1,1 --ppd 56", "--from"),
        ("banding --from 0,0,0 --to 1,1,1 --ppd 56 --bits 17", "--bits"),
        ("window --technique crt", "--technique"),
        ("window --plot spectrum.pdf", "--plot"),
        ("retina a.png --refresh 60 --velocity 1", "--velocity"),
        ("multiplex --reduction 1.5", "--reduction"),
    ] {
        let error = parse(line).unwrap_err();
        assert!(error.to_string().contains(option), "{line}: {error}");
        assert_eq!(error.exit_code(), 2, "{line}");
    }
}

#[test]
fn the_help_tells_the_range_of_every_number() {
    for command in Line::command().get_subcommands() {
        for argument in command.get_arguments() {
            let names: Vec<_> = argument.get_value_names().unwrap_or_default().to_vec();
            let numbers = ["HZ", "PPD", "P", "V", "MS", "PX", "MP/S", "DEG", "L", "N", "W", "R"];
            if names.iter().any(|name| numbers.contains(&name.as_str())) {
                let help = argument.get_help().unwrap().to_string();
                assert!(help.contains(" to "), "{} {argument}: {help}", command.get_name());
            }
        }
    }
}
