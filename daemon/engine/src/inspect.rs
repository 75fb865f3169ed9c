//! What the engine makes of one pixel, for pictures that explain what it does.
//!
//! Reads what the newest key left behind and changes nothing. Slow compared with a warp: one
//! question per pixel or per block, for people who look at one frame.

use crate::engine::Engine;
use crate::evidence::Evidence;
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::method::Method;
use crate::plane::Plane;
use crate::trajectory::rung::Rung;

/// Cells between the samples that speed is measured of, per axis.
const SPEED_STRIDE: usize = 4;
/// Pixels between the samples that shares are counted of, per axis.
const SHARE_STRIDE: usize = 16;
/// Motion that counts, pixels per motion span.
const MOVED_PX: f32 = 0.25;
/// If less than one in so many of those cells moves, the picture is still.
const STILL_PART: usize = 16;

/// The newest key, seen pixel by pixel.
#[derive(Clone, Copy, Debug)]
pub struct Inspection<'a> {
    pub(crate) key: &'a KeyFrame,
    pub(crate) map: &'a FieldMap,
    pub(crate) evidence: Option<&'a Evidence>,
    pub(crate) method: Method,
}

impl Inspection<'_> {
    /// Motion that the surface at a pixel is expected to go on with, pixels per motion span, x
    /// right, y down. None where it is held: outside the image, or where no motion is known.
    #[must_use]
    pub fn motion_at(&self, x: u32, y: u32) -> Option<[f32; 2]> {
        let [column, row] = self.cell_at(x, y)?;
        let velocity = self.key.velocity.at(column, row);
        let pixels = |steps: i16| f32::from(steps) / Velocity::PER_PX as f32;
        velocity.is_trackable().then(|| [pixels(velocity.x), pixels(velocity.y)])
    }

    /// How fast the picture moves, pixels per second: the median speed of what moves, or 0 where
    /// nearly nothing does. None without motion.
    #[must_use]
    pub fn speed(&self) -> Option<f32> {
        let (mut speeds, seconds) = self.speeds()?;
        let all = speeds.len();
        speeds.retain(|speed| *speed > MOVED_PX);
        if speeds.len() * STILL_PART < all {
            return Some(0.0);
        }
        Some(ranked(&mut speeds, 50) / seconds)
    }

    /// The speed that one surface in a hundred exceeds, pixels per second. None without motion.
    #[must_use]
    pub fn highest_speed(&self) -> Option<f32> {
        let (mut speeds, seconds) = self.speeds()?;
        Some(ranked(&mut speeds, 99) / seconds)
    }

    /// Speeds at some cells, pixels per motion span, and that span in seconds.
    #[expect(clippy::cast_possible_truncation, reason = "seconds need no more than an f32")]
    fn speeds(&self) -> Option<(Vec<f32>, f32)> {
        let seconds = self.key.motion_span()?.as_secs_f64() as f32;
        let field = &self.key.velocity;
        let rows = (0..field.height()).step_by(SPEED_STRIDE);
        let cells = rows.flat_map(|y| field.row(y).iter().step_by(SPEED_STRIDE));
        let tracked = cells.filter(|velocity| velocity.is_trackable());
        let speed =
            |v: &Velocity| libm::hypotf(f32::from(v.x), f32::from(v.y)) / Velocity::PER_PX as f32;
        Some((tracked.map(speed).collect(), seconds))
    }

    /// The model that the surface at a pixel goes on by.
    #[must_use]
    pub fn rung_at(&self, x: u32, y: u32) -> Rung {
        let Some([column, row]) = self.cell_at(x, y) else { return Rung::Hold };
        match (self.method, self.evidence) {
            (Method::Hold | Method::Blend, _) => Rung::Hold,
            (Method::Global, _) => Rung::Global,
            (Method::Affine, _) => Rung::Affine,
            (Method::Quadratic, _) => Rung::Quadratic,
            (Method::Flow, _) => Rung::Flow,
            (Method::World, Some(evidence)) => Rung::World(evidence.mover_order()),
            (Method::Auto, Some(evidence)) if !evidence.samples().data().is_empty() => {
                let depths = &self.key.depth;
                let depth = if depths.data().is_empty() { 0 } else { depths.at(column, row) };
                evidence.lead_at(column, row, depth).rung
            }
            _ => Rung::Linear,
        }
    }

    /// Which part of the picture goes on by which model, percent, the largest first.
    #[must_use]
    pub fn rung_percent(&self) -> Vec<(&'static str, f64)> {
        let mut counts: Vec<(&'static str, u32)> = Vec::new();
        let (width, height) = (self.key.color.width(), self.key.color.height());
        for y in (0..height).step_by(SHARE_STRIDE) {
            for x in (0..width).step_by(SHARE_STRIDE) {
                let name = self.rung_at(x, y).name();
                match counts.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, count)) => *count += 1,
                    None => counts.push((name, 1)),
                }
            }
        }
        let all: u32 = counts.iter().map(|(_, count)| count).sum();
        counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        let percent = |count: u32| 100.0 * f64::from(count) / f64::from(all.max(1));
        counts.into_iter().map(|(name, count)| (name, percent(count))).collect()
    }

    /// Blocks of `block` pixels that no block of the key lands on at `phase`: what has come into
    /// sight, and is filled.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "sizes up to 8192 are exact")]
    pub fn uncovered(&self, phase: f64, block: u32) -> Plane<bool> {
        let size = [self.key.color.width(), self.key.color.height()];
        let [columns, rows] = size.map(|length| length.div_ceil(block));
        let mut uncovered = Plane::new(columns, rows);
        uncovered.data_mut().fill(true);
        let length = block as f32;
        let landed = |column: u32, row: u32| {
            let middle = |block_index: u32| block_index * block + block / 2;
            let [dx, dy] = self.motion_at(middle(column), middle(row)).unwrap_or_default();
            let phase = phase as f32;
            [column as f32 * length + dx * phase, row as f32 * length + dy * phase]
        };
        for row in 0..rows {
            for column in 0..columns {
                let from = landed(column, row);
                let neighbours = [landed(column + 1, row)[0], landed(column, row + 1)[1]];
                // A surface that grows stays closed; one that ends, ends.
                let [across, down] = [0, 1].map(|axis| {
                    let end = from[axis] + length;
                    let is_same = (neighbours[axis] - end).abs() < length;
                    let to = if is_same { end.max(neighbours[axis]) } else { end };
                    let first = (from[axis] / length - 0.5).ceil().max(0.0) as u32;
                    let last = (to / length - 0.5).floor();
                    first..if last < 0.0 { 0 } else { last as u32 + 1 }
                });
                for y in down.start..down.end.min(rows) {
                    for x in across.start..across.end.min(columns) {
                        uncovered.row_mut(y)[x as usize] = false;
                    }
                }
            }
        }
        uncovered
    }

    /// The cell of the field grid that holds a pixel of the image.
    fn cell_at(&self, x: u32, y: u32) -> Option<[u32; 2]> {
        if self.key.velocity.data().is_empty() || self.key.motion_from.is_none() {
            return None;
        }
        let valid = self.key.valid;
        let x = x.checked_sub(valid.x).filter(|x| *x < valid.width)?;
        let y = y.checked_sub(valid.y).filter(|y| *y < valid.height)?;
        Some([self.map.x.cell_of(x), self.map.y.cell_of(y)])
    }
}

/// What `percent` of `speeds` do not exceed; 0 of none.
fn ranked(speeds: &mut [f32], percent: usize) -> f32 {
    let rank = speeds.len() * percent / 100;
    if rank >= speeds.len() { 0.0 } else { *speeds.select_nth_unstable_by(rank, f32::total_cmp).1 }
}

impl Engine {
    /// The newest key as the engine sees it; None before the first.
    #[must_use]
    pub fn inspect(&self) -> Option<Inspection<'_>> {
        let (key, map, evidence) = self.newest_seen()?;
        Some(Inspection { key, map, evidence, method: self.method() })
    }
}
