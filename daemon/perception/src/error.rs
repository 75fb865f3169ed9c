//! What can be wrong with what is asked of a model.

/// Why a model cannot answer.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PerceptionError {
    /// The text is no display profile.
    #[error("display profile: expected {expected}, found {found}")]
    Profile {
        /// What a profile has there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// No built-in profile has this name.
    #[error("expected a display profile of {expected}, found `{found}`; give a file for another")]
    UnknownProfile {
        /// The names there are.
        expected: String,
        /// The name that was asked for.
        found: String,
    },
    /// A number is outside the domain of a model.
    #[error("{what}: expected {expected}, found {found}")]
    OutOfDomain {
        /// Which number.
        what: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it was.
        found: f64,
    },
    /// Two pictures that belong together are not of one size.
    #[error(
        "expected a picture of {expected_width}x{expected_height}, found {found_width}x{found_height}"
    )]
    SizeDiffers {
        /// Columns of the first.
        expected_width: usize,
        /// Rows of the first.
        expected_height: usize,
        /// Columns of the other.
        found_width: usize,
        /// Rows of the other.
        found_height: usize,
    },
}

impl PerceptionError {
    /// `value` if `is_inside`, else what was expected of it.
    pub(crate) fn check(
        what: &'static str,
        expected: &'static str,
        value: f64,
        is_inside: bool,
    ) -> Result<f64, Self> {
        if is_inside { Ok(value) } else { Err(Self::OutOfDomain { what, expected, found: value }) }
    }

    /// `value` if it is finite and above 0.
    pub(crate) fn check_positive(what: &'static str, value: f64) -> Result<f64, Self> {
        Self::check(what, "a number above 0", value, value.is_finite() && value > 0.0)
    }
}
