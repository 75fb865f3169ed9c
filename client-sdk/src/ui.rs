//! A user interface in the application's hands, between key frames.
//!
//! It lies in a slot like a key frame, and only its UI plane is used. It is shown over every
//! picture from the next one on, where it is placed, neither moved nor scaled, until another one
//! comes.

use foreframe_protocol::{PlaneDescriptor, PlaneKind, PlaneSize, Rect};

use crate::error::{Error, Result};
use crate::frame::{KeyFrame, PlaneMut};

/// A slot that belongs to the application until it is submitted with
/// [`Client::submit_ui`](crate::Client::submit_ui) or dropped, which leaves this one out.
#[derive(Debug)]
pub struct UiFrame {
    frame: KeyFrame,
    place: [i32; 2],
}

impl UiFrame {
    pub(crate) fn new(frame: KeyFrame) -> Self {
        Self { frame, place: [0; 2] }
    }

    /// Size and stride of the plane. It has its largest size until it is resized.
    #[must_use]
    pub fn plane(&self) -> Option<&PlaneDescriptor> {
        self.frame.plane(PlaneKind::Ui)
    }

    /// The pixels to write: premultiplied, in the format of the stream's colour. What they held
    /// before is whatever the slot was used for, so write every one, transparent ones too.
    pub fn pixels_mut(&mut self) -> PlaneMut<'_> {
        self.frame.plane_mut(PlaneKind::Ui).unwrap_or(PlaneMut {
            bytes: &mut [],
            width: 0,
            height: 0,
            stride: 0,
            bytes_per_pixel: 0,
        })
    }

    /// Gives the plane another size, up to what the stream declares: what is small costs little.
    /// Its rows are packed anew, and all of it is valid.
    ///
    /// # Errors
    /// [`Error::Plane`] if it is larger than declared.
    pub fn resize(&mut self, size: PlaneSize) -> Result<()> {
        self.frame.resize(PlaneKind::Ui, size.width, size.height)
    }

    /// States which part of the plane is shown.
    ///
    /// # Errors
    /// [`Error::Plane`] if it is empty or reaches outside.
    pub fn set_valid(&mut self, valid: Rect) -> Result<()> {
        self.frame.set_valid(PlaneKind::Ui, valid)
    }

    /// Column and row of the output that the plane's first pixel lies on, (0, 0) unless stated.
    /// What lies outside the output is not shown.
    pub fn set_place(&mut self, x: i32, y: i32) {
        self.place = [x, y];
    }

    /// The slot, the descriptor of the plane, and its place.
    pub(crate) fn into_parts(self) -> Result<(KeyFrame, PlaneDescriptor, [i32; 2])> {
        let plane = *self.plane().ok_or(Error::NoPlane { plane: PlaneKind::Ui })?;
        Ok((self.frame, plane, self.place))
    }
}
