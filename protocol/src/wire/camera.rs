//! Cameras: two matrices of a key frame, and the pose that may follow it late.

use zerocopy::little_endian::{F32, U32, U64};

use super::Wire;
use super::check::{Check, floats, raw_floats};
use crate::error::Result;
use crate::message::MessageKind;

/// View and projection, unjittered, column-major, clip = projection * view * p.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Camera {
    /// World to view.
    pub view: [f32; 16],
    /// View to clip.
    pub projection: [f32; 16],
}

wire_struct! {
    /// See [`LateCamera`].
    LateCameraRaw, 80 {
        0 stream: U32,
        4 reserved: U32,
        8 content_time_ns: U64,
        16 view: [F32; 16],
    }
}

/// Where the camera is by now, at any time; the newest content time wins.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LateCamera {
    /// The client's number of the stream.
    pub stream: u32,
    /// Simulation time of the pose.
    pub content_time_ns: u64,
    /// World to view, column-major.
    pub view: [f32; 16],
}

impl Wire for LateCamera {
    type Raw = LateCameraRaw;
    const KIND: MessageKind = MessageKind::LateCamera;

    fn to_raw(&self) -> LateCameraRaw {
        LateCameraRaw {
            stream: U32::new(self.stream),
            reserved: U32::ZERO,
            content_time_ns: U64::new(self.content_time_ns),
            view: raw_floats(&self.view),
        }
    }

    fn from_raw(raw: &LateCameraRaw) -> Result<Self> {
        let check = Check(Self::KIND);
        check.zero("reserved", &raw.reserved)?;
        check.range("stream", u64::from(raw.stream.get()), 1, u64::from(u32::MAX))?;
        Ok(Self {
            stream: raw.stream.get(),
            content_time_ns: check.time("content_time_ns", raw.content_time_ns.get())?,
            view: matrix(check, "view", &raw.view)?,
        })
    }
}

/// A matrix whose elements are finite and which can be inverted.
pub(super) fn matrix(check: Check, field: &'static str, raw: &[F32; 16]) -> Result<[f32; 16]> {
    let matrix = floats(raw);
    if let Some(index) = matrix.iter().position(|element| !element.is_finite()) {
        let found = format!("{} in element {index}", matrix[index]);
        return check.fail(field, "16 finite numbers", found);
    }
    if determinant(&matrix.map(f64::from)) == 0.0 {
        return check.fail(field, "a matrix that can be inverted", "determinant 0");
    }
    Ok(matrix)
}

/// By 2x2 minors of the first and the last two columns (Laplace expansion). Elements of 32 bits
/// cannot overflow it.
fn determinant(m: &[f64; 16]) -> f64 {
    let minor = |columns: usize, a: usize, b: usize| {
        m[columns + a] * m[columns + 4 + b] - m[columns + b] * m[columns + 4 + a]
    };
    minor(0, 0, 1) * minor(8, 2, 3) - minor(0, 0, 2) * minor(8, 1, 3)
        + minor(0, 0, 3) * minor(8, 1, 2)
        + minor(0, 1, 2) * minor(8, 0, 3)
        - minor(0, 1, 3) * minor(8, 0, 2)
        + minor(0, 2, 3) * minor(8, 0, 1)
}
