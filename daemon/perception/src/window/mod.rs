//! The window of visibility: which copies of a moving line's spectrum can be seen.
//!
//! Watson et al. 1986; Denes 2020, figures 2.7 and 5.6. A thin line moves at even speed and the eye
//! follows it, so that its image on the retina repeats with the display's pattern of frames. Such a
//! signal has lines in temporal frequency, at multiples of the pattern's rate; on each, the
//! amplitude over spatial frequency is known in closed form (a sum over the frames of the pattern),
//! so that no transform of samples is needed and nothing leaks.
//!
//! Smooth motion has the line at 0 Hz alone, flat. What is lost there is blur; what is added
//! elsewhere, inside of the window, is judder or flicker.

use core::f64::consts::PI;

use crate::PerceptionError;
use crate::multiplex::{SIGMA_PX, Technique};
use crate::sensitivity::PyramidOfVisibility;

/// A line under pursuit on a display.
#[derive(Clone, PartialEq, Debug)]
pub struct LineSpectrum {
    frames: Vec<Frame>,
    refresh_hz: f64,
    velocity: f64,
}

/// One frame of the repeating pattern.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Frame {
    /// What is drawn: a line, its Gaussian blur, and weights of both.
    sharp: f64,
    blurred: f64,
    sigma_deg: f64,
    /// How far behind its place the line is drawn, deg.
    behind_deg: f64,
    /// Share of the frame during which it is lit.
    persistence: f64,
}

impl LineSpectrum {
    /// The spectrum for `technique` on a display of `refresh_hz` and `ppd`, lit for `persistence`
    /// of a frame, with the line at `velocity` deg/s.
    ///
    /// The row that an interlaced display lights every second frame is what is looked at.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn new(
        technique: Technique,
        refresh_hz: f64,
        ppd: f64,
        velocity: f64,
        persistence: f64,
    ) -> Result<Self, PerceptionError> {
        PerceptionError::check_positive("refresh_hz", refresh_hz)?;
        PerceptionError::check_positive("ppd", ppd)?;
        let is_inside = velocity.is_finite() && velocity >= 0.0;
        PerceptionError::check("velocity", "0 or more", velocity, is_inside)?;
        let is_inside = persistence > 0.0 && persistence <= 1.0;
        PerceptionError::check("persistence", "above 0, up to 1", persistence, is_inside)?;
        let sigma_deg = f64::from(SIGMA_PX) / ppd;
        let line = Frame { sharp: 1.0, blurred: 0.0, sigma_deg, behind_deg: 0.0, persistence };
        let sharpened = Frame { sharp: 2.0, blurred: -1.0, ..line };
        let blurred = Frame { sharp: 0.0, blurred: 1.0, ..line };
        let dark = Frame { sharp: 0.0, ..line };
        let late = velocity / refresh_hz;
        let second = match technique {
            Technique::Full | Technique::Reprojection => line,
            Technique::HalfRate => Frame { behind_deg: late, ..line },
            Technique::Interlace | Technique::BlackFrames => dark,
            Technique::SmoothFrames => Frame { behind_deg: late, ..blurred },
            Technique::Multiplexing(_) => blurred,
        };
        let first = match technique {
            Technique::SmoothFrames | Technique::Multiplexing(_) => sharpened,
            _ => line,
        };
        Ok(Self { frames: vec![first, second], refresh_hz, velocity })
    }

    /// Temporal frequency of harmonic `m`, Hz.
    #[must_use]
    pub fn harmonic_hz(&self, m: i32) -> f64 {
        f64::from(m) * self.refresh_hz / self.frames.len() as f64
    }

    /// Amplitude of harmonic `m` at `cpd`: 1 for smooth motion at `m` 0 and full light.
    #[must_use]
    pub fn amplitude(&self, m: i32, cpd: f64) -> f64 {
        let (mut real, mut imaginary) = (0.0, 0.0);
        let count = self.frames.len() as f64;
        for (index, frame) in self.frames.iter().enumerate() {
            let lit_s = frame.persistence / self.refresh_hz;
            // While the frame stands still the gaze moves on, so that its image slides back.
            let hz = cpd * self.velocity - self.harmonic_hz(m);
            let middle = hz * lit_s / 2.0 - f64::from(m) * index as f64 / count;
            let phase = 2.0 * PI * (middle + cpd * frame.behind_deg);
            let drawn = frame.sharp + frame.blurred * gaussian(cpd, frame.sigma_deg);
            let size = drawn * frame.persistence * sinc(hz * lit_s) / count;
            real += size * libm::cos(phase);
            imaginary += size * libm::sin(phase);
        }
        libm::hypot(real, imaginary)
    }

    /// The most visible contrast of any copy: amplitude of harmonics other than 0 over the mean
    /// light, times the sensitivity of the window relative to its centre. 0 if no copy is inside.
    #[must_use]
    pub fn visible_copies(&self, window: &Window) -> f64 {
        let samples = |m: i32| {
            let left = 1.0 - self.harmonic_hz(m) / window.hz;
            let most = window.cpd * left;
            (0..=200).map(move |step| (m, most * f64::from(step) / 200.0))
        };
        let last = (window.hz / self.harmonic_hz(1)).ceil() as i32;
        (1..last)
            .flat_map(samples)
            .map(|(m, cpd)| self.amplitude(m, cpd) * window.relative(self.harmonic_hz(m), cpd))
            .fold(0.0, f64::max)
            / self.amplitude(0, 0.0)
    }

    /// The lowest spatial frequency at which the steady image has lost half of its amplitude, cpd:
    /// the sharper, the higher. None if that is beyond `most_cpd`.
    #[must_use]
    pub fn half_amplitude_cpd(&self, most_cpd: f64) -> Option<f64> {
        let full = self.amplitude(0, 0.0);
        let steps = (0..=4000).map(|step| most_cpd * f64::from(step) / 4000.0);
        steps.into_iter().find(|&cpd| self.amplitude(0, cpd) < 0.5 * full)
    }
}

/// The window of visibility: a diamond between a temporal and a spatial frequency.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Window {
    /// Where full contrast is just seen without spatial detail, Hz.
    pub hz: f64,
    /// Where full contrast is just seen without change in time, cpd.
    pub cpd: f64,
    /// Natural logarithm of the sensitivity at its centre.
    height: f64,
}

impl Window {
    /// The window at `luminance` cd/m2: where the pyramid of visibility is at 1 for full contrast.
    ///
    /// # Errors
    /// If nothing is seen at that luminance.
    pub fn new(pyramid: &PyramidOfVisibility, luminance: f64) -> Result<Self, PerceptionError> {
        let [hz, cpd] = pyramid.corners(luminance);
        PerceptionError::check_positive("temporal limit of the window", hz)?;
        Ok(Self { hz, cpd, height: -hz * pyramid.per_hz })
    }

    /// Whether full contrast there is seen.
    #[must_use]
    pub fn contains(&self, hz: f64, cpd: f64) -> bool {
        hz.abs() / self.hz + cpd.abs() / self.cpd < 1.0
    }

    /// Sensitivity relative to that at the centre; 0 outside.
    #[must_use]
    pub fn relative(&self, hz: f64, cpd: f64) -> f64 {
        let out = hz.abs() / self.hz + cpd.abs() / self.cpd;
        if out < 1.0 { libm::exp(-self.height * out) } else { 0.0 }
    }
}

/// Spectrum of a Gaussian of `sigma` degrees at `cpd`.
fn gaussian(cpd: f64, sigma: f64) -> f64 {
    libm::exp(-2.0 * PI * PI * cpd * cpd * sigma * sigma)
}

/// `sin(pi x) / (pi x)`.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-9 { 1.0 } else { libm::sin(PI * x) / (PI * x) }
}

#[cfg(test)]
mod tests;
