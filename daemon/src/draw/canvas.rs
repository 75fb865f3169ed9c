//! The canvas: filled and stroked shapes, text, and images scaled to a box.

use tiny_skia::{
    FillRule, IntSize, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Shader,
    Stroke, StrokeDash, Transform,
};

use super::Rgba8Image;
use super::palette::{PAGE, Rgb, opaque};
use super::text::{TextStyle, rasterise};

/// A picture in the making, opaque everywhere.
#[derive(Clone, Debug)]
pub struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// An empty page. None for a size of 0 or one beyond what memory can address.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Option<Self> {
        IntSize::from_wh(width, height)?;
        let mut pixmap = Pixmap::new(width, height)?;
        pixmap.fill(opaque(PAGE));
        Some(Self { pixmap })
    }

    /// The finished picture.
    #[must_use]
    pub fn into_pixmap(self) -> Pixmap {
        self.pixmap
    }

    /// Fills the box at (`x`, `y`) of this size.
    pub fn fill_box(&mut self, [x, y]: [f32; 2], [width, height]: [f32; 2], color: Rgb) {
        if let Some(rect) = Rect::from_xywh(x, y, width, height) {
            self.pixmap.fill_rect(rect, &paint(color), Transform::identity(), None);
        }
    }

    /// Draws the outline of a box, one pixel wide, on the pixels around it.
    pub fn frame_box(&mut self, [x, y]: [f32; 2], [width, height]: [f32; 2], color: Rgb) {
        self.fill_box([x - 1.0, y - 1.0], [width + 2.0, 1.0], color);
        self.fill_box([x - 1.0, y + height], [width + 2.0, 1.0], color);
        self.fill_box([x - 1.0, y], [1.0, height], color);
        self.fill_box([x + width, y], [1.0, height], color);
    }

    /// Strokes the line through `points`.
    pub fn line(&mut self, points: &[[f32; 2]], width: f32, color: Rgb) {
        self.stroke(points, &Stroke { width, ..Stroke::default() }, color);
    }

    /// Strokes the line through `points` in dashes of `dash` px and gaps as long.
    pub fn dashed_line(&mut self, points: &[[f32; 2]], width: f32, dash: f32, color: Rgb) {
        let dash = StrokeDash::new(vec![dash, dash], 0.0);
        self.stroke(points, &Stroke { width, dash, ..Stroke::default() }, color);
    }

    fn stroke(&mut self, points: &[[f32; 2]], stroke: &Stroke, color: Rgb) {
        if let Some(path) = path(points, false) {
            self.pixmap.stroke_path(&path, &paint(color), stroke, Transform::identity(), None);
        }
    }

    /// Fills the polygon with these corners.
    pub fn fill_polygon(&mut self, corners: &[[f32; 2]], color: Rgb) {
        if let Some(path) = path(corners, true) {
            let identity = Transform::identity();
            self.pixmap.fill_path(&path, &paint(color), FillRule::Winding, identity, None);
        }
    }

    /// Fills a disc.
    pub fn fill_disc(&mut self, [x, y]: [f32; 2], radius: f32, color: Rgb) {
        if let Some(path) = PathBuilder::from_circle(x, y, radius) {
            let identity = Transform::identity();
            self.pixmap.fill_path(&path, &paint(color), FillRule::Winding, identity, None);
        }
    }

    /// Writes one line of text with its anchor at `at`, on the baseline.
    pub fn text(&mut self, text: &str, at: [f32; 2], style: TextStyle) {
        let (width, height) = (self.pixmap.width(), self.pixmap.height());
        let pixels = self.pixmap.pixels_mut();
        rasterise(text, style, at, |x, y, coverage| {
            let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
            if x < width && y < height {
                let pixel = &mut pixels[y as usize * width as usize + x as usize];
                *pixel = blend(*pixel, style.color, coverage);
            }
        });
    }

    /// Draws `image` into the box with its corner at (`x`, `y`); where the box is smaller, each
    /// pixel is the mean of the area that it stands for.
    pub fn image(&mut self, image: Rgba8Image<'_>, [x, y]: [u32; 2], [width, height]: [u32; 2]) {
        let right = (x + width).min(self.pixmap.width());
        let bottom = (y + height).min(self.pixmap.height());
        let stride = self.pixmap.width() as usize;
        let pixels = self.pixmap.pixels_mut();
        for row in y..bottom {
            let rows = covered(row - y, height, image.height());
            for column in x..right {
                let columns = covered(column - x, width, image.width());
                let [red, green, blue] = mean(image, columns, rows.clone());
                pixels[row as usize * stride + column as usize] =
                    PremultipliedColorU8::from_rgba(red, green, blue, 255)
                        .expect("an opaque colour is premultiplied");
            }
        }
    }
}

/// Source pixels that pixel `index` of `count` stands for, at least one of `length`.
fn covered(index: u32, count: u32, length: u32) -> std::ops::Range<u32> {
    let edge = |index: u32| u64::from(index) * u64::from(length) / u64::from(count);
    let first = u32::try_from(edge(index)).expect("less than the length");
    let end = u32::try_from(edge(index + 1)).expect("at most the length");
    first..end.max(first + 1)
}

fn mean(image: Rgba8Image<'_>, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) -> Rgb {
    let (mut sum, mut count) = ([0_u32; 3], 0);
    for row in rows {
        for column in columns.clone() {
            let pixel = image.at(column, row);
            sum = std::array::from_fn(|channel| sum[channel] + u32::from(pixel[channel]));
            count += 1;
        }
    }
    sum.map(|sum| u8::try_from((sum + count / 2) / count).expect("a mean of bytes"))
}

fn paint(color: Rgb) -> Paint<'static> {
    Paint { shader: Shader::SolidColor(opaque(color)), ..Paint::default() }
}

fn path(points: &[[f32; 2]], is_closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    let (&[x, y], rest) = points.split_first()?;
    builder.move_to(x, y);
    for &[x, y] in rest {
        builder.line_to(x, y);
    }
    if is_closed {
        builder.close();
    }
    builder.finish()
}

fn blend(under: PremultipliedColorU8, over: Rgb, coverage: f32) -> PremultipliedColorU8 {
    let coverage = coverage.clamp(0.0, 1.0);
    let mix = |under: u8, over: u8| {
        (f32::from(under) + (f32::from(over) - f32::from(under)) * coverage).round() as u8
    };
    let [red, green, blue] = over;
    PremultipliedColorU8::from_rgba(
        mix(under.red(), red),
        mix(under.green(), green),
        mix(under.blue(), blue),
        255,
    )
    .expect("an opaque colour is premultiplied")
}

#[cfg(test)]
mod tests {
    use super::super::{Anchor, text_width};
    use super::*;

    fn is_page(pixel: PremultipliedColorU8) -> bool {
        [pixel.red(), pixel.green(), pixel.blue()] == PAGE
    }

    #[test]
    fn text_stays_in_the_width_that_was_measured_for_each_anchor() {
        for (anchor, left) in [(Anchor::Start, 100.0), (Anchor::Middle, 0.5), (Anchor::End, 0.0)] {
            let width = text_width("phase 0.33", 14.0);
            let left = if left > 1.0 { 100.0 } else { 100.0 - width * (1.0 - left) };
            let mut canvas = Canvas::new(220, 40).unwrap();
            let style = TextStyle { size: 14.0, color: [0, 0, 0], anchor };
            canvas.text("phase 0.33", [100.0, 25.0], style);
            let pixmap = canvas.into_pixmap();
            let inked = |x: u32| (0..40).any(|y| !is_page(pixmap.pixel(x, y).unwrap()));
            let columns: Vec<u32> = (0..220).filter(|&x| inked(x)).collect();
            assert!(!columns.is_empty(), "{anchor:?}");
            assert!(columns.iter().all(|&x| x as f32 >= left - 2.0), "{anchor:?}");
            assert!(columns.iter().all(|&x| (x as f32) < left + width + 2.0), "{anchor:?}");
        }
    }

    #[test]
    fn what_lies_outside_the_canvas_is_clipped() {
        let mut canvas = Canvas::new(20, 20).unwrap();
        let style = TextStyle { size: 30.0, color: [0, 0, 0], anchor: Anchor::Start };
        canvas.text("wide", [-5.0, 5.0], style);
        canvas.text("far", [1e6, -1e6], style);
        canvas.line(&[[-50.0, -50.0], [f32::NAN, 3.0]], 1.0, [0, 0, 0]);
        let pixels = [255; 4 * 4];
        canvas.image(Rgba8Image::new(2, 2, &pixels).unwrap(), [15, 15], [40, 40]);
        let pixmap = canvas.into_pixmap();
        assert_eq!(pixmap.pixel(19, 19).unwrap().red(), 255);
        assert!(pixmap.pixels().iter().all(|pixel| pixel.alpha() == 255));
    }

    #[test]
    fn a_smaller_image_shows_the_mean_of_what_each_pixel_stands_for() {
        let pixels: Vec<u8> =
            [0, 100, 20, 40].iter().flat_map(|&grey| [grey, grey, grey, 255]).collect();
        let mut canvas = Canvas::new(4, 4).unwrap();
        canvas.image(Rgba8Image::new(4, 1, &pixels).unwrap(), [1, 1], [2, 1]);
        let pixmap = canvas.into_pixmap();
        assert_eq!(pixmap.pixel(1, 1).unwrap().red(), 50);
        assert_eq!(pixmap.pixel(2, 1).unwrap().red(), 30);
        assert!(is_page(pixmap.pixel(3, 1).unwrap()));
    }

    #[test]
    fn an_image_needs_exactly_its_pixels() {
        assert!(Rgba8Image::new(2, 1, &[0; 8]).is_some());
        assert!(Rgba8Image::new(2, 1, &[0; 7]).is_none());
        assert!(Rgba8Image::new(0, 1, &[]).is_none());
    }
}
