//! The image on the retina: what an eye that follows motion collects of a sequence of frames.
//!
//! Didyk et al. 2010 and Lee and Didyk 2018, equations 1 to 4: the eye adds up light over a short
//! window while its gaze moves, so that a receptor sees a path through the frames. Frames are made
//! of square pixels of even light, and a path is straight, so that its integral is a sum over the
//! pixels it crosses, and exact. Light adds up as is (Talbot and Plateau): planes hold linear
//! light.
//!
//! Hold-type blur, ghosts of repeated frames and the effect of low persistence all come out of this
//! sum; none of them is put in. Pursuit that is not perfect adds blur along the motion (Denes 2020,
//! equation 8.5), see [`pursuit_blurred`].

mod path;

use crate::PerceptionError;
use crate::motion_quality::{Motion, blur::pursuit_width};
use crate::plane::Plane;
use path::integral;

/// Time that the fovea fuses, s: flicker fusion near 40 Hz (Lee and Didyk 2018, section 3.1; Denes
/// 2020, section 8.3.1, 25 ms).
pub const FUSION_S: f64 = 0.025;

/// One frame on the display.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LitFrame<'a> {
    /// Its light.
    pub light: &'a Plane,
    /// When it lights up, s.
    pub from_s: f64,
    /// When it goes dark or is replaced, s.
    pub until_s: f64,
}

/// The frames of a display that shows one every `1 / refresh_hz` from time 0 and lights it for
/// `persistence` of that. The light itself stays as it is: a display that is lit for half of the
/// time gives half as much on average, unless its frames are twice as bright.
pub fn lit_frames(
    frames: &[Plane],
    refresh_hz: f64,
    persistence: f64,
) -> impl Iterator<Item = LitFrame<'_>> {
    frames.iter().enumerate().map(move |(index, light)| LitFrame {
        light,
        from_s: index as f64 / refresh_hz,
        until_s: (index as f64 + persistence) / refresh_hz,
    })
}

/// Mean light that each receptor gets from `start_s` for `window_s` seconds. Receptors are as
/// many as pixels and lie on pixel centres in the middle of the window; `gaze(x, y)` is how fast
/// the gaze moves where receptor (x, y) looks, pixels per second.
///
/// Time at which nothing is lit counts as dark. Beyond the border frames go on as at the border.
///
/// # Errors
/// If there are no frames, they differ in size, or the window is not above 0.
pub fn retinal_image(
    frames: &[LitFrame<'_>],
    start_s: f64,
    window_s: f64,
    gaze: impl Fn(usize, usize) -> [f64; 2],
) -> Result<Plane, PerceptionError> {
    PerceptionError::check_positive("window_s", window_s)?;
    let count = frames.len() as f64;
    let Some(first) = frames.first() else {
        return Err(PerceptionError::OutOfDomain {
            what: "frames",
            expected: "at least one",
            found: count,
        });
    };
    for frame in frames {
        first.light.check_same_size(frame.light)?;
    }
    let end_s = start_s + window_s;
    let middle_s = start_s + window_s / 2.0;
    let lit: Vec<_> = frames
        .iter()
        .map(|frame| (frame.light, frame.from_s.max(start_s), frame.until_s.min(end_s)))
        .filter(|(_, from, until)| until > from)
        .collect();
    let (width, height) = (first.light.width(), first.light.height());
    Ok(Plane::from_fn(width, height, |x, y| {
        let velocity = gaze(x, y);
        let at = |time: f64| {
            let way = time - middle_s;
            [x as f64 + 0.5 + velocity[0] * way, y as f64 + 0.5 + velocity[1] * way]
        };
        let sum: f64 = lit
            .iter()
            .map(|&(light, from, until)| (until - from) * integral(light, at(from), at(until)))
            .sum();
        (sum / window_s) as f32
    }))
}

/// A retinal image with the blur of imperfect pursuit: a box along `velocity` (pixels per second)
/// as wide as equation 8.5 of Denes 2020 has it at that speed.
///
/// # Errors
/// If `ppd` is not above 0.
pub fn pursuit_blurred(
    image: &Plane,
    velocity: [f64; 2],
    ppd: f64,
    motion: Motion,
) -> Result<Plane, PerceptionError> {
    PerceptionError::check_positive("ppd", ppd)?;
    let speed = libm::hypot(velocity[0], velocity[1]);
    if speed <= 0.0 {
        return Ok(image.clone());
    }
    let width_px = pursuit_width(speed / ppd, motion) * ppd;
    // A still picture under a gaze that moves by the width meanwhile is a box blur of that width.
    let still = [LitFrame { light: image, from_s: 0.0, until_s: 1.0 }];
    let gaze = velocity.map(|along| along / speed * width_px);
    retinal_image(&still, 0.0, 1.0, |_, _| gaze)
}

#[cfg(test)]
mod tests;
