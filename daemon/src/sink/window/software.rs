//! Pictures for displays without Wayland: a thread scales and paints them.
//!
//! The stream leaves its picture on an [`Easel`] and goes on. Nothing tells when it was shown; one
//! that another replaced before the thread got to it never is, and that is told.

use std::num::NonZeroU32;
use std::sync::Arc;
use std::thread;

use foreframe_engine::{ColorPlane, MonoTime, Rect, StreamFormat};
use softbuffer::{Context, SoftBufferError, Surface};
use tracing::warn;
use winit::event_loop::OwnedDisplayHandle;

use super::easel::Easel;
use super::pane::Pane;
use super::placement::Placement;
use super::shared::Shared;
use super::texels::{ByteOrder, Picture, Texels};
use super::{Closed, WindowError, WindowEvent};
use crate::stream::core::Told;

/// Paints a window. Its thread ends when this is dropped and the display lets it.
#[derive(Debug)]
pub(super) struct Painter {
    easel: Arc<Easel<MonoTime>>,
    shared: Arc<Shared>,
}

impl Painter {
    pub(super) fn start(
        window: Pane,
        display: OwnedDisplayHandle,
        format: &StreamFormat,
        shared: Arc<Shared>,
    ) -> Result<Self, WindowError> {
        let easel = Arc::new(Easel::default());
        let (place, format) = (Arc::clone(&easel), *format);
        let told = Arc::clone(&shared);
        thread::Builder::new().name("foreframe-painter".to_owned()).spawn(move || {
            if let Err(error) = paint_all(window, display, &format, &place, &told) {
                warn!(%error, "the window cannot be painted");
                told.close(Closed::WithDisplay);
            }
        })?;
        Ok(Self { easel, shared })
    }

    /// Leaves `frame` for the painter.
    pub(super) fn present(&self, planned: MonoTime, frame: &ColorPlane) -> bool {
        if let Some(planned) = self.easel.leave(planned, frame) {
            self.shared.tell(WindowEvent::Told(Told::Discarded { planned }));
        }
        true
    }
}

impl Drop for Painter {
    fn drop(&mut self) {
        self.easel.close();
    }
}

fn paint_all(
    window: Pane,
    display: OwnedDisplayHandle,
    format: &StreamFormat,
    easel: &Easel<MonoTime>,
    shared: &Shared,
) -> Result<(), SoftBufferError> {
    let context = Context::new(display)?;
    let mut surface = Surface::new(&context, window)?;
    let mut texels = Texels::new(format, ByteOrder::Bgrx);
    let (mut painted, mut row) = (None, Vec::new());
    while let Some((_, frame)) = easel.take(painted.take()) {
        let placement = Placement::scaled([frame.width(), frame.height()], shared.size());
        let [width, height] =
            placement.buffer.map(|length| NonZeroU32::new(length).expect("a side is at least 1"));
        surface.resize(width, height)?;
        let mut buffer = surface.buffer_mut()?;
        paint(&texels.picture(&frame, &placement), &placement, &mut row, &mut buffer);
        buffer.present()?;
        painted = Some(frame);
    }
    Ok(())
}

/// Draws a picture to its place in a whole buffer, black around it, by way of `row`.
fn paint(picture: &Picture<'_>, placement: &Placement, row: &mut Vec<u8>, buffer: &mut [u32]) {
    let Rect { x, y, width, height } = placement.picture;
    if [width, height] != placement.buffer {
        buffer.fill(0);
    }
    row.resize(width as usize * 4, 0);
    let rows = buffer.chunks_exact_mut(placement.buffer[0] as usize).skip(y as usize);
    for (y, pixels) in (0..height).zip(rows) {
        picture.draw_row(y, row);
        let pixels = &mut pixels[x as usize..][..width as usize];
        for (pixel, texel) in pixels.iter_mut().zip(row.as_chunks::<4>().0) {
            *pixel = u32::from_le_bytes([texel[0], texel[1], texel[2], 0]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_painted_in_its_place_whatever_was_there_before() {
        let format = StreamFormat::rgba8(2, 1);
        let mut frame = ColorPlane::new(format.color, 2, 1);
        frame.as_mut_bytes().copy_from_slice(&[1, 2, 3, 255, 4, 5, 6, 255]);
        let placement = Placement::scaled([2, 1], [4, 4]);
        let mut texels = Texels::new(&format, ByteOrder::Bgrx);
        let mut buffer = [0xffff_ffff; 16];
        paint(&texels.picture(&frame, &placement), &placement, &mut Vec::new(), &mut buffer);
        let [dark, one, four] = [0, 0x01_02_03, 0x04_05_06];
        let shown = [[dark; 4], [one, one, four, four], [one, one, four, four], [dark; 4]];
        assert_eq!(buffer, *shown.as_flattened());
    }
}
