//! What the engine makes of one pixel, for pictures that explain what it does.
//!
//! Reads what the newest key left behind and changes nothing. Slow compared with a warp: one
//! question per pixel or per block, for people who look at one frame.

use crate::engine::Engine;
use crate::evidence::Evidence;
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::method::Method;
use crate::trajectory::rung::Rung;

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
            (Method::World, Some(evidence)) => Rung::World(evidence.order()),
            (Method::Auto, Some(evidence)) if !evidence.samples().data().is_empty() => {
                let depths = &self.key.depth;
                let depth = if depths.data().is_empty() { 0 } else { depths.at(column, row) };
                evidence.lead_at(column, row, depth).rung
            }
            _ => Rung::Linear,
        }
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

impl Engine {
    /// The newest key as the engine sees it; None before the first.
    #[must_use]
    pub fn inspect(&self) -> Option<Inspection<'_>> {
        let (key, map, evidence) = self.newest_seen()?;
        Some(Inspection { key, map, evidence, method: self.method() })
    }
}
