//! Full-reference picture metrics: pure functions of two [`Srgb8`] pictures of one size.
//!
//! | metric | source |
//! |---|---|
//! | [`psnr_rgb_db`] | mean squared error of all three channels together |
//! | [`psnr_y_db`], [`TileTally`] | Falchetto, Barone, Pau 2007, (1.3) and the list of classes below it |
//! | [`error_flicker`] | change of the error from one output frame to the next |
//! | [`ssim`](ssim()) | Wang, Bovik, Sheikh, Simoncelli 2004, on luma |
//! | [`flip`](mod@flip) | Andersson et al. 2020, LDR-FLIP |
//!
//! Higher is better for the decibels and SSIM, lower for flicker and FLIP. A metric of unequal
//! sizes has no meaning and panics: output and truth of one stream always have one size.

mod blur;
mod flicker;
pub mod flip;
mod psnr;
mod ssim;
mod tiles;

pub use flicker::{ErrorPicture, error_flicker};
pub use psnr::{MAX_PSNR_DB, psnr_rgb_db, psnr_y_db};
pub use ssim::ssim;
pub use tiles::{TILE_PX, TileClasses, TileTally};

use crate::score::picture::Srgb8;

/// Luma of an sRGB-encoded pixel, 0 to 255 (Falchetto et al. 2007, (1.2); ITU-R BT.601).
pub(crate) fn luma([red, green, blue]: [u8; 3]) -> f32 {
    0.299 * f32::from(red) + 0.587 * f32::from(green) + 0.114 * f32::from(blue)
}

pub(crate) fn assert_same_size(output: &Srgb8, truth: &Srgb8) {
    assert_eq!(
        (output.width(), output.height()),
        (truth.width(), truth.height()),
        "output and truth have one size"
    );
}

#[cfg(test)]
pub(crate) mod test_pictures {
    //! Pictures that the tests of several metrics share.

    use super::Srgb8;

    /// A textured picture: an integer hash of position and `seed` over a ramp.
    pub(crate) fn textured(width: u32, height: u32, seed: u32) -> Srgb8 {
        from_fn(width, height, |x, y| {
            let hash = (x * 73 + y * 151 + seed * 977).wrapping_mul(2_654_435_761) >> 24;
            [(x * 3 + y) % 200 + hash % 40, (y * 5 + x) % 180 + hash % 60, hash]
                .map(|level| level.min(255) as u8)
        })
    }

    /// A picture made pixel by pixel.
    pub(crate) fn from_fn(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 3]) -> Srgb8 {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        Srgb8::from_vec(width, height, pixels.map(|(x, y)| pixel(x, y)).collect())
    }

    /// `picture` with `change` applied to each channel value.
    pub(crate) fn map(picture: &Srgb8, change: impl Fn(u8) -> u8) -> Srgb8 {
        let pixels = picture.data().iter().map(|pixel| pixel.map(&change)).collect();
        Srgb8::from_vec(picture.width(), picture.height(), pixels)
    }
}
