//! Self-contained pages: text, tables, drawings and data in one file that needs nothing else.

#[cfg(test)]
pub(crate) mod browser;

use std::fmt::Write as _;

use anyhow::Context as _;
use image::ImageEncoder as _;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};

use crate::draw::Drawing;

/// Looks of every page, in both themes.
const STYLE: &str = include_str!("html/page.css");

/// A page in the making.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    body: String,
    scripts: String,
}

impl Page {
    /// An empty page.
    #[must_use]
    pub fn new(title: &str) -> Self {
        let body = format!("<h1>{}</h1>\n", escaped(title));
        Self { title: title.to_owned(), body, scripts: String::new() }
    }

    /// Adds a heading.
    pub fn heading(&mut self, text: &str) {
        let _infallible = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: &str) {
        let _infallible = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// Adds a drawing, at its own size or as wide as the page.
    pub fn drawing(&mut self, drawing: &Drawing) {
        let _infallible = writeln!(self.body, "<figure>{}</figure>", drawing.to_svg());
    }

    /// Adds a table: the cells of the head, then rows of as many. The first cell of each row is
    /// its name, all others are numbers.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        self.body += "<div class=\"wide\"><table><thead><tr>";
        for cell in head {
            let _infallible = write!(self.body, "<th>{}</th>", escaped(cell));
        }
        self.body += "</tr></thead><tbody>\n";
        for row in rows {
            self.body += "<tr>";
            for (index, cell) in row.iter().enumerate() {
                let tag = if index == 0 { "th" } else { "td" };
                let _infallible = write!(self.body, "<{tag}>{}</{tag}>", escaped(cell));
            }
            self.body += "</tr>\n";
        }
        self.body += "</tbody></table></div>\n";
    }

    /// Adds markup as it is.
    pub fn markup(&mut self, markup: &str) {
        self.body += markup;
    }

    /// Adds data that scripts find under `id`.
    ///
    /// # Errors
    /// If the value has no JSON.
    pub fn data(&mut self, id: &str, value: &impl serde::Serialize) -> anyhow::Result<()> {
        // A script element ends at its end tag wherever that stands.
        let json = serde_json::to_string(value)?.replace("</", "<\\/");
        let _infallible =
            writeln!(self.scripts, "<script type=\"application/json\" id=\"{id}\">{json}</script>");
        Ok(())
    }

    /// Adds a script, which runs when the page is there.
    pub fn script(&mut self, script: &str) {
        let _infallible = writeln!(self.scripts, "<script>{script}</script>");
    }

    /// The file.
    #[must_use]
    pub fn finish(&self) -> String {
        let Self { title, body, scripts } = self;
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width\"><title>{}</title>\
             <style>{STYLE}</style></head>\n<body>\n{body}{scripts}</body></html>\n",
            escaped(title)
        )
    }
}

/// Text that markup cannot break out of.
#[must_use]
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A picture as a PNG in a URL.
///
/// # Errors
/// If it has no pixels.
pub fn png_url(width: u32, height: u32, rgb: &[u8]) -> anyhow::Result<String> {
    let mut png = Vec::new();
    PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
        .write_image(rgb, width, height, image::ExtendedColorType::Rgb8)
        .context("encoding a picture of the page")?;
    Ok(format!("data:image/png;base64,{}", base64(&png)))
}

/// Base64 with padding (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |index: usize| u32::from(chunk.get(index).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for digit in 0..4 {
            let value = (bits >> (18 - 6 * digit)) & 63;
            let is_there = digit <= chunk.len();
            text.push(if is_there { char::from(DIGITS[value as usize]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        let vectors = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, encoded) in vectors {
            assert_eq!(base64(plain.as_bytes()), encoded);
        }
    }

    #[test]
    fn neither_text_nor_data_can_break_out_of_their_elements() {
        let mut page = Page::new("a <b> & \"c\"");
        page.table(&["x"], &[vec!["<script>".to_owned()]]);
        page.data("d", &["</script><script>"]).unwrap();
        let html = page.finish();
        assert_eq!(html.matches("<script").count(), 2, "one element, one text of data: {html}");
        assert_eq!(html.matches("</script>").count(), 1, "{html}");
        assert!(html.contains("<title>a &lt;b&gt; &amp; &quot;c&quot;</title>"));
    }
}
