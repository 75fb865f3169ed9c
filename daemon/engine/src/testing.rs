//! What the tests of several kernels share: keys made from functions, and one call per method.

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::color::{ColorFormat, ColorPlane, OrderedRgba16, Rgb10a2, Rgba8, half_to_ordered};
use crate::field::FieldMap;
use crate::key::{KeyFrame, Velocity};
use crate::method::Method;
use crate::phase::Phase;
use crate::plane::{Plane, Rect};
use crate::warp::gather::warp_gather;
use crate::warp::linear::{LinearScratch, warp_linear};

pub(crate) fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// A plane made from a function of column and row.
pub(crate) fn plane<T>(width: u32, height: u32, at: impl Fn(u32, u32) -> T) -> Plane<T> {
    let at = &at;
    let data = (0..height).flat_map(|y| (0..width).map(move |x| at(x, y))).collect();
    Plane::from_vec(width, height, data)
}

/// A velocity in pixels per span.
pub(crate) fn px(x: f32, y: f32) -> Velocity {
    let steps = |v: f32| (v * 32.0) as i16;
    Velocity { x: steps(x), y: steps(y) }
}

/// A well-mixed number of three.
pub(crate) fn hash(a: u32, b: u32, c: u32) -> u32 {
    let mut h = a.wrapping_mul(0x9e37_79b1) ^ b.wrapping_mul(0x85eb_ca77) ^ c.wrapping_mul(0xc2b2);
    for _ in 0..2 {
        h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    }
    h ^ (h >> 16)
}

/// A colour plane of noise, every channel of every pixel another value.
pub(crate) fn noise(format: ColorFormat, width: u32, height: u32, seed: u32) -> ColorPlane {
    match format {
        ColorFormat::Rgba8 => {
            ColorPlane::Rgba8(plane(width, height, |x, y| Rgba8(hash(x, y, seed))))
        }
        ColorFormat::Rgb10a2 => {
            ColorPlane::Rgb10a2(plane(width, height, |x, y| Rgb10a2(hash(x, y, seed))))
        }
        ColorFormat::Rgba16f => ColorPlane::Rgba16f(plane(width, height, |x, y| {
            // Finite halves of either sign.
            OrderedRgba16(std::array::from_fn(|channel| {
                let bits = hash(x, y, seed + channel as u32) as u16;
                half_to_ordered(if bits & 0x7c00 == 0x7c00 { bits & !0x0400 } else { bits })
            }))
        })),
    }
}

/// A key whose whole picture moves.
pub(crate) fn key(color: ColorPlane, depth: Plane<u32>, velocity: Plane<Velocity>) -> KeyFrame {
    let valid = Rect::full(color.width(), color.height());
    KeyFrame { color, valid, depth, velocity, ..KeyFrame::default() }
}

pub(crate) fn map_of(key: &KeyFrame) -> FieldMap {
    let mut map = FieldMap::default();
    map.update(key.valid, [key.velocity.width(), key.velocity.height()], key.field_offset);
    map
}

/// The frame of `key` at `phase` by a method that moves, and the scratch of `linear`.
pub(crate) fn warp(
    threads: usize,
    method: Method,
    key: &KeyFrame,
    phase: Phase,
) -> (ColorPlane, LinearScratch) {
    let (pool, map) = (pool(threads), map_of(key));
    let mut out = ColorPlane::new(key.color.format(), key.color.width(), key.color.height());
    let mut scratch = LinearScratch::default();
    match method {
        Method::Gather => warp_gather(&pool, key, &map, phase, &mut out),
        Method::Linear => {
            scratch.take_key(&pool, key);
            warp_linear(&pool, key, &[], &map, phase, &mut scratch, &mut out);
        }
        _ => panic!("{method} has tests of its own"),
    }
    (out, scratch)
}

/// The pixels of an rgba8 plane.
pub(crate) fn words(color: &ColorPlane) -> Plane<u32> {
    match color {
        ColorPlane::Rgba8(plane) => Plane::from_vec(
            plane.width(),
            plane.height(),
            plane.data().iter().map(|texel| texel.0).collect(),
        ),
        other => panic!("not rgba8 but {:?}", other.format()),
    }
}
