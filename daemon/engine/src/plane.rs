//! Two-dimensional arrays and rectangles in pixels.

/// A row-major image without padding. `data.len() == width * height` holds always.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Plane<T> {
    width: u32,
    height: u32,
    data: Vec<T>,
}

impl<T: Copy + Default> Plane<T> {
    /// A plane of `width` x `height` pixels, all `T::default()`.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, data: vec![T::default(); width as usize * height as usize] }
    }

    /// Changes the size, keeping the allocation where it is large enough. Contents become default
    /// only where the plane grew: write every pixel before reading it.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.width = width;
        self.height = height;
        self.data.resize(width as usize * height as usize, T::default());
    }

    /// Takes on the pixels and size of `other`, keeping the allocation where it is large enough.
    pub fn copy_from(&mut self, other: &Self) {
        self.resize(other.width, other.height);
        self.data.copy_from_slice(&other.data);
    }
}

impl<T> Plane<T> {
    /// A plane over existing pixels.
    ///
    /// # Panics
    /// If `data` does not have `width * height` pixels.
    #[must_use]
    pub fn from_vec(width: u32, height: u32, data: Vec<T>) -> Self {
        assert_eq!(data.len(), width as usize * height as usize, "a plane of {width}x{height}");
        Self { width, height, data }
    }

    /// Pixels per row.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row by row.
    #[must_use]
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All pixels, row by row.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Row `y`, counted from the top.
    #[must_use]
    pub fn row(&self, y: u32) -> &[T] {
        let width = self.width as usize;
        &self.data[y as usize * width..][..width]
    }

    /// Row `y`, counted from the top.
    pub fn row_mut(&mut self, y: u32) -> &mut [T] {
        let width = self.width as usize;
        &mut self.data[y as usize * width..][..width]
    }
}

impl<T: Copy> Plane<T> {
    /// The pixel in column `x` of row `y`.
    #[must_use]
    pub fn at(&self, x: u32, y: u32) -> T {
        self.data[y as usize * self.width as usize + x as usize]
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
