//! Lets the compiler use wider registers than the build's baseline.
//!
//! [`widest`] compiles a piece of work twice: for the baseline, and for AVX2, which is asked for at
//! run time. Both are the same Rust: integer and float operations mean the same in either (nothing
//! is contracted or reassociated), so the result does not depend on the processor. A few kernels
//! are written for a kind of registers by hand, some for AVX-512 as well: by itself the compiler
//! gains nothing by those.
//!
//! [`Simd::Portable`] takes the ways of the oldest processor on any processor, so that one machine
//! can compare all. It belongs to the threads of an engine, which do all of its work.

use std::cell::Cell;

/// Which of an engine's ways through a kernel are taken. The result does not depend on it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Simd {
    /// The widest registers that the processor has.
    #[default]
    Widest,
    /// AVX2 at most. For tests.
    Avx2,
    /// What every processor of the architecture has. For tests.
    Portable,
}

thread_local! {
    static SIMD: Cell<Simd> = const { Cell::new(Simd::Widest) };
}

impl Simd {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Widest, Self::Avx2, Self::Portable];

    /// What the widest registers are that kernels use on this processor, for people.
    #[must_use]
    pub fn widest_registers() -> &'static str {
        #[cfg(target_arch = "x86_64")]
        {
            let names = [(has_avx512(), "AVX-512"), (has_avx2(), "AVX2"), (true, "SSE2")];
            names.into_iter().find_map(|(has, name)| has.then_some(name)).unwrap_or_default()
        }
        #[cfg(not(target_arch = "x86_64"))]
        "what the compiler does"
    }

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
    SIMD.get() != Simd::Portable && is_x86_feature_detected!("avx2")
}

/// Whether kernels of this thread may use AVX-512, with 16-bit lanes and their dot products
/// (2019 on).
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn has_avx512() -> bool {
    SIMD.get() == Simd::Widest
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512vnni")
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
            for simd in Simd::ALL {
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
        let avx2 = is_x86_feature_detected!("avx2");
        let avx512 = is_x86_feature_detected!("avx512bw") && is_x86_feature_detected!("avx512vnni");
        for (simd, expected) in [
            (Simd::Portable, [false, false]),
            (Simd::Avx2, [avx2, false]),
            (Simd::Widest, [avx2, avx512]),
        ] {
            let pool = start_pool(NonZeroUsize::MIN, simd, || ());
            let found = pool.install(|| [has_avx2(), has_avx512()]);
            assert_eq!(found, expected, "{simd:?}");
        }
    }
}
