//! The pictures that the tool leaves behind: a contact sheet, a timeline, charts, small
//! multiples, stacked columns.
//!
//! Pure functions from plain structs to a [`tiny_skia::Pixmap`], which encodes itself as PNG. They
//! read no file and no clock, and know nothing of how the frames were made.

mod chart;
mod columns;
mod contact_sheet;
mod small_multiples;
mod timeline;

pub use chart::{ChartLabels, MapAxes, Series, line_chart, map_chart};
pub use columns::{Column, ColumnSheet, columns};
pub use contact_sheet::{ContactSheetRow, contact_sheet};
pub use small_multiples::{Across, Line, Look, Mark, Panel, Point, Sheet, small_multiples};
pub use timeline::{PresentKind, TimelineEvent, timeline};

/// Why a picture cannot be drawn.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// There is nothing to show.
    #[error("expected at least one {expected}, found none")]
    Empty {
        /// What is missing.
        expected: &'static str,
    },
    /// The images of a contact sheet are not of one size.
    #[error(
        "expected images of {expected_width}x{expected_height} pixels, found {width}x{height} in row `{row}`"
    )]
    SizeDiffers {
        /// Of the first image.
        expected_width: u32,
        /// Of the first image.
        expected_height: u32,
        /// Of the image that differs.
        width: u32,
        /// Of the image that differs.
        height: u32,
        /// Label of its row.
        row: String,
    },
    /// The picture would be too large.
    #[error("expected a picture of at most 32767 pixels a side, found {width}x{height}; show less")]
    TooLarge {
        /// Columns needed.
        width: u64,
        /// Rows needed.
        height: u64,
    },
}
