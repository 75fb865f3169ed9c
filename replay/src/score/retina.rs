//! `score --retina`: how close a sequence comes to the true one, on the retina.
//!
//! Didyk et al. 2010, figure 8: an eye that follows a surface adds up what the display shows along
//! its path. Of each key, the light of the frames around it is collected while the gaze of every
//! receptor moves with the surface that the key shows there (`foreframe_perception::retina`): of
//! the true frames, of the keys alone, each held until the next, and of the frames that a method
//! made. The window is the time from key to key, 25 ms at 40 Hz, which is what the fovea fuses, and
//! its middle is the middle of the key: so the keys alone lie where the true frames lie, and what
//! they lose is sharpness, not place.
//!
//! The images are compared as 8-bit codes, like any other picture.

use std::cmp::Ordering;

use foreframe_engine::{FinishConfig, Plane};
use foreframe_perception::PerceptionError;
use foreframe_perception::display::transfer::{srgb_from_linear, srgb_to_linear};
use foreframe_perception::plane::Plane as Light;
use foreframe_perception::retina::{LitFrame, retinal_image};
use rayon::prelude::*;
use serde::Serialize;

use super::metrics::{psnr_rgb_db, ssim};
use super::picture::Srgb8;

/// How close the retinal images of one method come to the true ones. Means over the windows.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct RetinaScore {
    /// Keys around which light was collected.
    pub windows: u64,
    /// Of the method's frames.
    pub psnr_rgb_db: f64,
    /// Of the method's frames.
    pub ssim: f64,
    /// Of the keys alone, held.
    pub keys_psnr_rgb_db: f64,
    /// Of the keys alone, held.
    pub keys_ssim: f64,
}

/// The sums of one method.
#[derive(Clone, Copy, Debug, Default)]
pub struct RetinaTally {
    windows: u64,
    /// PSNR and SSIM of the method, then of the keys.
    sums: [f64; 4],
}

impl RetinaTally {
    /// Adds what the eye sees of a method and of the keys in one window.
    pub fn add(&mut self, method: [f64; 2], keys: [f64; 2]) {
        self.windows += 1;
        for (sum, value) in self.sums.iter_mut().zip([method, keys].into_iter().flatten()) {
            *sum += value;
        }
    }

    /// The means; None of nothing.
    #[must_use]
    pub fn finish(&self) -> Option<RetinaScore> {
        let [psnr_rgb_db, ssim, keys_psnr_rgb_db, keys_ssim] =
            self.sums.map(|sum| sum / self.windows as f64);
        let Self { windows, .. } = *self;
        (windows > 0).then_some(RetinaScore {
            windows,
            psnr_rgb_db,
            ssim,
            keys_psnr_rgb_db,
            keys_ssim,
        })
    }
}

/// Frames before and behind a key that a window of `ratio` frames around its middle touches.
#[must_use]
pub fn reach(ratio: usize) -> usize {
    ratio / 2
}

/// An eye before one key of a recording.
#[derive(Clone, Debug)]
pub struct Eye {
    /// Pixels per frame, x right and y down, of each receptor.
    gaze: Plane<[f32; 2]>,
    ratio: usize,
    light: [[f32; 256]; 3],
    gamma: Option<[f64; 3]>,
}

impl Eye {
    /// An eye that looks for `ratio` frames, each receptor following `gaze` (pixels per frame), at
    /// the display that `finish` knows.
    #[must_use]
    pub fn new(gaze: Plane<[f32; 2]>, ratio: usize, finish: &FinishConfig) -> Self {
        let gamma = finish.gamma;
        let light = |channel: usize, level: usize| {
            let code = level as f64 / 255.0;
            let share = match gamma {
                Some(gamma) => libm::pow(code, gamma[channel]),
                None => srgb_to_linear(code),
            };
            share as f32
        };
        let light = [0, 1, 2].map(|c| std::array::from_fn(|level| light(c, level)));
        Self { gaze, ratio, light, gamma }
    }

    /// What it sees of `frames`, of which the middle one is the key.
    ///
    /// # Errors
    /// If the frames differ in size.
    pub fn sees(&self, frames: &[&Srgb8]) -> Result<Srgb8, PerceptionError> {
        let reach = (frames.len() / 2) as f64;
        let shown = frames.iter().zip(0_u32..).map(|(frame, index)| {
            let from = f64::from(index) - reach;
            (*frame, from, from + 1.0)
        });
        self.collects(&shown.collect::<Vec<_>>())
    }

    /// What it sees of the key alone, held.
    ///
    /// # Errors
    /// None that a picture could cause.
    pub fn sees_held(&self, key: &Srgb8) -> Result<Srgb8, PerceptionError> {
        let ratio = self.ratio as f64;
        self.collects(&[(key, -ratio, 2.0 * ratio)])
    }

    fn collects(&self, shown: &[(&Srgb8, f64, f64)]) -> Result<Srgb8, PerceptionError> {
        let ratio = self.ratio as f64;
        let start = 0.5 - ratio / 2.0;
        let channels: Vec<Light> = (0..3_usize)
            .into_par_iter()
            .map(|channel| {
                let lights: Vec<_> =
                    shown.iter().map(|(frame, ..)| self.light_of(frame, channel)).collect();
                let lit: Vec<_> = lights
                    .iter()
                    .zip(shown)
                    .map(|(light, &(_, from_s, until_s))| LitFrame { light, from_s, until_s })
                    .collect();
                // Time counts frames.
                retinal_image(&lit, start, ratio, |x, y| {
                    self.gaze.at(x as u32, y as u32).map(f64::from)
                })
            })
            .collect::<Result<_, _>>()?;
        let (width, height) = (self.gaze.width(), self.gaze.height());
        let pixels = (0..width as usize * height as usize)
            .map(|pixel| [0, 1, 2].map(|c| self.code(channels[c].values()[pixel], c)));
        Ok(Plane::from_vec(width, height, pixels.collect()))
    }

    fn light_of(&self, frame: &Srgb8, channel: usize) -> Light {
        let width = frame.width() as usize;
        Light::from_fn(width, frame.height() as usize, |x, y| {
            let level = frame.data()[y * width + x][channel];
            self.light[channel][usize::from(level)]
        })
    }

    fn code(&self, light: f32, channel: usize) -> u8 {
        let light = f64::from(light.clamp(0.0, 1.0));
        let code = match self.gamma {
            Some(gamma) => libm::pow(light, 1.0 / gamma[channel]),
            None => srgb_from_linear(light),
        };
        (code * 255.0).round() as u8
    }
}

/// PSNR in dB and SSIM of what an eye sees against what it would truly see.
#[must_use]
pub fn closeness(seen: &Srgb8, truly: &Srgb8) -> [f64; 2] {
    [psnr_rgb_db(seen, truly), ssim(seen, truly)]
}

/// Of a displacement that spans `frames` frames, one per cell of a grid that covers the picture,
/// the motion per frame of each pixel of `size`; 0 where it is not known.
#[must_use]
pub fn gaze_of(displacement: &Plane<[f32; 2]>, frames: f32, size: [u32; 2]) -> Plane<[f32; 2]> {
    let cells = [displacement.width(), displacement.height()];
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    let motion = pixels.map(|pixel| {
        if cells.contains(&0) {
            return [0.0; 2];
        }
        let [x, y] = [0, 1].map(|axis| {
            let cell = u64::from(pixel[axis]) * u64::from(cells[axis]) / u64::from(size[axis]);
            cell as u32
        });
        let moved = displacement.at(x, y).map(|way| way / frames);
        match moved.iter().all(|way| way.abs().partial_cmp(&1e4) == Some(Ordering::Less)) {
            true => moved,
            false => [0.0; 2],
        }
    });
    Plane::from_vec(size[0], size[1], motion.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(position: f64) -> Srgb8 {
        let pixel = |x: u32| [if (f64::from(x) - position).abs() < 3.0 { 250 } else { 10 }; 3];
        Plane::from_vec(60, 4, (0..60 * 4).map(|i| pixel(i % 60)).collect())
    }

    fn eye(ratio: usize, speed: f32) -> Eye {
        let gaze = Plane::from_vec(60, 4, vec![[speed, 0.0]; 240]);
        Eye::new(gaze, ratio, &FinishConfig::default())
    }

    #[test]
    fn a_still_picture_is_seen_as_it_is_shown_or_held() {
        let (eye, picture) = (eye(3, 0.0), line(30.0));
        assert_eq!(eye.sees(&[&picture; 3]).unwrap(), picture);
        assert_eq!(eye.sees_held(&picture).unwrap(), picture);
    }

    #[test]
    fn a_held_key_is_smeared_over_the_way_to_the_next_and_frames_between_over_less() {
        for ratio in [2, 3, 4, 5] {
            let eye = eye(ratio, 2.0);
            let reach = reach(ratio) as i32;
            let frames: Vec<_> =
                (-reach..=reach).map(|at| line(30.0 + 2.0 * f64::from(at))).collect();
            let truly = eye.sees(&frames.iter().collect::<Vec<_>>()).unwrap();
            let held = eye.sees_held(&line(30.0)).unwrap();
            let edges = |picture: &Srgb8| {
                (0..60).filter(|x| (15..245).contains(&picture.at(*x, 0)[0])).count()
            };
            assert!(edges(&held) > edges(&truly), "{ratio}: {} {}", edges(&held), edges(&truly));
            // Both in the same place: alike to the left and to the right of the line.
            let centre = |picture: &Srgb8| {
                let weight = |x: u32| f64::from(picture.at(x, 0)[0]) - 10.0;
                (0..60).map(|x| f64::from(x) * weight(x)).sum::<f64>()
                    / (0..60).map(weight).sum::<f64>()
            };
            assert!((centre(&held) - centre(&truly)).abs() < 0.3, "{ratio}");
        }
    }

    #[test]
    fn gaze_is_the_motion_of_the_cell_per_frame_and_0_where_none_is_known() {
        let field = Plane::from_vec(2, 1, vec![[6.0, -3.0], [f32::NAN, 1.0]]);
        let gaze = gaze_of(&field, 3.0, [4, 2]);
        assert_eq!((gaze.at(1, 1), gaze.at(2, 0)), ([2.0, -1.0], [0.0, 0.0]));
        assert_eq!(gaze_of(&Plane::new(0, 0), 3.0, [4, 2]).at(3, 1), [0.0, 0.0]);
    }

    #[test]
    fn means_are_over_windows_and_nothing_has_none() {
        let mut tally = RetinaTally::default();
        assert_eq!(tally.finish(), None);
        tally.add([30.0, 0.9], [20.0, 0.5]);
        tally.add([40.0, 0.7], [22.0, 0.7]);
        let score = tally.finish().unwrap();
        assert_eq!((score.windows, score.psnr_rgb_db, score.keys_psnr_rgb_db), (2, 35.0, 21.0));
        assert!((score.ssim - 0.8).abs() < 1e-12 && (score.keys_ssim - 0.6).abs() < 1e-12);
    }
}
