//! One key frame in the application's hands: its planes as memory to write.
//!
//! The memory is the slot itself, which the daemon reads: what is rendered or read back into it is
//! copied by nobody on this side.

use std::sync::mpsc::Sender;

use foreframe_protocol::memory::SlotMemory;
use foreframe_protocol::{PlaneDescriptor, PlaneKind, PlaneMap, PlaneSize, Rect};

use crate::error::{Error, Result};
use crate::stream::SlotLayout;

/// A slot that belongs to the application until it is submitted or dropped. Dropping it is how a
/// key frame is left out: the slot is free again. It can be filled on another thread.
#[derive(Debug)]
pub struct KeyFrame {
    stream: u32,
    layout: SlotLayout,
    planes: PlaneMap<PlaneDescriptor>,
    memory: Option<SlotMemory>,
    home: Sender<SlotMemory>,
}

/// One plane to write. What it held before is whatever an older key frame left.
#[derive(Debug)]
pub struct PlaneMut<'a> {
    /// All rows; row `y` starts at `y * stride`.
    pub bytes: &'a mut [u8],
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next.
    pub stride: u32,
    /// Bytes of one pixel.
    pub bytes_per_pixel: u32,
}

impl PlaneMut<'_> {
    /// The pixels of row `y`, without padding; empty below the last row.
    pub fn row_mut(&mut self, y: u32) -> &mut [u8] {
        let start = y as usize * self.stride as usize;
        let len = self.width as usize * self.bytes_per_pixel as usize;
        self.bytes.get_mut(start..start + len).unwrap_or_default()
    }
}

impl KeyFrame {
    pub(crate) fn new(
        stream: u32,
        layout: SlotLayout,
        memory: SlotMemory,
        home: Sender<SlotMemory>,
    ) -> Self {
        let planes = PlaneMap::from_fn(|kind| {
            let place = layout.places.get(kind)?;
            Some(layout.describe(kind, place.max_size))
        });
        Self { stream, layout, planes, memory: Some(memory), home }
    }

    pub(crate) fn stream(&self) -> u32 {
        self.stream
    }

    pub(crate) fn planes(&self) -> &PlaneMap<PlaneDescriptor> {
        &self.planes
    }

    pub(crate) fn slot(&self) -> u32 {
        self.memory.as_ref().map_or(0, SlotMemory::index)
    }

    /// Takes the slot out; None only while the frame is being dropped.
    pub(crate) fn take_memory(&mut self) -> Option<SlotMemory> {
        self.memory.take()
    }

    /// Size and stride of a plane; None where the stream does not have it or it was left out.
    #[must_use]
    pub fn plane(&self, kind: PlaneKind) -> Option<&PlaneDescriptor> {
        self.planes.get(kind)
    }

    /// Gives a plane another size for this key frame, up to what the stream declares. It is valid
    /// everywhere afterwards, and its rows are packed anew. Colour always has the stream's size:
    /// use [`set_valid`](Self::set_valid) for dynamic resolution.
    ///
    /// # Errors
    /// [`Error::Plane`] if it is larger than declared.
    pub fn resize(&mut self, kind: PlaneKind, width: u32, height: u32) -> Result<()> {
        let Some(place) = self.layout.places.get(kind) else {
            return Err(Error::NoPlane { plane: kind });
        };
        let (max_size, size) = (place.max_size, PlaneSize { width, height });
        let is_fixed = kind == PlaneKind::Color && size != max_size;
        let is_small = width == 0 || height == 0;
        if is_fixed || is_small || width > max_size.width || height > max_size.height {
            let most = if kind == PlaneKind::Color { "" } else { "1x1 to " };
            let expected = format!("{most}{max_size}");
            return Err(Error::Plane { plane: kind, expected, found: size.to_string() });
        }
        let jitter = self.planes.get(kind).map_or([0.0; 2], |plane| plane.jitter);
        let plane = PlaneDescriptor { jitter, ..self.layout.describe(kind, size) };
        self.planes.set(kind, Some(plane));
        Ok(())
    }

    /// States which part of a plane holds the image.
    ///
    /// # Errors
    /// [`Error::Plane`] if it is empty or reaches outside.
    pub fn set_valid(&mut self, kind: PlaneKind, valid: Rect) -> Result<()> {
        let plane = self.planes.get_mut(kind).ok_or(Error::NoPlane { plane: kind })?;
        if !valid.fits(plane.width, plane.height) {
            let expected = format!("a rectangle inside {}", plane.size());
            return Err(Error::Plane { plane: kind, expected, found: valid.to_string() });
        }
        plane.valid = valid;
        Ok(())
    }

    /// States the sub-pixel offset of a plane's samples, in pixels of this plane, x right, y down:
    /// a sample of pixel centre c shows the unjittered image at c + jitter.
    ///
    /// # Errors
    /// [`Error::NoPlane`] if there is no such plane.
    pub fn set_jitter(&mut self, kind: PlaneKind, jitter: [f32; 2]) -> Result<()> {
        self.planes.get_mut(kind).ok_or(Error::NoPlane { plane: kind })?.jitter = jitter;
        Ok(())
    }

    /// Leaves a plane out of this key frame. Colour cannot be left out.
    ///
    /// # Errors
    /// [`Error::Plane`] for colour.
    pub fn omit(&mut self, kind: PlaneKind) -> Result<()> {
        if kind == PlaneKind::Color {
            let (expected, found) = ("colour in every key frame".to_owned(), "none".to_owned());
            return Err(Error::Plane { plane: kind, expected, found });
        }
        self.planes.set(kind, None);
        Ok(())
    }

    /// The colour plane.
    pub fn color_mut(&mut self) -> PlaneMut<'_> {
        self.plane_mut(PlaneKind::Color).unwrap_or(PlaneMut {
            bytes: &mut [],
            width: 0,
            height: 0,
            stride: 0,
            bytes_per_pixel: 0,
        })
    }

    /// One plane; None where the stream does not have it or it was left out.
    pub fn plane_mut(&mut self, kind: PlaneKind) -> Option<PlaneMut<'_>> {
        let mut planes = self.planes_mut();
        let plane = planes.get_mut(kind)?;
        let bytes = std::mem::take(&mut plane.bytes);
        let PlaneMut { width, height, stride, bytes_per_pixel, .. } = *plane;
        Some(PlaneMut { bytes, width, height, stride, bytes_per_pixel })
    }

    /// All planes at once, to be filled on several threads or in one pass.
    pub fn planes_mut(&mut self) -> PlaneMap<PlaneMut<'_>> {
        let Self { layout, planes, memory, .. } = self;
        let mut rest: &mut [u8] = memory.as_deref_mut().unwrap_or_default();
        let mut done = 0;
        PlaneMap::from_fn(|kind| {
            let (place, plane) = (layout.places.get(kind)?, planes.get(kind)?);
            // Places of planes follow each other in the order of their kinds.
            let start = usize::try_from(plane.offset).ok()?.checked_sub(done)?;
            let len = plane.stride as usize * plane.height as usize;
            let (_, from_plane) = std::mem::take(&mut rest).split_at_mut_checked(start)?;
            let (bytes, behind) = from_plane.split_at_mut_checked(len)?;
            rest = behind;
            done += start + len;
            let PlaneDescriptor { width, height, stride, .. } = *plane;
            Some(PlaneMut { bytes, width, height, stride, bytes_per_pixel: place.bytes_per_pixel })
        })
    }
}

impl Drop for KeyFrame {
    fn drop(&mut self) {
        if let Some(memory) = self.memory.take() {
            // The stream may be gone already, and its memory goes with this slot then.
            drop(self.home.send(memory));
        }
    }
}
