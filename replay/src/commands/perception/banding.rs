//! `foreframe perception banding`: steps of a gradient, Denes 2020, chapter 6.

use std::path::PathBuf;

use foreframe_perception::banding::{BandWidth, Gradient, MOST_BITS};
use serde::Serialize;

use super::{plot, read_profile, round};
use crate::options::{number, whole};
use crate::output::Output;
use crate::pictures::{ChartLabels, Series, line_chart};

#[derive(clap::Args, Debug)]
pub(super) struct Args {
    /// Colour at which the gradient starts, codes of 0 to 1.
    #[arg(long, value_name = "R,G,B", value_parser = parse_color, allow_negative_numbers = true)]
    from: Color,
    /// Colour at which it ends, codes of 0 to 1.
    #[arg(long, value_name = "R,G,B", value_parser = parse_color, allow_negative_numbers = true)]
    to: Color,
    /// Bits per channel, 1 to 16.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = whole(1, 16))]
    #[arg(allow_negative_numbers = true)]
    bits: i32,
    /// Pixels per degree, 1 to 1000.
    #[arg(long, value_name = "PPD", value_parser = number(1.0, 1000.0))]
    #[arg(allow_negative_numbers = true)]
    ppd: f64,
    /// Display: a built-in profile (see `perception displays`) or a file that ends in .toml.
    #[arg(long, value_name = "NAME", default_value = "asus-pg279q")]
    profile: String,
    /// Length of the gradient in pixels, 2 to 100000; without it, whatever is seen best.
    #[arg(long, value_name = "W", value_parser = number(2.0, 100_000.0))]
    #[arg(allow_negative_numbers = true)]
    width_px: Option<f64>,
    /// Plot probability over bits to this SVG or PNG.
    #[arg(long, value_name = "FILE", value_parser = plot::parse_plot)]
    plot: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Color([f64; 3]);

fn parse_color(text: &str) -> Result<Color, String> {
    let fail = || format!("expected three numbers of 0 to 1 as R,G,B, found `{text}`");
    let numbers: Vec<f64> =
        text.split(',').map(str::parse).collect::<Result<_, _>>().map_err(|_| fail())?;
    let color: [f64; 3] = numbers.try_into().map_err(|_| fail())?;
    let is_inside = color.iter().all(|code| (0.0..=1.0).contains(code));
    if is_inside { Ok(Color(color)) } else { Err(fail()) }
}

/// Scripts read these names.
#[derive(Serialize, Debug)]
struct Report {
    probability: f64,
    achromatic: f64,
    red_green: f64,
    yellow_violet: f64,
    /// None if 16 bits do not hide the steps.
    min_bits: Option<u8>,
}

pub(super) fn run(args: &Args, output: &Output) -> anyhow::Result<()> {
    let profile = read_profile(&args.profile)?;
    let gradient = Gradient::new(args.from.0, args.to.0)?;
    let width = args.width_px.map_or(BandWidth::Worst, BandWidth::Over);
    let xyz = |codes| profile.model().xyz(codes);
    let bits = u8::try_from(args.bits)?;
    let seen = gradient.seen(bits, width, args.ppd, xyz)?;
    let report = Report {
        probability: round(seen.any()),
        achromatic: round(seen.achromatic),
        red_green: round(seen.red_green),
        yellow_violet: round(seen.yellow_violet),
        min_bits: gradient.least_bits(width, args.ppd, xyz)?,
    };
    if let Some(path) = &args.plot {
        let mut points = Vec::new();
        for bits in 1..=MOST_BITS {
            points.push([bits.into(), gradient.seen(bits, width, args.ppd, xyz)?.any()]);
        }
        let title = format!("Banding on {}", profile.title());
        let labels = ChartLabels { title: &title, across: "bits per channel", up: "probability" };
        let series = [Series { name: "steps are seen".to_owned(), points }];
        plot::write(&line_chart(labels, &series)?, path)?;
    }
    let least = report
        .min_bits
        .map_or_else(|| format!("more than {MOST_BITS} bits"), |bits| format!("{bits} bits"));
    let text = format!(
        "steps of {bits} bits are seen with probability {:.2} (luminance {:.2}, red-green {:.2}, \
         yellow-violet {:.2}); {least} hide them",
        report.probability, report.achromatic, report.red_green, report.yellow_violet
    );
    output.result(&report, &text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_three_codes() {
        assert_eq!(parse_color("0,0.5,1").unwrap(), Color([0.0, 0.5, 1.0]));
        for text in ["", "0,1", "0,1,2", "0,0,-1", "0,0,nan", "a,b,c", "0,0,0,0"] {
            assert!(parse_color(text).unwrap_err().contains(&format!("`{text}`")), "{text}");
        }
    }
}
