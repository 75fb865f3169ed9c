//! The contact sheet: a row per in-between frame, with its key, itself, the truth and the error.
//!
//! The error is the largest difference of the three channels at a pixel, times [`ERROR_GAIN`],
//! in the colours of [`heat`]; a legend below says which colour is how many of 255 levels. It is
//! taken before images are scaled down, so a thin error fades but does not move.

use tiny_skia::Pixmap;

use super::PictureError;
use crate::draw::palette::{INK, MUTED, heat};
use crate::draw::{Anchor, Canvas, Rgba8Image, TextStyle};

/// One row of the sheet. All images of a sheet have one size.
#[derive(Clone, Debug)]
pub struct ContactSheetRow<'a> {
    /// What the row shows, as "key 12, phase 0.33".
    pub label: String,
    /// A figure about it, as "31.2 dB"; may be empty.
    pub detail: String,
    /// The key frame that the in-between frame was made from.
    pub key: Rgba8Image<'a>,
    /// The in-between frame.
    pub in_between: Rgba8Image<'a>,
    /// What the application would have rendered.
    pub truth: Rgba8Image<'a>,
}

/// Errors are shown this many times as large.
pub(super) const ERROR_GAIN: u32 = 4;

const HEADINGS: [&str; 4] = ["Key frame", "In-between frame", "Truth", "Error x 4"];

/// Widest column, px: four of them fit a screen of 1920 pixels.
const WIDEST: u32 = 440;
const MARGIN: u32 = 24;
const GAP: u32 = 12;
/// Title and headings.
const HEADER: u32 = 84;
/// The label above a row's images.
const LABEL: u32 = 30;
const FOOTER: u32 = 64;
/// Largest side of a picture.
const LARGEST: u64 = 32767;

/// Where things are on a sheet, px.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct SheetLayout {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Size of each image as drawn.
    pub(super) cell: [u32; 2],
}

impl SheetLayout {
    pub(super) fn new(image: [u32; 2], rows: usize) -> Result<Self, PictureError> {
        let [wide, high] = image.map(u64::from);
        let column = wide.min(u64::from(WIDEST));
        let row = (high * column / wide).max(1);
        let width = u64::from(2 * MARGIN + 3 * GAP) + 4 * column;
        let height = u64::from(HEADER + FOOTER) + rows as u64 * (u64::from(LABEL + GAP) + row);
        // A heading needs more than a column of a tiny image.
        let width = width.max(640);
        match (u32::try_from(width), u32::try_from(height)) {
            (Ok(sheet_width), Ok(sheet_height)) if width.max(height) <= LARGEST => Ok(Self {
                width: sheet_width,
                height: sheet_height,
                cell: [column, row].map(|side| u32::try_from(side).expect("less than the sheet")),
            }),
            _ => Err(PictureError::TooLarge { width, height }),
        }
    }

    /// Corner of an image.
    pub(super) fn corner(&self, column: u32, row: u32) -> [u32; 2] {
        let pitch = (self.width - 2 * MARGIN + GAP) / 4;
        [MARGIN + column * pitch, HEADER + LABEL + row * (LABEL + GAP + self.cell[1])]
    }
}

/// Draws the sheet.
///
/// # Errors
/// If there is no row, images differ in size, or the sheet would be too large.
pub fn contact_sheet(title: &str, rows: &[ContactSheetRow<'_>]) -> Result<Pixmap, PictureError> {
    let first = rows.first().ok_or(PictureError::Empty { expected: "row" })?;
    let size = [first.key.width(), first.key.height()];
    check_sizes(rows, size)?;
    let layout = SheetLayout::new(size, rows.len())?;
    let mut canvas = Canvas::new(layout.width, layout.height).ok_or(PictureError::TooLarge {
        width: layout.width.into(),
        height: layout.height.into(),
    })?;
    let large = TextStyle { size: 24.0, color: INK, anchor: Anchor::Start };
    let normal = TextStyle { size: 16.0, ..large };
    canvas.text(title, [MARGIN as f32, 38.0], large);
    for (column, heading) in (0..).zip(HEADINGS) {
        let x = layout.corner(column, 0)[0] as f32;
        canvas.text(heading, [x, HEADER as f32 - 10.0], TextStyle { size: 18.0, ..normal });
    }
    for (index, row) in (0..).zip(rows) {
        let error = error_pixels(row.in_between, row.truth);
        let error =
            Rgba8Image::new(size[0], size[1], &error).expect("as many pixels as the images");
        for (column, image) in (0..).zip([row.key, row.in_between, row.truth, error]) {
            let corner = layout.corner(column, index);
            canvas.image(image, corner, layout.cell);
            let [corner, cell] = [corner, layout.cell].map(|pair| pair.map(|side| side as f32));
            canvas.frame_box(corner, cell, MUTED);
        }
        let [x, y] = layout.corner(0, index).map(|side| side as f32);
        canvas.text(&row.label, [x, y - 9.0], normal);
        let [x, y] = layout.corner(3, index).map(|side| side as f32);
        canvas.text(&row.detail, [x, y - 9.0], TextStyle { color: MUTED, ..normal });
    }
    draw_legend(&mut canvas, &layout);
    Ok(canvas.into_pixmap())
}

fn check_sizes(rows: &[ContactSheetRow<'_>], expected: [u32; 2]) -> Result<(), PictureError> {
    for row in rows {
        for image in [row.key, row.in_between, row.truth] {
            if [image.width(), image.height()] != expected {
                return Err(PictureError::SizeDiffers {
                    expected_width: expected[0],
                    expected_height: expected[1],
                    width: image.width(),
                    height: image.height(),
                    row: row.label.clone(),
                });
            }
        }
    }
    Ok(())
}

/// The error picture, rgba8.
pub(super) fn error_pixels(a: Rgba8Image<'_>, b: Rgba8Image<'_>) -> Vec<u8> {
    let pairs = a.rgb().zip(b.rgb());
    let largest = pairs.map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0));
    let pixels = largest.flat_map(|error| {
        let shown = u8::try_from(u32::from(error) * ERROR_GAIN).unwrap_or(u8::MAX);
        let [red, green, blue] = heat(shown);
        [red, green, blue, 255]
    });
    pixels.collect()
}

/// A bar of the error colours with its levels, under the error column.
fn draw_legend(canvas: &mut Canvas, layout: &SheetLayout) {
    let width = 256_u32;
    let left = (layout.width - MARGIN - width) as f32;
    let top = (layout.height - FOOTER) as f32 + 14.0;
    for step in 0..=255_u8 {
        canvas.fill_box([left + f32::from(step), top], [1.0, 14.0], heat(step));
    }
    canvas.frame_box([left, top], [width as f32, 14.0], MUTED);
    let style = TextStyle { size: 14.0, color: MUTED, anchor: Anchor::Middle };
    for level in [0, 16, 32, 48, 64_u32] {
        let x = left + (level * ERROR_GAIN) as f32;
        canvas.fill_box([x.min(left + 255.0), top + 14.0], [1.0, 4.0], MUTED);
        let text = if level == 64 { "64+".to_owned() } else { level.to_string() };
        canvas.text(&text, [x, top + 33.0], style);
    }
    let style = TextStyle { anchor: Anchor::End, ..style };
    let what = "largest channel difference, in levels of 255";
    canvas.text(what, [left - 16.0, top + 13.0], style);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::palette::PAGE;

    fn row<'a>(pixels: &'a [Vec<u8>; 3], [width, height]: [u32; 2]) -> ContactSheetRow<'a> {
        let image = |index: usize| Rgba8Image::new(width, height, &pixels[index]).unwrap();
        ContactSheetRow {
            label: "key 0".to_owned(),
            detail: "30 dB".to_owned(),
            key: image(0),
            in_between: image(1),
            truth: image(2),
        }
    }

    fn flat(color: [u8; 4], count: usize) -> Vec<u8> {
        color.repeat(count)
    }

    #[test]
    fn each_image_fills_one_column_of_its_row_and_nothing_beside_it() {
        let size = [200, 100];
        let colors = [[9, 200, 9, 255], [200, 9, 9, 255], [190, 9, 9, 255]];
        let pixels = colors.map(|color| flat(color, 200 * 100));
        let sheet = contact_sheet("", &[row(&pixels, size), row(&pixels, size)]).unwrap();
        let layout = SheetLayout::new(size, 2).unwrap();
        let error = heat(40);
        let expected = [[9, 200, 9], [200, 9, 9], [190, 9, 9], error];
        for (row, column) in [(0, 0), (0, 1), (0, 2), (0, 3), (1, 0), (1, 3)] {
            let [x, y] = layout.corner(column, row);
            let rgb = |x: u32, y: u32| {
                let pixel = sheet.pixel(x, y).unwrap();
                [pixel.red(), pixel.green(), pixel.blue()]
            };
            let color = expected[column as usize];
            assert_eq!([rgb(x, y), rgb(x + 199, y + 99)], [color; 2], "column {column}");
            assert_eq!(rgb(x + 202, y + 50), PAGE, "right of column {column}");
            assert_eq!(rgb(x + 100, y + 102), PAGE, "below column {column}");
        }
    }

    #[test]
    fn the_error_is_the_largest_channel_difference_times_four() {
        let (a, b) = ([10, 20, 30, 255], [10, 25, 27, 0]);
        let image = |pixel| Rgba8Image::new(1, 1, pixel).unwrap();
        let [red, green, blue] = heat(20);
        assert_eq!(error_pixels(image(&a), image(&b)), [red, green, blue, 255]);
        assert_eq!(error_pixels(image(&a), image(&a)), [255; 4]);
    }

    #[test]
    fn images_of_two_sizes_no_rows_and_endless_sheets_are_refused() {
        let pixels = [flat([0; 4], 8), flat([0; 4], 8), flat([0; 4], 8)];
        let mut odd = row(&pixels, [4, 2]);
        odd.truth = Rgba8Image::new(2, 4, &pixels[2]).unwrap();
        let error = contact_sheet("", &[row(&pixels, [4, 2]), odd]).unwrap_err();
        assert_eq!(error.to_string(), "expected images of 4x2 pixels, found 2x4 in row `key 0`");
        assert_eq!(contact_sheet("", &[]), Err(PictureError::Empty { expected: "row" }));
        let layout = SheetLayout::new([400, 400], 100);
        assert!(matches!(layout, Err(PictureError::TooLarge { .. })));
    }
}
