//! One small chart per sweep: the points across, PSNR up, a line per method.

use super::report::{Report, SweepReport};
use crate::draw::Drawing;
use crate::pictures::{Across, Line, Look, Panel, PictureError, Sheet, small_multiples};

/// Highest value that is drawn, dB: above it nothing can be seen, and 100 stands for no error.
const HIGHEST_DB: f64 = 50.0;
const COLUMNS: usize = 4;
const PANEL_PX: [f32; 2] = [300.0, 216.0];

/// Draws all sweeps.
///
/// # Errors
/// If there is no point.
pub fn plot(report: &Report) -> Result<Drawing, PictureError> {
    let methods = report.sweeps.iter().map(SweepReport::methods).max_by_key(Vec::len);
    let methods = methods.unwrap_or_default();
    let looks = Look::of_methods(&methods);
    let panel = |sweep: &SweepReport| {
        let line = |(method, look): (&&str, &Look)| {
            let of = |(place, point): (usize, &super::report::PointReport)| {
                Some([place as f64, point.of(method)?.psnr_rgb_db.min(HIGHEST_DB)])
            };
            let points = sweep.points.iter().enumerate().filter_map(of).collect();
            Line { look: *look, points, is_marked: true }
        };
        Panel {
            title: sweep.name.to_owned(),
            across: sweep.knob.to_owned(),
            axis: Across::Named(sweep.points.iter().map(|point| point.label.clone()).collect()),
            lines: methods.iter().zip(&looks).map(line).collect(),
            points: Vec::new(),
        }
    };
    small_multiples(&Sheet {
        title: "Where methods fail".to_owned(),
        notes: vec![format!(
            "PSNR in dB of the frames between keys; from harmless to hard; above {HIGHEST_DB} dB cut off"
        )],
        legend: methods.iter().map(|name| (*name).to_owned()).zip(looks.iter().copied()).collect(),
        panels: report.sweeps.iter().map(panel).collect(),
        columns: COLUMNS,
        panel_px: PANEL_PX,
    })
}

#[cfg(test)]
mod tests {
    use super::super::report::tests::sweep;
    use super::*;

    #[test]
    fn a_sweep_is_a_panel_with_a_line_per_method_and_nothing_above_the_highest_value() {
        let sweeps = vec![sweep(&[(20.0, 30.0), (25.0, 100.0)], false); 5];
        let svg = plot(&Report::new(192, 108, sweeps)).unwrap().to_svg();
        // Lines of two methods in each panel, and of the legend.
        assert_eq!(svg.matches("<polyline").count(), 5 * 2 + 2);
        assert_eq!(svg.matches(">px per key interval</text>").count(), 5);
        let tick = |label: &str| svg.contains(&format!(">{label}</text>"));
        assert!(tick("50") && !tick("60") && !tick("100"), "{svg}");
    }

    #[test]
    fn nothing_swept_is_an_error() {
        assert!(plot(&Report::new(192, 108, Vec::new())).is_err());
    }
}
