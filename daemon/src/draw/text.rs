//! Text: the built-in font, measured and rasterised by ab_glyph.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, Glyph, PxScaleFont, ScaleFont, point};

use super::palette::Rgb;

static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).expect("the built-in font is whole")
});

/// Which point of a line of text its position is. Vertically it is always the baseline.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Anchor {
    /// The left end.
    #[default]
    Start,
    /// The middle.
    Middle,
    /// The right end.
    End,
}

/// How a line of text looks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TextStyle {
    /// Height of the font, px.
    pub size: f32,
    /// Colour.
    pub color: Rgb,
    /// What its position means.
    pub anchor: Anchor,
}

/// Width of one line of text, px.
#[must_use]
pub fn text_width(text: &str, size: f32) -> f32 {
    lay_out(text, size).1
}

/// Calls `dot(x, y, coverage)` for each pixel that `text` touches, coverage 0 to 1.
pub(super) fn rasterise(
    text: &str,
    style: TextStyle,
    [x, baseline]: [f32; 2],
    mut dot: impl FnMut(i32, i32, f32),
) {
    let (glyphs, width) = lay_out(text, style.size);
    let left = match style.anchor {
        Anchor::Start => x,
        Anchor::Middle => x - width / 2.0,
        Anchor::End => x - width,
    };
    for mut glyph in glyphs {
        glyph.position.x += left;
        glyph.position.y += baseline;
        let Some(outline) = FONT.outline_glyph(glyph) else { continue };
        let corner = outline.px_bounds().min;
        outline.draw(|column, row, coverage| {
            dot(
                corner.x as i32 + column.cast_signed(),
                corner.y as i32 + row.cast_signed(),
                coverage,
            );
        });
    }
}

/// Glyphs of a line from x 0 on its baseline, and how far it goes.
fn lay_out(text: &str, size: f32) -> (Vec<Glyph>, f32) {
    let font: PxScaleFont<&FontRef<'_>> = FONT.as_scaled(size);
    let mut glyphs = Vec::new();
    let (mut x, mut last) = (0.0, None);
    for character in text.chars() {
        let id = font.glyph_id(character);
        if let Some(last) = last {
            x += font.kern(last, id);
        }
        glyphs.push(id.with_scale_and_position(font.scale(), point(x, 0.0)));
        x += font.h_advance(id);
        last = Some(id);
    }
    (glyphs, x)
}
