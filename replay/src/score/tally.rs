//! What one method reached on one recording: collected frame by frame, averaged at the end.

use foreframe_engine::{ColorPlane, Method, MonoSpan};

use super::metrics::flip::FlipTruth;
use super::metrics::{ErrorPicture, TileTally, error_flicker, psnr_rgb_db, psnr_y_db, ssim};
use super::picture::Srgb8;
use super::report::{FramePoint, MethodScore};
use super::retina::RetinaTally;
use crate::virtual_time::digest::FrameDigester;

/// A mean that grows.
#[derive(Clone, Copy, Default, Debug)]
struct Mean {
    sum: f64,
    count: u64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    /// None of nothing.
    fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

/// A ground truth, prepared for the comparison with several outputs.
#[derive(Debug)]
pub struct Truth {
    picture: Srgb8,
    flip: FlipTruth,
}

impl Truth {
    /// Prepares a picture.
    #[must_use]
    pub fn new(picture: Srgb8) -> Self {
        let flip = FlipTruth::new(&picture);
        Self { picture, flip }
    }

    /// The picture.
    #[must_use]
    pub fn picture(&self) -> &Srgb8 {
        &self.picture
    }
}

/// Every metric of one output frame.
#[derive(Debug)]
pub struct FrameScore {
    psnr_rgb_db: f64,
    psnr_y_db: f64,
    ssim: f64,
    flip: f64,
    tiles: TileTally,
    error: ErrorPicture,
}

impl FrameScore {
    /// Compares.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn of(output: &Srgb8, truth: &Truth) -> Self {
        Self {
            psnr_rgb_db: psnr_rgb_db(output, &truth.picture),
            psnr_y_db: psnr_y_db(output, &truth.picture),
            ssim: ssim(output, &truth.picture),
            flip: truth.flip.mean_flip(output),
            tiles: TileTally::of(output, &truth.picture),
            error: ErrorPicture::of(output, &truth.picture),
        }
    }
}

/// Collects the scores of one method.
#[derive(Debug)]
pub struct MethodTally {
    method: Method,
    had_late_camera: bool,
    psnr_rgb_db: Mean,
    psnr_y_db: Mean,
    /// By place after the key, from 0.
    psnr_y_by_phase_db: Vec<Mean>,
    ssim: Mean,
    flip: Mean,
    tiles: TileTally,
    flicker: Mean,
    frame_ms: Mean,
    key_ms: Mean,
    /// What the eye sees of it.
    pub retina: RetinaTally,
    frames: Vec<FramePoint>,
    digester: FrameDigester,
}

impl MethodTally {
    /// Nothing yet, of recordings with `ratio` frames from key to key.
    #[must_use]
    pub fn new(method: Method, ratio: usize) -> Self {
        Self {
            method,
            had_late_camera: false,
            psnr_rgb_db: Mean::default(),
            psnr_y_db: Mean::default(),
            psnr_y_by_phase_db: vec![Mean::default(); ratio - 1],
            ssim: Mean::default(),
            flip: Mean::default(),
            tiles: TileTally::default(),
            flicker: Mean::default(),
            frame_ms: Mean::default(),
            key_ms: Mean::default(),
            retina: RetinaTally::default(),
            frames: Vec::new(),
            digester: FrameDigester::default(),
        }
    }

    /// Taking in a key cost so much.
    pub fn add_key_work(&mut self, work: MonoSpan) {
        self.key_ms.add(work.as_ms_f64());
    }

    /// The method was told where the camera is at the time of a frame.
    pub fn add_late_camera(&mut self) {
        self.had_late_camera = true;
    }

    /// This frame was made at such a cost.
    pub fn add_frame(&mut self, frame: &ColorPlane, work: MonoSpan) {
        self.digester.add(frame);
        self.frame_ms.add(work.as_ms_f64());
    }

    /// Adds the frames after one key, in order, from number `first` on. `is_whole`: they reach to
    /// the next key, so that the step from the last of them to that key is one of successive output
    /// frames.
    pub fn add_frames(
        &mut self,
        first: usize,
        frames: &[FrameScore],
        size: (u32, u32),
        is_whole: bool,
    ) {
        let key_error = ErrorPicture::of_key(size.0, size.1);
        let mut before = &key_error;
        for (place, frame) in frames.iter().enumerate() {
            self.psnr_rgb_db.add(frame.psnr_rgb_db);
            self.psnr_y_db.add(frame.psnr_y_db);
            self.psnr_y_by_phase_db[place].add(frame.psnr_y_db);
            self.ssim.add(frame.ssim);
            self.flip.add(frame.flip);
            self.frames.push(FramePoint {
                frame: first + place,
                psnr_rgb_db: frame.psnr_rgb_db,
                flip: frame.flip,
            });
            self.tiles.merge(&frame.tiles);
            self.flicker.add(error_flicker(before, &frame.error));
            before = &frame.error;
        }
        if is_whole && !frames.is_empty() {
            self.flicker.add(error_flicker(before, &key_error));
        }
    }

    /// The means, of frames that `backend` made.
    #[must_use]
    pub fn finish(&self, backend: String) -> MethodScore {
        MethodScore {
            name: self.method.name(),
            backend,
            interpolates: self.method.interpolates(),
            late_camera: self.had_late_camera,
            frames: self.psnr_y_db.count,
            digest: self.digester.all(),
            psnr_rgb_db: self.psnr_rgb_db.value(),
            psnr_y_db: self.psnr_y_db.value(),
            psnr_y_by_phase_db: self.psnr_y_by_phase_db.iter().map(Mean::value).collect(),
            ssim: self.ssim.value(),
            flip: self.flip.value(),
            worst_tile_psnr_db: self.tiles.worst_db(),
            tile_classes_percent: self.tiles.classes_percent(),
            error_flicker: self.flicker.value(),
            ms_per_frame: self.frame_ms.value(),
            ms_per_key: self.key_ms.value(),
            retina: self.retina.finish(),
            by_frame: self.frames.clone(),
        }
    }
}
