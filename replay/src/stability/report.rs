//! What `foreframe stability` prints: one JSON object, or tables.

use std::fmt::Write as _;

use serde::Serialize;

use super::sweeps::Sweep;

/// What every method is compared with.
pub const HOLD: &str = "hold";
/// A method may be so far below `hold` before the table of the worst names it, dB.
pub const TOLERANCE_DB: f64 = 0.5;

/// The whole result.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Report {
    /// Columns of the pictures.
    pub width: u32,
    /// Rows of the pictures.
    pub height: u32,
    /// One entry per sweep.
    pub sweeps: Vec<SweepReport>,
    /// Where methods are more than [`TOLERANCE_DB`] below `hold`, the worst first.
    pub below_hold: Vec<BelowHold>,
}

/// One sweep.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct SweepReport {
    /// Its name.
    pub name: &'static str,
    /// What is swept.
    pub what: &'static str,
    /// What the labels of its points say.
    pub knob: &'static str,
    /// Its points, from harmless to hard.
    pub points: Vec<PointReport>,
    /// From which point on each method is worse than `hold`.
    pub worse_than_hold: Vec<WorseThanHold>,
}

/// One point of a sweep.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct PointReport {
    /// The setting of the knob.
    pub label: String,
    /// Whether something happens that a method can recover from.
    pub has_event: bool,
    /// The methods that take part.
    pub methods: Vec<MethodPoint>,
}

/// One method at one point.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MethodPoint {
    /// Name of the method.
    pub name: &'static str,
    /// Whether it was given the key after the frame.
    pub interpolates: bool,
    /// Mean over the measured frames.
    pub psnr_rgb_db: f64,
    /// See [`crate::score::metrics::error_flicker`].
    pub error_flicker: f64,
    /// The worst 4x4 tile of the measured frames.
    pub worst_tile_psnr_db: f64,
    /// Sound keys until the frames are within half a decibel of what they are without the event,
    /// 1 at the best; None where there is no event, or where that never came to pass.
    pub keys_to_recover: Option<usize>,
}

/// From where on a method is worse than `hold`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct WorseThanHold {
    /// The method.
    pub method: &'static str,
    /// Label of the first point where it is; None where it never is.
    pub from: Option<String>,
}

/// A point at which a method is far below `hold`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct BelowHold {
    /// The method.
    pub method: &'static str,
    /// The sweep.
    pub sweep: &'static str,
    /// Label of the point.
    pub point: String,
    /// `hold`'s PSNR minus the method's.
    pub by_db: f64,
}

impl PointReport {
    /// What a method reached here.
    #[must_use]
    pub fn of(&self, method: &str) -> Option<&MethodPoint> {
        self.methods.iter().find(|point| point.name == method)
    }

    /// How far a method is above `hold`.
    #[must_use]
    pub fn over_hold_db(&self, method: &str) -> Option<f64> {
        Some(self.of(method)?.psnr_rgb_db - self.of(HOLD)?.psnr_rgb_db)
    }
}

impl SweepReport {
    /// Adds from where on each method is worse than `hold`.
    #[must_use]
    pub fn new(sweep: &Sweep, points: Vec<PointReport>) -> Self {
        let Sweep { name, what, knob, .. } = *sweep;
        let mut report = Self { name, what, knob, points, worse_than_hold: Vec::new() };
        let methods = report.methods();
        report.worse_than_hold = methods
            .into_iter()
            .filter(|method| *method != HOLD)
            .map(|method| {
                let is_worse = |point: &&PointReport| {
                    point.over_hold_db(method).is_some_and(|over| over < 0.0)
                };
                let from = report.points.iter().find(is_worse).map(|point| point.label.clone());
                WorseThanHold { method, from }
            })
            .collect();
        report
    }

    /// The methods that take part.
    #[must_use]
    pub fn methods(&self) -> Vec<&'static str> {
        let first = self.points.first();
        first
            .map(|point| point.methods.iter().map(|method| method.name).collect())
            .unwrap_or_default()
    }
}

impl Report {
    /// Adds where methods are far below `hold`.
    #[must_use]
    pub fn new(width: u32, height: u32, sweeps: Vec<SweepReport>) -> Self {
        let mut below_hold = Vec::new();
        for sweep in &sweeps {
            for point in &sweep.points {
                for method in &point.methods {
                    let over = point.over_hold_db(method.name).unwrap_or(0.0);
                    if over < -TOLERANCE_DB {
                        below_hold.push(BelowHold {
                            method: method.name,
                            sweep: sweep.name,
                            point: point.label.clone(),
                            by_db: -over,
                        });
                    }
                }
            }
        }
        below_hold.sort_by(|a, b| b.by_db.total_cmp(&a.by_db));
        Self { width, height, sweeps, below_hold }
    }

    /// One table per sweep, and one of where methods are far below `hold`.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for sweep in &self.sweeps {
            text += &sweep.to_text();
            text.push('\n');
        }
        text += &self.below_hold_text();
        text + "\nPSNR in dB, the mean over the frames measured; r n: n sound keys until it is within \
                half a decibel of what it is without the event, r - for never\n"
    }

    /// How often each method is far below `hold`, and where most.
    fn below_hold_text(&self) -> String {
        let mut text = format!("more than {TOLERANCE_DB} dB below hold\n");
        let points: usize = self.sweeps.iter().map(|sweep| sweep.points.len()).sum();
        // Not every method takes part in every sweep.
        let methods = self.sweeps.iter().map(SweepReport::methods).max_by_key(Vec::len);
        for method in methods.unwrap_or_default() {
            let below: Vec<_> = self.below_hold.iter().filter(|at| at.method == method).collect();
            let worst: Vec<_> = below
                .iter()
                .take(3)
                .map(|at| format!("{} {} by {:.1} dB", at.sweep, at.point, at.by_db))
                .collect();
            let at =
                if worst.is_empty() { String::new() } else { format!(": {}", worst.join(", ")) };
            let _infallible =
                writeln!(text, "  {method:<9} {:>3} of {points} points{at}", below.len());
        }
        text
    }
}

impl SweepReport {
    fn to_text(&self) -> String {
        let mut text = format!("{}: {} ({})\n", self.name, self.what, self.knob);
        let mut header = format!("  {:<9}", "");
        for point in &self.points {
            let _infallible = write!(header, " {:>9}", point.label);
        }
        text += header.trim_end();
        text += "  worse than hold\n";
        for method in self.methods() {
            let _infallible = write!(text, "  {method:<9}");
            for point in &self.points {
                text += &point.of(method).map_or_else(|| " ".repeat(10), |at| cell(at, point));
            }
            let worse = self.worse_than_hold.iter().find(|worse| worse.method == method);
            let from = worse.and_then(|worse| worse.from.as_deref());
            let _infallible = writeln!(
                text,
                "  {}",
                from.map_or_else(String::new, |from| format!("from {from}"))
            );
        }
        text
    }
}

fn cell(method: &MethodPoint, point: &PointReport) -> String {
    let recovery = match (point.has_event, method.keys_to_recover) {
        (false, _) => String::new(),
        (true, Some(keys)) => format!(" r{keys}"),
        (true, None) => " r-".to_owned(),
    };
    format!(" {:>9}", format!("{:.1}{recovery}", method.psnr_rgb_db))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A sweep of points at which `hold` and `linear` reach so many decibels.
    pub(in super::super) fn sweep(points: &[(f64, f64)], has_event: bool) -> SweepReport {
        let method = |name, psnr_rgb_db, keys_to_recover| MethodPoint {
            name,
            interpolates: false,
            psnr_rgb_db,
            error_flicker: 1.5,
            worst_tile_psnr_db: 4.0,
            keys_to_recover,
        };
        let point = |(index, &(hold, linear)): (usize, &(f64, f64))| PointReport {
            label: format!("at {index}"),
            has_event,
            methods: vec![
                method(HOLD, hold, has_event.then_some(1)),
                method("linear", linear, None),
            ],
        };
        let points = points.iter().enumerate().map(point).collect();
        SweepReport::new(Sweep::by_name("speed").unwrap(), points)
    }

    #[test]
    fn a_method_is_worse_than_hold_from_the_first_point_where_it_is() {
        let from = |points: &[(f64, f64)]| sweep(points, false).worse_than_hold[0].from.clone();
        assert_eq!(from(&[(20.0, 30.0), (20.0, 20.0)]), None);
        let crossing = [(20.0, 30.0), (20.0, 19.9), (20.0, 25.0)];
        assert_eq!(from(&crossing).as_deref(), Some("at 1"));
    }

    #[test]
    fn the_table_names_what_is_farther_below_hold_than_the_tolerance_the_worst_first() {
        let points = [(20.0, 19.6), (20.0, 19.0), (20.0, 15.0), (20.0, 30.0)];
        let report = Report::new(192, 108, vec![sweep(&points, false)]);
        let below: Vec<_> = report.below_hold.iter().map(|at| at.point.as_str()).collect();
        assert_eq!(below, ["at 2", "at 1"]);
        let text = report.to_text();
        assert!(
            text.contains("linear      2 of 4 points: speed at 2 by 5.0 dB, speed at 1"),
            "{text}"
        );
        assert!(text.contains("hold        0 of 4 points\n"), "{text}");
    }

    #[test]
    fn recovery_is_told_where_there_is_an_event_and_never_is_a_dash() {
        let text = |has_event| sweep(&[(20.0, 30.0)], has_event).to_text();
        assert!(text(true).contains("20.0 r1") && text(true).contains("30.0 r-"), "{}", text(true));
        assert!(!text(false).contains(" r"), "{}", text(false));
    }
}
