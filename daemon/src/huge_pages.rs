//! Large buffers in huge pages, for whole programs: an allocator.
//!
//! A stream's planes take megabytes each. In pages of 4 KiB their first use costs a fault in every
//! 1024 pixels, which made the first keys of a 1280x720 stream ten times as dear as those after
//! them. Linux gives pages of 2 MiB to who asks, where `transparent_hugepage/enabled` in
//! `/sys/kernel/mm` is `madvise` or `always`; where it is `never`, pages are as small as without.
//! Where memory is in pieces, `transparent_hugepage/defrag` says whether the kernel may tidy up
//! first, while the thread that writes to a new block waits. Streams keep their blocks, so that can
//! happen to their first keys alone.
//!
//! Blocks of zeros are written to at once: large ones are not to be asked for and left unused.
//!
//! Set by the two programs, `foreframed` and `foreframe`, not by the library: an allocator is for
//! whoever owns the process to choose.

use std::alloc::{GlobalAlloc, Layout, System};

use rustix::mm::{Advice, madvise};

/// Bytes of a huge page, on x86-64 and on ARM with small pages of 4 KiB.
const HUGE_PAGE: usize = 2 << 20;
/// A huge page is filled at least so far: what a block takes is then at most a third more than what
/// was asked for.
const LEAST_FILLED: usize = HUGE_PAGE / 4 * 3;

/// The system's allocator, with huge pages for blocks of 1.5 MiB and more.
#[derive(Clone, Copy, Debug, Default)]
pub struct HugePages;

/// What is asked of the system for a block of `layout`; None for a block that gets nothing special.
/// It begins with huge pages; a rest that would not fill one is in small ones.
fn with_pages(layout: Layout) -> Option<Layout> {
    let size = match layout.size() % HUGE_PAGE {
        LEAST_FILLED.. => layout.size().checked_next_multiple_of(HUGE_PAGE)?,
        _ if layout.size() < HUGE_PAGE => return None,
        _ => layout.size(),
    };
    Layout::from_size_align(size, layout.align().max(HUGE_PAGE)).ok()
}

// SAFETY: every block comes from `System` and goes back to it with the layout that it was asked for
// with, which `with_pages` makes from the caller's alone: the same one each time. That layout is
// never smaller nor less aligned than the caller's. Nothing here unwinds.
unsafe impl GlobalAlloc for HugePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let Some(pages) = with_pages(layout) else {
            // SAFETY: the caller's promise, passed on.
            return unsafe { System.alloc(layout) };
        };
        // SAFETY: its size is not 0, as it is at least `LEAST_FILLED`.
        let block = unsafe { System.alloc(pages) };
        if !block.is_null() {
            let length = pages.size() / HUGE_PAGE * HUGE_PAGE;
            // It is a wish: without it the block is the same, in small pages.
            // SAFETY: the range is the block's own, and this advice changes no byte of it.
            unsafe { madvise(block.cast(), length, Advice::LinuxHugepage) }.ok();
        }
        block
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if with_pages(layout).is_none() {
            // SAFETY: the caller's promise, passed on.
            return unsafe { System.alloc_zeroed(layout) };
        }
        // SAFETY: the caller's promise, passed on.
        let block = unsafe { self.alloc(layout) };
        if !block.is_null() {
            // SAFETY: the block is at least `layout.size()` bytes, and nobody else's yet.
            unsafe { block.write_bytes(0, layout.size()) };
        }
        block
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: `alloc` has asked for it with this very layout.
        unsafe { System.dealloc(block, with_pages(layout).unwrap_or(layout)) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        // SAFETY: the caller promises that the size, rounded up to the alignment, is no overflow.
        let new = unsafe { Layout::from_size_align_unchecked(new_size, layout.align()) };
        match (with_pages(layout), with_pages(new)) {
            // SAFETY: both layouts are the caller's, and so is the promise.
            (None, None) => return unsafe { System.realloc(block, layout, new_size) },
            // It fits where it is.
            (Some(old), Some(new)) if old == new => return block,
            _ => {}
        }
        // SAFETY: `new_size` is not 0, as the caller promises.
        let moved = unsafe { self.alloc(new) };
        if !moved.is_null() {
            // SAFETY: two blocks of the caller's, both at least this long; then the old one goes.
            unsafe {
                moved.copy_from_nonoverlapping(block, layout.size().min(new_size));
                self.dealloc(block, layout);
            }
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn large_blocks_get_whole_pages_and_small_ones_what_they_ask_for() {
        let of = |size| with_pages(Layout::from_size_align(size, 4).unwrap());
        assert_eq!(of(LEAST_FILLED - 1), None);
        for size in [LEAST_FILLED, HUGE_PAGE - 1, HUGE_PAGE] {
            let pages = Layout::from_size_align(HUGE_PAGE, HUGE_PAGE).unwrap();
            assert_eq!(of(size), Some(pages), "{size}");
        }
        assert_eq!(of(HUGE_PAGE + 1).unwrap().size(), HUGE_PAGE + 1, "the rest in small pages");
        assert_eq!(of(HUGE_PAGE + LEAST_FILLED).unwrap().size(), 2 * HUGE_PAGE);
        let aligned = Layout::from_size_align(LEAST_FILLED, 4 * HUGE_PAGE).unwrap();
        assert_eq!(with_pages(aligned).unwrap().align(), 4 * HUGE_PAGE, "no less than asked");
        let most = Layout::from_size_align(isize::MAX as usize, 1).unwrap();
        assert_eq!(with_pages(most), None, "beyond what there is: the system says no");
    }

    proptest! {
        #[test]
        fn no_block_takes_a_third_more_than_was_asked_for(size in 1..64 * HUGE_PAGE) {
            let layout = Layout::from_size_align(size, 8).unwrap();
            let taken = with_pages(layout).unwrap_or(layout).size();
            prop_assert!(taken >= size && taken <= size + size.div_ceil(3), "{taken} for {size}");
        }
    }

    /// Sizes on both sides of every border.
    fn sizes() -> impl Strategy<Value = usize> {
        let near = |middle: usize| middle - 2..middle + 3;
        prop_oneof![
            1_usize..64,
            near(LEAST_FILLED),
            near(HUGE_PAGE),
            near(2 * HUGE_PAGE),
            1..3 * HUGE_PAGE
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        /// What lies in a block stays there however often the block changes its size.
        #[test]
        fn bytes_survive_every_change_of_size(sizes in prop::collection::vec(sizes(), 1..6)) {
            let of = |size| Layout::from_size_align(size, 16).unwrap();
            let byte = |at: usize| (at % 251) as u8;
            let mut size = sizes[0];
            // SAFETY: no size is 0, the layouts are those of the block, and only its bytes are
            // touched; it is freed once.
            unsafe {
                let mut block = HugePages.alloc_zeroed(of(size));
                let zeroed = std::slice::from_raw_parts(block, size);
                prop_assert!(zeroed.iter().all(|&byte| byte == 0));
                for new_size in sizes {
                    let bytes = std::slice::from_raw_parts_mut(block, size);
                    bytes.iter_mut().enumerate().for_each(|(at, to)| *to = byte(at));
                    block = HugePages.realloc(block, of(size), new_size);
                    prop_assert!(!block.is_null());
                    let layout = of(new_size);
                    let align = with_pages(layout).unwrap_or(layout).align();
                    prop_assert_eq!(block as usize % align, 0);
                    let kept = std::slice::from_raw_parts(block, size.min(new_size));
                    prop_assert!(kept.iter().enumerate().all(|(at, &found)| found == byte(at)));
                    size = new_size;
                }
                HugePages.dealloc(block, of(size));
            }
        }
    }
}
