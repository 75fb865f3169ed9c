//! The kernels of the pipeline, in the order in which a key and then an in-between frame meet them.
//!
//! [`KERNELS`] says for each where it lives, what runs it on the CPU, which shader does, and how
//! close the two have to come. The GPU backend takes its steps from this table, and tests that hold
//! for every kernel loop over it.

use crate::backend::shader::Shader;
use crate::fill::far_side::FAR_SIDE;
use crate::finish::compensate::COMPENSATE;
use crate::finish::pyramid::PYRAMID;
use crate::light::relight::RELIGHT;
use crate::trajectory::effective::EFFECTIVE;
use crate::warp::blend::BLEND;
use crate::warp::gather::GATHER;
use crate::warp::grid::GRID;
use crate::warp::linear::{LINEAR, PREVIOUS};
use crate::warp::resolve::{CLASSIFY, RESOLVE};
use crate::warp::scatter::{SCATTER, SOURCE};
use crate::warp::voxel::{VOXEL, VOXEL_OLDER};

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
    /// The function that runs it over whole planes on the CPU.
    pub cpu: &'static str,
    /// The same in WGSL; None where the kernel runs on the CPU whatever the backend.
    pub shader: Option<&'static Shader>,
    /// How close another implementation has to come to it.
    pub exactness: Exactness,
}

const fn exact(folder: &'static str, cpu: &'static str, shader: Option<&'static Shader>) -> Kernel {
    Kernel { folder, cpu, shader, exactness: Exactness::Exact }
}

/// Every kernel, in order. A method uses those of its own name and what it names.
pub const KERNELS: &[Kernel] = &[
    exact("trajectory/dilate_motion", "dilate_motion", None),
    exact("warp/blend", "blend", Some(&BLEND)),
    exact("warp/gather", "warp_gather", Some(&GATHER)),
    exact("warp/scatter", "update", Some(&SOURCE)),
    exact("trajectory/effective", "effective_velocity", Some(&EFFECTIVE)),
    exact("warp/scatter", "scatter", Some(&SCATTER)),
    exact("warp/resolve", "resolve", Some(&RESOLVE)),
    exact("fill/far_side", "far_side", Some(&FAR_SIDE)),
    exact("warp/resolve", "classify", Some(&CLASSIFY)),
    exact("warp/linear", "warp_linear", Some(&LINEAR)),
    exact("warp/linear", "linked_keys", Some(&PREVIOUS[0])),
    exact("warp/grid", "warp_grid", Some(&GRID)),
    exact("warp/voxel", "warp_voxel", Some(&VOXEL)),
    exact("warp/voxel", "older_part", Some(&VOXEL_OLDER)),
    exact("light", "measure", None),
    exact("light/relight", "relight", Some(&RELIGHT)),
    exact("finish/selection", "take_key", None),
    exact("finish/pyramid", "pyramid", Some(&PYRAMID)),
    exact("finish/compensate", "compensate", Some(&COMPENSATE)),
    exact("ui", "composite", None),
];

#[cfg(test)]
mod tests;
