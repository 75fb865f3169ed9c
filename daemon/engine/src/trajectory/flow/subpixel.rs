//! Below a pixel: least squares by the gradient of the newest picture.
//!
//! With g the gradient of L, and r = L'(x - D) - L(x) over a block, L'(x - D) shows what L shows at
//! x + e, so that r = g e:
//!
//! ```text
//! (4) (sum g g^T + DAMPING) e = sum g r        D <- D + e
//! ```
//!
//! Damped, so that along an edge, where e is anybody's guess, it stays what it was. A step that
//! leaves more of (1) is not taken.

use super::luma::Level;
use super::own::{Mask, in_any_light};
use super::{BLOCK, PER_PX, Step};

/// Steps of (4).
const ITERATIONS: usize = 3;
/// DAMPING of (4): that of a difference of four steps of luma over every pixel, which noise may
/// make.
const DAMPING: i64 = 64 * 16;
/// Most that D moves to a side in one step, and farthest from where it began, Q8 pixels.
const MOST: i32 = 256;

/// A step of the answer in Q8.
const Q8_STEP: i32 = 256 / PER_PX as i32;

const SIDE: usize = BLOCK as usize;

/// A block of the newest picture, with twice its gradient.
struct Template {
    luma: [[i32; SIDE]; SIDE],
    across: [[i32; SIDE]; SIDE],
    down: [[i32; SIDE]; SIDE],
}

impl Template {
    #[inline(always)]
    fn new(now: &Level, [x, y]: [i32; 2]) -> Self {
        let none = [[0; SIDE]; SIDE];
        let mut of = Self { luma: none, across: none, down: none };
        for row in 0..SIDE {
            let y = y + row as i32;
            let (above, own, below) = (
                now.run::<SIDE>(x, y - 1),
                now.run::<{ SIDE + 2 }>(x - 1, y),
                now.run::<SIDE>(x, y + 1),
            );
            for i in 0..SIDE {
                of.luma[row][i] = i32::from(own[i + 1]);
                of.across[row][i] = i32::from(own[i + 2]) - i32::from(own[i]);
                of.down[row][i] = i32::from(below[i]) - i32::from(above[i]);
            }
        }
        of
    }

    /// r of (4), 1/16 steps of luma, where the older picture is read `d` (Q8) before.
    #[inline(always)]
    fn residual(&self, then: &Level, at: [i32; 2], d: [i32; 2]) -> [[i32; SIDE]; SIDE] {
        let from = [(at[0] << 8) - d[0], (at[1] << 8) - d[1]];
        let (x, y) = (from[0] >> 8, from[1] >> 8);
        let (fx, fy) = (from[0] & 0xff, from[1] & 0xff);
        let mut r = [[0; SIDE]; SIDE];
        for (row, (r, shown)) in (0..).zip(r.iter_mut().zip(&self.luma)) {
            let upper = then.run::<{ SIDE + 1 }>(x, y + row);
            let lower = then.run::<{ SIDE + 1 }>(x, y + row + 1);
            for i in 0..SIDE {
                let across = |row: &[u8; SIDE + 1]| {
                    i32::from(row[i]) * (256 - fx) + i32::from(row[i + 1]) * fx
                };
                let luma = (across(upper) >> 4) * (256 - fy) + (across(lower) >> 4) * fy;
                r[i] = (luma >> 8) - 16 * shown[i];
            }
        }
        r
    }
}

/// (1), in whole steps.
#[inline(always)]
fn error(r: &[[i32; SIDE]; SIDE]) -> u32 {
    r.as_flattened().iter().map(|r| r.unsigned_abs()).sum::<u32>() >> 4
}

/// What `step`, which [`refine`] found, leaves of (1), without the mean, where the block at `at`
/// counts.
pub(super) fn error_of([now, then]: [&Level; 2], at: [i32; 2], step: Step, counts: &Mask) -> u32 {
    let r = Template::new(now, at).residual(then, at, step.map(|d| i32::from(d) * Q8_STEP));
    in_any_light(&r, counts)
}

/// Takes the block at `at` from `step` whole pixels on to 1/32 pixels, and says what of (1) is
/// left.
pub(super) fn refine([now, then]: [&Level; 2], at: [i32; 2], step: Step) -> (Step, u32) {
    let start = step.map(|d| i32::from(d) << 8);
    let template = Template::new(now, at);
    let mut d = start;
    let mut r = template.residual(then, at, d);
    let mut left = error(&r);
    let sum = |a: &[[i32; SIDE]; SIDE], b: &[[i32; SIDE]; SIDE]| {
        let products = a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b);
        i64::from(products.sum::<i32>())
    };
    let (xx, xy, yy) = (
        sum(&template.across, &template.across) + DAMPING,
        sum(&template.across, &template.down),
        sum(&template.down, &template.down) + DAMPING,
    );
    let determinant = xx * yy - xy * xy;
    for _ in 0..ITERATIONS {
        let (x, y) = (sum(&template.across, &r), sum(&template.down, &r));
        // Gradients are doubled, r is in sixteenths: 2 / 16 pixels, in Q8.
        let part = |numerator: i64| {
            i32::try_from(32 * numerator / determinant).map_or(0, |e| e.clamp(-MOST, MOST))
        };
        let e = [part(yy * x - xy * y), part(xx * y - xy * x)];
        let next =
            [0, 1].map(|axis| (d[axis] + e[axis]).clamp(start[axis] - MOST, start[axis] + MOST));
        let from = [0, 1].map(|axis| at[axis] - (next[axis] >> 8));
        if next == d || !then.has_block(from) {
            break;
        }
        let rest = template.residual(then, at, next);
        let error = error(&rest);
        if error >= left {
            break;
        }
        (d, r, left) = (next, rest, error);
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the reach of all levels is below 1023 pixels"
    )]
    let steps = d.map(|d| (d + Q8_STEP / 2).div_euclid(Q8_STEP) as i16);
    (steps, left)
}
