//! Converts output frames to 8-bit sRGB, for sinks that know nothing else.
//!
//! `rgba8` sRGB passes through unchanged. Everything else is decoded to linear light through a
//! table, clipped at the stream's white, brought to BT.709 primaries and encoded again:
//! - PQ (SMPTE ST 2084, 2018, eq. 4.1): 1 is the stated white; 203 cd/m2 where none is stated
//!   (ITU-R BT.2408-7, 2023, table 1);
//! - scene-linear: 1 is the stated white, whatever its luminance;
//! - sRGB (IEC 61966-2-1:1999): 10-bit codes are rounded to 8 bits.

use foreframe_engine::color::ordered_to_half;
use foreframe_engine::format::{Primaries, Transfer};
use foreframe_engine::{ColorPlane, StreamFormat};
use half::f16;

/// Luminance of diffuse white of a PQ stream that does not state it, in cd/m2.
const DEFAULT_PQ_WHITE: f32 = 203.0;

/// Rows: red, green and blue of some primaries from those of others.
pub(crate) type Matrix = [[f32; 3]; 3];

/// BT.709 from BT.2020 (ITU-R BT.2087-0, 2015, inverse).
const BT709_FROM_BT2020: Matrix = [
    [1.660_491, -0.587_641_1, -0.072_849_9],
    [-0.124_550_5, 1.132_899_9, -0.008_349_4],
    [-0.018_150_8, -0.100_578_9, 1.118_729_7],
];

/// BT.2020 from BT.709 (ITU-R BT.2087-0, 2015).
const BT2020_FROM_BT709: Matrix = [
    [0.627_404, 0.329_283, 0.043_313],
    [0.069_097, 0.919_54, 0.011_362],
    [0.016_391, 0.088_013, 0.895_595],
];

/// BT.709 from Display P3 (SMPTE EG 432-1, D65 white).
const BT709_FROM_DISPLAY_P3: Matrix = [
    [1.224_940_2, -0.224_940_2, 0.0],
    [-0.042_057, 1.042_057, 0.0],
    [-0.019_637_6, -0.078_636_1, 1.098_273_6],
];

const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// BT.709 from these.
pub(crate) const fn bt709_from(primaries: Primaries) -> Matrix {
    match primaries {
        Primaries::Bt709 => IDENTITY,
        Primaries::Bt2020 => BT709_FROM_BT2020,
        Primaries::DisplayP3 => BT709_FROM_DISPLAY_P3,
    }
}

/// BT.2020 from these.
pub(crate) fn bt2020_from(primaries: Primaries) -> Matrix {
    let first = match primaries {
        Primaries::Bt2020 => return IDENTITY,
        Primaries::Bt709 => IDENTITY,
        Primaries::DisplayP3 => BT709_FROM_DISPLAY_P3,
    };
    let column = |at: usize| first.map(|row| row[at]);
    let product = |row: [f32; 3], at| row.iter().zip(column(at)).map(|(a, b)| a * b).sum();
    BT2020_FROM_BT709.map(|row| [0, 1, 2].map(|at| product(row, at)))
}

/// Luminance of 1, in cd/m2.
pub(crate) fn white(format: &StreamFormat) -> f32 {
    if format.white_cd_m2 > 0.0 { format.white_cd_m2 } else { DEFAULT_PQ_WHITE }
}

/// Converts the frames of one stream.
#[derive(Debug)]
pub struct SrgbConverter {
    primaries: Primaries,
    /// Linear light, clipped to 0..=1, of each code value. Empty for 8-bit sRGB in BT.709.
    linear: Vec<f32>,
    /// Final code of each code value, where no matrix lies between. Empty with other primaries.
    direct: Vec<u8>,
}

impl SrgbConverter {
    /// For streams of this format.
    #[must_use]
    pub fn new(format: &StreamFormat) -> Self {
        use foreframe_engine::color::ColorFormat;
        let codes: Vec<f32> = match format.color {
            ColorFormat::Rgba8 => (0..=255_u8).map(|code| f32::from(code) / 255.0).collect(),
            ColorFormat::Rgb10a2 => (0..1024_u16).map(|code| f32::from(code) / 1023.0).collect(),
            ColorFormat::Rgba16f => (0..=u16::MAX)
                .map(|ordered| f16::from_bits(ordered_to_half(ordered)).to_f32())
                .collect(),
        };
        let white = white(format);
        let linear: Vec<f32> = codes
            .into_iter()
            .map(|code| {
                let light = match format.transfer {
                    Transfer::Srgb => linear_from_srgb(code),
                    Transfer::Pq => luminance_from_pq(code) / white,
                    Transfer::Linear => code,
                };
                // Written so that NaN becomes black.
                if light > 0.0 { light.min(1.0) } else { 0.0 }
            })
            .collect();
        let direct = match format.primaries {
            Primaries::Bt709 => linear.iter().map(|&light| code_from_linear(light)).collect(),
            Primaries::Bt2020 | Primaries::DisplayP3 => Vec::new(),
        };
        Self { primaries: format.primaries, linear, direct }
    }

    /// Replaces `out` by the frame's pixels: red, green, blue, one byte each, row by row.
    /// Alpha is left out: an output frame is opaque.
    pub fn convert(&self, frame: &ColorPlane, out: &mut Vec<u8>) {
        out.clear();
        out.reserve(frame.width() as usize * frame.height() as usize * 3);
        match frame {
            ColorPlane::Rgba8(plane) => self.extend(out, plane.data(), |texel| {
                let [red, green, blue, _] = texel.0.to_le_bytes();
                [red, green, blue].map(usize::from)
            }),
            ColorPlane::Rgb10a2(plane) => self.extend(out, plane.data(), |texel| {
                [0, 10, 20].map(|shift| (texel.0 >> shift & 0x3ff) as usize)
            }),
            ColorPlane::Rgba16f(plane) => self.extend(out, plane.data(), |texel| {
                let [red, green, blue, _] = texel.0;
                [red, green, blue].map(usize::from)
            }),
        }
    }

    fn extend<T: Copy>(&self, out: &mut Vec<u8>, texels: &[T], codes: impl Fn(T) -> [usize; 3]) {
        if self.primaries == Primaries::Bt709 {
            let direct = &self.direct;
            out.extend(texels.iter().flat_map(|&texel| codes(texel).map(|code| direct[code])));
            return;
        }
        let matrix = bt709_from(self.primaries);
        out.extend(texels.iter().flat_map(|&texel| {
            let light = codes(texel).map(|code| self.linear[code]);
            matrix.map(|row| {
                code_from_linear(row[0] * light[0] + row[1] * light[1] + row[2] * light[2])
            })
        }));
    }
}

fn linear_from_srgb(code: f32) -> f32 {
    if code <= 0.040_45 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// The 8-bit sRGB code of linear light, rounded; light outside 0..=1 is clipped.
#[expect(clippy::cast_possible_truncation, reason = "float to int casts saturate")]
#[expect(clippy::cast_sign_loss, reason = "float to int casts saturate")]
fn code_from_linear(light: f32) -> u8 {
    let light = light.clamp(0.0, 1.0);
    let code =
        if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (code * 255.0).round() as u8
}

/// Luminance in cd/m2 of a PQ code in 0..=1 (ST 2084 eq. 4.1; m1, m2, c1, c2, c3 as there).
fn luminance_from_pq(code: f32) -> f32 {
    const M1: f32 = 2610.0 / 16384.0;
    const M2: f32 = 2523.0 / 4096.0 * 128.0;
    const C1: f32 = 3424.0 / 4096.0;
    const C2: f32 = 2413.0 / 4096.0 * 32.0;
    const C3: f32 = 2392.0 / 4096.0 * 32.0;
    let power = code.clamp(0.0, 1.0).powf(1.0 / M2);
    10_000.0 * ((power - C1).max(0.0) / (C2 - C3 * power)).powf(1.0 / M1)
}

#[cfg(test)]
mod tests {
    use foreframe_engine::Plane;
    use foreframe_engine::color::{ColorFormat, OrderedRgba16, Rgb10a2, Rgba8, half_to_ordered};

    use super::*;

    fn convert_one(format: &StreamFormat, frame: &ColorPlane) -> [u8; 3] {
        let mut out = Vec::new();
        SrgbConverter::new(format).convert(frame, &mut out);
        out.try_into().expect("one pixel")
    }

    fn rgba8(bytes: [u8; 4]) -> ColorPlane {
        ColorPlane::Rgba8(Plane::from_vec(1, 1, vec![Rgba8(u32::from_le_bytes(bytes))]))
    }

    fn rgb10([red, green, blue]: [u32; 3]) -> ColorPlane {
        let word = red | green << 10 | blue << 20 | 3 << 30;
        ColorPlane::Rgb10a2(Plane::from_vec(1, 1, vec![Rgb10a2(word)]))
    }

    fn half(channels: [f32; 3]) -> ColorPlane {
        let [red, green, blue] =
            channels.map(|channel| half_to_ordered(f16::from_f32(channel).to_bits()));
        let texel = OrderedRgba16([red, green, blue, half_to_ordered(0x3c00)]);
        ColorPlane::Rgba16f(Plane::from_vec(1, 1, vec![texel]))
    }

    #[test]
    fn eight_bit_srgb_passes_through_unchanged() {
        let format = StreamFormat::rgba8(1, 1);
        for code in 0..=255 {
            let bytes = [code, 255 - code, code / 2, 7];
            assert_eq!(convert_one(&format, &rgba8(bytes)), bytes[..3]);
        }
    }

    #[test]
    fn ten_bit_srgb_is_rounded_to_the_nearest_code() {
        let format = StreamFormat { color: ColorFormat::Rgb10a2, ..StreamFormat::rgba8(1, 1) };
        for code in 0..1024 {
            let rounded = u8::try_from((code * 255 * 2 + 1023) / (2 * 1023)).unwrap();
            assert_eq!(convert_one(&format, &rgb10([code, 0, 1023])), [rounded, 0, 255]);
        }
    }

    #[test]
    fn linear_halves_are_clipped_and_encoded() {
        let format = StreamFormat {
            color: ColorFormat::Rgba16f,
            transfer: Transfer::Linear,
            ..StreamFormat::rgba8(1, 1)
        };
        assert_eq!(convert_one(&format, &half([-1.0, 0.5, 7.0])), [0, 188, 255]);
        assert_eq!(convert_one(&format, &half([f32::NAN, f32::INFINITY, 0.0])), [0, 255, 0]);
    }

    #[test]
    fn pq_white_is_where_the_stream_says() {
        // ST 2084: code 0.5081 stands for 100 cd/m2.
        let mut format = StreamFormat {
            color: ColorFormat::Rgb10a2,
            transfer: Transfer::Pq,
            white_cd_m2: 100.0,
            ..StreamFormat::rgba8(1, 1)
        };
        let frame = rgb10([520, 520, 520]);
        assert_eq!(convert_one(&format, &frame), [255; 3]);
        format.white_cd_m2 = 10_000.0;
        // 1 % of white is sRGB code 25.5.
        let [red, green, blue] = convert_one(&format, &frame);
        assert!((25..=26).contains(&red) && red == green && green == blue, "{red}");
    }

    #[test]
    fn primaries_there_and_back_are_the_same() {
        for (at, row) in bt2020_from(Primaries::Bt709).into_iter().enumerate() {
            let column = |column: usize| BT709_FROM_BT2020.map(|row| row[column]);
            let product: [f32; 3] =
                [0, 1, 2].map(|it| row.iter().zip(column(it)).map(|(a, b)| a * b).sum());
            let off: [f32; 3] = [0, 1, 2].map(|it| if it == at { 1.0 } else { 0.0 } - product[it]);
            assert!(off.iter().all(|off| off.abs() < 1e-4), "{at}: {product:?}");
        }
        let through = bt2020_from(Primaries::DisplayP3);
        assert!((through[0][0] - 0.753_83).abs() < 1e-3, "{through:?}");
        assert!((through[1][1] - 0.941_78).abs() < 1e-3, "{through:?}");
    }

    #[test]
    fn other_primaries_keep_white_and_clip_what_bt709_cannot_show() {
        for primaries in [Primaries::Bt2020, Primaries::DisplayP3] {
            let format = StreamFormat { primaries, ..StreamFormat::rgba8(1, 1) };
            assert_eq!(convert_one(&format, &rgba8([255; 4])), [255; 3]);
            assert_eq!(convert_one(&format, &rgba8([128, 128, 128, 0])), [128; 3]);
            let [red, green, blue] = convert_one(&format, &rgba8([0, 255, 0, 255]));
            assert!(red == 0 && green == 255 && blue == 0, "{red} {green} {blue}");
            let [red, ..] = convert_one(&format, &rgba8([200, 60, 60, 255]));
            assert!(red > 200, "a wide red is a stronger red in BT.709, not {red}");
        }
    }
}
