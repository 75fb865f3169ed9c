//! Planes of a key frame: which there are, and where and how large each one is in its slot.

use std::fmt;

use crate::error::{Error, Result};
use crate::limits::{MAX_JITTER_PX, MAX_PLANE_RATIO, MAX_SIZE, MAX_STRIDE, OFFSET_ALIGN};

wire_enum! {
    /// What a plane shows. The code is its place in every table of planes.
    PlaneKind {
        /// The rendered picture. Every key frame has it.
        Color = 0 "color",
        /// Distance from the camera.
        Depth = 1 "depth",
        /// Displacement of each surface point since `motion_from_ns`.
        Motion = 2 "motion",
        /// User interface, premultiplied, composited last and never warped.
        Ui = 3 "ui",
        /// Class of each pixel.
        Mask = 4 "mask",
    }
}

impl PlaneKind {
    /// How many kinds there are.
    pub const COUNT: usize = 5;

    const fn index(self) -> usize {
        self.code() as usize
    }

    /// Its bit in a set of planes.
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self.code()
    }
}

/// At most one `T` per kind of plane.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PlaneMap<T>([Option<T>; PlaneKind::COUNT]);

impl<T> Default for PlaneMap<T> {
    fn default() -> Self {
        Self(Default::default())
    }
}

impl<T> PlaneMap<T> {
    /// What `make` gives for each kind, called in the order of the codes.
    pub fn from_fn(mut make: impl FnMut(PlaneKind) -> Option<T>) -> Self {
        Self(std::array::from_fn(|index| make(PlaneKind::ALL[index])))
    }

    /// As [`from_fn`](Self::from_fn); stops at the first error.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn try_from_fn<E>(
        mut make: impl FnMut(PlaneKind) -> std::result::Result<Option<T>, E>,
    ) -> std::result::Result<Self, E> {
        let mut map = Self::default();
        for &kind in PlaneKind::ALL {
            map.0[kind.index()] = make(kind)?;
        }
        Ok(map)
    }

    /// The entry of this kind.
    #[must_use]
    pub fn get(&self, kind: PlaneKind) -> Option<&T> {
        self.0[kind.index()].as_ref()
    }

    /// The entry of this kind.
    pub fn get_mut(&mut self, kind: PlaneKind) -> Option<&mut T> {
        self.0[kind.index()].as_mut()
    }

    /// Sets or clears the entry of this kind.
    pub fn set(&mut self, kind: PlaneKind, value: Option<T>) {
        self.0[kind.index()] = value;
    }

    /// The entries that are there, in the order of the codes.
    pub fn iter(&self) -> impl Iterator<Item = (PlaneKind, &T)> {
        PlaneKind::ALL.iter().filter_map(|&kind| Some((kind, self.get(kind)?)))
    }

    /// Bits of the kinds that are there.
    #[must_use]
    pub fn bits(&self) -> u32 {
        self.iter().map(|(kind, _)| kind.bit()).sum()
    }
}

/// Columns and rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PlaneSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl fmt::Display for PlaneSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// A rectangle of pixels: columns `x..x + width`, rows `y..y + height`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Rect {
    /// The rectangle that covers a whole plane of this size.
    #[must_use]
    pub fn full(width: u32, height: u32) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Whether it is not empty and lies inside a plane of this size.
    #[must_use]
    pub fn fits(&self, width: u32, height: u32) -> bool {
        let right = u64::from(self.x) + u64::from(self.width);
        let bottom = u64::from(self.y) + u64::from(self.height);
        self.width > 0
            && self.height > 0
            && right <= u64::from(width)
            && bottom <= u64::from(height)
    }
}

impl fmt::Display for Rect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{} at {}, {}", self.width, self.height, self.x, self.y)
    }
}

/// Where one plane of a key frame lies, and which part of it holds the image.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlaneDescriptor {
    /// Bytes from the start of the slot to the first row.
    pub offset: u64,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next.
    pub stride: u32,
    /// The part that holds the image.
    pub valid: Rect,
    /// Sub-pixel offset of the samples, in pixels of this plane, x right, y down: a sample of
    /// pixel centre c shows the unjittered image at c + jitter. Within +-1.
    pub jitter: [f32; 2],
}

impl PlaneDescriptor {
    /// A plane without padding or jitter that is valid everywhere.
    #[must_use]
    pub fn packed(offset: u64, size: PlaneSize, bytes_per_pixel: u32) -> Self {
        let PlaneSize { width, height } = size;
        Self {
            offset,
            width,
            height,
            stride: width.saturating_mul(bytes_per_pixel),
            valid: Rect::full(width, height),
            jitter: [0.0; 2],
        }
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> PlaneSize {
        PlaneSize { width: self.width, height: self.height }
    }

    /// Bytes from `offset` to the end of the last row, whose padding is not counted. Cannot
    /// overflow once [`check`](Self::check) has passed; saturates before.
    #[must_use]
    pub fn byte_len(&self, bytes_per_pixel: u32) -> u64 {
        let rows_before = u64::from(self.height.saturating_sub(1));
        let last_row = u64::from(self.width) * u64::from(bytes_per_pixel);
        (rows_before * u64::from(self.stride)).saturating_add(last_row)
    }

    /// The first property that no stream allows: name, what it has to be, what it is.
    pub(crate) fn first_fault(&self) -> Option<(&'static str, String, String)> {
        let Self { offset, width, height, stride, valid, jitter } = *self;
        let sizes = 1..=MAX_SIZE;
        if !sizes.contains(&width) || !sizes.contains(&height) {
            let expected = format!("1x1 to {MAX_SIZE}x{MAX_SIZE} pixels");
            return Some(("size", expected, self.size().to_string()));
        }
        if stride > MAX_STRIDE {
            return Some(("stride", format!("at most {MAX_STRIDE} bytes"), stride.to_string()));
        }
        if !offset.is_multiple_of(OFFSET_ALIGN) {
            return Some(("offset", format!("a multiple of {OFFSET_ALIGN}"), offset.to_string()));
        }
        if !valid.fits(width, height) {
            let expected = format!("a rectangle inside {width}x{height}");
            return Some(("valid", expected, valid.to_string()));
        }
        let within = |offset: f32| offset.abs() <= MAX_JITTER_PX;
        if !jitter.into_iter().all(within) {
            let expected = format!("within +-{MAX_JITTER_PX} pixels");
            return Some(("jitter", expected, format!("{}, {}", jitter[0], jitter[1])));
        }
        None
    }

    /// Checks everything that needs the stream: size against the declared maximum and against the
    /// colour plane, stride against the pixel size, place against the slot.
    ///
    /// # Errors
    /// [`Error::Plane`] with the first property that does not fit.
    pub fn check(
        &self,
        kind: PlaneKind,
        bytes_per_pixel: u32,
        max_size: PlaneSize,
        color: PlaneSize,
        slot_bytes: u64,
    ) -> Result<()> {
        let fault =
            |field, expected, found| Err(Error::Plane { plane: kind, field, expected, found });
        if let Some((field, expected, found)) = self.first_fault() {
            return fault(field, expected, found);
        }
        let size = self.size();
        if size.width > max_size.width || size.height > max_size.height {
            return fault("size", format!("at most {max_size} as declared"), size.to_string());
        }
        let is_within_ratio =
            |plane: u32, color: u32| plane <= color && plane >= (color / MAX_PLANE_RATIO).max(1);
        if kind != PlaneKind::Ui
            && !(is_within_ratio(size.width, color.width)
                && is_within_ratio(size.height, color.height))
        {
            let expected = format!("1/{MAX_PLANE_RATIO} to 1/1 of colour's {color} per axis");
            return fault("size", expected, size.to_string());
        }
        let row_bytes = size.width * bytes_per_pixel;
        if self.stride < row_bytes || !self.stride.is_multiple_of(bytes_per_pixel) {
            let expected = format!("at least {row_bytes}, a multiple of {bytes_per_pixel}");
            return fault("stride", expected, self.stride.to_string());
        }
        match self.offset.checked_add(self.byte_len(bytes_per_pixel)) {
            Some(end) if end <= slot_bytes => Ok(()),
            end => {
                let found = end.map_or_else(|| "more than 2^64".to_owned(), |end| end.to_string());
                fault("end", format!("at most {slot_bytes}, the bytes of a slot"), found)
            }
        }
    }
}
