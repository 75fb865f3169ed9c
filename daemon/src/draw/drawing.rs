//! A picture as a list of shapes, which becomes pixels or SVG: both show the same.

use std::fmt::Write as _;

use tiny_skia::Pixmap;

use super::palette::{GRID, INK, MUTED, PAGE, PANEL, Rgb};
use super::{Anchor, Canvas, TextStyle};

#[derive(Clone, PartialEq, Debug)]
enum Shape {
    Box { at: [f32; 2], size: [f32; 2], color: Rgb },
    Line { points: Vec<[f32; 2]>, width: f32, color: Rgb, dash: Option<f32> },
    Disc { centre: [f32; 2], radius: f32, color: Rgb },
    Text { text: String, at: [f32; 2], style: TextStyle },
}

/// Shapes on a page, later ones over earlier ones.
#[derive(Clone, PartialEq, Debug)]
pub struct Drawing {
    size: [u32; 2],
    shapes: Vec<Shape>,
}

impl Drawing {
    /// An empty page of so many columns and rows.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        Self { size, shapes: Vec::new() }
    }

    /// Fills the box with its corner at `at`.
    pub fn fill_box(&mut self, at: [f32; 2], size: [f32; 2], color: Rgb) {
        self.shapes.push(Shape::Box { at, size, color });
    }

    /// Strokes the line through `points`, in dashes of `dash` px and gaps as long if asked to.
    pub fn line(&mut self, points: &[[f32; 2]], width: f32, color: Rgb, dash: Option<f32>) {
        self.shapes.push(Shape::Line { points: points.to_vec(), width, color, dash });
    }

    /// Fills a disc.
    pub fn disc(&mut self, centre: [f32; 2], radius: f32, color: Rgb) {
        self.shapes.push(Shape::Disc { centre, radius, color });
    }

    /// Writes one line of text with its anchor at `at`, on the baseline.
    pub fn text(&mut self, text: &str, at: [f32; 2], style: TextStyle) {
        self.shapes.push(Shape::Text { text: text.to_owned(), at, style });
    }

    /// The page as pixels. None for a size of 0 or one beyond what memory can address.
    #[must_use]
    pub fn to_pixmap(&self) -> Option<Pixmap> {
        let [width, height] = self.size;
        let mut canvas = Canvas::new(width, height)?;
        for shape in &self.shapes {
            match shape {
                Shape::Box { at, size, color } => canvas.fill_box(*at, *size, *color),
                Shape::Line { points, width, color, dash: None } => {
                    canvas.line(points, *width, *color);
                }
                Shape::Line { points, width, color, dash: Some(dash) } => {
                    canvas.dashed_line(points, *width, *dash, *color);
                }
                Shape::Disc { centre, radius, color } => {
                    canvas.fill_disc(*centre, *radius, *color);
                }
                Shape::Text { text, at, style } => canvas.text(text, *at, *style),
            }
        }
        Some(canvas.into_pixmap())
    }

    /// The page as a complete SVG file. Text is in the reader's own sans-serif font, and page, ink
    /// and grid are dark where the reader prefers a dark page.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let [width, height] = self.size;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"Ubuntu, sans-serif\">\n"
        );
        svg += &dark_style();
        let page = Shape::Box { at: [0.0; 2], size: [width as f32, height as f32], color: PAGE };
        for shape in std::iter::once(&page).chain(&self.shapes) {
            write_shape(&mut svg, shape).expect("a string takes any text");
            svg.push('\n');
        }
        svg + "</svg>\n"
    }
}

fn write_shape(svg: &mut String, shape: &Shape) -> std::fmt::Result {
    match shape {
        Shape::Box { at: [x, y], size: [width, height], color } => write!(
            svg,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{}\"/>",
            hex(*color)
        ),
        Shape::Line { points, width, color, dash } => {
            let points: Vec<_> = points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
            write!(svg, "<polyline points=\"{}\" fill=\"none\"", points.join(" "))?;
            write!(svg, " stroke=\"{}\" stroke-width=\"{width}\"", hex(*color))?;
            if let Some(dash) = dash {
                write!(svg, " stroke-dasharray=\"{dash}\"")?;
            }
            write!(svg, "/>")
        }
        Shape::Disc { centre: [x, y], radius, color } => {
            write!(
                svg,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\" fill=\"{}\"/>",
                hex(*color)
            )
        }
        Shape::Text { text, at: [x, y], style: TextStyle { size, color, anchor } } => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            write!(
                svg,
                "<text x=\"{x:.2}\" y=\"{y:.2}\" font-size=\"{size}\" fill=\"{}\" text-anchor=\"{anchor}\">{}</text>",
                hex(*color),
                escaped(text)
            )
        }
    }
}

/// What page, panel, ink, muted ink and grid become on a dark page.
const DARK: [(Rgb, Rgb); 5] = [
    (PAGE, [22, 24, 28]),
    (PANEL, [32, 35, 40]),
    (INK, [232, 232, 226]),
    (MUTED, [160, 163, 170]),
    (GRID, [58, 62, 70]),
];

/// Rules that win over the attributes of shapes in a dark theme.
fn dark_style() -> String {
    let rules = DARK.map(|(light, dark)| {
        let (light, dark) = (hex(light), hex(dark));
        format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}")
    });
    format!("<style>@media (prefers-color-scheme:dark){{{}}}</style>\n", rules.concat())
}

fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawing() -> Drawing {
        let mut drawing = Drawing::new([40, 20]);
        drawing.fill_box([10.0, 5.0], [20.0, 10.0], [255, 0, 0]);
        drawing.line(&[[0.0, 10.0], [40.0, 10.0]], 2.0, [0, 0, 255], Some(5.0));
        drawing.disc([20.0, 10.0], 3.0, [0, 255, 0]);
        let style = TextStyle { size: 9.0, color: [0, 0, 0], anchor: Anchor::End };
        drawing.text("a < b & c", [38.0, 18.0], style);
        drawing
    }

    #[test]
    fn pixels_show_the_shapes_in_their_order() {
        let picture = drawing().to_pixmap().unwrap();
        let at = |x, y| {
            let pixel = picture.pixel(x, y).unwrap();
            [pixel.red(), pixel.green(), pixel.blue()]
        };
        assert_eq!(at(20, 10), [0, 255, 0], "the disc is over box and line");
        assert_eq!(at(12, 10), [0, 0, 255], "the line is over the box");
        assert_eq!(at(12, 6), [255, 0, 0]);
        assert_eq!(at(7, 10), PAGE, "in the first gap of the dashes");
        assert_eq!(at(35, 2), PAGE);
    }

    #[test]
    fn svg_holds_every_shape_once_and_text_that_cannot_break_it() {
        let svg = drawing().to_svg();
        for (element, count) in [("<rect", 2), ("<polyline", 1), ("<circle", 1), ("<text", 1)] {
            assert_eq!(svg.matches(element).count(), count, "{element} in {svg}");
        }
        assert!(svg.contains("points=\"0.00,10.00 40.00,10.00\""), "{svg}");
        assert!(
            svg.contains("stroke=\"#0000ff\" stroke-width=\"2\" stroke-dasharray=\"5\""),
            "{svg}"
        );
        assert!(svg.contains("text-anchor=\"end\">a &lt; b &amp; c</text>"), "{svg}");
        assert!(svg.starts_with("<svg xmlns") && svg.ends_with("</svg>\n"), "{svg}");
    }

    #[test]
    fn on_a_dark_page_ink_is_light_and_hues_stay() {
        let mut drawing = drawing();
        drawing.fill_box([0.0; 2], [1.0; 2], INK);
        let svg = drawing.to_svg();
        assert!(svg.contains("[fill=\"#222428\"]{fill:#e8e8e2}"), "{svg}");
        assert!(svg.contains("fill=\"#222428\"/>"), "the light page is in the attributes");
        assert!(!svg.contains("[fill=\"#ff0000\"]"), "a hue has no rule");
    }

    #[test]
    fn a_page_without_pixels_is_none() {
        assert!(Drawing::new([0, 4]).to_pixmap().is_none());
    }
}
