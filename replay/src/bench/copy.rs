//! The plain copy that everything is compared with: what the memory of this machine allows.
//!
//! It goes round in two rings, each as large as the last-level cache, so that no copy finds its
//! bytes in a cache; the same threads share it that share the engine's work.

use std::fs;
use std::num::NonZeroUsize;
use std::ops::Range;

use anyhow::Context as _;
use rayon::iter::{IndexedParallelIterator as _, ParallelIterator as _};
use rayon::slice::{ParallelSlice as _, ParallelSliceMut as _};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Bytes that one thread copies at a time.
const CHUNK: usize = 1 << 18;
/// Bytes of a ring where the system does not tell the size of its caches.
const DEFAULT_RING: usize = 64 << 20;
/// Bytes of a ring at most, for machines whose caches are those of many processors.
const MAX_RING: usize = 512 << 20;

/// Two rings of memory and the threads that copy from one to the other.
#[derive(Debug)]
pub(super) struct PlainCopy {
    pool: ThreadPool,
    from: Vec<u8>,
    to: Vec<u8>,
    next: usize,
}

impl PlainCopy {
    /// Rings that hold at least two copies of `most_bytes`.
    pub(super) fn new(threads: NonZeroUsize, most_bytes: usize) -> anyhow::Result<Self> {
        let ring = cache_bytes().unwrap_or(DEFAULT_RING).min(MAX_RING).max(2 * most_bytes);
        Self::with_ring(threads, ring)
    }

    fn with_ring(threads: NonZeroUsize, ring: usize) -> anyhow::Result<Self> {
        let pool = ThreadPoolBuilder::new().num_threads(threads.get()).build();
        let pool = pool.context("starting the threads of the plain copy")?;
        // Not zeros: the system backs pages of zeros that were never written with one page.
        Ok(Self { pool, from: vec![1; ring], to: vec![2; ring], next: 0 })
    }

    /// Copies `bytes` bytes to where no copy went for the longest time.
    pub(super) fn copy(&mut self, bytes: usize) {
        let part = self.advance(bytes);
        let (from, to) = (&self.from[part.clone()], &mut self.to[part]);
        self.pool.install(|| {
            let parts = to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK));
            parts.for_each(|(to, from)| to.copy_from_slice(from));
        });
    }

    /// The next `bytes` of the rings; from their start where too few are left, and never more than
    /// there are.
    fn advance(&mut self, bytes: usize) -> Range<usize> {
        let bytes = bytes.min(self.from.len());
        let start = if self.next + bytes > self.from.len() { 0 } else { self.next };
        self.next = start + bytes;
        start..self.next
    }
}

/// Size of the largest cache of the first processor, if the system tells.
fn cache_bytes() -> Option<usize> {
    let folder = "/sys/devices/system/cpu/cpu0/cache";
    let sizes = (0..8).filter_map(|index| {
        let text = fs::read_to_string(format!("{folder}/index{index}/size")).ok()?;
        parse_size(text.trim())
    });
    sizes.max()
}

fn parse_size(text: &str) -> Option<usize> {
    let (number, unit) = text.split_at(text.find(|c: char| !c.is_ascii_digit())?);
    let unit = match unit {
        "K" => 1 << 10,
        "M" => 1 << 20,
        _ => return None,
    };
    number.parse::<usize>().ok()?.checked_mul(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_go_round_the_ring_and_no_part_comes_again_before_all_others() {
        let mut copy = PlainCopy::with_ring(NonZeroUsize::MIN, 100).unwrap();
        let parts: Vec<_> = (0..4).map(|_| copy.advance(30)).collect();
        assert_eq!(parts, [0..30, 30..60, 60..90, 0..30]);
        assert_eq!(copy.advance(1000), 0..100, "more than the ring is the ring");
    }

    #[test]
    fn what_was_asked_for_is_copied_by_any_number_of_threads_and_nothing_else() {
        for threads in [1, 3] {
            let ring = 3 * CHUNK;
            let mut copy = PlainCopy::with_ring(NonZeroUsize::new(threads).unwrap(), ring).unwrap();
            copy.copy(CHUNK + 7);
            assert!(copy.to[..CHUNK + 7].iter().all(|&byte| byte == 1));
            assert!(copy.to[CHUNK + 7..].iter().all(|&byte| byte == 2));
        }
    }

    #[test]
    fn sizes_of_caches_are_read_as_the_kernel_writes_them() {
        assert_eq!(parse_size("32K"), Some(32768));
        assert_eq!(parse_size("8M"), Some(8 << 20));
        for text in ["", "32", "K", "8X"] {
            assert_eq!(parse_size(text), None, "`{text}`");
        }
    }
}
