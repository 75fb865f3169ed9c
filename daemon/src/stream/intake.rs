//! Key frames and UI planes out of their slots, into the engine, and a copy of them to the
//! recorder.
//!
//! Without a recorder the engine reads the slot itself, row by row, while it converts. With one the
//! planes are copied first, and both read the copy.

use foreframe_engine::{DecodeError, KeyReport};
use foreframe_protocol::{Error, ErrorCode, ErrorMessage, PlaneKind, PlaneMap, StreamFormat};

use super::core::StreamCore;
use super::mailbox::{Submission, UiSubmission};
use super::planes::{PlaneCopier, SlotPlanes};
use crate::clock;
use crate::ingest::{self, IngestError, PlaneSource};
use crate::recorder::StreamRecorder;

/// What is kept from one key, and from one UI plane, to the next.
#[derive(Debug, Default)]
pub(super) struct Intake {
    keys: PlaneCopier,
    uis: PlaneCopier,
}

impl Intake {
    /// Takes a key in, and the user interface that came with it.
    ///
    /// # Errors
    /// If its planes do not fit the stream. What to tell the client, without the stream's number.
    pub(super) fn key(
        &mut self,
        format: &StreamFormat,
        submission: &Submission,
        recorder: Option<&mut StreamRecorder>,
        core: &mut StreamCore,
    ) -> Result<KeyReport, ErrorMessage> {
        let Submission { submit, arrived_at, pool, slot_offset } = submission;
        let described = &submit.planes;
        if let Some(recorder) = recorder {
            let planes = self.keys.copy(format, described, pool, *slot_offset).map_err(outside)?;
            recorder.offer(submit, *arrived_at, &planes);
            let source = |kind| planes.get(kind).map(PlaneSource::Packed);
            take_key(core, format, submission, source)
        } else {
            let planes = SlotPlanes::new(format, described, pool, *slot_offset).map_err(outside)?;
            let source = |kind| planes.get(kind).map(PlaneSource::InSlot);
            take_key(core, format, submission, source)
        }
    }

    /// Takes in a UI plane that came by itself.
    ///
    /// # Errors
    /// If it does not fit the stream. What to tell the client, without the stream's number.
    pub(super) fn ui(
        &mut self,
        format: &StreamFormat,
        submission: &UiSubmission,
        recorder: Option<&mut StreamRecorder>,
        core: &mut StreamCore,
    ) -> Result<(), ErrorMessage> {
        let UiSubmission { ui, arrived_at, pool, slot_offset } = submission;
        let mut take_ui = |source: Option<PlaneSource<'_>>| {
            let source = source.unwrap_or(PlaneSource::Packed(&[]));
            let input = ingest::ui_input(format, ui, source).map_err(wrong)?;
            core.set_ui(&input, *arrived_at).map_err(undeclared)
        };
        let described = PlaneMap::from_fn(|kind| (kind == PlaneKind::Ui).then_some(ui.plane));
        if let Some(recorder) = recorder {
            let planes = self.uis.copy(format, &described, pool, *slot_offset).map_err(outside)?;
            recorder.offer_ui(ui, *arrived_at, &planes);
            take_ui(planes.get(PlaneKind::Ui).map(PlaneSource::Packed))
        } else {
            let planes =
                SlotPlanes::new(format, &described, pool, *slot_offset).map_err(outside)?;
            take_ui(planes.get(PlaneKind::Ui).map(PlaneSource::InSlot))
        }
    }
}

fn take_key<'a>(
    core: &mut StreamCore,
    format: &StreamFormat,
    Submission { submit, arrived_at, .. }: &Submission,
    source: impl Fn(PlaneKind) -> Option<PlaneSource<'a>>,
) -> Result<KeyReport, ErrorMessage> {
    let input = ingest::key_input(format, submit, &source).map_err(wrong)?;
    let ui = ingest::ui_of_key(format, submit, &source).map_err(wrong)?;
    let report = core.on_key(&input, clock::now).map_err(undeclared)?;
    if let Some(ui) = ui {
        core.set_ui(&ui, *arrived_at).map_err(undeclared)?;
    }
    Ok(report)
}

fn outside(error: Error) -> ErrorMessage {
    ErrorMessage::new(&error, false, None)
}

fn wrong(error: IngestError) -> ErrorMessage {
    plane_error(error.parts())
}

fn undeclared(error: DecodeError) -> ErrorMessage {
    plane_error(("planes".into(), "what the stream declares".into(), error.to_string()))
}

fn plane_error((field, expected, found): (String, String, String)) -> ErrorMessage {
    ErrorMessage { code: ErrorCode::Plane, is_fatal: false, stream: None, field, expected, found }
}
