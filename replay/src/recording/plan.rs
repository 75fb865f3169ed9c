//! Which frames of a recording are keys, which are predicted, and where each key's motion is from.
//!
//! Every N-th frame from frame 0 is a key; all others between the first and the last key are
//! predicted. A key inherits the cut flag of any frame since the last key. Frames from a cut to the
//! next key are left out: no method can know of them. Motion from one key to the next is the
//! recording's own where it has that step, else it is composed from the fields of the frames
//! between, and a cut key has none. Where every frame is a key, each keeps the motion that was
//! recorded with it, whose span says by itself when a key before it was lost.

use std::num::NonZeroUsize;
use std::ops::Range;

use foreframe_engine::{MonoSpan, MonoTime};

use super::FrameHead;

/// Content times that differ by no more are one: side-cars round to microseconds.
const SAME_TIME: MonoSpan = MonoSpan::from_us(1);

/// Where the motion of a key comes from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum MotionSource {
    /// This motion plane of the key itself.
    Own {
        /// Which one.
        plane: usize,
    },
    /// The fields of the key and of the frames before it, newest first: frame, motion plane.
    /// Each points back to the next one's content time, the last one to the previous key's.
    Composed {
        /// At least two.
        path: Vec<(usize, usize)>,
    },
    /// Nowhere: the key is a cut, or the recording does not tell.
    None,
}

/// A frame that the engine gets.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PlannedKey {
    /// Which frame of the recording it is.
    pub frame: usize,
    /// Whether a cut lies between it and the previous key, or on it.
    pub is_cut: bool,
    /// Where its motion comes from.
    pub motion: MotionSource,
}

/// A recording, divided into keys and frames to predict.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Plan {
    /// Frames from one key to the next.
    pub ratio: NonZeroUsize,
    /// The keys, in order.
    pub keys: Vec<PlannedKey>,
    heads_cut: Vec<bool>,
}

impl Plan {
    /// Plans a recording with these frames.
    #[must_use]
    pub fn new(heads: &[FrameHead], ratio: NonZeroUsize) -> Self {
        let keys = (0..heads.len()).step_by(ratio.get()).map(|frame| {
            let since = (frame + 1).saturating_sub(ratio.get());
            let is_cut = heads[since..=frame].iter().any(|head| head.is_cut);
            let motion = match frame.checked_sub(ratio.get()) {
                _ if is_cut => MotionSource::None,
                _ if ratio.get() == 1 => as_recorded(&heads[frame]),
                Some(previous) => motion_between(heads, previous, frame),
                None => first_motion(heads, ratio),
            };
            PlannedKey { frame, is_cut, motion }
        });
        let heads_cut = heads.iter().map(|head| head.is_cut).collect();
        Self { ratio, keys: keys.collect(), heads_cut }
    }

    /// Frames to predict from key number `key`: those before the next key, up to a cut.
    /// Empty for the last key.
    #[must_use]
    pub fn predicted(&self, key: usize) -> Range<usize> {
        let between = self.between(key);
        let cut = between.clone().find(|frame| self.heads_cut[*frame]);
        between.start..cut.unwrap_or(between.end)
    }

    /// How many frames after key number `key` are left out: those from a cut to the next key.
    #[must_use]
    pub fn left_out(&self, key: usize) -> usize {
        self.between(key).len() - self.predicted(key).len()
    }

    fn between(&self, key: usize) -> Range<usize> {
        let start = self.keys[key].frame + 1;
        start..self.keys.get(key + 1).map_or(start, |next| next.frame)
    }
}

fn is_same_time(a: MonoTime, b: MonoTime) -> bool {
    let apart = a - b;
    apart <= SAME_TIME && -apart <= SAME_TIME
}

/// The motion plane of `head` that points back to `from`.
fn plane_from(head: &FrameHead, from: MonoTime) -> Option<usize> {
    head.motions.iter().position(|motion_from| is_same_time(*motion_from, from))
}

fn as_recorded(head: &FrameHead) -> MotionSource {
    if head.motions.is_empty() { MotionSource::None } else { MotionSource::Own { plane: 0 } }
}

fn motion_between(heads: &[FrameHead], previous: usize, key: usize) -> MotionSource {
    if let Some(plane) = plane_from(&heads[key], heads[previous].content_time) {
        return MotionSource::Own { plane };
    }
    let step =
        |frame: usize| Some((frame, plane_from(&heads[frame], heads[frame - 1].content_time)?));
    let path: Option<Vec<_>> = (previous + 1..=key).rev().map(step).collect();
    path.map_or(MotionSource::None, |path| MotionSource::Composed { path })
}

/// The first key has no key before it, but it has its own motion: of its planes the one that
/// points back by what comes nearest to one key interval.
fn first_motion(heads: &[FrameHead], ratio: NonZeroUsize) -> MotionSource {
    let first = &heads[0];
    let interval = heads
        .get(ratio.get())
        .map_or(MonoSpan::ZERO, |next| next.content_time - first.content_time);
    let off_by = |from: &MonoTime| {
        let off = first.content_time - *from - interval;
        off.max(-off)
    };
    let usable = first.motions.iter().enumerate().filter(|(_, from)| **from < first.content_time);
    let nearest = usable.min_by_key(|(_, from)| off_by(from));
    nearest.map_or(MotionSource::None, |(plane, _)| MotionSource::Own { plane })
}

#[cfg(test)]
mod tests {
    use super::*;

    const INTERVAL: MonoSpan = MonoSpan::from_us(8_333);

    fn time(frame: i64) -> MonoTime {
        MonoTime::from_ns(1_000_000_000) + INTERVAL.scale(frame, 1)
    }

    /// Frames of which `motions` says how many frames each motion plane points back.
    fn heads(count: i64, motions: impl Fn(i64) -> Vec<i64>, cuts: &[i64]) -> Vec<FrameHead> {
        (0..count)
            .map(|frame| FrameHead {
                content_time: time(frame),
                arrived_at: time(frame),
                is_cut: cuts.contains(&frame),
                motions: motions(frame).into_iter().map(|back| time(frame - back)).collect(),
            })
            .collect()
    }

    fn plan(heads: &[FrameHead], ratio: usize) -> Plan {
        Plan::new(heads, NonZeroUsize::new(ratio).unwrap())
    }

    fn frames(plan: &Plan) -> Vec<usize> {
        plan.keys.iter().map(|key| key.frame).collect()
    }

    #[test]
    fn every_nth_frame_is_a_key_and_all_others_up_to_the_last_key_are_predicted() {
        let plan = plan(&heads(51, |_| vec![], &[]), 4);
        assert_eq!(frames(&plan), (0..=48).step_by(4).collect::<Vec<_>>());
        let predicted: Vec<_> = (0..plan.keys.len()).flat_map(|key| plan.predicted(key)).collect();
        let expected: Vec<_> = (0..48).filter(|frame| frame % 4 != 0).collect();
        assert_eq!(predicted, expected, "frames after the last key are not predicted");
        assert_eq!((0..plan.keys.len()).map(|key| plan.left_out(key)).sum::<usize>(), 0);
    }

    #[test]
    fn motion_of_the_key_step_is_preferred_to_composing() {
        let plan = plan(&heads(9, |_| vec![1, 3, 4], &[]), 4);
        assert_eq!(plan.keys[1].motion, MotionSource::Own { plane: 2 });
        assert_eq!(plan.keys[2].motion, MotionSource::Own { plane: 2 });
    }

    #[test]
    fn without_the_key_step_motion_is_composed_along_the_frames_between() {
        let plan = plan(&heads(7, |frame| if frame == 5 { vec![3, 1] } else { vec![1] }, &[]), 3);
        let path = vec![(6, 0), (5, 1), (4, 0)];
        assert_eq!(plan.keys[2].motion, MotionSource::Composed { path });
    }

    #[test]
    fn a_key_with_a_hole_in_its_path_has_no_motion() {
        let plan = plan(&heads(9, |frame| if frame == 6 { vec![] } else { vec![1] }, &[]), 4);
        assert!(matches!(plan.keys[1].motion, MotionSource::Composed { .. }));
        assert_eq!(plan.keys[2].motion, MotionSource::None);
    }

    #[test]
    fn the_first_key_uses_its_own_motion_nearest_to_the_key_interval() {
        let of = |motions: Vec<i64>| {
            let first = move |frame| if frame == 0 { motions.clone() } else { vec![] };
            plan(&heads(5, first, &[]), 4).keys[0].motion.clone()
        };
        assert_eq!(of(vec![1, 3, 4]), MotionSource::Own { plane: 2 });
        assert_eq!(of(vec![1]), MotionSource::Own { plane: 0 });
        assert_eq!(of(vec![0]), MotionSource::None, "no time passes in that plane");
        assert_eq!(of(vec![]), MotionSource::None);
    }

    #[test]
    fn frames_from_a_cut_to_the_next_key_are_left_out_and_the_key_inherits_the_cut() {
        let plan = plan(&heads(13, |_| vec![1, 4], &[6]), 4);
        assert_eq!(plan.predicted(1), 5..6);
        assert_eq!(plan.left_out(1), 2);
        assert_eq!(
            plan.keys.iter().map(|k| k.is_cut).collect::<Vec<_>>(),
            [false, false, true, false]
        );
        assert_eq!(plan.keys[2].motion, MotionSource::None, "a cut key's own motion is not used");
        assert_eq!(plan.keys[3].motion, MotionSource::Own { plane: 1 });
    }

    #[test]
    fn a_cut_on_a_key_leaves_nothing_out() {
        let plan = plan(&heads(9, |_| vec![4], &[4]), 4);
        assert_eq!((plan.predicted(0), plan.left_out(0)), (1..4, 0));
        assert_eq!((plan.predicted(1), plan.left_out(1)), (5..8, 0));
        assert!(plan.keys[1].is_cut && !plan.keys[2].is_cut);
        assert_eq!(plan.keys[1].motion, MotionSource::None);
    }

    #[test]
    fn a_cut_on_the_last_frame_before_a_key_leaves_that_frame_out_alone() {
        let plan = plan(&heads(9, |_| vec![4], &[3]), 4);
        assert_eq!((plan.predicted(0), plan.left_out(0)), (1..3, 1));
        assert!(plan.keys[1].is_cut && !plan.keys[2].is_cut);
    }

    #[test]
    fn a_recording_without_frames_or_with_one_has_nothing_to_predict() {
        assert_eq!(plan(&[], 4).keys, []);
        let one = plan(&heads(1, |_| vec![1], &[]), 4);
        assert_eq!((frames(&one), one.predicted(0)), (vec![0], 1..1));
    }

    #[test]
    fn at_ratio_one_every_frame_is_a_key() {
        let plan = plan(&heads(3, |_| vec![1], &[1]), 1);
        assert_eq!(frames(&plan), [0, 1, 2]);
        assert_eq!(plan.keys.iter().map(|k| k.is_cut).collect::<Vec<_>>(), [false, true, false]);
        assert_eq!(plan.keys[2].motion, MotionSource::Own { plane: 0 });
    }

    #[test]
    fn a_key_after_a_lost_one_keeps_its_motion_where_every_frame_is_a_key() {
        let mut frames = heads(4, |_| vec![1], &[]);
        frames.remove(2);
        assert_eq!(plan(&frames, 1).keys[2].motion, MotionSource::Own { plane: 0 });
        assert_eq!(plan(&frames, 2).keys[1].motion, MotionSource::None, "its step is unknown");
    }
}
