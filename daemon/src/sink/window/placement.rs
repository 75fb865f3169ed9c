//! Where the picture lies in a buffer: as large as fits, in the middle, its shape kept.

use foreframe_engine::Rect;

/// A buffer has at most so many columns and rows: no display has more, and 32 bits hold its bytes.
pub(super) const MOST: u32 = 16_384;
/// Times the pixels of picture or window, whichever has more, that bars may bring a buffer to.
const WASTE: u64 = 4;

/// Size of a buffer, and the part of it that shows the picture. The rest is black.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Placement {
    /// Columns and rows of the buffer.
    pub(super) buffer: [u32; 2],
    /// Inside the buffer.
    pub(super) picture: Rect,
}

impl Placement {
    /// For a display that stretches buffers to the window, in images of at most `most` columns and
    /// rows: padded, or where bars make that too large, scaled to the window.
    pub(super) fn stretched(picture: [u32; 2], window: [u32; 2], most: u32) -> Self {
        let padded = Self::padded(picture, window);
        let pixels = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
        let enough = pixels(picture).max(pixels(window)).saturating_mul(WASTE);
        match padded.buffer.iter().all(|&length| length <= most) && pixels(padded.buffer) <= enough
        {
            true => padded,
            false => Self::limited(picture, window, most),
        }
    }

    /// Scaled to the window, or to one of its shape that images of at most `most` columns and rows
    /// can fill.
    pub(super) fn limited(picture: [u32; 2], window: [u32; 2], most: u32) -> Self {
        let longest = window[0].max(window[1]);
        match longest > most {
            true => Self::scaled(picture, window.map(|length| rounded(length, most, longest))),
            false => Self::scaled(picture, window),
        }
    }

    /// For a display that stretches buffers to the window: the picture pixel by pixel, with bars
    /// that give the buffer the window's shape.
    pub(super) fn padded(picture: [u32; 2], window: [u32; 2]) -> Self {
        let [width, height] = picture.map(|length| length.clamp(1, MOST));
        let [across, down] = window.map(|length| length.max(1));
        let is_wider = u64::from(width) * u64::from(down) >= u64::from(across) * u64::from(height);
        let buffer = match is_wider {
            true => [width, rounded(width, down, across).clamp(height, MOST)],
            false => [rounded(height, across, down).clamp(width, MOST), height],
        };
        Self { buffer, picture: centred(buffer, [width, height]) }
    }

    /// For a display that shows buffers pixel by pixel: the picture scaled to the window.
    pub(super) fn scaled(picture: [u32; 2], window: [u32; 2]) -> Self {
        let [width, height] = picture.map(|length| length.clamp(1, MOST));
        let buffer @ [across, down] = window.map(|length| length.clamp(1, MOST));
        let is_wider = u64::from(width) * u64::from(down) >= u64::from(across) * u64::from(height);
        let fitting = match is_wider {
            true => [across, rounded(across, height, width).clamp(1, down)],
            false => [rounded(down, width, height).clamp(1, across), down],
        };
        Self { buffer, picture: centred(buffer, fitting) }
    }

    /// Bytes of a row of a buffer of 4-byte texels.
    pub(super) fn row_len(&self) -> usize {
        self.buffer[0] as usize * 4
    }

    /// Bytes of a buffer of 4-byte texels.
    pub(super) fn byte_len(&self) -> usize {
        self.row_len() * self.buffer[1] as usize
    }
}

/// `length` times `numerator / denominator`, to the nearest.
fn rounded(length: u32, numerator: u32, denominator: u32) -> u32 {
    let product = u64::from(length) * u64::from(numerator) + u64::from(denominator) / 2;
    u32::try_from(product / u64::from(denominator)).unwrap_or(u32::MAX)
}

fn centred(outer: [u32; 2], inner: [u32; 2]) -> Rect {
    let [x, y] = [0, 1].map(|axis| (outer[axis] - inner[axis]) / 2);
    Rect { x, y, width: inner[0], height: inner[1] }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_window_of_the_pictures_shape_has_no_bars() {
        let placement = Placement::padded([640, 360], [1280, 720]);
        assert_eq!(placement.buffer, [640, 360]);
        assert_eq!(placement.picture, Rect::full(640, 360));
        let placement = Placement::scaled([640, 360], [1280, 720]);
        assert_eq!(placement.picture, Rect::full(1280, 720));
    }

    #[test]
    fn bars_are_where_the_window_is_longer_than_the_picture() {
        let tall = Placement::padded([640, 360], [800, 800]);
        assert_eq!(tall.buffer, [640, 640]);
        assert_eq!(tall.picture, Rect { x: 0, y: 140, width: 640, height: 360 });
        let wide = Placement::scaled([100, 100], [300, 100]);
        assert_eq!(wide.picture, Rect { x: 100, y: 0, width: 100, height: 100 });
    }

    #[test]
    fn a_window_of_another_shape_does_not_make_images_huge() {
        let picture = [1920, 1080];
        assert_eq!(Placement::padded(picture, [200, 1400]).buffer, [1920, 13_440]);
        let narrow = Placement::stretched(picture, [200, 1400], MOST);
        assert_eq!(narrow, Placement::scaled(picture, [200, 1400]));
        // Bars of an ordinary window stay bars.
        let square = Placement::stretched(picture, [800, 800], MOST);
        assert_eq!(square, Placement::padded(picture, [800, 800]));
        // Larger than the device has images.
        let wall = Placement::stretched([7680, 4320], [10_240, 4320], 8192);
        assert_eq!(wall, Placement::scaled([7680, 4320], [8192, 3456]));
    }

    proptest! {
        #[test]
        fn images_have_the_shape_of_the_window_and_are_within_the_limits(
            picture in [1_u32..5_000, 1_u32..5_000],
            window in [1_u32..9_000, 1_u32..9_000],
            most in 64_u32..9_000,
        ) {
            let area = |[width, height]: [u32; 2]| u64::from(width) * u64::from(height);
            let enough = 4 * area(picture).max(area(window));
            for placement in [
                Placement::stretched(picture, window, most),
                Placement::limited(picture, window, most),
            ] {
                let [width, height] = placement.buffer;
                prop_assert!(width <= most && height <= most, "{placement:?}");
                prop_assert!(area(placement.buffer) <= enough, "{placement:?}");
                prop_assert!(placement.picture.fits(width, height), "{placement:?}");
                let [across, down] = window.map(i64::from);
                let off = i64::from(width) * down - i64::from(height) * across;
                prop_assert!(off.abs() <= across.max(down), "{placement:?} in {window:?}");
            }
        }

        #[test]
        fn the_picture_is_inside_and_keeps_its_shape(
            picture in [1_u32..5_000, 1_u32..5_000],
            window in [0_u32..9_000, 0_u32..9_000],
        ) {
            for placement in [Placement::padded(picture, window), Placement::scaled(picture, window)] {
                let [width, height] = placement.buffer;
                prop_assert!(placement.picture.fits(width, height), "{placement:?}");
                prop_assert!(width <= MOST && height <= MOST);
                let Rect { width: across, height: down, .. } = placement.picture;
                // One rounded pixel off at most, or a length that rounding cannot make 0.
                let off = i64::from(across) * i64::from(picture[1]) - i64::from(down) * i64::from(picture[0]);
                let step = i64::from(picture[0].max(picture[1]));
                prop_assert!(off.abs() <= step, "{picture:?} became {placement:?}");
            }
        }
    }
}
