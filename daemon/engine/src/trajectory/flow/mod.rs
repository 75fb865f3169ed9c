//! Block flow: motion estimated from the pictures of the two newest keys, and from nothing else.
//!
//! For a block of 8x8 pixels of the newest key at x, the displacement D for which the older key
//! shows the same at x - D. Luma in 8 bits, found coarse to fine ([`search`]):
//!
//! ```text
//! (1) SAD(D)  = sum over the block of |L(x) - L'(x - D)|
//! (2) cost(D) = SAD(D) + SMOOTH |D - P|        P what the coarser level, or the neighbours, say
//! (3) D found to a whole pixel by (2), and below that by the least squares of L'(x - D) - L(x)
//! ```
//!
//! A block without texture costs the same wherever it goes, so that (2) leaves it with its
//! surroundings. It is believed only where it explains the block, so that whoever goes by it is
//! hardly ever worse off than with a picture that stands still ([`believe`]).
//!
//! Where a key has no motion the answer is given on cells of 4x4 pixels, each with the motion of
//! that block around it that fits it best. Where it has, only those blocks are searched that its
//! own motion fails to explain ([`failed`]): what moves over a surface, or is seen in it. Integers
//! alone, every block for itself: the number of threads changes nothing.

mod believe;
mod block;
mod cells;
mod failed;
mod glance;
mod luma;
mod own;
mod search;
mod subpixel;
#[cfg(test)]
mod tests;

use rayon::ThreadPool;

use crate::key::KeyFrame;
use crate::plane::Plane;
use crate::time::MonoTime;
use cells::Cells;
pub use failed::FailedField;
use failed::Failing;
use luma::Pyramid;
use own::Own;
use search::Search;

/// Pixels of a block, per axis.
const BLOCK: u32 = 8;
/// Pixels of a cell of the answer, per axis.
pub const CELL: u32 = 4;
/// Steps of a displacement per pixel.
pub const PER_PX: i16 = 32;

/// A displacement: newer minus older position, whole pixels of a level or 1/[`PER_PX`] pixels.
type Step = [i16; 2];

/// Finds the flow between pairs of keys of one stream, and keeps the buffers.
#[derive(Clone, Debug, Default)]
pub struct Flow {
    newest: Pyramid,
    older: Pyramid,
    /// Content time of the key that `newest` is of.
    newest_of: Option<MonoTime>,
    /// The same of `older`.
    older_of: Option<MonoTime>,
    search: Search,
    cells: Cells,
    failing: Failing,
    /// Keys that were glanced at.
    glances: u32,
}

impl Flow {
    /// Finds how the picture of `newest` moved since `older`, the key before it. Returns false
    /// where the two cannot be compared, or have too little in common to tell: nothing is known
    /// then.
    pub fn find(&mut self, pool: &ThreadPool, newest: &KeyFrame, older: &KeyFrame) -> bool {
        if !self.take_pictures(pool, newest, older) {
            return false;
        }
        self.newest.complete(pool);
        self.older.complete(pool);
        self.search.find(pool, &self.newest, &self.older, None);
        self.search.believe(pool, &self.newest, &self.older);
        if !self.search.is_believable() {
            return false;
        }
        self.cells.choose(pool, [self.newest.finest(), self.older.finest()], &self.search);
        true
    }

    /// Finds in `found` where the motion of `newest`, which points back to `older`, does not
    /// explain its picture, and what does. Little work where it does everywhere. Returns whether it
    /// does: the pictures can be compared, and no block is doubted of those whose turn it was.
    pub fn find_failed(
        &mut self,
        pool: &ThreadPool,
        newest: &KeyFrame,
        older: &KeyFrame,
        found: &mut FailedField,
    ) -> bool {
        found.clear();
        if !self.take_pictures(pool, newest, older) {
            return false;
        }
        let Self { newest: now, older: then, search, failing, .. } = self;
        let own = Own::new(newest, older);
        let times = [newest.content_time, older.content_time];
        if !failing.mark(pool, &own, [now.finest(), then.finest()], times) {
            return !failing.doubts();
        }
        now.complete(pool);
        then.complete(pool);
        failing.spread(now.levels());
        search.find(pool, now, then, Some(failing.wanted()));
        failing.keep(pool, &own, [now.finest(), then.finest()], search, found);
        false
    }

    /// Whether `newest`, in which nothing moves, shows what `older` did, as far as some rows of
    /// blocks tell, in turn from key to key.
    pub fn shows_the_same(
        &mut self,
        pool: &ThreadPool,
        newest: &KeyFrame,
        older: &KeyFrame,
    ) -> bool {
        self.glances = self.glances.wrapping_add(1);
        Self::is_comparable(newest, older) && glance::is_same(pool, newest, older, self.glances)
    }

    /// Whether two keys can be compared.
    fn is_comparable(newest: &KeyFrame, older: &KeyFrame) -> bool {
        let is_in = |key: &KeyFrame| key.valid.fits(key.color.width(), key.color.height());
        let is_alike = newest.valid == older.valid
            && newest.color.format() == older.color.format()
            && is_in(newest)
            && is_in(older);
        is_alike && newest.valid.width.min(newest.valid.height) >= 2 * BLOCK
    }

    /// Has luma of both keys. Returns false where the two cannot be compared.
    fn take_pictures(&mut self, pool: &ThreadPool, newest: &KeyFrame, older: &KeyFrame) -> bool {
        if !Self::is_comparable(newest, older) {
            (self.newest_of, self.older_of) = (None, None);
            return false;
        }
        let (of_newest, of_older) = (Some(newest.content_time), Some(older.content_time));
        if (self.newest_of, self.older_of) == (of_newest, of_older) {
            return true;
        }
        std::mem::swap(&mut self.newest, &mut self.older);
        if self.newest_of != of_older {
            self.older.update(pool, older);
        }
        self.newest.update(pool, newest);
        (self.newest_of, self.older_of) = (of_newest, of_older);
        true
    }

    /// Fills `displacement`, a field of `cells` (columns, rows) that share the picture out evenly,
    /// with what was found last: newer minus older position, pixels.
    pub fn fill(&self, cells: [u32; 2], displacement: &mut Plane<[f32; 2]>) {
        let found = self.cells.field();
        let size = [found.width(), found.height()];
        displacement.resize(cells[0], cells[1]);
        // The cell at the centre of another one.
        let at = |i: u32, axis: usize| ((2 * i + 1) * size[axis] / (2 * cells[axis])) as usize;
        for y in 0..cells[1] {
            let row = found.row(at(y, 1) as u32);
            for (x, out) in (0..).zip(displacement.row_mut(y)) {
                *out = row[at(x, 0)].map(|d| f32::from(d) / f32::from(PER_PX));
            }
        }
    }

    /// Columns and rows of the answer's own cells.
    #[must_use]
    pub fn cells(&self) -> [u32; 2] {
        [self.cells.field().width(), self.cells.field().height()]
    }
}
