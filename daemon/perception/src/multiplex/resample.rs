//! Down to a smaller frame and up again: D and U of Denes 2020, equations 5.1 and 5.2.
//!
//! D is a Gaussian and reading at the smaller frame's pixel centres, U is bilinear. Both work on
//! light to the power of 1 over a gamma, where blur is about as visible in dark as in bright
//! regions (section 5.2.2).

use super::SIGMA_PX;
use crate::PerceptionError;
use crate::plane::Plane;

/// Columns and rows of a frame whose sides are reduced to `reduction`, at least one each.
///
/// # Errors
/// If `reduction` is not above 0 and at most 1.
pub fn reduced_size(size: [usize; 2], reduction: f64) -> Result<[usize; 2], PerceptionError> {
    let is_inside = reduction > 0.0 && reduction <= 1.0;
    PerceptionError::check("reduction", "above 0, up to 1", reduction, is_inside)?;
    Ok(size.map(|side| ((side as f64 * reduction).round() as usize).max(1)))
}

/// A full frame reduced to `width` x `height` (D).
#[must_use]
pub fn reduced(full: &Plane, [width, height]: [usize; 2], gamma: f32) -> Plane {
    let encoded = full.map(|light| encode(light, gamma)).blurred(SIGMA_PX);
    read(&encoded, [width, height]).map(|code| decode(code, gamma))
}

/// A reduced frame at `width` x `height` again (U).
#[must_use]
pub fn restored(low: &Plane, [width, height]: [usize; 2], gamma: f32) -> Plane {
    let encoded = low.map(|light| encode(light, gamma));
    read(&encoded, [width, height]).map(|code| decode(code, gamma))
}

fn read(plane: &Plane, [width, height]: [usize; 2]) -> Plane {
    let across = plane.width() as f32 / width as f32;
    let down = plane.height() as f32 / height as f32;
    Plane::from_fn(width, height, |x, y| {
        plane.bilinear((x as f32 + 0.5) * across, (y as f32 + 0.5) * down)
    })
}

fn encode(light: f32, gamma: f32) -> f32 {
    libm::powf(light.max(0.0), 1.0 / gamma)
}

fn decode(code: f32, gamma: f32) -> f32 {
    libm::powf(code.max(0.0), gamma)
}
