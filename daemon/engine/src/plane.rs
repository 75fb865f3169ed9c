//! Two-dimensional arrays and rectangles in pixels.

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

/// Bytes that a thread finds memory for by itself, at least: half of a huge page. The system hands
/// out pages when they are first written to, each emptied first, so threads share that.
const SHARE_BYTES: usize = 1 << 20;

/// A row-major image without padding. `data.len() == width * height` holds always.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Plane<T> {
    width: u32,
    height: u32,
    data: Vec<T>,
}

impl<T: Copy + Default + Send> Plane<T> {
    /// A plane of `width` x `height` pixels, all `T::default()`.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, data: vec![T::default(); width as usize * height as usize] }
    }

    /// Changes the size, keeping the allocation where it is large enough. What the pixels are then
    /// is unspecified: write every pixel before reading it.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.width = width;
        self.height = height;
        let count = width as usize * height as usize;
        let is_in_pool = rayon::current_thread_index().is_some();
        if count > self.data.capacity() && count * size_of::<T>() >= 2 * SHARE_BYTES && is_in_pool {
            let share = SHARE_BYTES / size_of::<T>();
            self.data = Vec::new(); // first, so that there are never two
            let pixels = (0..count).into_par_iter().with_min_len(share).map(|_| T::default());
            pixels.collect_into_vec(&mut self.data);
        } else {
            self.data.resize(count, T::default());
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_its_size_whoever_finds_its_memory() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let resized = |sizes: &[[u32; 2]]| {
            let mut plane = Plane::<u32>::default();
            sizes.iter().for_each(|&[width, height]| plane.resize(width, height));
            plane
        };
        for sizes in
            [&[[1023, 512]][..], &[[1024, 512]], &[[8, 8], [1280, 720]], &[[1280, 720], [7, 5]]]
        {
            let [width, height] = sizes[sizes.len() - 1];
            let shared = pool.install(|| resized(sizes));
            assert_eq!(shared, resized(sizes), "{sizes:?}");
            assert_eq!((shared.width(), shared.height()), (width, height));
            assert_eq!(shared.data().len(), width as usize * height as usize);
        }
    }

    #[test]
    fn a_plane_that_shrinks_keeps_its_memory_for_when_it_grows_again() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let mut plane = Plane::<u32>::default();
        pool.install(|| plane.resize(1280, 720));
        let at = plane.data().as_ptr();
        pool.install(|| plane.resize(64, 64));
        pool.install(|| plane.resize(1280, 720));
        assert_eq!(plane.data().as_ptr(), at);
    }
}
