//! What is compared of quality, and how much of it may be lost.

use serde::{Deserialize, Serialize};

use crate::score::report::MethodScore;

/// PSNR from which on none is a loss, dB: what differs is less than one level of 256 in the root
/// mean square.
const PERFECT_DB: f64 = 50.0;

/// A metric of `score`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// See [`crate::score::metrics::psnr_rgb_db`].
    PsnrRgbDb,
    /// See [`crate::score::metrics::psnr_y_db`].
    PsnrYDb,
    /// See [`crate::score::metrics::ssim`].
    Ssim,
    /// See [`crate::score::metrics::flip`].
    Flip,
    /// The worst tile of all frames.
    WorstTilePsnrDb,
    /// See [`crate::score::metrics::error_flicker`].
    ErrorFlicker,
}

impl Metric {
    /// All of them, in the order of reports.
    pub const ALL: [Self; 6] = [
        Self::PsnrRgbDb,
        Self::PsnrYDb,
        Self::Ssim,
        Self::Flip,
        Self::WorstTilePsnrDb,
        Self::ErrorFlicker,
    ];

    /// Its name in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PsnrRgbDb => "psnr_rgb_db",
            Self::PsnrYDb => "psnr_y_db",
            Self::Ssim => "ssim",
            Self::Flip => "flip",
            Self::WorstTilePsnrDb => "worst_tile_psnr_db",
            Self::ErrorFlicker => "error_flicker",
        }
    }

    /// By how much it may be worse, in its unit: what nobody sees. One tile of all frames tells
    /// less than a mean, and may lose more.
    #[must_use]
    pub const fn tolerance(self) -> f64 {
        match self {
            Self::PsnrRgbDb | Self::PsnrYDb => 0.05,
            Self::Ssim | Self::Flip => 0.001,
            Self::WorstTilePsnrDb => 0.5,
            Self::ErrorFlicker => 0.05,
        }
    }

    /// By how much `found` is worse than `baseline`; negative where it is better. Beyond
    /// [`PERFECT_DB`] no PSNR is.
    #[must_use]
    pub fn loss(self, baseline: f64, found: f64) -> f64 {
        match self {
            Self::PsnrRgbDb | Self::PsnrYDb | Self::WorstTilePsnrDb => {
                // Not `min`, which would take a number for NaN.
                let found = if found > PERFECT_DB { PERFECT_DB } else { found };
                baseline.min(PERFECT_DB) - found
            }
            Self::Ssim => baseline - found,
            Self::Flip | Self::ErrorFlicker => found - baseline,
        }
    }
}

/// All of them, of one method on one capture.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "each is the metric of its name")]
pub struct Quality {
    pub psnr_rgb_db: f64,
    pub psnr_y_db: f64,
    pub ssim: f64,
    pub flip: f64,
    pub worst_tile_psnr_db: f64,
    pub error_flicker: f64,
}

impl Quality {
    /// What `score` found; None where no frame was predicted.
    #[must_use]
    pub fn new(score: &MethodScore) -> Option<Self> {
        Some(Self {
            psnr_rgb_db: score.psnr_rgb_db?,
            psnr_y_db: score.psnr_y_db?,
            ssim: score.ssim?,
            flip: score.flip?,
            worst_tile_psnr_db: score.worst_tile_psnr_db?,
            error_flicker: score.error_flicker?,
        })
    }

    /// One of them.
    #[must_use]
    pub const fn of(&self, metric: Metric) -> f64 {
        match metric {
            Metric::PsnrRgbDb => self.psnr_rgb_db,
            Metric::PsnrYDb => self.psnr_y_db,
            Metric::Ssim => self.ssim,
            Metric::Flip => self.flip,
            Metric::WorstTilePsnrDb => self.worst_tile_psnr_db,
            Metric::ErrorFlicker => self.error_flicker,
        }
    }
}
