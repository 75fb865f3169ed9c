//! What one point of a sweep renders, damages and measures.

use std::fmt;
use std::ops::Range;

use foreframe_fixtures::probes::Probe;

use crate::stability::shoot::KeyRecipe;
use crate::stability::spoil::Spoil;

/// Makes a probe.
pub(super) type Build = Box<dyn Fn() -> Probe + Send + Sync>;

/// Which frames are made between keys.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Frames {
    /// Three between whole key intervals, wherever the keys lie.
    Quarters,
    /// One after each key, so many key intervals later.
    After(f64),
}

/// The same without the event, which says what a method reaches once it has recovered.
pub struct Calm {
    /// The scene; None for the same.
    pub probe: Option<Build>,
    /// The keys.
    pub keys: Vec<KeyRecipe>,
}

/// One point of a sweep.
pub struct Case {
    /// The scene.
    pub probe: Build,
    /// The keys, in order.
    pub keys: Vec<KeyRecipe>,
    /// The frames to make.
    pub frames: Frames,
    /// What is wrong with which keys.
    pub spoil: Option<(Spoil, Range<usize>)>,
    /// Keys that never arrive.
    pub dropped: Vec<usize>,
    /// Key intervals, by the key that begins them, whose frames are measured.
    pub measured: Range<usize>,
    /// The first key after each event with which nothing is wrong.
    pub sound_again: Vec<usize>,
    /// The same without events, where there are any.
    pub calm: Option<Calm>,
}

/// Keys of a sequence without an event.
const KEYS: usize = 11;
/// Keys of a sequence with one.
const KEYS_WITH_EVENT: usize = 13;
/// Keys with which something is wrong, where something is.
const SPOILT: Range<usize> = 5..8;

/// `count` keys, one per key interval.
pub(super) fn even_keys(count: usize) -> Vec<KeyRecipe> {
    (0..count).map(|key| KeyRecipe::new(key as f64, key as f64 - 1.0)).collect()
}

impl Case {
    /// A scene that is hard all the time.
    pub(super) fn steady(probe: impl Fn() -> Probe + Send + Sync + 'static) -> Self {
        Self {
            probe: Box::new(probe),
            keys: even_keys(KEYS),
            frames: Frames::Quarters,
            spoil: None,
            dropped: Vec::new(),
            // The first two keys are for those who learn from their errors.
            measured: 2..KEYS - 1,
            sound_again: Vec::new(),
            calm: None,
        }
    }

    /// The same with a mask beside every key.
    pub(super) fn masked(mut self) -> Self {
        self.keys.iter_mut().for_each(|key| key.has_mask = true);
        self
    }

    /// A scene where something happens before key `sound_again`, beside a calm one; measured are
    /// `measured` intervals.
    pub(super) fn with_event(
        probe: impl Fn() -> Probe + Send + Sync + 'static,
        calm: impl Fn() -> Probe + Send + Sync + 'static,
        sound_again: usize,
        measured: Range<usize>,
    ) -> Self {
        let keys = even_keys(KEYS_WITH_EVENT);
        Self {
            keys: keys.clone(),
            measured,
            sound_again: vec![sound_again],
            calm: Some(Calm { probe: Some(Box::new(calm)), keys }),
            ..Self::steady(probe)
        }
    }

    /// A scene of which three keys are damaged, `change` says how; measured are the frames after
    /// those keys.
    pub(super) fn with_bad_keys(
        probe: impl Fn() -> Probe + Send + Sync + 'static,
        change: impl Fn(&mut KeyRecipe),
        spoil: Option<Spoil>,
    ) -> Self {
        let calm = even_keys(KEYS_WITH_EVENT);
        let mut keys = calm.clone();
        keys[SPOILT].iter_mut().for_each(change);
        Self {
            keys,
            measured: SPOILT,
            spoil: spoil.map(|spoil| (spoil, SPOILT)),
            sound_again: vec![SPOILT.end],
            calm: Some(Calm { probe: None, keys: calm }),
            ..Self::steady(probe)
        }
    }
}

impl fmt::Debug for Calm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Calm").field("keys", &self.keys).finish_non_exhaustive()
    }
}

impl fmt::Debug for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Case")
            .field("frames", &self.frames)
            .field("spoil", &self.spoil)
            .field("dropped", &self.dropped)
            .field("measured", &self.measured)
            .finish_non_exhaustive()
    }
}
