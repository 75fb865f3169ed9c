//! Every way to read between pixels against the definition.

use super::*;
use crate::simd::Simd;
use crate::testing::hash;
use crate::warp::sample::{Listed, sample_run};
use proptest::prelude::*;

proptest! {
    #[test]
    fn luma_of_a_run_is_that_of_each_pixel(
        texels in proptest::collection::vec(any::<u32>(), 0..100),
    ) {
        let texels: Vec<_> = texels.into_iter().map(Rgba8).collect();
        let expected: Vec<_> = texels.iter().map(|texel| texel.luma8()).collect();
        for simd in Simd::ALL {
            simd.enter();
            let mut luma = vec![0; texels.len()];
            Rgba8::luma8_run(&texels, &mut luma);
            prop_assert_eq!(&luma, &expected, "{:?}", simd);
        }
    }

    #[test]
    fn all_channels_at_once_equal_channel_by_channel(
        corners: [u32; 4], fx in 0_u32..256, fy in 0_u32..256,
    ) {
        let corners = corners.map(Rgba8);
        prop_assert_eq!(
            Rgba8::bilinear(corners, fx, fy),
            Rgba8::bilinear_by_channel(corners, fx, fy)
        );
    }

    #[test]
    fn sampling_each_of_many_equals_sampling_one_by_one(
        (width, height) in (1_u32..20, 1_u32..20),
        (left, top) in (0_u32..4, 0_u32..4),
        positions in proptest::collection::vec((-900..6000_i32, -900..6000_i32), 0..40),
        seed: u32,
    ) {
        let ColorPlane::Rgba8(plane) =
            crate::testing::noise(ColorFormat::Rgba8, width + left + 1, height + top, seed)
        else {
            unreachable!("the format asked for")
        };
        let valid = Rect { x: left, y: top, width, height };
        let (xs, ys): (Vec<i32>, Vec<i32>) = positions.iter().copied().unzip();
        check_each(&plane, valid, &xs, &ys)?;
    }

    #[test]
    fn sampling_close_together_equals_sampling_one_by_one(
        (width, height) in (1_u32..80, 1_u32..20),
        (left, top) in (0_u32..4, 0_u32..4),
        (x, y) in (-900..18_000_i32, -900..6000_i32),
        steps in proptest::collection::vec((150..340_i32, -20..20_i32), 0..70),
        is_mirrored: bool,
        seed: u32,
    ) {
        let ColorPlane::Rgba8(plane) =
            crate::testing::noise(ColorFormat::Rgba8, width + left, height + top, seed)
        else {
            unreachable!("the format asked for")
        };
        let valid = Rect { x: left, y: top, width, height };
        let places = steps.into_iter().scan([x, y], |place, (dx, dy)| {
            *place = [place[0] + if is_mirrored { -dx } else { dx }, place[1] + dy];
            Some((place[0], place[1]))
        });
        let (xs, ys): (Vec<i32>, Vec<i32>) = places.unzip();
        check_each(&plane, valid, &xs, &ys)?;
    }

    #[test]
    fn sampling_a_run_equals_sampling_one_by_one(
        (width, height) in (1_u32..40, 1_u32..20),
        (left, top) in (0_u32..4, 0_u32..4),
        (x, y) in (-900..9000_i32, -900..6000_i32),
        whole in 0..3,
        count in 0_usize..30,
        seed: u32,
    ) {
        let ColorPlane::Rgba8(plane) =
            crate::testing::noise(ColorFormat::Rgba8, width + left + 1, height + top, seed)
        else {
            unreachable!("the format asked for")
        };
        let valid = Rect { x: left, y: top, width, height };
        // Some runs lie on columns, and some of those on a row too.
        let x = if whole > 0 { x & !0xff } else { x };
        let y = if whole > 1 { y & !0xff } else { y };
        let mut out = vec![Rgba8::default(); count];
        sample_run(&plane, valid, [x, y], &mut out);
        for (x, texel) in (x..).step_by(256).zip(out) {
            prop_assert_eq!(texel, sample(&plane, valid, x, y), "at {}, {}", x, y);
        }
    }

    #[test]
    fn interpolation_stays_between_its_corners(
        corners: [[u16; 4]; 4], fx in 0_u32..256, fy in 0_u32..256,
    ) {
        let OrderedRgba16(mean) = OrderedRgba16::bilinear(corners.map(OrderedRgba16), fx, fy);
        for channel in 0..4 {
            let values = corners.map(|corner| corner[channel]);
            prop_assert!(values.iter().min() <= Some(&mean[channel]));
            prop_assert!(values.iter().max() >= Some(&mean[channel]));
        }
    }
}

#[test]
fn extreme_corners_are_weighed_exactly() {
    for case in 0..4096 {
        let corner = |i: u32| if hash(case, i, 0) & 1 == 0 { 0 } else { 0xff00_ff00 };
        let corners = [0, 1, 2, 3].map(|i| Rgba8(corner(i)));
        let (fx, fy) = (hash(case, 8, 0) & 255, hash(case, 9, 0) & 255);
        assert_eq!(Rgba8::bilinear(corners, fx, fy), Rgba8::bilinear_by_channel(corners, fx, fy));
    }
}

#[test]
fn ordered_halves_sort_as_their_values_and_come_back() {
    let mut finite: Vec<u16> =
        (0..=u16::MAX).filter(|bits| half::f16::from_bits(*bits).is_finite()).collect();
    finite.sort_by_key(|bits| half_to_ordered(*bits));
    for pair in finite.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(half::f16::from_bits);
        assert!(a <= b, "{a} before {b}");
    }
    assert!((0..=u16::MAX).all(|bits| ordered_to_half(half_to_ordered(bits)) == bits));
}

/// Reads `plane` at all places in every way, and each by the definition.
fn check_each(
    plane: &Plane<Rgba8>,
    valid: Rect,
    xs: &[i32],
    ys: &[i32],
) -> Result<(), TestCaseError> {
    for simd in Simd::ALL {
        simd.enter();
        let mut out = vec![Rgba8::default(); xs.len()];
        Rgba8::sample_each(plane, valid, &Listed { xs, ys }, &mut out);
        for ((x, y), texel) in xs.iter().zip(ys).zip(out) {
            let expected = sample(plane, valid, *x, *y);
            prop_assert_eq!(texel, expected, "at {}, {}, {:?}", x, y, simd);
        }
    }
    Ok(())
}
