//! How much the error changes from one output frame to the next.
//!
//! An error that stays on the object is far less visible than one that comes and goes with every
//! key frame, and no metric of single frames tells the two apart. The error e of a frame is output
//! minus truth, signed, per channel; a key frame shows the truth, so its error is 0 everywhere.

use super::{Srgb8, assert_same_size};

/// Signed error of one output frame, per channel, in 8-bit levels.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ErrorPicture(Vec<[i16; 3]>);

impl ErrorPicture {
    /// Output minus truth.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn of(output: &Srgb8, truth: &Srgb8) -> Self {
        assert_same_size(output, truth);
        let pixel = |(o, t): (&[u8; 3], &[u8; 3])| {
            std::array::from_fn(|channel| i16::from(o[channel]) - i16::from(t[channel]))
        };
        Self(output.data().iter().zip(truth.data()).map(pixel).collect())
    }

    /// The error of a key frame of this size: none.
    #[must_use]
    pub fn of_key(width: u32, height: u32) -> Self {
        Self(vec![[0; 3]; width as usize * height as usize])
    }
}

/// Mean over pixels and channels of |e(t) - e(t-1)|, in 8-bit levels, 0 to 510, for two successive
/// output frames.
///
/// # Panics
/// If the sizes differ.
#[must_use]
pub fn error_flicker(before: &ErrorPicture, after: &ErrorPicture) -> f64 {
    assert_eq!(before.0.len(), after.0.len(), "successive frames have one size");
    let samples = before.0.as_flattened().iter().zip(after.0.as_flattened());
    let sum: u64 = samples.map(|(b, a)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / (before.0.len() * 3).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{from_fn, map, textured};
    use super::*;

    fn flicker(before: &ErrorPicture, after: &ErrorPicture) -> f64 {
        let forwards = error_flicker(before, after);
        assert!((forwards - error_flicker(after, before)).abs() < 1e-12, "symmetric in time");
        forwards
    }

    #[test]
    fn an_error_that_stays_does_not_flicker_however_large_it_is() {
        let error_of = |truth: &Srgb8, by: u8| {
            let truth = map(truth, |v| v.min(150));
            ErrorPicture::of(&map(&truth, |v| v + by), &truth)
        };
        let (first, second) = (textured(16, 9, 1), textured(16, 9, 2));
        assert!(flicker(&error_of(&first, 100), &error_of(&second, 100)) < 1e-12);
        assert!(flicker(&error_of(&first, 100), &error_of(&second, 99)) > 0.99);
    }

    #[test]
    fn after_a_key_it_is_the_mean_absolute_error() {
        let truth = from_fn(4, 4, |_, _| [100, 100, 100]);
        let output = from_fn(4, 4, |x, _| if x == 0 { [112, 100, 88] } else { [100; 3] });
        let error = ErrorPicture::of(&output, &truth);
        let expected = (12.0 + 12.0) / 3.0 / 4.0;
        assert!((flicker(&ErrorPicture::of_key(4, 4), &error) - expected).abs() < 1e-12);
    }

    #[test]
    fn an_error_that_changes_sign_counts_twice() {
        let truth = from_fn(4, 4, |_, _| [100; 3]);
        let over = ErrorPicture::of(&map(&truth, |v| v + 10), &truth);
        let under = ErrorPicture::of(&map(&truth, |v| v - 10), &truth);
        assert!((flicker(&over, &under) - 20.0).abs() < 1e-12);
    }

    #[test]
    fn the_largest_possible_change_does_not_overflow() {
        let (black, white) = (from_fn(2, 2, |_, _| [0; 3]), from_fn(2, 2, |_, _| [255; 3]));
        let up = ErrorPicture::of(&white, &black);
        let down = ErrorPicture::of(&black, &white);
        assert!((flicker(&up, &down) - 510.0).abs() < 1e-12);
    }
}
