//! Light that changes: a shadow that passes, a lamp that swings, a cloud before the sun.
//!
//! No motion vector follows them, and no flow where they fall on texture: what stays there is the
//! texture, what moves is how much light it has. So the change of light is continued, per tile of
//! 8x8 pixels of the valid rectangle, where the last key has shown that it goes on so. With L the
//! mean luma of samples of a tile that both keys show, of the newest key and where they came from:
//!
//! ```text
//! (1) c = log2 L - log2 L'                     octaves per motion span ([`change`])
//! (2) R(s)^2 = (sum c c'_s)^2 / (sum c^2 sum c'_s^2),  a = sum c c'_s / sum c'_s^2
//!                                              over 3x3 tiles ([`trend`])
//! (3) t(x) = a c(x - s)                        a at most 1; 0 where R^2 < 1/2 or a < 0
//! (4) g(y, p) = 2^(min(p, 1) t(y - v p))       at phase p; v the motion of the tile
//! ```
//!
//! c' is the change that the key before has shown, per span of the newest, along with the surfaces,
//! and c'_s what moved by s tiles over them since, 2 per axis at most: the s of the largest R. A
//! change stays where a lamp grows brighter, and moves with the edge of a shadow. R^2 is the part of
//! the change that was foreseen: none where light flickers, or where a change is noise or news. The
//! picture is then made brighter by g ([`relight`]), which lies between tiles linearly. A half float
//! is a logarithm already: c and t p are differences of its codes.
//!
//! Only surfaces that both keys show are compared, and only in tiles that move as one, so that
//! something bright that comes in front of something dark is no light; and a tile that has half of
//! the change around it alone is none either. Nothing is known where flow explains what motion does
//! not, where a tile is not shown to go as it came (it is held, or damped), without depth, and after
//! a cut. One row of tiles in eight is measured, in turn, and those near rows in which light has
//! changed. Floats as in [`crate::trajectory`], quantised before a pixel is touched; made on the CPU
//! whatever the backend. Exactness: `Exact`.

mod change;
pub mod relight;
#[cfg(test)]
mod tests;
mod trend;

use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::color::ColorFormat;
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::phase::Phase;
use crate::plane::Plane;
use crate::time::MonoSpan;
use crate::warp::displacement;
pub use change::measure;
use change::{Change, Comparison, is_noticed};
use trend::Foreseen;

/// Pixels of a tile's side.
pub const TILE: u32 = 8;
/// Rows of tiles of which one is measured where nothing has changed.
const TURNS: u32 = 8;
/// Rows of tiles around one whose light changes that are measured with the next key.
const NEAR: usize = 3;
/// (3) at most, octaves of the levels of an integer format: half as bright again.
const MOST_LEVELS: f32 = 0.6;
/// The same of light, in a format of half floats.
const MOST_LIGHT: f32 = 1.3;
/// Steps of (3) per octave, those of a half float's codes.
const STEPS: f32 = 1024.0;

/// How the light of one stream goes on.
#[derive(Clone, Debug)]
pub struct Light {
    format: ColorFormat,
    changes: Plane<Change>,
    /// Those of the key before.
    before: Plane<Change>,
    foreseen: Foreseen,
    /// (3), 1/[`STEPS`] octaves.
    trend: Plane<i16>,
    /// Whether it is 0 everywhere.
    is_steady: bool,
    /// Which rows of tiles of the last key were measured; then, which of the next will be.
    measured: Vec<bool>,
    watched: Vec<bool>,
    keys: u32,
    /// Motion span of the last key.
    span: Option<MonoSpan>,
    /// (4) of the picture being made.
    gains: Plane<i32>,
}

impl Light {
    /// For a stream of `format`.
    #[must_use]
    pub fn new(format: ColorFormat) -> Self {
        Self {
            format,
            changes: Plane::default(),
            before: Plane::default(),
            foreseen: Foreseen::default(),
            trend: Plane::default(),
            is_steady: true,
            measured: Vec::new(),
            watched: Vec::new(),
            keys: 0,
            span: None,
            gains: Plane::default(),
        }
    }

    /// The scene is another: forgets what is known.
    pub fn forget(&mut self) {
        self.changes.resize(0, 0);
        self.is_steady = true;
        self.measured.clear();
    }

    /// Takes in `key`, whose field lies as `map` says and points back to `older`. `is_followed` says
    /// of a pixel whether flow explains what it shows.
    pub fn take_key(
        &mut self,
        pool: &ThreadPool,
        key: &KeyFrame,
        older: &KeyFrame,
        map: &FieldMap,
        is_followed: impl Fn([f32; 2]) -> bool + Sync,
    ) {
        let Some(comparison) = Comparison::new(key, older, map) else { return self.forget() };
        let span = key.motion_span();
        let ratio = span.zip(std::mem::replace(&mut self.span, span));
        let ratio = ratio.map_or(1.0, |(now, then)| now.as_secs_f64() / then.as_secs_f64()) as f32;
        let size = [key.valid.width, key.valid.height].map(|side| side.div_ceil(TILE));
        std::mem::swap(&mut self.changes, &mut self.before);
        self.changes.resize(size[0], size[1]);
        let knows_before = [self.before.width(), self.before.height()] == size;
        self.keys = self.keys.wrapping_add(1);
        let turn = self.keys % TURNS;
        self.measured.resize(size[1] as usize, false);
        for (row, is_measured) in (0..).zip(&mut self.measured) {
            *is_measured = row % TURNS == turn || (knows_before && *is_measured);
        }
        measure(pool, &comparison, &self.measured, &mut self.changes);
        self.watch();
        self.is_steady = !knows_before || !self.watched.contains(&true);
        if self.is_steady {
            self.take_turns();
            return;
        }
        self.trend.resize(size[0], size[1]);
        self.foreseen.carry(&self.changes, &self.before, ratio);
        let most = if self.format == ColorFormat::Rgba16f { MOST_LIGHT } else { MOST_LEVELS };
        let foreseen = &self.foreseen;
        let measured = &self.measured;
        for_each_row(pool, &mut self.trend, |row, trend| {
            if !measured[row as usize] {
                return trend.fill(0);
            }
            let y = (key.valid.y + row * TILE + TILE / 2) as f32;
            for (column, trend) in (0..).zip(trend) {
                let x = (key.valid.x + column * TILE + TILE / 2) as f32;
                let octaves = foreseen.goes_on([column, row]);
                let is_its = octaves != 0.0 && !is_followed([x, y]);
                let octaves = if is_its { octaves.clamp(-most, most) } else { 0.0 };
                #[expect(clippy::cast_possible_truncation, reason = "below two octaves")]
                let steps = libm::roundf(octaves * STEPS) as i16;
                *trend = steps;
            }
        });
        self.is_steady = self.trend.data().iter().all(|trend| *trend == 0);
        self.take_turns();
    }

    /// Finds the rows of tiles that are worth another look: near those in which light has changed,
    /// and where those go.
    fn watch(&mut self) {
        let rows = self.changes.height() as usize;
        self.watched.clear();
        self.watched.resize(rows, false);
        for row in (0..rows).filter(|row| self.measured[*row]) {
            let changes = self.changes.row(row as u32);
            if !is_noticed(changes) {
                continue;
            }
            let most = changes.iter().max_by(|a, b| a.octaves.abs().total_cmp(&b.octaves.abs()));
            let down =
                displacement(most.map_or(Velocity::default(), |it| it.motion), Phase::ONE)[1];
            let goes_to = row.saturating_add_signed((down / (TILE as i32 * 256)) as isize);
            for row in [row, goes_to.min(rows - 1)] {
                self.watched[row.saturating_sub(NEAR)..(row + NEAR + 1).min(rows)].fill(true);
            }
        }
    }

    /// The rows that are watched are measured with the next key.
    fn take_turns(&mut self) {
        std::mem::swap(&mut self.measured, &mut self.watched);
    }

    /// (4) per tile at `phase` after the newest key, as [`relight`] takes it; None where the light
    /// stays as it is.
    pub fn gains(&mut self, pool: &ThreadPool, phase: Phase) -> Option<&Plane<i32>> {
        if self.is_steady || phase == Phase::ZERO {
            return None;
        }
        let Self { format, changes, trend, gains, .. } = self;
        gains.resize(trend.width(), trend.height());
        let share = phase.q12().min(Phase::ONE.q12());
        let neutral = relight::gain(*format, 0);
        for_each_row(pool, gains, |row, gains| {
            for (column, gain) in (0..).zip(gains) {
                let d = displacement(changes.at(column, row).motion, phase);
                let steps = (at(trend, [column, row], d) * share) >> Phase::FRACTION_BITS;
                *gain = if steps == 0 { neutral } else { relight::gain(*format, steps) };
            }
        });
        Some(gains)
    }
}

/// (3) of where a tile came from, by `d` in 1/256 pixel: between tiles linear.
fn at(trend: &Plane<i16>, tile: [u32; 2], d: [i32; 2]) -> i32 {
    const ACROSS: i32 = TILE as i32 * 256;
    let last = [trend.width(), trend.height()].map(|tiles| tiles as i32 - 1);
    let place = |axis: usize| (tile[axis] as i32 * ACROSS - d[axis]).clamp(0, last[axis] * ACROSS);
    let (x, y) = (place(0), place(1));
    let (column, row) = (x / ACROSS, y / ACROSS);
    let (way_x, way_y) = (x % ACROSS, y % ACROSS);
    let of = |column: i32, row: i32| {
        i32::from(trend.at(column.min(last[0]) as u32, row.min(last[1]) as u32))
    };
    let across = |row: i32| of(column, row) * (ACROSS - way_x) + of(column + 1, row) * way_x;
    // Eleven bits and a sign, times eleven bits twice: more than 32.
    let sum = i64::from(across(row)) * i64::from(ACROSS - way_y)
        + i64::from(across(row + 1)) * i64::from(way_y);
    (sum / (i64::from(ACROSS) * i64::from(ACROSS))) as i32
}
