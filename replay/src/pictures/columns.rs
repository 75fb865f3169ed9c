//! Stacked columns: what share of a whole each class has, a column per series.

use super::PictureError;
use crate::draw::palette::{INK, MUTED, Rgb};
use crate::draw::{Anchor, Drawing, TextStyle, text_width};

/// Height of the columns, px.
const HEIGHT: f32 = 180.0;
/// Width of a column, and from one to the next, px.
const WIDTH: [f32; 2] = [54.0, 74.0];
/// Left and top of the first column, px.
const CORNER: [f32; 2] = [64.0, 74.0];
const LABEL: TextStyle = TextStyle { size: 13.0, color: INK, anchor: Anchor::Start };

/// One column: its name and the percentage of each class, bottom up.
#[derive(Clone, PartialEq, Debug)]
pub struct Column {
    /// Below it.
    pub name: String,
    /// One for each class of the sheet; together 100.
    pub percent: Vec<f64>,
}

/// Columns beside each other.
#[derive(Clone, PartialEq, Debug)]
pub struct ColumnSheet {
    /// Above the columns.
    pub title: String,
    /// Classes with their colours, bottom up.
    pub classes: Vec<(&'static str, Rgb)>,
    /// The columns.
    pub columns: Vec<Column>,
}

/// Draws the columns.
///
/// # Errors
/// If there are none.
pub fn columns(sheet: &ColumnSheet) -> Result<Drawing, PictureError> {
    if sheet.columns.is_empty() {
        return Err(PictureError::Empty { expected: "column" });
    }
    let legend: f32 = sheet.classes.iter().map(|(name, _)| entry_width(name)).sum();
    let width = CORNER[0] + (WIDTH[1] * sheet.columns.len() as f32).max(legend) + 16.0;
    let bottom = CORNER[1] + HEIGHT;
    let mut drawing = Drawing::new([width as u32, (bottom + 34.0) as u32]);
    drawing.text(&sheet.title, [20.0, 28.0], TextStyle { size: 16.0, ..LABEL });
    let mut x = CORNER[0];
    for (name, color) in &sheet.classes {
        drawing.fill_box([x, 44.0], [12.0, 12.0], *color);
        drawing.text(name, [x + 17.0, 55.0], LABEL);
        x += entry_width(name);
    }
    for percent in [0_u8, 50, 100] {
        let y = bottom - HEIGHT * f32::from(percent) / 100.0;
        let style = TextStyle { color: MUTED, anchor: Anchor::End, ..LABEL };
        drawing.text(&format!("{percent} %"), [CORNER[0] - 10.0, y + 4.0], style);
    }
    for (index, column) in sheet.columns.iter().enumerate() {
        let left = CORNER[0] + WIDTH[1] * index as f32;
        let mut y = bottom;
        for ((_, color), percent) in sheet.classes.iter().zip(&column.percent) {
            let height = HEIGHT * *percent as f32 / 100.0;
            y -= height;
            drawing.fill_box([left, y], [WIDTH[0], height], *color);
        }
        let style = TextStyle { anchor: Anchor::Middle, ..LABEL };
        drawing.text(&column.name, [left + WIDTH[0] / 2.0, bottom + 20.0], style);
    }
    Ok(drawing)
}

fn entry_width(name: &str) -> f32 {
    // The reader's font may be wider than the one that is measured.
    17.0 + 1.12 * text_width(name, LABEL.size) + 16.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_takes_its_share_of_the_column_from_the_bottom_up() {
        let (low, high) = ([200, 0, 0], [0, 0, 200]);
        let sheet = ColumnSheet {
            title: "t".to_owned(),
            classes: vec![("low", low), ("high", high)],
            columns: vec![Column { name: "a".to_owned(), percent: vec![25.0, 75.0] }],
        };
        let picture = columns(&sheet).unwrap().to_pixmap().unwrap();
        let x = (CORNER[0] + WIDTH[0] / 2.0) as u32;
        let count = |color: Rgb| {
            let rows = CORNER[1] as u32..(CORNER[1] + HEIGHT) as u32;
            let is = |y: &u32| {
                let pixel = picture.pixel(x, *y).unwrap();
                [pixel.red(), pixel.green(), pixel.blue()] == color
            };
            rows.filter(is).count()
        };
        assert_eq!((count(low), count(high)), (45, 135));
        assert!(columns(&ColumnSheet { columns: Vec::new(), ..sheet }).is_err());
    }
}
