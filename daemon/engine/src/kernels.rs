//! The kernels of the pipeline, in the order in which a key and then an in-between frame meet them.
//!
//! Tests that hold for every kernel loop over [`KERNELS`]: the names are unique, and each kernel
//! has its folder.

/// How close two implementations of a kernel have to come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Exactness {
    /// The same bits everywhere: integers, or floats whose every operation is fixed.
    Exact,
}

/// One kernel.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// Its folder, below `src`.
    pub folder: &'static str,
    /// The function of its `cpu.rs` that runs it over whole planes.
    pub cpu: &'static str,
    /// How close another implementation has to come to it.
    pub exactness: Exactness,
}

const fn exact(folder: &'static str, cpu: &'static str) -> Kernel {
    Kernel { folder, cpu, exactness: Exactness::Exact }
}

/// Every kernel, in order. A method uses those of its own name and what it names.
pub const KERNELS: &[Kernel] = &[
    exact("trajectory/dilate_motion", "dilate_motion"),
    exact("warp/blend", "blend"),
    exact("warp/gather", "warp_gather"),
    exact("warp/scatter", "scatter"),
    exact("warp/resolve", "resolve"),
    exact("fill/far_side", "far_side"),
    exact("warp/resolve", "classify"),
    exact("warp/linear", "warp_linear"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::fs;
    use std::path::Path;

    #[test]
    fn every_kernel_is_where_the_table_says_and_no_name_comes_twice() {
        let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut names = BTreeSet::new();
        for kernel in KERNELS {
            let cpu = fs::read_to_string(src.join(kernel.folder).join("cpu.rs")).unwrap();
            assert!(cpu.contains(&format!("pub fn {}(", kernel.cpu)), "{kernel:?}");
            let header = fs::read_to_string(src.join(kernel.folder).join("mod.rs")).unwrap();
            assert!(header.contains("Exactness:"), "{kernel:?} declares no exactness");
            assert!(names.insert(kernel.cpu), "{kernel:?} comes twice");
        }
    }
}
