//! The naive baseline: the plain mean of two keys.
//!
//! ```text
//! (1) out(x) = (older(x) + newer(x)) / 2, rounded half up, in the encoded domain
//! ```
//!
//! A mean of weight 1/2 at every content time strictly between the keys, as frame-averaging
//! converters do it; whoever wants a cross-fade does not want a baseline. Interpolates: it needs
//! the key after the content time. Exactness: `Exact`.

mod cpu;
mod gpu;

pub use cpu::blend;
pub use gpu::BLEND;
