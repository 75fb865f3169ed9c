//! When the keys, the late cameras and the user interfaces of a recording arrive on the virtual
//! clock.

use foreframe_engine::MonoTime;

use super::{TimedKey, TimedPose};
use crate::recording::keys::KeyReader;
use crate::recording::plan::Plan;
use crate::recording::{FrameHead, Recording};

/// What decides when a key arrives.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum KeyTiming {
    /// The recorded arrival, with all its jitter.
    AsRecorded,
    /// Content time: the first key as recorded, the others after it by what lies between their
    /// content times.
    Stepped,
}

/// When the keys of `plan` arrive, in order; never earlier than the key before.
#[must_use]
pub fn arrivals(heads: &[FrameHead], plan: &Plan, timing: KeyTiming) -> Vec<MonoTime> {
    let keys = plan.keys.iter().map(|key| &heads[key.frame]);
    let Some(first) = keys.clone().next() else { return Vec::new() };
    let mut latest = MonoTime::ZERO;
    keys.map(|head| {
        let arrives_at = match timing {
            KeyTiming::AsRecorded => head.arrived_at,
            KeyTiming::Stepped => first.arrived_at + (head.content_time - first.content_time),
        };
        latest = latest.max(arrives_at);
        latest
    })
    .collect()
}

/// The keys of `plan` with their arrivals, read one by one.
pub fn timed_keys<'a>(
    recording: &'a mut dyn Recording,
    reader: &'a KeyReader,
    plan: &'a Plan,
    timing: KeyTiming,
) -> impl Iterator<Item = anyhow::Result<TimedKey>> + 'a {
    let arrivals = arrivals(recording.heads(), plan, timing);
    arrivals.into_iter().enumerate().map(move |(key, arrives_at)| {
        Ok(TimedKey { arrives_at, frame: reader.read(recording, plan, key)? })
    })
}

/// The poses of `recorded`, in order of arrival, as far from the key before them as they were when
/// they were recorded. Poses that arrived before the first key lead nothing and are left out.
#[must_use]
pub fn timed_poses(
    recorded: &[TimedPose],
    heads: &[FrameHead],
    plan: &Plan,
    timing: KeyTiming,
) -> Vec<TimedPose> {
    let mut poses: Vec<_> = beside_keys(recorded, |pose| pose.arrives_at, heads, plan, timing)
        .map(|(pose, arrives_at)| TimedPose { arrives_at, ..*pose })
        .collect();
    poses.sort_by_key(|pose| pose.arrives_at);
    poses
}

/// The same for user interfaces, by their numbers in the file.
#[must_use]
pub fn timed_uis(
    recorded: &[(usize, MonoTime)],
    heads: &[FrameHead],
    plan: &Plan,
    timing: KeyTiming,
) -> Vec<(usize, MonoTime)> {
    let mut uis: Vec<_> = beside_keys(recorded, |(_, arrives_at)| *arrives_at, heads, plan, timing)
        .map(|((number, _), arrives_at)| (*number, arrives_at))
        .collect();
    uis.sort_by_key(|(_, arrives_at)| *arrives_at);
    // What came before the first key is shown from that one on.
    let first = plan.keys.first().map(|key| &heads[key.frame]);
    let first = first.zip(arrivals(heads, plan, timing).first().copied());
    if let Some((head, arrives_at)) = first {
        let earlier = recorded.iter().filter(|(_, arrived_at)| *arrived_at < head.arrived_at);
        let newest = earlier.max_by_key(|(_, arrived_at)| *arrived_at);
        uis.splice(..0, newest.map(|(number, _)| (*number, arrives_at)));
    }
    uis
}

/// What was `recorded` beside keys, without what arrived before the first, and when it arrives: as
/// far behind its key as it did then.
fn beside_keys<'a, T>(
    recorded: &'a [T],
    arrived_at: impl Fn(&T) -> MonoTime + 'a,
    heads: &'a [FrameHead],
    plan: &'a Plan,
    timing: KeyTiming,
) -> impl Iterator<Item = (&'a T, MonoTime)> {
    let arrivals = arrivals(heads, plan, timing);
    recorded.iter().filter_map(move |one| {
        let arrived_at = arrived_at(one);
        let keys = plan.keys.iter().map(|key| &heads[key.frame]).zip(&arrivals);
        let (key, key_arrives_at) =
            keys.take_while(|(key, _)| key.arrived_at <= arrived_at).last()?;
        Some((one, *key_arrives_at + (arrived_at - key.arrived_at)))
    })
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use foreframe_engine::MonoSpan;

    use super::*;

    fn at_ms(ms: i64) -> MonoTime {
        MonoTime::ZERO + MonoSpan::from_ms(ms)
    }

    fn plan_of(times: &[(i64, i64)]) -> (Vec<FrameHead>, Plan) {
        let head = |(content, arrived): &(i64, i64)| FrameHead {
            content_time: at_ms(*content),
            arrived_at: at_ms(*arrived),
            is_cut: false,
            motions: Vec::new(),
        };
        let heads: Vec<_> = times.iter().map(head).collect();
        let plan = Plan::new(&heads, NonZeroUsize::MIN);
        (heads, plan)
    }

    #[test]
    fn as_recorded_keeps_the_jitter_and_stepped_takes_it_out() {
        let (heads, plan) = plan_of(&[(0, 100), (25, 131), (50, 149)]);
        let recorded = arrivals(&heads, &plan, KeyTiming::AsRecorded);
        assert_eq!(recorded, [100, 131, 149].map(at_ms));
        let stepped = arrivals(&heads, &plan, KeyTiming::Stepped);
        assert_eq!(stepped, [100, 125, 150].map(at_ms));
    }

    #[test]
    fn a_pose_stays_as_far_behind_its_key_as_it_was_recorded() {
        let (heads, plan) = plan_of(&[(0, 100), (25, 131), (50, 149)]);
        let pose = |arrives_ms| TimedPose {
            arrives_at: at_ms(arrives_ms),
            content_time: at_ms(0),
            view: [0.0; 16],
        };
        let recorded = [99, 104, 131, 160].map(pose);
        let arrivals = |timing| {
            let poses = timed_poses(&recorded, &heads, &plan, timing);
            poses.iter().map(|pose| pose.arrives_at).collect::<Vec<_>>()
        };
        assert_eq!(arrivals(KeyTiming::AsRecorded), [104, 131, 160].map(at_ms));
        assert_eq!(arrivals(KeyTiming::Stepped), [104, 125, 161].map(at_ms));
    }

    #[test]
    fn no_key_arrives_before_the_one_before_it() {
        let (heads, plan) = plan_of(&[(50, 100), (0, 90), (25, 120)]);
        assert_eq!(arrivals(&heads, &plan, KeyTiming::AsRecorded), [100, 100, 120].map(at_ms));
        assert_eq!(arrivals(&heads, &plan, KeyTiming::Stepped), [100, 100, 100].map(at_ms));
    }
}
