//! Damage to the planes of a key, as applications and drivers do it. Deterministic by seed.

use super::shoot::KeyShot;

/// What is wrong with the data of some keys.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Spoil {
    /// Depth times 1 plus Gaussian noise of this standard deviation, by pixel.
    DepthNoise(f64),
    /// Depth as a depth buffer of so many bits holds it, 0 at the near plane and 1 at the far one.
    DepthBits(u32),
    /// Gaussian noise of this standard deviation in pixels on both components, by pixel.
    MotionNoise(f64),
    /// Both components rounded to this step in pixels.
    MotionStep(f64),
    /// Factors on the components: -1 is a wrong sign.
    MotionScale([f64; 2]),
    /// This share of the vectors, by lot, is not a number.
    MotionNan(f64),
    /// No motion plane.
    MotionMissing,
    /// Neither depth nor motion plane: colour alone.
    FieldsMissing,
}

/// Near and far plane of the depth buffer of [`Spoil::DepthBits`], in pixels of the probes' world:
/// the ratio of 10 cm to 1 km.
const DEPTH_BUFFER: [f64; 2] = [0.54, 5400.0];

/// Damages one key. Keys and kinds of damage have their own random numbers, and no others.
pub fn spoil(key: &mut KeyShot, kind: Spoil, seed: u64) {
    let mut random = Random::new(seed);
    match kind {
        Spoil::DepthNoise(deviation) => {
            for depth in &mut key.depth {
                // Never at the eye or behind it.
                let factor = (1.0 + deviation * random.normal()).max(0.05);
                *depth = (f64::from(*depth) * factor) as f32;
            }
        }
        Spoil::DepthBits(bits) => {
            for depth in &mut key.depth {
                *depth = through_depth_buffer(f64::from(*depth), bits) as f32;
            }
        }
        Spoil::MotionNoise(deviation) => {
            each(key, |component| component + deviation * random.normal());
        }
        Spoil::MotionStep(step) => each(key, |component| (component / step).round() * step),
        Spoil::MotionScale([x, y]) => {
            for motion in &mut key.motion {
                *motion = [(f64::from(motion[0]) * x) as f32, (f64::from(motion[1]) * y) as f32];
            }
        }
        Spoil::MotionNan(share) => {
            for motion in &mut key.motion {
                if random.unit() < share {
                    *motion = [f32::NAN; 2];
                }
            }
        }
        Spoil::MotionMissing => key.has_motion = false,
        Spoil::FieldsMissing => (key.has_motion, key.has_depth) = (false, false),
    }
}

fn each(key: &mut KeyShot, mut change: impl FnMut(f64) -> f64) {
    for component in key.motion.as_flattened_mut() {
        *component = change(f64::from(*component)) as f32;
    }
}

/// The distance that is read back from a depth buffer of `bits` bits, 1 to 32.
fn through_depth_buffer(depth: f64, bits: u32) -> f64 {
    let [near, far] = DEPTH_BUFFER;
    let steps = f64::from(u32::MAX >> (32 - bits.clamp(1, 32)));
    let stored = (far / (far - near) * (1.0 - near / depth)).clamp(0.0, 1.0);
    let read = (stored * steps).round() / steps;
    // The last step stands for all that is beyond it.
    near / (1.0 - read * (far - near) / far).max(near / far)
}

/// Random numbers by seed (Steele, Lea, Flood 2014, SplitMix64).
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// A sequence of its own for each seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// The next number of 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The next number of a normal distribution, in good approximation: the sum of twelve numbers
    /// of 0 to 1 has a variance of 1, and needs no function that differs from machine to machine.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_seed_repeat_and_have_the_moments_that_they_claim() {
        let numbers = |seed| {
            let mut random = Random::new(seed);
            (0..20_000).map(|_| random.normal()).collect::<Vec<_>>()
        };
        let first = numbers(1);
        assert_eq!(first, numbers(1));
        assert_ne!(first, numbers(2));
        let mean = first.iter().sum::<f64>() / first.len() as f64;
        let variance = first.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / first.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.03, "{mean} {variance}");
    }

    #[test]
    fn a_depth_buffer_of_fewer_bits_is_farther_off_and_one_of_32_bits_is_exact() {
        let off = |bits| {
            let depths = (10..200).map(f64::from);
            depths.map(|d| (through_depth_buffer(d, bits) - d).abs() / d).fold(0.0, f64::max)
        };
        assert!(off(32) < 1e-6, "{}", off(32));
        assert!(off(8) > 10.0 * off(12) && off(12) > 10.0 * off(16), "{} {}", off(8), off(12));
        assert!(through_depth_buffer(5400.0, 8).is_finite());
    }
}
