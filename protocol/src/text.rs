//! Short texts inside fixed-size messages: UTF-8, length apart, the rest zero.

use zerocopy::little_endian::U32;

use crate::error::Result;
use crate::wire::check::Check;

/// Puts as much of `text` into the field as fits, cut between characters; control characters
/// become spaces.
pub(crate) fn put<const N: usize>(text: &str) -> (U32, [u8; N]) {
    let mut bytes = [0; N];
    let mut length = 0;
    for character in text.chars().map(|c| if c.is_control() { ' ' } else { c }) {
        if length + character.len_utf8() > N {
            break;
        }
        length += character.encode_utf8(&mut bytes[length..]).len();
    }
    (U32::new(u32::try_from(length).expect("fields are shorter than a packet")), bytes)
}

/// Reads a text back; refuses other encodings, control characters and bytes behind the end.
pub(crate) fn get<const N: usize>(
    check: Check,
    field: &'static str,
    length: U32,
    bytes: &[u8; N],
) -> Result<String> {
    check.range(field, u64::from(length.get()), 0, N as u64)?;
    let (text, rest) = bytes.split_at(length.get() as usize);
    check.zero(field, rest)?;
    match std::str::from_utf8(text) {
        Ok(text) if !text.chars().any(char::is_control) => Ok(text.to_owned()),
        Ok(_) => check.fail(field, "text without control characters", "a control character"),
        Err(_) => check.fail(field, "UTF-8 text", "other bytes"),
    }
}
