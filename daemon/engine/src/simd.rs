//! Lets the compiler use wider registers than the build's baseline.
//!
//! [`widest`] compiles a piece of work twice: for the baseline, and for AVX2, which is asked for at
//! run time. Both are the same Rust: integer and float operations mean the same in either (nothing
//! is contracted or reassociated), so the result does not depend on the processor.
//!
//! [`Simd::Portable`] takes the ways of the oldest processor on any processor, so that one machine
//! can compare both. It belongs to the threads of an engine, which do all of its work.

use std::cell::Cell;

/// Which of an engine's ways through a kernel are taken. The result does not depend on it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Simd {
    /// The widest registers that the processor has.
    #[default]
    Widest,
    /// What every processor of the architecture has. For tests.
    Portable,
}

thread_local! {
    static SIMD: Cell<Simd> = const { Cell::new(Simd::Widest) };
}

impl Simd {
    /// Makes this the choice of the calling thread.
    pub(crate) fn enter(self) {
        SIMD.set(self);
    }
}

/// Runs `work`, compiled for AVX2 where the processor has it.
///
/// Only what is inlined into `work` is compiled so: mark the closure `#[inline(always)]`.
#[inline(always)]
pub(crate) fn widest<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        // SAFETY: the processor has AVX2, asked for just above.
        return unsafe { with_avx2(work) };
    }
    work()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<R>(work: impl FnOnce() -> R) -> R {
    work()
}

/// Whether kernels of this thread may use AVX2.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn has_avx2() -> bool {
    SIMD.get() == Simd::Widest && is_x86_feature_detected!("avx2")
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use super::*;
    use crate::engine::start_pool;

    #[test]
    fn the_choice_of_an_engine_holds_on_all_of_its_threads_and_on_no_other() {
        for threads in [1, 3] {
            let threads = NonZeroUsize::new(threads).unwrap();
            for simd in [Simd::Portable, Simd::Widest] {
                let pool = start_pool(threads, simd, || ());
                let found = pool.broadcast(|_| (SIMD.get(), widest(|| SIMD.get())));
                assert_eq!(found, vec![(simd, simd); threads.get()]);
            }
        }
        assert_eq!(SIMD.get(), Simd::Widest, "this thread chose nothing");
    }

    #[test]
    #[cfg(target_arch = "x86_64")]
    fn wide_registers_are_used_where_the_processor_has_them_and_they_are_not_refused() {
        let here = is_x86_feature_detected!("avx2");
        for (simd, expected) in [(Simd::Portable, false), (Simd::Widest, here)] {
            let pool = start_pool(NonZeroUsize::MIN, simd, || ());
            assert_eq!(pool.install(has_avx2), expected, "{simd:?}");
        }
    }
}
