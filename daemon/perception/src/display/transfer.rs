//! The transfer functions that streams state: sRGB and PQ.
//!
//! sRGB: IEC 61966-2-1:1999. PQ: SMPTE ST 2084:2014, equations for the EOTF and its inverse, which
//! gives cd/m2 and not a share of white.

/// Luminance of PQ code 1, cd/m2.
pub const PQ_PEAK: f64 = 10_000.0;

const PQ_M1: f64 = 2610.0 / 16384.0;
const PQ_M2: f64 = 2523.0 / 4096.0 * 128.0;
const PQ_C1: f64 = 3424.0 / 4096.0;
const PQ_C2: f64 = 2413.0 / 4096.0 * 32.0;
const PQ_C3: f64 = 2392.0 / 4096.0 * 32.0;

/// Light of an sRGB code, both 0 to 1; codes outside keep their sign and go on.
#[must_use]
pub fn srgb_to_linear(code: f64) -> f64 {
    let size = code.abs();
    let light = if size <= 0.04045 { size / 12.92 } else { libm::pow((size + 0.055) / 1.055, 2.4) };
    libm::copysign(light, code)
}

/// The inverse of [`srgb_to_linear`].
#[must_use]
pub fn srgb_from_linear(light: f64) -> f64 {
    let size = light.abs();
    let code =
        if size <= 0.003_130_8 { size * 12.92 } else { 1.055 * libm::pow(size, 1.0 / 2.4) - 0.055 };
    libm::copysign(code, light)
}

/// Luminance of a PQ code of 0 to 1, cd/m2. Codes outside are clamped.
#[must_use]
pub fn pq_to_luminance(code: f64) -> f64 {
    let root = libm::pow(code.clamp(0.0, 1.0), 1.0 / PQ_M2);
    let ratio = (root - PQ_C1).max(0.0) / (PQ_C2 - PQ_C3 * root);
    PQ_PEAK * libm::pow(ratio, 1.0 / PQ_M1)
}

/// PQ code of a luminance of 0 to 10000 cd/m2, clamped there.
#[must_use]
pub fn pq_from_luminance(luminance: f64) -> f64 {
    let power = libm::pow((luminance / PQ_PEAK).clamp(0.0, 1.0), PQ_M1);
    libm::pow((PQ_C1 + PQ_C2 * power) / (1.0 + PQ_C3 * power), PQ_M2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_go_to_light_and_back() {
        for level in 0..=1023_u16 {
            let code = f64::from(level) / 1023.0;
            let srgb = srgb_from_linear(srgb_to_linear(code));
            let pq = pq_from_luminance(pq_to_luminance(code));
            assert!((srgb - code).abs() < 1e-7, "sRGB {code}: {srgb}");
            // PQ of no light is C1^M2, 7e-7, not 0.
            assert!((pq - code).abs() < 1e-6, "PQ {code}: {pq}");
            assert!((srgb_from_linear(srgb_to_linear(-code)) + code).abs() < 1e-7);
        }
    }

    #[test]
    fn the_published_points_lie_on_the_curves() {
        // ITU-R BT.2408: 100 cd/m2 is 50.8 % of PQ, 203 cd/m2 is 58 %; 1000 cd/m2 is 75.2 %.
        for (luminance, code) in [(100.0, 0.508), (203.0, 0.581), (1000.0, 0.752), (PQ_PEAK, 1.0)] {
            assert!((pq_from_luminance(luminance) - code).abs() < 5e-4, "{luminance} cd/m2");
        }
        assert!(pq_to_luminance(0.0).abs() < 1e-12);
        // IEC 61966-2-1: level 188 of 255 is half of the light, to a level.
        assert!((srgb_to_linear(188.0 / 255.0) - 0.5).abs() < 0.005);
        assert!((srgb_to_linear(0.04045) - 0.04045 / 12.92).abs() < 1e-12);
    }
}
