//! The best refresh rate and resolution for a budget of pixels per second.
//!
//! Denes 2020, equation 8.20: the highest quality with `R^2 f` times the field of view within the
//! budget, and at least 50 Hz. The printed constraint has R and not its square; pixels per degree
//! count once per axis, and only so is the published 443 megapixels per second the display's
//! 2560x1440 at 120 Hz. A [`ScheduleTable`] holds the answers per degree per second, as section
//! 8.4.1 has it.

use super::{Motion, Shown, parts};
use crate::PerceptionError;

/// No schedule goes below this, Hz (equation 8.20).
pub const LEAST_REFRESH_HZ: f64 = 50.0;
/// Rates are tried this far apart, Hz: finer than any rate that a viewer could tell.
const STEP_HZ: f64 = 0.5;

/// A display that can be driven at any rate from 50 Hz up, and at any resolution up to its own.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ScheduleDisplay {
    /// Columns and rows.
    pub size_px: [u32; 2],
    /// Horizontal field of view, deg.
    pub width_deg: f64,
    /// The highest rate, Hz, at least 50.
    pub max_refresh_hz: f64,
    /// Share of a frame during which it is lit.
    pub persistence: f64,
}

/// What to render.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Schedule {
    /// Frames per second.
    pub refresh_hz: f64,
    /// Rendered columns over the display's columns, and the same for rows, up to 1.
    pub scale: f64,
}

impl ScheduleDisplay {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Which number is out of which range.
    pub fn check(&self) -> Result<(), PerceptionError> {
        for side in self.size_px {
            PerceptionError::check_positive("size_px", side.into())?;
        }
        PerceptionError::check_positive("width_deg", self.width_deg)?;
        let rate = self.max_refresh_hz;
        let is_inside = rate.is_finite() && rate >= LEAST_REFRESH_HZ;
        PerceptionError::check("max_refresh_hz", "at least 50", rate, is_inside)?;
        let persistence = self.persistence;
        let is_inside = persistence > 0.0 && persistence <= 1.0;
        PerceptionError::check("persistence", "above 0, up to 1", persistence, is_inside)?;
        Ok(())
    }

    /// Pixels per degree at full resolution.
    #[must_use]
    pub fn ppd(&self) -> f64 {
        f64::from(self.size_px[0]) / self.width_deg
    }

    /// The largest scale at `refresh_hz` for `budget` pixels per second.
    fn scale_within(&self, refresh_hz: f64, budget: f64) -> f64 {
        let pixels = f64::from(self.size_px[0]) * f64::from(self.size_px[1]);
        libm::sqrt(budget / (pixels * refresh_hz)).min(1.0)
    }
}

/// The schedule of the highest quality at `velocity` deg/s for `budget` pixels per second.
///
/// # Errors
/// If the display, the budget or the velocity is out of range.
pub fn schedule(
    display: &ScheduleDisplay,
    budget: f64,
    velocity: f64,
    motion: Motion,
) -> Result<Schedule, PerceptionError> {
    display.check()?;
    PerceptionError::check_positive("budget", budget)?;
    let is_inside = velocity.is_finite() && velocity >= 0.0;
    PerceptionError::check("velocity", "0 or more", velocity, is_inside)?;
    let shown = |refresh_hz| Shown {
        refresh_hz,
        ppd: display.ppd() * display.scale_within(refresh_hz, budget),
        persistence: display.persistence,
    };
    // The anchor of the equation only moves all qualities by the same amount.
    let quality = |refresh_hz| parts(shown(refresh_hz), velocity, motion).total();
    let steps = ((display.max_refresh_hz - LEAST_REFRESH_HZ) / STEP_HZ).floor() as u32;
    let rates = (0..=steps).map(|step| LEAST_REFRESH_HZ + f64::from(step) * STEP_HZ);
    // Of equals the first, so that nothing is spent on rates that are not seen.
    let mut best = (LEAST_REFRESH_HZ, quality(LEAST_REFRESH_HZ));
    for rate in rates.chain([display.max_refresh_hz]) {
        let found = quality(rate);
        if found > best.1 {
            best = (rate, found);
        }
    }
    Ok(Schedule { refresh_hz: best.0, scale: display.scale_within(best.0, budget) })
}

/// Schedules for whole velocities, one budget and one kind of motion.
#[derive(Clone, PartialEq, Debug)]
pub struct ScheduleTable {
    display: ScheduleDisplay,
    budget: f64,
    /// Rate at 0, 1, 2, ... deg/s.
    refresh_hz: Vec<f64>,
}

impl ScheduleTable {
    /// Works out the schedules from 0 to `max_velocity` deg/s.
    ///
    /// # Errors
    /// As [`schedule`].
    pub fn new(
        display: ScheduleDisplay,
        budget: f64,
        motion: Motion,
        max_velocity: u16,
    ) -> Result<Self, PerceptionError> {
        let at =
            |velocity: u16| Ok(schedule(&display, budget, velocity.into(), motion)?.refresh_hz);
        let refresh_hz = (0..=max_velocity).map(at).collect::<Result<_, _>>()?;
        Ok(Self { display, budget, refresh_hz })
    }

    /// The schedule at `velocity` deg/s, between the two nearest entries. Beyond the last one it is
    /// the last; NaN and less than 0 count as 0.
    #[must_use]
    pub fn at(&self, velocity: f64) -> Schedule {
        let last = self.refresh_hz.len() - 1;
        let velocity = velocity.max(0.0).min(last as f64);
        let below = velocity.floor() as usize;
        let share = velocity - velocity.floor();
        let above = (below + 1).min(last);
        let refresh_hz = self.refresh_hz[below] * (1.0 - share) + self.refresh_hz[above] * share;
        Schedule { refresh_hz, scale: self.display.scale_within(refresh_hz, self.budget) }
    }
}
