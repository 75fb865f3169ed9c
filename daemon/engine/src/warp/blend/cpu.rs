//! The reference of [`super`].

use rayon::ThreadPool;

use crate::bands::for_each_row;
use crate::color::{ColorPlane, Texel};
use crate::plane::Plane;

/// Mean of `older` and `newer` into `out`; all three have the same size and format.
pub fn blend(pool: &ThreadPool, older: &ColorPlane, newer: &ColorPlane, out: &mut ColorPlane) {
    match (older, newer, out) {
        (ColorPlane::Rgba8(a), ColorPlane::Rgba8(b), ColorPlane::Rgba8(out)) => {
            mean(pool, a, b, out);
        }
        (ColorPlane::Rgb10a2(a), ColorPlane::Rgb10a2(b), ColorPlane::Rgb10a2(out)) => {
            mean(pool, a, b, out);
        }
        (ColorPlane::Rgba16f(a), ColorPlane::Rgba16f(b), ColorPlane::Rgba16f(out)) => {
            mean(pool, a, b, out);
        }
        _ => unreachable!("all keys of a stream have its format"),
    }
}

fn mean<T: Texel>(pool: &ThreadPool, older: &Plane<T>, newer: &Plane<T>, out: &mut Plane<T>) {
    for_each_row(
        pool,
        out,
        #[inline(always)]
        |y, row| {
            for ((texel, &a), &b) in row.iter_mut().zip(older.row(y)).zip(newer.row(y)) {
                *texel = T::mix(a, b, 128);
            }
        },
    );
}
