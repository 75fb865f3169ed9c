//! The compositing of [`super`], row by row. Rows cost what is seen of the interface in them.

use std::ops::Range;

use rayon::ThreadPool;

use super::{UiLayer, half};
use crate::bands::for_each_row;
use crate::color::{ColorPlane, OrderedRgba16, Rgb10a2, Rgba8};
use crate::plane::{Plane, Rect};

/// A kind of pixel that can lie over another.
trait Over: Copy + Default + Send + Sync {
    /// Whether it leaves what it lies over.
    fn is_clear(self) -> bool;

    /// This over `picture`: (1) or (2).
    fn over(self, picture: Self) -> Self;
}

impl Over for Rgba8 {
    #[inline(always)]
    fn is_clear(self) -> bool {
        self.0 >> 24 == 0
    }

    #[inline(always)]
    fn over(self, picture: Self) -> Self {
        let (alpha, mut out) = (self.0 >> 24, 0);
        for shift in [0, 8, 16, 24] {
            let [ui, under] = [self.0, picture.0].map(|word| word >> shift & 0xff);
            // x / 255, rounded: exact for every product of two levels.
            let weighed = (255 - alpha) * under + 128;
            out |= (ui.min(alpha) + ((weighed + (weighed >> 8)) >> 8)) << shift;
        }
        Self(out)
    }
}

impl Over for Rgb10a2 {
    #[inline(always)]
    fn is_clear(self) -> bool {
        self.0 >> 30 == 0
    }

    #[inline(always)]
    fn over(self, picture: Self) -> Self {
        let (alpha, mut out) = (self.0 >> 30, 0);
        for (shift, mask, most) in [(0, 0x3ff, 341), (10, 0x3ff, 341), (20, 0x3ff, 341), (30, 3, 1)]
        {
            let [ui, under] = [self.0, picture.0].map(|word| word >> shift & mask);
            // A third has no ties, so 1 rounds to nearest.
            out |= (ui.min(alpha * most) + ((3 - alpha) * under + 1) / 3) << shift;
        }
        Self(out)
    }
}

impl Over for OrderedRgba16 {
    #[inline(always)]
    fn is_clear(self) -> bool {
        half::rest_under(self.0[3]) == half::rest_under(Self::default().0[3])
    }

    #[inline(always)]
    fn over(self, picture: Self) -> Self {
        let rest = half::rest_under(self.0[3]);
        Self(std::array::from_fn(|i| half::over(self.0[i], picture.0[i], rest)))
    }
}

/// Lays `ui` over `picture`, which has the format of the stream.
pub fn composite(pool: &ThreadPool, ui: &UiLayer, picture: &mut ColorPlane) {
    match (&ui.pixels, picture) {
        (ColorPlane::Rgba8(pixels), ColorPlane::Rgba8(picture)) => lay(pool, ui, pixels, picture),
        (ColorPlane::Rgb10a2(pixels), ColorPlane::Rgb10a2(picture)) => {
            lay(pool, ui, pixels, picture);
        }
        (ColorPlane::Rgba16f(pixels), ColorPlane::Rgba16f(picture)) => {
            lay(pool, ui, pixels, picture);
        }
        // Nothing has come yet: no pixels of any format.
        _ => {}
    }
}

/// The part of `0..length` that lies, moved by `place`, within `0..room`.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "clamped to 0..length")]
fn visible(of: [u16; 2], place: i32, room: u32) -> Range<usize> {
    let [from, to] = of.map(i64::from);
    let within = |at: i64| at.clamp(from, to.max(from)).unsigned_abs() as usize;
    within(-i64::from(place))..within(i64::from(room) - i64::from(place))
}

fn lay<T: Over>(pool: &ThreadPool, ui: &UiLayer, pixels: &Plane<T>, picture: &mut Plane<T>) {
    let Some(height) = u16::try_from(pixels.height()).ok().filter(|rows| *rows > 0) else { return };
    let [x, y] = ui.place;
    let (width, rows) = (picture.width(), visible([0, height], y, picture.height()));
    if rows.is_empty() || width == 0 {
        return;
    }
    for_each_row(
        pool,
        picture,
        #[inline(always)]
        |row, out| {
            let own = i64::from(row) - i64::from(y);
            let Ok(own) = u32::try_from(own) else { return };
            if !rows.contains(&(own as usize)) {
                return;
            }
            let columns = visible(ui.seen.at(0, own), x, width);
            if columns.is_empty() {
                return;
            }
            let start = columns.start as i64 + i64::from(x);
            let out = out.get_mut(start.unsigned_abs() as usize..).unwrap_or_default();
            for (out, ui) in out.iter_mut().zip(&pixels.row(own)[columns]) {
                *out = ui.over(*out);
            }
        },
    );
}

/// Finds the columns of each row in which something is seen.
pub(super) fn find_seen(
    pool: &ThreadPool,
    pixels: &ColorPlane,
    valid: Rect,
    seen: &mut Plane<[u16; 2]>,
) {
    match pixels {
        ColorPlane::Rgba8(pixels) => find(pool, pixels, valid, seen),
        ColorPlane::Rgb10a2(pixels) => find(pool, pixels, valid, seen),
        ColorPlane::Rgba16f(pixels) => find(pool, pixels, valid, seen),
    }
}

#[expect(clippy::cast_possible_truncation, reason = "planes have at most 8192 columns")]
fn find<T: Over>(pool: &ThreadPool, pixels: &Plane<T>, valid: Rect, seen: &mut Plane<[u16; 2]>) {
    seen.resize(1, pixels.height());
    for_each_row(
        pool,
        seen,
        #[inline(always)]
        |row, seen| {
            seen[0] = [0; 2];
            if !(valid.y..valid.y + valid.height).contains(&row) {
                return;
            }
            let part = &pixels.row(row)[valid.x as usize..][..valid.width as usize];
            let is_seen = |pixel: &T| !pixel.is_clear();
            let Some(first) = part.iter().position(is_seen) else { return };
            let last = part.iter().rposition(is_seen).unwrap_or(first);
            seen[0] = [first, last + 1].map(|column| (valid.x as usize + column) as u16);
        },
    );
}
