//! Why the GPU backend could not do what was asked. Each of these ends in the CPU doing it.

/// Why a GPU adapter cannot be used, or no longer.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// The adapter lacks what the kernels need.
    #[error("{adapter} lacks what the kernels need: {why}")]
    Unusable {
        /// Its name.
        adapter: String,
        /// What is missing.
        why: String,
    },
    /// The driver gave no device.
    #[error("the driver of {adapter} opened no device: {why}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// What the driver said.
        why: String,
    },
    /// The driver did not take a shader.
    #[error("shader {shader} did not compile: {why}")]
    Shader {
        /// Its file.
        shader: &'static str,
        /// What the compiler said.
        why: String,
    },
    /// A plane does not fit into what the adapter binds at once.
    #[error("a plane of {needed} bytes, where the adapter binds at most {limit}")]
    TooLarge {
        /// Bytes of the plane.
        needed: u64,
        /// Bytes that the adapter binds.
        limit: u64,
    },
    /// Its memory is used up.
    #[error("out of memory of the GPU adapter: {why}")]
    OutOfMemory {
        /// What the driver said.
        why: String,
    },
    /// The device is gone: removed, reset, or taken away.
    #[error("the GPU device was lost: {why}")]
    Lost {
        /// What the driver said.
        why: String,
    },
    /// The device refused a command.
    #[error("the GPU device refused a command: {why}")]
    Refused {
        /// What it said.
        why: String,
    },
    /// The picture could not be read back.
    #[error("the picture could not be read back from the GPU")]
    ReadBack,
    /// No answer in time: a hung device.
    #[error("no answer from the GPU within {seconds} s")]
    TimedOut {
        /// How long was waited.
        seconds: u64,
    },
}
