//! What the engine makes of a picture, drawn over it.

use foreframe_engine::ColorPlane;
use foreframe_engine::inspect::Inspection;
use tiny_skia::{ColorU8, Paint, PathBuilder, Pixmap, Stroke, Transform};

use super::overlay::lay;
use crate::draw::palette::{HUES, Rgb, opaque, rung_color};

/// Pixels of the picture that one block of a view stands for, each way.
const BLOCK: u32 = 4;
/// Pixels between the lines of the grid where nothing moves.
const PITCH: u32 = 32;
/// Speed at which a colour is strongest, pixels per motion span.
const FULL_SPEED: f32 = 32.0;
/// How much of a view covers the picture, of 256.
const OPACITY: u32 = 176;

/// Direction of motion as hue, the root of speed as strength, so that slow motion shows too; grey
/// where nothing is known.
pub(super) fn motion(inspection: Inspection<'_>, picture: &mut ColorPlane) {
    blocks(picture, |x, y| match inspection.motion_at(x, y) {
        None => ColorU8::from_rgba(128, 128, 128, 255),
        Some([dx, dy]) => {
            let strength = libm::sqrtf(libm::hypotf(dx, dy) / FULL_SPEED).min(1.0);
            let [red, green, blue] = hue(libm::atan2f(dy, dx));
            ColorU8::from_rgba(red, green, blue, (255.0 * strength) as u8)
        }
    });
}

/// The model that each block goes on by, each in its colour; none where it is held.
pub(super) fn rungs(inspection: Inspection<'_>, picture: &mut ColorPlane) {
    blocks(picture, |x, y| match rung_color(inspection.rung_at(x, y)) {
        None => ColorU8::from_rgba(0, 0, 0, 0),
        Some([red, green, blue]) => ColorU8::from_rgba(red, green, blue, 255),
    });
}

/// What is filled at `phase`, in one colour.
pub(super) fn disocclusion(inspection: Inspection<'_>, phase: f64, picture: &mut ColorPlane) {
    let uncovered = inspection.uncovered(phase, BLOCK);
    let [red, green, blue] = HUES[1];
    blocks(picture, |x, y| {
        let is_hole = uncovered.at(x / BLOCK, y / BLOCK);
        ColorU8::from_rgba(red, green, blue, if is_hole { 255 } else { 0 })
    });
}

/// Lines that lay straight at the key and have moved on with the surfaces to `phase`.
pub(super) fn grid(inspection: Inspection<'_>, phase: f64, picture: &mut ColorPlane) {
    let (width, height) = (picture.width(), picture.height());
    let Some(mut lines) = Pixmap::new(width, height) else { return };
    let vertex = |x: u32, y: u32| {
        let (x, y) = (x.min(width - 1), y.min(height - 1));
        let [dx, dy] = inspection.motion_at(x, y).unwrap_or_default();
        let phase = phase as f32;
        [x as f32 + dx * phase, y as f32 + dy * phase]
    };
    let mut path = PathBuilder::new();
    let mut line = |points: &mut dyn Iterator<Item = [f32; 2]>| {
        for (index, [x, y]) in points.enumerate() {
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
    };
    let steps = |length: u32| (0..=length.div_ceil(PITCH)).map(|step| step * PITCH);
    for y in steps(height) {
        line(&mut steps(width).map(|x| vertex(x, y)));
    }
    for x in steps(width) {
        line(&mut steps(height).map(|y| vertex(x, y)));
    }
    let Some(path) = path.finish() else { return };
    let shader = tiny_skia::Shader::SolidColor(opaque([255, 230, 60]));
    let (paint, stroke) = (Paint { shader, ..Paint::default() }, Stroke::default());
    lines.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    lay(picture, &lines, [0, 0], 1, 256);
}

/// A bar along the left edge, black and white in turn.
pub(super) fn tear(index: u64, picture: &mut ColorPlane) {
    let (width, height) = (picture.width(), picture.height());
    let Some(mut bar) = Pixmap::new((width / 24).max(1), height.max(1)) else { return };
    let shade: Rgb = if index.is_multiple_of(2) { [0; 3] } else { [255; 3] };
    bar.fill(opaque(shade));
    lay(picture, &bar, [0, 0], 1, 256);
}

/// Lays one colour per block over the picture, that of the block's middle.
fn blocks(picture: &mut ColorPlane, color: impl Fn(u32, u32) -> ColorU8) {
    let size = [picture.width(), picture.height()].map(|length| length.div_ceil(BLOCK));
    let Some(mut map) = Pixmap::new(size[0], size[1]) else { return };
    for (index, pixel) in (0..).zip(map.pixels_mut()) {
        let [x, y] = [index % size[0], index / size[0]].map(|block| block * BLOCK + BLOCK / 2);
        *pixel = color(x, y).premultiply();
    }
    lay(picture, &map, [0, 0], BLOCK, OPACITY);
}

/// A colour for an angle: red to the right, then through yellow, green and blue.
fn hue(angle: f32) -> Rgb {
    const THIRD: f32 = std::f32::consts::TAU / 3.0;
    std::array::from_fn(|channel| {
        let off = libm::cosf(angle - THIRD * channel as f32);
        (255.0 * (0.5 + off).clamp(0.0, 1.0)) as u8
    })
}
