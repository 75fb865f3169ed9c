//! The GPU adapters that tests run on, the software ones among them.
//!
//! A machine without any driver skips such tests: each says so on standard error, with a count. The
//! variable [`REQUIRED`] names adapters that have to be there, and then nothing is skipped.

use std::collections::BTreeSet;
use std::env;
use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use super::{Gpu, GpuAdapter, adapters};

/// Environment variable: names of adapters, or parts of them, with commas between.
pub const REQUIRED: &str = "FOREFRAME_REQUIRE_ADAPTERS";

/// Every usable adapter of the machine, for `test`. Empty where there is none: the test then
/// returns, and has been reported as skipped.
///
/// # Panics
/// If an adapter that [`REQUIRED`] names is missing.
#[must_use]
pub fn test_adapters(test: &str) -> Vec<GpuAdapter> {
    static SKIPPED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut found = adapters();
    found.retain(|adapter| adapter.facts.unusable.is_none());
    let required = env::var(REQUIRED).unwrap_or_default();
    for name in required.split(',').filter(|name| !name.is_empty()) {
        let is_it =
            |adapter: &GpuAdapter| adapter.facts.name.to_lowercase().contains(&name.to_lowercase());
        assert!(found.iter().any(is_it), "{REQUIRED} names {name}, which is not among {found:?}");
    }
    if found.is_empty() {
        let mut skipped = SKIPPED.lock().unwrap_or_else(PoisonError::into_inner);
        if skipped.insert(test.to_owned()) {
            let count = skipped.len();
            // Straight to the stream: the test runner swallows what tests print.
            let said = writeln!(io::stderr(), "skipped ({count}): {test}: no GPU adapter");
            drop(said);
        }
    }
    found
}

/// [`test_adapters`], opened.
///
/// # Panics
/// If one of them does not open.
#[must_use]
pub fn test_gpus(test: &str) -> Vec<Arc<Gpu>> {
    let opened = test_adapters(test).into_iter().map(|adapter| Gpu::open(&adapter));
    opened.map(|gpu| gpu.expect("a usable adapter opens")).collect()
}
