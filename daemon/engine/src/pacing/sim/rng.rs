//! SplitMix64, the generator of Steele, Lea, Flood 2014 ("Fast splittable pseudorandom number
//! generators", figure 13): 64 bits of state, no dependencies, and the same numbers everywhere,
//! which is all that a simulation needs of chance.

use crate::time::MonoSpan;

/// A deterministic source of chance.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// A source that depends on `seed` alone.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 equally likely bits.
    pub fn next_bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A span from `-bound` to `bound`, all equally likely; zero where `bound` is not positive.
    pub fn within(&mut self, bound: MonoSpan) -> MonoSpan {
        let bits = i128::from(self.next_bits());
        let bound = i128::from(bound.as_ns().max(0));
        let ns = ((bits * (2 * bound + 1)) >> 64) - bound;
        MonoSpan::from_ns(i64::try_from(ns).expect("inside the bound, which is an i64"))
    }

    /// True `per_mille` times in a thousand.
    pub fn happens(&mut self, per_mille: u32) -> bool {
        ((u128::from(self.next_bits()) * 1_000) >> 64) < u128::from(per_mille)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_published_generator() {
        // The reference sequence for seed 1234567, as other implementations print it.
        let mut rng = SplitMix64::new(1_234_567);
        let first = [rng.next_bits(), rng.next_bits()];
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn spans_fill_their_bounds_and_chances_their_share() {
        let mut rng = SplitMix64::new(1);
        let spans: Vec<i64> =
            (0..1_000).map(|_| rng.within(MonoSpan::from_ns(10)).as_ns()).collect();
        assert_eq!((spans.iter().min(), spans.iter().max()), (Some(&-10), Some(&10)));
        let hits = (0..10_000).filter(|_| rng.happens(30)).count();
        assert!((200..400).contains(&hits), "{hits} of 10000 at 30 per mille");
    }
}
