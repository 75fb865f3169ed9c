//! Smooth pursuit: which part of a motion the eye can follow.

/// Retinal speed up to which tracking is taken as perfect, deg/s (Didyk et al. 2010, section 6).
pub const FULL_TRACKING_DEG_PER_S: f32 = 70.0;
/// Retinal speed from which nothing is tracked, deg/s (Didyk et al. 2010, section 6).
pub const NO_TRACKING_DEG_PER_S: f32 = 90.0;

/// Share of a motion of `speed` deg/s that the eye follows, 1 to 0.
///
/// Cubic smooth-step with f(70) = 1, f(90) = 0 and zero slope at both (Didyk et al. 2010,
/// section 6, after Daly 1998). NaN gives 0.
#[must_use]
#[expect(clippy::manual_clamp, reason = "clamp would let NaN through")]
pub fn tracked_share(speed: f32) -> f32 {
    let range = NO_TRACKING_DEG_PER_S - FULL_TRACKING_DEG_PER_S;
    let t = ((NO_TRACKING_DEG_PER_S - speed) / range).max(0.0).min(1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tracking_is_whole_up_to_70_gone_from_90_and_half_at_80() {
        assert_eq!(tracked_share(0.0).to_bits(), 1.0_f32.to_bits());
        assert_eq!(tracked_share(70.0).to_bits(), 1.0_f32.to_bits());
        assert_eq!(tracked_share(80.0).to_bits(), 0.5_f32.to_bits());
        assert_eq!(tracked_share(90.0).to_bits(), 0.0_f32.to_bits());
        assert_eq!(tracked_share(f32::NAN).to_bits(), 0.0_f32.to_bits());
    }
}
