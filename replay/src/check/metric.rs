//! What is compared of quality, and how much of it may be lost.

use serde::{Deserialize, Serialize};

use crate::score::report::MethodScore;

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

    /// By how much `found` is worse than `baseline`; negative where it is better.
    #[must_use]
    pub fn loss(self, baseline: f64, found: f64) -> f64 {
        match self {
            Self::PsnrRgbDb | Self::PsnrYDb | Self::Ssim | Self::WorstTilePsnrDb => {
                baseline - found
            }
            Self::Flip | Self::ErrorFlicker => found - baseline,
        }
    }
}

/// All of them, of one method on one capture. None where no frame was predicted.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[expect(missing_docs, reason = "each is the metric of its name")]
pub struct Quality {
    pub psnr_rgb_db: Option<f64>,
    pub psnr_y_db: Option<f64>,
    pub ssim: Option<f64>,
    pub flip: Option<f64>,
    pub worst_tile_psnr_db: Option<f64>,
    pub error_flicker: Option<f64>,
}

impl Quality {
    /// What `score` found.
    #[must_use]
    pub fn new(score: &MethodScore) -> Self {
        Self {
            psnr_rgb_db: score.psnr_rgb_db,
            psnr_y_db: score.psnr_y_db,
            ssim: score.ssim,
            flip: score.flip,
            worst_tile_psnr_db: score.worst_tile_psnr_db,
            error_flicker: score.error_flicker,
        }
    }

    /// One of them.
    #[must_use]
    pub const fn of(&self, metric: Metric) -> Option<f64> {
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
