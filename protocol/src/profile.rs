//! The name of a display profile: what a stream calls the display that its picture is for.
//!
//! A name is 1 to 64 bytes of UTF-8 without control characters. What it stands for the daemon
//! knows; here it is only text.

use std::fmt;
use std::str::FromStr;

use crate::error::{Error, Result};
use crate::message::MessageKind;

/// Name of a display profile, 1 to [`ProfileName::MAX_BYTES`] bytes of text.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ProfileName {
    /// Bytes of `bytes` that are the name, a whole number of characters. The rest is 0.
    length: u8,
    bytes: [u8; Self::MAX_BYTES],
}

impl ProfileName {
    /// The longest name, in bytes.
    pub const MAX_BYTES: usize = 64;

    /// A name.
    ///
    /// # Errors
    /// [`Error::Field`] unless it is 1 to 64 bytes without control characters.
    pub fn new(name: &str) -> Result<Self> {
        let expected = || format!("1 to {} bytes of text", Self::MAX_BYTES);
        let fail = |expected: String, found: String| {
            Err(Error::field(MessageKind::CreateStream, Self::FIELD, expected, found))
        };
        if name.chars().any(char::is_control) {
            let expected = "text without control characters".to_owned();
            return fail(expected, "a control character".to_owned());
        }
        let mut bytes = [0; Self::MAX_BYTES];
        match (u8::try_from(name.len()), bytes.get_mut(..name.len())) {
            (Ok(length @ 1..), Some(place)) => {
                place.copy_from_slice(name.as_bytes());
                Ok(Self { length, bytes })
            }
            _ => fail(expected(), format!("{} bytes", name.len())),
        }
    }

    /// Name of the extension in messages about it.
    pub(crate) const FIELD: &str = "display_profile";

    /// The name that a peer sent.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let name = std::str::from_utf8(bytes).map_err(|_| {
            Error::field(MessageKind::CreateStream, Self::FIELD, "UTF-8 text", "other bytes")
        })?;
        Self::new(name)
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        let bytes = &self.bytes[..usize::from(self.length)];
        std::str::from_utf8(bytes).expect("a name is made from a str")
    }
}

impl FromStr for ProfileName {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::new(name)
    }
}

impl fmt::Display for ProfileName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Debug for ProfileName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}
