//! The frames that each technique puts on a display.

use super::TemporalMultiplexing;
use crate::PerceptionError;
use crate::plane::Plane;

/// A way to fill a display of twice the rate of the keys.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Technique {
    /// Every frame rendered: what the others are compared with.
    Full,
    /// Every second frame is the one before, moved on: exact for motion of the whole picture, which
    /// is all that is modelled of it here.
    Reprojection,
    /// Every second frame rendered, shown twice.
    HalfRate,
    /// Even rows, then odd rows, the others black.
    Interlace,
    /// Every second frame black.
    BlackFrames,
    /// Nonlinearity compensated smooth frame insertion (Chen et al. 2006): every rendered frame is
    /// shown sharpened, then blurred.
    SmoothFrames,
    /// Temporal resolution multiplexing with sides reduced to this share.
    Multiplexing(f64),
}

impl Technique {
    /// All, in the order of table 5.1 of Denes 2020 after [`Technique::Full`].
    pub const ALL: [Self; 7] = [
        Self::Full,
        Self::Reprojection,
        Self::HalfRate,
        Self::Interlace,
        Self::BlackFrames,
        Self::SmoothFrames,
        Self::Multiplexing(0.5),
    ];

    /// Name for tables and command lines.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Reprojection => "reprojection",
            Self::HalfRate => "half-rate",
            Self::Interlace => "interlace",
            Self::BlackFrames => "bfi",
            Self::SmoothFrames => "ncsfi",
            Self::Multiplexing(_) => "trm",
        }
    }

    /// Share of the pixels that need not be rendered.
    #[must_use]
    pub fn pixels_saved(self) -> f64 {
        match self {
            Self::Full => 0.0,
            Self::Multiplexing(reduction) => super::pixels_saved(reduction),
            _ => 0.5,
        }
    }
}

/// `count` frames of `technique` for content that `render(t)` gives at time `t`, in frames of the
/// display, and that moves by `motion_px` pixels per frame as a whole.
///
/// `gamma` is the one in which frames are resampled.
///
/// # Errors
/// If the technique's reduction is out of range.
pub fn sequence(
    technique: Technique,
    count: usize,
    gamma: f32,
    motion_px: [f32; 2],
    render: impl Fn(f64) -> Plane,
) -> Result<Vec<Plane>, PerceptionError> {
    let key = |index: usize| render((index / 2 * 2) as f64);
    let now = |index: usize| render(index as f64);
    let is_even = |index: usize| index.is_multiple_of(2);
    let frames: Vec<Plane> = match technique {
        Technique::Full => (0..count).map(now).collect(),
        Technique::HalfRate => (0..count).map(key).collect(),
        Technique::Reprojection => {
            let moved = |index: usize| {
                if is_even(index) { key(index) } else { shifted(&key(index), motion_px) }
            };
            (0..count).map(moved).collect()
        }
        Technique::Interlace => {
            let rows = |index: usize| {
                let frame = now(index);
                Plane::from_fn(frame.width(), frame.height(), |x, y| {
                    let is_shown = is_even(y) == is_even(index);
                    if is_shown { frame.at(x.cast_signed(), y.cast_signed()) } else { 0.0 }
                })
            };
            (0..count).map(rows).collect()
        }
        Technique::BlackFrames => {
            let lit = |index| if is_even(index) { key(index) } else { key(index).map(|_| 0.0) };
            (0..count).map(lit).collect()
        }
        Technique::SmoothFrames => {
            let pair =
                |index| smooth_pair(&key(index), gamma)[usize::from(!is_even(index))].clone();
            (0..count).map(pair).collect()
        }
        Technique::Multiplexing(reduction) => {
            let first = now(0);
            let size = [first.width(), first.height()];
            let mut multiplexing = TemporalMultiplexing::new(size, reduction, gamma)?;
            let mut frames = Vec::with_capacity(count);
            for index in 0..count {
                let frame = now(index);
                let shown = if is_even(index) {
                    multiplexing.even(&frame)
                } else {
                    let low = multiplexing.reduce(&frame);
                    multiplexing.odd(&low)
                };
                frames.push(shown?);
            }
            frames
        }
    };
    Ok(frames)
}

/// A frame sharpened and blurred, of which the sum of light is twice the frame's: where the
/// sharpened one would leave the display's range, the blurred one takes the rest.
fn smooth_pair(frame: &Plane, gamma: f32) -> [Plane; 2] {
    let encoded = frame.map(|light| libm::powf(light.max(0.0), 1.0 / gamma));
    let blurred = encoded.blurred(super::SIGMA_PX).map(|code| libm::powf(code, gamma));
    let sharp = frame.zip(&blurred, |full, low| (2.0 * full - low).clamp(0.0, 1.0));
    let rest = frame.zip(&sharp, |full, sharp| 2.0 * full - sharp);
    [sharp, rest]
}

/// The frame with its content moved by `motion_px`.
fn shifted(frame: &Plane, [dx, dy]: [f32; 2]) -> Plane {
    Plane::from_fn(frame.width(), frame.height(), |x, y| {
        frame.bilinear(x as f32 + 0.5 - dx, y as f32 + 0.5 - dy)
    })
}
