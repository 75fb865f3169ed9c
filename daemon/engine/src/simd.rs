//! Lets the compiler use wider registers than the build's baseline.
//!
//! [`widest`] compiles a piece of work twice: for the baseline, and for AVX2, which is asked for at
//! run time. Both are the same Rust: integer and float operations mean the same in either (nothing
//! is contracted or reassociated), so the result does not depend on the processor.

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

/// Whether kernels may use AVX2.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
}
