//! The sweeps as a table: which knob is turned on which probe, and how far.
//!
//! Points of a sweep go from harmless to hard. Times are in key intervals, lengths in pixels of a
//! picture 192 wide and 108 high.

mod case;
mod color;
mod data;
mod moving;
mod timing;

pub use case::{Calm, Case, Frames};

/// One knob.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// What is swept, in one line.
    pub what: &'static str,
    /// What its points say, with the unit.
    pub knob: &'static str,
    /// Its points, from harmless to hard.
    pub points: fn() -> Vec<Point>,
}

/// One setting of a knob.
#[derive(Debug)]
pub struct Point {
    /// What it is called on an axis.
    pub label: String,
    /// What is rendered, damaged and measured.
    pub case: Case,
}

impl Point {
    fn new(label: impl ToString, case: Case) -> Self {
        Self { label: label.to_string(), case }
    }
}

const fn sweep(
    name: &'static str,
    what: &'static str,
    knob: &'static str,
    points: fn() -> Vec<Point>,
) -> Sweep {
    Sweep { name, what, knob, points }
}

/// Every sweep, in the order of reports.
pub const SWEEPS: &[Sweep] = &[
    sweep(
        "distance",
        "extrapolation ever farther",
        "key intervals after the key",
        moving::distance,
    ),
    sweep("speed", "boards that slide", "px per key interval", moving::speed),
    sweep("rotation", "a board that turns", "degrees per key interval", moving::rotation),
    sweep(
        "acceleration",
        "boards that gain speed",
        "px per key interval, each interval",
        moving::acceleration,
    ),
    sweep("bounce", "boards that turn back", "px per key interval", moving::bounce),
    sweep("teleport", "boards that jump", "px", moving::teleport),
    sweep("thin-bars", "thin bars that slide", "width in px", moving::thin_bars),
    sweep(
        "disocclusion",
        "background that comes into view",
        "px per key interval",
        moving::disocclusion,
    ),
    sweep("shadow", "shadows that slide over a wall", "px per key interval", color::shadow),
    sweep("mirror", "what moves in a still mirror", "px per key interval", color::mirror),
    sweep("glass", "panes of glass that slide over a wall", "opacity", color::glass),
    sweep("particles", "sparks that fall before a wall", "how many", color::particles),
    sweep(
        "scrolling",
        "a texture that scrolls on a still screen",
        "px per key interval",
        color::scrolling,
    ),
    sweep(
        "shadow-mask",
        "shadows, and a mask that says so",
        "px per key interval",
        color::shadow_mask,
    ),
    sweep(
        "mirror-mask",
        "a mirror, and a mask that says so",
        "px per key interval",
        color::mirror_mask,
    ),
    sweep("glass-mask", "panes of glass, and a mask that says so", "opacity", color::glass_mask),
    sweep("particles-mask", "sparks, and a mask that says so", "how many", color::particles_mask),
    sweep(
        "scrolling-mask",
        "a scrolling texture, and a mask that says so",
        "px per key interval",
        color::scrolling_mask,
    ),
    sweep(
        "depth-noise",
        "noise on depth, three keys long",
        "standard deviation, % of depth",
        data::depth_noise,
    ),
    sweep("depth-bits", "depth through a depth buffer, three keys long", "bits", data::depth_bits),
    sweep(
        "motion-noise",
        "noise on motion, three keys long",
        "standard deviation, px",
        data::motion_noise,
    ),
    sweep("motion-step", "motion rounded, three keys long", "step, px", data::motion_step),
    sweep(
        "motion-sign",
        "motion of a wrong sign, three keys long",
        "which axis",
        data::motion_sign,
    ),
    sweep(
        "motion-scale",
        "motion too short or too long, three keys long",
        "factor",
        data::motion_scale,
    ),
    sweep(
        "motion-nan",
        "vectors that are no numbers, three keys long",
        "% of the vectors",
        data::motion_nan,
    ),
    sweep("missing", "planes that are missing, three keys long", "which planes", data::missing),
    sweep("dropped-keys", "keys that never arrive", "% of the keys", timing::dropped),
    sweep("key-jitter", "keys at uneven times", "up to, % of the key interval", timing::jitter),
    sweep(
        "taa",
        "depth and motion with jittered samples, declared",
        "sevenths of a px",
        timing::taa,
    ),
    sweep(
        "taa-undeclared",
        "depth and motion with jittered samples, not declared",
        "sevenths of a px",
        timing::taa_undeclared,
    ),
    sweep("resolution", "resolution that falls, three keys long", "% per axis", timing::resolution),
    sweep("cut", "another place from one key to the next", "what the key says", timing::cut),
];

impl Sweep {
    /// The sweep called `name`.
    #[must_use]
    pub fn by_name(name: &str) -> Option<&'static Self> {
        SWEEPS.iter().find(|sweep| sweep.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_every_sweep_has_points_whose_labels_differ() {
        for (index, sweep) in SWEEPS.iter().enumerate() {
            assert_eq!(SWEEPS.iter().position(|other| other.name == sweep.name), Some(index));
            let points = (sweep.points)();
            assert!(points.len() > 1, "{}", sweep.name);
            let mut labels: Vec<_> = points.iter().map(|point| &point.label).collect();
            labels.sort_unstable();
            labels.dedup();
            assert_eq!(labels.len(), points.len(), "{}", sweep.name);
        }
    }

    #[test]
    fn every_case_measures_intervals_that_it_has_and_recovers_from_keys_that_it_has() {
        for sweep in SWEEPS {
            for Point { label, case } in (sweep.points)() {
                let name = format!("{} {label}", sweep.name);
                let keys = case.keys.len();
                assert!(case.measured.start >= 2, "{name}: methods know two keys by then");
                assert!(case.measured.end < keys, "{name}: a key follows");
                assert!(case.sound_again.iter().all(|key| *key + 1 < keys), "{name}");
                assert_eq!(case.sound_again.is_empty(), case.calm.is_none(), "{name}");
            }
        }
    }
}
