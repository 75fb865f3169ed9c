//! The camera's path: the poses that are known, and where it goes on from the newest.
//!
//! Between poses V0, V1, V2 (world to view) at t0 < t1 < t2 the camera moves by twists in its own
//! frame, of which each is the mean over its interval:
//!
//! ```text
//! (1) x12 = log(V2 V1^-1) / (t2 - t1),  x01 alike
//! (2) al  = (x12 - x01) / ((t2 - t0) / 2)                       change of the twist
//! (3) V(t2 + s) = exp((x12 + k al (t2 - t1) / 2) s + k al s^2 / 2) V2
//! ```
//!
//! k is the order: 0 keeps the mean twist of the last interval, 1 lets it go on changing as it did,
//! 1/2 lies between. Which is best depends on who steers: a walk that speeds up is followed by 1,
//! the hand of a player or a chasing camera rather by less. Evidence decides.

mod reprojection;
mod twist;

use glam::{DMat4, Mat4};

use crate::key::Camera;
use crate::plane::Rect;
use crate::time::{MonoSpan, MonoTime};
pub use reprojection::Reprojection;
use reprojection::Unprojection;
use twist::Twist;

/// How the camera's twist is continued: k of (3).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum CameraOrder {
    /// It stays.
    #[default]
    Constant,
    /// It changes half as fast as it did.
    Damped,
    /// It changes as it did.
    Accelerated,
}

impl CameraOrder {
    /// Every order, simplest first.
    pub const ALL: [Self; 3] = [Self::Constant, Self::Damped, Self::Accelerated];

    fn factor(self) -> f64 {
        match self {
            Self::Constant => 0.0,
            Self::Damped => 0.5,
            Self::Accelerated => 1.0,
        }
    }
}

/// A camera and the content time that it is of.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Pose {
    /// Content time.
    pub time: MonoTime,
    /// The camera.
    pub camera: Camera,
}

/// Content times that differ by no more are one.
const SAME_TIME: MonoSpan = MonoSpan::from_us(2);
/// Least time to a late pose. The last bit of a view is 6e-8: over 1 ms, and then on for a key
/// interval, that is 1e-6 rad.
const CLOSEST: MonoSpan = MonoSpan::from_ms(1);
/// Poses that (1) to (3) need.
const KEPT: usize = 3;

/// The newest poses of a stream since its last cut, oldest first.
#[derive(Clone, Debug, Default)]
pub struct CameraPath {
    poses: Vec<Pose>,
}

impl CameraPath {
    /// Forgets every pose: the camera has jumped.
    pub fn cut(&mut self) {
        self.poses.clear();
    }

    /// Adds a pose. One that is not newer than the newest is no news.
    pub fn push(&mut self, pose: Pose) {
        if self.poses.last().is_some_and(|last| pose.time <= last.time + SAME_TIME) {
            return;
        }
        if self.poses.len() == KEPT {
            self.poses.remove(0);
        }
        self.poses.push(pose);
    }

    /// The newest pose.
    #[must_use]
    pub fn newest(&self) -> Option<&Pose> {
        self.poses.last()
    }

    /// The pose at a content time, if it is known.
    #[must_use]
    pub fn at(&self, time: MonoTime) -> Option<&Pose> {
        let is_same = |pose: &&Pose| pose.time - time <= SAME_TIME && time - pose.time <= SAME_TIME;
        self.poses.iter().find(is_same)
    }

    /// How the camera goes on from its newest pose (3): None with fewer than two poses, or where it
    /// turned about. With two poses every order is [`CameraOrder::Constant`].
    #[must_use]
    pub fn onward(&self, order: CameraOrder) -> Option<Onward> {
        let [before @ .., from, to] = self.poses.as_slice() else { return None };
        let (mean, span) = mean_twist(from, to)?;
        let mut onward = Onward { newest: *to, twist: mean, change: Twist::default() };
        if let Some((earlier, earlier_span)) = before.last().and_then(|pose| mean_twist(pose, from))
        {
            // (2)
            let change = mean.minus(&earlier).scale(2.0 / (span + earlier_span));
            onward.change = change.scale(order.factor());
            onward.twist = mean.plus(&onward.change.scale(0.5 * span));
        }
        Some(onward)
    }

    /// How the camera gets from its newest pose to `late`, at a constant twist, and on from there.
    /// None where they are so close in time that the rounding of their views would be a velocity.
    #[must_use]
    pub fn towards(&self, late: &Pose) -> Option<Onward> {
        let newest = self.poses.last().filter(|newest| late.time - newest.time >= CLOSEST)?;
        let (twist, _) = mean_twist(newest, late)?;
        Some(Onward { newest: *newest, twist, change: Twist::default() })
    }
}

/// (1), per second, and the seconds between.
fn mean_twist(from: &Pose, to: &Pose) -> Option<(Twist, f64)> {
    let seconds = (to.time - from.time).as_secs_f64();
    if seconds <= 0.0 {
        return None;
    }
    let twist = Twist::log(&(view(&to.camera) * view(&from.camera).inverse()))?;
    Some((twist.scale(1.0 / seconds), seconds))
}

fn view(camera: &Camera) -> DMat4 {
    Mat4::from_cols_array(&camera.view).as_dmat4()
}

/// The way of the camera after its newest pose.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Onward {
    newest: Pose,
    twist: Twist,
    change: Twist,
}

impl Onward {
    /// From the picture `valid` at the newest pose to the one `after` it.
    #[must_use]
    pub fn reprojection(&self, valid: Rect, after: MonoSpan) -> Option<Reprojection> {
        let s = after.as_secs_f64();
        let motion = self.twist.scale(s).plus(&self.change.scale(0.5 * s * s)).exp();
        let camera = &self.newest.camera;
        Reprojection::new(&Unprojection::new(camera, valid)?, &motion, camera, valid)
    }
}

/// From the picture of one camera to that of another, over the same rectangle.
#[must_use]
pub fn between(from: &Camera, to: &Camera, valid: Rect) -> Option<Reprojection> {
    let motion = view(to) * view(from).inverse();
    if !motion.is_finite() {
        return None;
    }
    Reprojection::new(&Unprojection::new(from, valid)?, &motion, to, valid)
}

#[cfg(test)]
mod tests;
