//! The HUD: what a stream does, drawn into the picture that goes to a window.
//!
//! A [`HudView`] is chosen while the daemon runs. [`panel`] draws the numbers, four times a second;
//! [`views`] draw what the engine makes of the picture; [`overlay`] lays either onto a frame of any
//! format. Frames that are recorded, written to files or handed to subscribers never have a HUD.

mod overlay;
mod panel;
mod views;

use std::fmt;
use std::str::FromStr;

use foreframe_engine::ColorPlane;
use foreframe_engine::inspect::Inspection;
use tiny_skia::Pixmap;

use crate::control::StreamStatus;
use crate::stream::core::{FrameKind, PresentedFrame};

/// What the HUD shows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum HudView {
    /// Nothing.
    #[default]
    Off,
    /// Rates, latency by stage, and how early pictures are ready.
    Stats,
    /// Where each block of the picture goes: direction as hue, speed as strength.
    Motion,
    /// A grid that moves with the surfaces.
    Grid,
    /// The model that each block goes on by.
    Rungs,
    /// What comes into sight behind what moves, and is filled.
    Disocclusion,
    /// A bar that changes with every frame, in which tearing shows.
    Tear,
    /// Real frames alone.
    OnlyReal,
    /// Synthesised frames alone.
    OnlySynthesised,
}

impl HudView {
    /// All of them, in the order in which a key press goes through them.
    pub const ALL: [Self; 9] = [
        Self::Off,
        Self::Stats,
        Self::Motion,
        Self::Grid,
        Self::Rungs,
        Self::Disocclusion,
        Self::Tear,
        Self::OnlyReal,
        Self::OnlySynthesised,
    ];

    /// Name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Stats => "stats",
            Self::Motion => "motion",
            Self::Grid => "grid",
            Self::Rungs => "rungs",
            Self::Disocclusion => "disocclusion",
            Self::Tear => "tear",
            Self::OnlyReal => "only-real",
            Self::OnlySynthesised => "only-synthesised",
        }
    }

    /// The one after it; off after the last.
    #[must_use]
    pub fn next(self) -> Self {
        let at = Self::ALL.iter().position(|view| *view == self).unwrap_or(0);
        Self::ALL[(at + 1) % Self::ALL.len()]
    }

    /// Whether a frame of this kind is shown.
    #[must_use]
    pub fn shows(self, kind: FrameKind) -> bool {
        match self {
            Self::OnlyReal => kind == FrameKind::Real,
            Self::OnlySynthesised => kind == FrameKind::Synthesised,
            _ => true,
        }
    }
}

impl fmt::Display for HudView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for HudView {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|view| view.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("expected one of {names}, found `{name}`")
        })
    }
}

/// The HUD of one stream.
#[derive(Clone, Debug, Default)]
pub struct Hud {
    view: HudView,
    /// The numbers as they were drawn last.
    panel: Option<Pixmap>,
    /// Median latency of a key at each report, milliseconds.
    latency_ms: Vec<f64>,
}

impl Hud {
    /// What it shows.
    #[must_use]
    pub fn view(&self) -> HudView {
        self.view
    }

    /// Shows something else from the next frame on.
    pub fn set_view(&mut self, view: HudView) {
        self.view = view;
    }

    /// Takes new numbers in.
    pub fn report(&mut self, report: &StreamStatus) {
        const REMEMBERED: usize = 120;
        self.latency_ms.push(report.latency_ms.whole.p50);
        let forgotten = self.latency_ms.len().saturating_sub(REMEMBERED);
        self.latency_ms.drain(..forgotten);
        self.panel = match self.view {
            HudView::Off => None,
            view => panel::draw(report, &self.latency_ms, view),
        };
    }

    /// Draws onto `picture`, which shows `frame`.
    pub fn draw(
        &self,
        frame: &PresentedFrame,
        inspection: Option<Inspection<'_>>,
        picture: &mut ColorPlane,
    ) {
        match (self.view, inspection) {
            (HudView::Off, _) => return,
            (HudView::Motion, Some(inspection)) => views::motion(inspection, picture),
            (HudView::Rungs, Some(inspection)) => views::rungs(inspection, picture),
            (HudView::Disocclusion, Some(inspection)) => {
                views::disocclusion(inspection, frame.phase.as_f64(), picture);
            }
            (HudView::Grid, Some(inspection)) => {
                views::grid(inspection, frame.phase.as_f64(), picture);
            }
            (HudView::Tear, _) => views::tear(frame.index, picture),
            _ => {}
        }
        if let Some(panel) = &self.panel {
            overlay::lay(picture, panel, [12, 12], 1, overlay::PANEL_OPACITY);
        }
    }
}

#[cfg(test)]
mod tests;
