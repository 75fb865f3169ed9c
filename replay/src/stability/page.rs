//! The sweeps as one self-contained page: charts, then tables.

use super::plot::plot;
use super::report::{MethodPoint, PointReport, Report, SweepReport, TOLERANCE_DB};
use crate::html::Page;

/// Writes the page.
///
/// # Errors
/// If there is no sweep to draw.
pub fn page(report: &Report) -> anyhow::Result<String> {
    let mut page = Page::new("Foreframe: where methods fail");
    page.text(&format!(
        "Each sweep turns one knob on a small scene ({}x{}) that isolates one difficulty. Every \
         fourth frame is a key; the frames between are made from the keys and compared with the \
         truth. Points go from harmless to hard.",
        report.width, report.height
    ));
    page.drawing(&plot(report)?);
    page.heading(&format!("More than {TOLERANCE_DB} dB below hold"));
    let rows: Vec<_> = report
        .below_hold
        .iter()
        .map(|at| {
            vec![
                at.method.to_owned(),
                at.sweep.to_owned(),
                at.point.clone(),
                format!("{:.2}", at.by_db),
            ]
        })
        .collect();
    if rows.is_empty() {
        page.text("No method is, anywhere.");
    } else {
        page.table(&["method", "sweep", "point", "by, dB"], &rows);
    }
    for sweep in &report.sweeps {
        page.heading(&format!("{}: {} ({})", sweep.name, sweep.what, sweep.knob));
        for (what, value) in VALUES {
            if let Some(rows) = rows_of(sweep, *value) {
                page.text(what);
                let labels = sweep.points.iter().map(|point| point.label.as_str());
                let head: Vec<_> = std::iter::once("method").chain(labels).collect();
                page.table(&head, &rows);
            }
        }
        let worse = sweep.worse_than_hold.iter().filter_map(|worse| {
            worse.from.as_ref().map(|from| format!("{} from {from}", worse.method))
        });
        let worse: Vec<_> = worse.collect();
        if !worse.is_empty() {
            page.text(&format!("Worse than hold: {}.", worse.join(", ")));
        }
    }
    Ok(page.finish())
}

type Value = fn(&PointReport, &MethodPoint) -> Option<String>;

/// The tables of a sweep: what is in them, and where it comes from.
const VALUES: &[(&str, Value)] = &[
    ("PSNR in dB", |_, at| Some(format!("{:.2}", at.psnr_rgb_db))),
    ("Error flicker in 8-bit levels", |_, at| Some(format!("{:.2}", at.error_flicker))),
    ("Worst 4x4 tile in dB", |_, at| Some(format!("{:.1}", at.worst_tile_psnr_db))),
    ("Sound keys needed to recover", |point, at| {
        let keys = |keys: usize| keys.to_string();
        point.has_event.then(|| at.keys_to_recover.map_or_else(|| "never".to_owned(), keys))
    }),
];

/// Rows of a table; None where it would be empty.
fn rows_of(sweep: &SweepReport, value: Value) -> Option<Vec<Vec<String>>> {
    let mut is_empty = true;
    let mut row = |method: &'static str| {
        let cell = |point: &PointReport| {
            let text = point.of(method).and_then(|at| value(point, at));
            is_empty &= text.is_none();
            text.unwrap_or_else(|| "-".to_owned())
        };
        std::iter::once(method.to_owned()).chain(sweep.points.iter().map(cell)).collect()
    };
    let rows = sweep.methods().into_iter().map(&mut row).collect();
    (!is_empty).then_some(rows)
}

#[cfg(test)]
mod tests {
    use super::super::report::tests::sweep;
    use super::*;

    #[test]
    fn the_page_has_the_charts_the_worst_points_and_the_tables_that_a_sweep_has_values_for() {
        let of = |has_event| {
            page(&Report::new(192, 108, vec![sweep(&[(20.0, 15.0)], has_event)])).unwrap()
        };
        let html = of(false);
        assert!(html.contains("<svg") && html.contains("<td>5.00</td>"), "{html}");
        assert!(html.contains("Worse than hold: linear from at 0."), "{html}");
        assert!(!html.contains("needed to recover"), "nothing happens in this sweep");
        assert!(of(true).contains("<td>never</td>"), "linear does not recover");
    }
}
